"""Linear analysis: modes, flying qualities and control steps, with standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import fed_of
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.linear_model import FlightCondition, LinearModel, linearise
from aerosid.flight_model.modes import DUTCH_ROLL, PHUGOID, SHORT_PERIOD, mode_shape_ratio, modes_of
from aerosid.flight_model.simulation import BALANCES
from aerosid.loop.flying_qualities.carried_deviations import (
    TermCovariance,
    carried_band,
    carried_deviation,
    central_slopes,
)
from aerosid.loop.flying_qualities.extrapolated_modes import beyond_record
from aerosid.loop.flying_qualities.mil_f_8785c import Requirement, control_anticipation
from aerosid.loop.flying_qualities.mode_levels import QUALITIES, Level, mode_levels
from aerosid.loop.quantity import Parameter


@dataclass(frozen=True)
class ModeRow:
    """One mode of a linear model.

    `name` is that of `flight_model.modes.Mode`; `numbers` holds those of `QUANTITIES` that the mode has, `extrapolated`
    the names of those that last longer than the longest recording.
    """

    name: str
    numbers: Mapping[str, Parameter]
    extrapolated: tuple[str, ...] = ()


@dataclass(frozen=True)
class StepRow:
    """The linear response to a step of one control.

    Attributes
    ----------
    control : str
        The channel of the surface.
    size : float
        rad.
    time : ndarray, shape (N,)
        s.
    response : mapping of str to ndarray, shape (N,)
        Deviations from trim of what the control is there for: V, alpha, q and theta, or beta, p, r and phi; SI.
    deviation : mapping of str to ndarray, shape (N,)
        Standard deviations of these; empty where unknown.
    """

    control: str
    size: float
    time: FloatArray
    response: Mapping[str, FloatArray]
    deviation: Mapping[str, FloatArray]


@dataclass(frozen=True)
class LinearRow:
    """A model linearised at level flight, its modes, flying qualities and control steps.

    Attributes
    ----------
    model : str
        declared or completed.
    airspeed, density, mass : float
        The condition: the mean of the first identification log; m/s, kg/m^3, kg.
    trim : mapping of str to Parameter
        Trim values of level flight: alpha, delta_e and thrust, beta, delta_a and delta_r.
    states : tuple of str
        The n states that something depends on.
    inputs : tuple of str
        The I controls.
    A : ndarray, shape (n, n)
        d(rates)/d(states), SI.
    B : ndarray, shape (n, I)
        d(rates)/d(controls), SI.
    modes : tuple of ModeRow
        Of each motion the fastest first.
    qualities : mapping of str to Parameter
        n_alpha and, where there is a short period, cap; phi_to_beta where there is a Dutch roll.
    category, aircraft_class : str
        Flight phase and class of the levels (MIL-F-8785C).
    levels : mapping of str to Level
        By mode, of those that there are requirements for.
    steps : tuple of StepRow
        Of elevator, aileron and rudder as far as the model has them.
    record : float or None
        Length of the longest identification log, s: what lasts longer is extrapolated.
    """

    model: str
    airspeed: float
    density: float
    mass: float
    trim: Mapping[str, Parameter]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    A: FloatArray
    B: FloatArray
    modes: tuple[ModeRow, ...]
    qualities: Mapping[str, Parameter]
    category: str
    aircraft_class: str
    levels: Mapping[str, Level]
    steps: tuple[StepRow, ...]
    record: float | None = None

    @property
    def short_period_level(self) -> int | None:
        """1 to 3, 4 where worse; of a short period that has become a divergence, that of the divergence."""
        found = self.levels.get(SHORT_PERIOD)
        return None if found is None else found.level

    @property
    def short_period_level_range(self) -> tuple[int, int] | None:
        """Best and worst level within two deviations; None where the deviations are unknown."""
        found = self.levels.get(SHORT_PERIOD)
        return None if found is None else found.span

    @property
    def phugoid_level(self) -> int | None:
        """1 to 3, 4 where worse; None where there is no phugoid."""
        found = self.levels.get(PHUGOID)
        return None if found is None else found.level


FloatArray = NDArray[np.float64]

STEP = np.pi / 180.0
"""rad; size of the control steps, in the positive sense."""

STEP_TIME = np.linspace(0.0, 6.0, 121)
"""s; a few short periods, before the phugoid carries the flight away from its trim."""

_UNITS = {
    "frequency": "rad/s",
    "damping": "1",
    "period": "s",
    "time_to_half": "s",
    "time_to_double": "s",
    "time_constant": "s",
    "root": "1/s",
    "n_alpha": "g/rad",
    "cap": "1/(g s^2)",
    "phi_to_beta": "1",
    "thrust": "N",
}
"""Of quantities that are not angles."""

QUANTITIES = ("frequency", "damping", "period", "time_constant", "time_to_half", "time_to_double", "root")
"""Numbers of a mode."""


def requirement_for(aircraft: Aircraft, category: str | None, aircraft_class: str | None) -> Requirement:
    """Requested category and class, else those of the aircraft file, else category B and class II.

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
    axes = manoeuvre.axes
    balanced = {name for balance in BALANCES if balance.moves(axes) for name in balance.unknowns}
    level = ({"rho", "mass", "speed_of_sound", *axes.measured} - {"alpha"}) | balanced
    return FlightCondition(
        airspeed=mean["V"] if "V" in mean else float(np.nanmean(manoeuvre.measured("V"))),
        density=mean["rho"],
        mass=mean["mass"],
        speed_of_sound=mean["speed_of_sound"],
        inputs={name: value for name, value in mean.items() if name not in level},
    )


