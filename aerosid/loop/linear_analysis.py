"""Linear analysis: modes, control anticipation and elevator step, with standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.linear_model import FlightCondition, LinearModel, linearise
from aerosid.flight_model.modes import PHUGOID, SHORT_PERIOD, longitudinal_modes
from aerosid.loop.flying_qualities import (
    Requirement,
    control_anticipation,
    divergence_level,
    phugoid_level,
    short_period_level,
)
from aerosid.loop.quantity import Parameter


@dataclass(frozen=True)
class ModeRow:
    """One mode of a linear model.

    `name` is short_period, phugoid, third_oscillatory, real_root_1 or real_root_2; `numbers` holds those of frequency
    (undamped, natural), damping, period, time_to_half and time_to_double that the mode has.
    """

    name: str
    numbers: Mapping[str, Parameter]


@dataclass(frozen=True)
class LinearRow:
    """A model linearised at level flight, its modes, flying qualities and elevator step.

    Attributes
    ----------
    model : str
        declared or completed.
    airspeed, density, mass : float
        The condition: the mean of the first identification log; m/s, kg/m^3, kg.
    trim : mapping of str to Parameter
        alpha, delta_e, thrust of level flight.
    inputs : tuple of str
        The I controls.
    A : ndarray, shape (4, 4)
        d(rates)/d(u, w, q, theta), SI.
    B : ndarray, shape (4, I)
        d(rates)/d(controls), SI.
    modes : tuple of ModeRow
        The fastest first.
    qualities : mapping of str to Parameter
        n_alpha and, where there is a short period, cap.
    category, aircraft_class : str
        What the levels were judged for (MIL-F-8785C).
    short_period_level, phugoid_level : int or None
        1 to 3, 4 where worse; None where there is no such mode. Of a short period that has become a divergence, that
        of the divergence.
    short_period_level_range : (int, int) or None
        Best and worst level within two deviations; None where the deviations are unknown.
    step_size : float
        Of the elevator step, rad.
    step_time : ndarray, shape (N,)
        s.
    step : mapping of str to ndarray, shape (N,)
        Deviations of V, alpha, q and theta from trim after the step, SI.
    step_deviation : mapping of str to ndarray, shape (N,)
        Standard deviations of these; empty where unknown.
    """

    model: str
    airspeed: float
    density: float
    mass: float
    trim: Mapping[str, Parameter]
    inputs: tuple[str, ...]
    A: FloatArray
    B: FloatArray
    modes: tuple[ModeRow, ...]
    qualities: Mapping[str, Parameter]
    category: str
    aircraft_class: str
    short_period_level: int | None
    short_period_level_range: tuple[int, int] | None
    phugoid_level: int | None
    step_size: float
    step_time: FloatArray
    step: Mapping[str, FloatArray]
    step_deviation: Mapping[str, FloatArray]


FloatArray = NDArray[np.float64]

STEP = np.pi / 180.0
"""rad; size of the elevator step, trailing edge down."""

STEP_TIME = np.linspace(0.0, 6.0, 121)
"""s; a few short periods, before the phugoid carries the flight away from its trim."""

_UNITS = {
    "frequency": "rad/s",
    "damping": "1",
    "period": "s",
    "time_to_half": "s",
    "time_to_double": "s",
    "n_alpha": "g/rad",
    "cap": "1/(g s^2)",
    "alpha": "rad",
    "delta_e": "rad",
    "thrust": "N",
}


@dataclass(frozen=True)
class Spread:
    """What is known of a model's values.

    Attributes
    ----------
    entries : tuple of Entry
        The uncertain ones, F of them.
    covariance : ndarray, shape (F, F)
        Infinite where a record tells nothing.
    """

    entries: tuple[Entry, ...]
    covariance: FloatArray

    @staticmethod
    def independent(entries: Sequence[Entry], deviations: Sequence[float]) -> Spread:
        """From standard deviations alone, as an aircraft file gives them."""
        return Spread(tuple(entries), np.diag(np.square(np.array(deviations, dtype=np.float64))))


def requirement_for(aircraft: Aircraft, category: str | None, aircraft_class: str | None) -> Requirement:
    """What was asked for, else what the aircraft file says, else category B and class II.

    Raises
    ------
    UsageError
        Where a word is not one of the choices.
    """
    return Requirement(
        category or aircraft.flight_phase or "B",
        aircraft_class or aircraft.aircraft_class or "II",
    )


def condition_of(manoeuvre: Manoeuvre) -> FlightCondition:
    """Level flight at the mean airspeed, density, mass and configuration of a flight."""
    mean = dict(zip(manoeuvre.columns, manoeuvre.flight.inputs.mean(axis=0).tolist(), strict=True))
    lateral = ("rho", "thrust", "mass", "speed_of_sound", "phi", "p", "r", "beta", "delta_e")
    return FlightCondition(
        airspeed=float(np.nanmean(manoeuvre.measured("V"))),
        density=mean["rho"],
        mass=mean["mass"],
        speed_of_sound=mean["speed_of_sound"],
        inputs={name: value for name, value in mean.items() if name not in lateral},
    )


def load_factor_per_alpha(linear: LinearModel) -> float:
    """n/alpha [g/rad]: load factor over angle of attack in steady flight at constant airspeed after an elevator input.

    Notes
    -----
    MIL-F-8785C, 6.2.2. The rows of alpha and q with V held, in which n = V q/g once alpha is steady; NaN where the
    elevator moves nothing.
    """
    a, b = linear.air_axes
    try:
        alpha, q = np.linalg.solve(a[1:3, 1:3], -b[1:3, linear.inputs.index("delta_e")])
    except np.linalg.LinAlgError:  # neutral at constant airspeed: no steady state
        return float("nan")
    return float(linear.trimmed.airspeed * q / (GRAVITY * alpha)) if alpha != 0.0 else float("nan")


def analyse_models(
    aircraft: Aircraft,
    declared: AerodynamicModel,
    completed: AerodynamicModel,
    spread: Spread,
    manoeuvre: Manoeuvre,
    requirement: Requirement,
) -> tuple[tuple[LinearRow, ...], tuple[str, ...]]:
    """The linear models of an aircraft as declared and as completed, and sentences on what could not be done.

    Parameters
    ----------
    aircraft : Aircraft
        Its sigmas are the declared model's deviations.
    declared, completed : AerodynamicModel
        The nonlinear models.
    spread : Spread
        Covariance of the completed model's values.
    manoeuvre : Manoeuvre
        Its mean is the condition.
    requirement : Requirement
        Flight phase and class for the levels.
    """
    condition = condition_of(manoeuvre)
    given = [(d.coefficient, d.term) for d in aircraft.derivatives if d.sigma is not None]
    a_priori = Spread.independent(given, [d.sigma for d in aircraft.derivatives if d.sigma is not None])
    rows, notes = [], []
    for name, model, known in (("declared", declared, a_priori), ("completed", completed, spread)):
        try:
            rows.append(analyse(name, model, condition, known, requirement))
        except EstimationError as error:
            notes.append(f"The {name} model is not linearised: {error}")
    return tuple(rows), tuple(notes)


def analyse(
    name: str,
    model: AerodynamicModel,
    condition: FlightCondition,
    spread: Spread,
    requirement: Requirement,
) -> LinearRow:
    """The linear model at a condition, its modes and flying qualities.

    Parameters
    ----------
    name : str
        `declared` or `completed`.
    model : AerodynamicModel
        The nonlinear model.
    condition : FlightCondition
        Where it is linearised.
    spread : Spread
        Covariance of its values; what it does not hold is taken as exact.
    requirement : Requirement
        Flight phase and class for the levels.

    Raises
    ------
    EstimationError
        Where the model has no trim at the condition.

    Notes
    -----
    Deviations are carried over to first order, g' C g, with the gradient g by central differences of the whole chain:
    the trim moves with the derivatives too. A number that depends on a derivative of which nothing is known has none.
    """
    linear = linearise(model, condition)
    steps, lower, upper = _neighbours(model, condition, spread)
    numbers, below, above = _numbers(linear), [_numbers(x) for x in lower], [_numbers(x) for x in upper]

    def deviation(key: tuple[str, str]) -> float | None:
        slopes = _slopes([held.get(key) for held in below], [held.get(key) for held in above], steps)
        return _carried(slopes, spread.covariance)

    rows = {key: Parameter(value, deviation(key), _UNITS[key[1]]) for key, value in numbers.items()}
    by_name = {mode.name: mode for mode in longitudinal_modes(linear.A)}
    phugoid = by_name.get(PHUGOID)
    best, level, worst = _levels(rows, requirement)

    def of(group: str) -> dict[str, Parameter]:
        return {quantity: row for (owner, quantity), row in rows.items() if owner == group}

    return LinearRow(
        model=name,
        airspeed=condition.airspeed,
        density=condition.density,
        mass=condition.mass,
        trim=of("trim"),
        inputs=linear.inputs,
        A=linear.A,
        B=linear.B,
        modes=tuple(ModeRow(mode, of(mode)) for mode in by_name),
        qualities=of("qualities"),
        category=requirement.category,
        aircraft_class=requirement.aircraft_class,
        short_period_level=level,
        short_period_level_range=None if best is None or worst is None else (best, worst),
        phugoid_level=None if phugoid is None else phugoid_level(phugoid.damping, phugoid.time_to_double),
        step_size=STEP,
        step_time=STEP_TIME,
        step=linear.step_response(STEP_TIME, "delta_e", STEP),
        step_deviation=_bands(lower, upper, steps, spread.covariance),
    )


def _neighbours(
    model: AerodynamicModel, condition: FlightCondition, spread: Spread
) -> tuple[FloatArray, list[LinearModel], list[LinearModel]]:
    """Steps (F,) in the uncertain values, and the linear models a step below and above."""
    places = model.indices(spread.entries)
    deviations = np.sqrt(np.maximum(np.diag(spread.covariance), 0.0))
    # A tenth of a deviation is where the tangent serves; of an unknown value only whether it matters is asked.
    sizes = np.where(np.isfinite(deviations) & (deviations > 0.0), 0.1 * deviations, 1e-4)
    steps = np.minimum(sizes, 0.01 * np.maximum(np.abs(model.values[places]), 0.01))
    sides: list[list[LinearModel]] = []
    for sign in (-1.0, 1.0):
        moved = []
        for place, step in zip(places, steps, strict=True):
            values = np.array(model.values)
            values[place] += sign * step
            moved.append(linearise(model.with_values(values), condition))
        sides.append(moved)
    return steps, sides[0], sides[1]


def _numbers(linear: LinearModel) -> dict[tuple[str, str], float]:
    """Every number of the analysis by (mode, quantity); those that do not exist are left out."""
    trimmed = linear.trimmed
    numbers: dict[tuple[str, str], float | None] = {
        ("trim", "alpha"): trimmed.alpha,
        ("trim", "delta_e"): trimmed.delta_e,
        ("trim", "thrust"): trimmed.thrust,
    }
    frequency = None
    for mode in longitudinal_modes(linear.A):
        for quantity in ("frequency", "damping", "period", "time_to_half", "time_to_double"):
            numbers[mode.name, quantity] = getattr(mode, quantity)
        frequency = mode.frequency if mode.name == SHORT_PERIOD else frequency
    n_alpha = load_factor_per_alpha(linear)
    numbers["qualities", "n_alpha"] = n_alpha
    numbers["qualities", "cap"] = None if frequency is None else control_anticipation(frequency, n_alpha)
    return {key: value for key, value in numbers.items() if value is not None and np.isfinite(value)}


def _slopes(lower: Sequence[float | None], upper: Sequence[float | None], steps: FloatArray) -> FloatArray:
    """Central differences (F,); NaN where the number ceases to exist within a step."""
    below = np.array([np.nan if value is None else value for value in lower])
    above = np.array([np.nan if value is None else value for value in upper])
    return np.asarray((above - below) / (2.0 * steps))


def _carried(slopes: FloatArray, covariance: FloatArray) -> float | None:
    """sqrt(g' C g); None where it is unknown."""
    if not slopes.size or not np.isfinite(slopes).all():
        return None
    # A value of which nothing is known does no harm where nothing depends on it, to the accuracy of the trims.
    acts = np.abs(slopes) > 1e-6 * np.max(np.abs(slopes))
    acting = np.flatnonzero(acts | np.isfinite(np.diag(covariance)))
    part = covariance[np.ix_(acting, acting)]
    if not np.isfinite(part).all():
        return None
    variance = float(slopes[acting] @ part @ slopes[acting])
    # The corrected covariance of a short record need not be positive definite: a deviation of zero would be a lie.
    return float(np.sqrt(variance)) if variance > 0.0 else None


def _bands(
    lower: Sequence[LinearModel], upper: Sequence[LinearModel], steps: FloatArray, covariance: FloatArray
) -> dict[str, FloatArray]:
    """Standard deviation of each channel of the step response, (N,); empty where a covariance is infinite."""
    if not steps.size or not np.isfinite(covariance).all():
        return {}
    below = [linear.step_response(STEP_TIME, "delta_e", STEP) for linear in lower]
    above = [linear.step_response(STEP_TIME, "delta_e", STEP) for linear in upper]
    bands = {}
    for channel in below[0]:
        slopes = np.array([(a[channel] - b[channel]) for a, b in zip(above, below, strict=True)]) / (
            2.0 * steps[:, None]
        )
        bands[channel] = np.sqrt(np.maximum(np.einsum("in,ij,jn->n", slopes, covariance, slopes), 0.0))
    return bands


def _levels(
    rows: dict[tuple[str, str], Parameter], requirement: Requirement
) -> tuple[int | None, int | None, int | None]:
    """The best, the likeliest and the worst level of the short period within two deviations of its numbers.

    Where it has become a divergence, the level of that.
    """
    wanted = [(SHORT_PERIOD, "frequency"), (SHORT_PERIOD, "damping"), ("qualities", "n_alpha")]
    if any(key not in rows for key in wanted):
        doubling = [row.value for (mode, name), row in rows.items() if name == "time_to_double" and mode != PHUGOID]
        return None, divergence_level(min(doubling)) if doubling else None, None
    frequency, damping, n_alpha = (rows[key] for key in wanted)
    level = short_period_level(frequency.value, damping.value, n_alpha.value, requirement)
    if any(row.std_error is None for row in (frequency, damping, n_alpha)):
        return None, level, None
    corners = [
        short_period_level(
            max(frequency.value + 2.0 * i * (frequency.std_error or 0.0), 0.0),
            damping.value + 2.0 * j * (damping.std_error or 0.0),
            n_alpha.value + 2.0 * k * (n_alpha.std_error or 0.0),
            requirement,
        )
        for i in (-1.0, 0.0, 1.0)
        for j in (-1.0, 0.0, 1.0)
        for k in (-1.0, 0.0, 1.0)
    ]
    return min(corners), level, max(corners)