def load_factor_per_alpha(linear: LinearModel) -> float:
    """n/alpha [g/rad]: load factor over angle of attack in steady flight at constant airspeed after an elevator input.

    Notes
    -----
    MIL-F-8785C, 6.2.2. The rows of alpha and q with V held, in which n = V q/g once alpha is steady; NaN where the
    elevator moves nothing.
    """
    a, b = linear.air_axes
    turning = [linear.air_states.index(name) for name in ("alpha", "q")]
    try:
        alpha, q = np.linalg.solve(a[np.ix_(turning, turning)], -b[turning, linear.inputs.index("delta_e")])
    except np.linalg.LinAlgError:  # neutral at constant airspeed: no steady state
        return float("nan")
    return float(linear.trimmed.airspeed * q / (GRAVITY * alpha)) if alpha != 0.0 else float("nan")


def analyse_models(
    aircraft: Aircraft,
    declared: AerodynamicModel,
    completed: AerodynamicModel,
    uncertainty: TermCovariance,
    manoeuvres: Sequence[Manoeuvre],
    requirement: Requirement,
) -> tuple[tuple[LinearRow, ...], tuple[str, ...]]:
    """The linear models of an aircraft as declared and as completed, and sentences on what could not be done.

    Parameters
    ----------
    aircraft : Aircraft
        Its sigmas are the declared model's deviations.
    declared, completed : AerodynamicModel
        The nonlinear models.
    uncertainty : TermCovariance
        Covariance of the completed model's values.
    manoeuvres : sequence of Manoeuvre
        The mean of the first is the condition; the longest limits the modes that were observed.
    requirement : Requirement
        Flight phase and class for the levels.
    """
    condition = condition_of(manoeuvres[0])
    record = max(float(manoeuvre.log.time[-1] - manoeuvre.log.time[0]) for manoeuvre in manoeuvres)
    given = [(d.coefficient, d.term) for d in aircraft.derivatives if d.sigma is not None]
    a_priori = TermCovariance.independent(given, [d.sigma for d in aircraft.derivatives if d.sigma is not None])
    rows, notes = [], []
    for name, model, known in (("declared", declared, a_priori), ("completed", completed, uncertainty)):
        try:
            rows.append(analyse(name, model, condition, known, requirement, record))
        except EstimationError as error:
            notes.append(f"The {name} model is not linearised: {error}")
    return tuple(rows), tuple(notes)


def analyse(
    name: str,
    model: AerodynamicModel,
    condition: FlightCondition,
    uncertainty: TermCovariance,
    requirement: Requirement,
    record: float | None = None,
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
    uncertainty : TermCovariance
        Covariance of its values; what it does not hold is taken as exact.
    requirement : Requirement
        Flight phase and class for the levels.
    record : float, optional
        Length of the longest recording behind the model, s; without one nothing is marked as extrapolated.

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
    neighbours = _neighbours(model, condition, uncertainty)
    sizes, lower, upper = neighbours
    numbers, below, above = _numbers(linear), [_numbers(x) for x in lower], [_numbers(x) for x in upper]

    def deviation(key: tuple[str, str]) -> float | None:
        slopes = central_slopes([held.get(key) for held in below], [held.get(key) for held in above], sizes)
        return carried_deviation(slopes, uncertainty.covariance)

    rows = {key: Parameter(value, deviation(key), _UNITS.get(key[1], "rad")) for key, value in numbers.items()}
    modes = modes_of(linear.A, linear.states)

    def of(group: str) -> dict[str, Parameter]:
        return {quantity: row for (owner, quantity), row in rows.items() if owner == group}

    def row_of(mode: str) -> ModeRow:
        return ModeRow(mode, of(mode), () if record is None else beyond_record(of(mode), record))

    return LinearRow(
        model=name,
        airspeed=condition.airspeed,
        density=condition.density,
        mass=condition.mass,
        trim=of("trim"),
        states=linear.states,
        inputs=linear.inputs,
        A=linear.A,
        B=linear.B,
        modes=tuple(row_of(mode.name) for mode in modes),
        qualities=of(QUALITIES),
        category=requirement.category,
        aircraft_class=requirement.aircraft_class,
        levels=mode_levels(rows, modes, requirement),
        steps=_steps(linear, neighbours, uncertainty.covariance),
        record=record,
    )


def _steps(linear: LinearModel, neighbours: Neighbours, covariance: FloatArray) -> tuple[StepRow, ...]:
    """The response to a step of each surface that trims the model, with deviations where all of them are known."""
    sizes, lower, upper = neighbours
    rows = []
    for balance in BALANCES:
        channels = fed_of(balance.plane)
        for control in balance.unknowns:
            if control not in linear.inputs or not set(channels) <= set(linear.air_states):
                continue

            def answer(model: LinearModel, control: str = control) -> dict[str, FloatArray]:
                return model.step_response(STEP_TIME, control, STEP)

            whole, bands = answer(linear), {}
            if sizes.size and np.isfinite(covariance).all():
                below, above = [answer(model) for model in lower], [answer(model) for model in upper]
                bands = {
                    name: carried_band([b[name] for b in below], [a[name] for a in above], sizes, covariance)
                    for name in channels
                }
            rows.append(StepRow(control, STEP, STEP_TIME, {name: whole[name] for name in channels}, bands))
    return tuple(rows)


Neighbours = tuple[FloatArray, list[LinearModel], list[LinearModel]]
"""Steps (F,) in the uncertain values, and the linear models a step below and above."""


def _neighbours(model: AerodynamicModel, condition: FlightCondition, uncertainty: TermCovariance) -> Neighbours:
    """Steps (F,) in the uncertain values, and the linear models a step below and above."""
    places = model.indices(uncertainty.entries)
    deviations = np.sqrt(np.maximum(np.diag(uncertainty.covariance), 0.0))
    # The tangent is valid within a tenth of a standard error; of an unknown value only its relevance matters.
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
    numbers: dict[tuple[str, str], float | None] = {
        ("trim", name): getattr(linear.trimmed, name) for name in linear.trimmed.balanced
    }
    for mode in modes_of(linear.A, linear.states):
        numbers |= {(mode.name, quantity): getattr(mode, quantity) for quantity in QUANTITIES}
        if mode.name == DUTCH_ROLL:
            air, _ = linear.air_axes
            numbers[QUALITIES, "phi_to_beta"] = mode_shape_ratio(air, linear.air_states, mode, "phi", "beta")
    if "alpha" in linear.air_states:
        n_alpha, frequency = load_factor_per_alpha(linear), numbers.get((SHORT_PERIOD, "frequency"))
        numbers[QUALITIES, "n_alpha"] = n_alpha
        numbers[QUALITIES, "cap"] = None if frequency is None else control_anticipation(frequency, n_alpha)
    return {key: value for key, value in numbers.items() if value is not None and np.isfinite(value)}
