"""Simulated flights: trim, manoeuvre, sensor noise, and the log that a recorder would hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import AerodynamicModel, controls_of
from aerosid.flight_model.axes import ATMOSPHERE_AND_BODY, LATERAL, LONGITUDINAL, Axes, moving_of, state_vector
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.settings import SIMULATION
from aerosid.flight_model.workspace import make_workspace
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS, is_surface

ALTITUDE = 1500.0
"""Design: m; where a simulated manoeuvre begins."""

SPEED_OF_SOUND = 340.29
"""Physical: m/s, at sea level in the standard atmosphere; where the simulated flight has no atmosphere of its own."""


class Balance(NamedTuple):
    """What balances the forces and moments of one plane of the motion.

    Attributes
    ----------
    plane : Axes
        The case whose moving states are to stand still.
    unknowns : tuple of str
        Fields of `Trim`, as many of the first that the model has as there are states.
    """

    plane: Axes
    unknowns: tuple[str, ...]

    def held_by(self, model: AerodynamicModel) -> tuple[str, ...]:
        """Those of the unknowns that the model has; none where its case does not integrate the plane."""
        if not self.moves(model.axes):
            return ()
        acting = controls_of(model)
        there = (name for name in self.unknowns if name in acting or not is_surface(name))
        return tuple(there)[: len(moving_of(self.plane))]

    def moves(self, axes: Axes) -> bool:
        """Whether a case integrates the plane."""
        return set(moving_of(self.plane)) <= set(axes.integrated)


BALANCES = (
    Balance(LONGITUDINAL, ("alpha", "delta_e", "thrust")),
    Balance(LATERAL, ("beta", "delta_a", "delta_r", "phi")),
)
"""Bank takes the place of a surface that the model lacks: else the wings are level."""

_START = {"alpha": 0.05, "thrust": 0.1}
"""Numerical: rad and weights; where the search for a trim begins, zero for the others."""

_NOTHING = 1e-12
"""Numerical: rad; angles of a trim below this are zero."""


@dataclass(frozen=True)
class Trim:
    """Straight, level flight without acceleration at an airspeed [m/s].

    Attributes
    ----------
    airspeed : float
        m/s.
    alpha, delta_e, thrust : float
        Angle of attack [rad], elevator [rad] and thrust [N]: as balanced, or as given where the case measures them.
    beta, phi, delta_a, delta_r : float
        Sideslip, bank, aileron and rudder, rad.
    balanced : tuple of str
        Those of the fields that were solved for.
    """

    airspeed: float
    alpha: float
    delta_e: float
    thrust: float
    beta: float = 0.0
    phi: float = 0.0
    delta_a: float = 0.0
    delta_r: float = 0.0
    balanced: tuple[str, ...] = ("alpha", "delta_e", "thrust")


def trim(
    model: AerodynamicModel,
    airspeed: float,
    density: float,
    mass: float,
    *,
    speed_of_sound: float = SPEED_OF_SOUND,
    further_inputs: Mapping[str, float] | None = None,
) -> Trim:
    """The angles, deflections and thrust that hold straight, level flight.

    Parameters
    ----------
    airspeed : float
        m/s.
    density : float
        kg/m^3.
    mass : float
        kg.
    speed_of_sound : float
        m/s.
    further_inputs : mapping of str to float, optional
        Other inputs that terms name, and of a case that measures it the angle of attack, SI; those that the model has
        no column for are ignored.

    Raises
    ------
    EstimationError
        Where no trim exists within 0.6 rad of angle of attack, sideslip and bank and 1 rad of each surface.
    """
    axes, further = model.axes, dict(further_inputs or {})
    unknowns = tuple(name for balance in BALANCES for name in balance.held_by(model))
    places = [axes.integrated.index(name) for name in moving_of(axes)]
    work = make_workspace(len(model.extra_columns), model.table, model.constants.layout)
    positions = np.zeros((len(axes.outputs), 3))
    given = {name: further.get(name, 0.0) for name in ("alpha", "delta_e", "thrust", "delta_a", "delta_r")}
    values = np.array(model.values)  # the kernel is compiled for arrays that can be written

    def balance(unknown: NDArray[np.float64]) -> Trim:
        found = given | dict(zip(unknowns, unknown.tolist(), strict=True))
        if "thrust" in unknowns:
            found["thrust"] *= mass * GRAVITY
        return Trim(airspeed, **found, balanced=unknowns)

    def accelerations(unknown: NDArray[np.float64]) -> NDArray[np.float64]:
        trimmed = balance(unknown)
        inputs = trimmed_inputs(model, trimmed, density, mass, speed_of_sound, further)
        x = trimmed_state(model, trimmed)
        evaluate(x, inputs, values, model.table, model.constants, positions, work, False, False)
        return work.rates[places]

    from scipy.optimize import root  # late: what lacks in a model is found without it

    start = np.array([_START.get(name, 0.0) for name in unknowns])
    # A model that lacks surfaces has fewer unknowns than equations: symmetric flight needs none of them.
    solution = root(accelerations, start, tol=1e-12, method="hybr" if len(places) == len(unknowns) else "lm")
    found = dict(zip(unknowns, solution.x.tolist(), strict=True))
    # Rounding may stop the solver short of its tolerance; what counts is that nothing accelerates.
    balanced = float(np.max(np.abs(accelerations(solution.x)))) < 1e-9
    if not balanced or any(abs(found.get(name, 0.0)) > furthest for name, furthest in SIMULATION.trim.items()):
        ended = ", ".join(f"{name} {found[name]:.3g} rad" for name in unknowns if name != "thrust")
        raise EstimationError(
            f"no trim was found at {airspeed:g} m/s (the search ended at {ended}); try another airspeed or density."
        )
    # Of a symmetric aircraft the solver leaves the last digits of zero.
    return balance(np.where(np.abs(solution.x) < _NOTHING, 0.0, solution.x))


def trimmed_inputs(
    model: AerodynamicModel,
    trimmed: Trim,
    density: float,
    mass: float,
    speed_of_sound: float = SPEED_OF_SOUND,
    further_inputs: Mapping[str, float] | None = None,
) -> NDArray[np.float64]:
    """The model's inputs (I,) in a trimmed flight, SI; `further_inputs` are those of `trim`."""
    row = input_row(model, density, trimmed.thrust, mass, speed_of_sound)
    surfaces = {name: getattr(trimmed, name) for name in ("delta_e", "delta_a", "delta_r")}
    further = {name: value for name, value in (further_inputs or {}).items() if name not in ATMOSPHERE_AND_BODY}
    motion = {"V": trimmed.airspeed, "alpha": trimmed.alpha, "theta": _pitch(trimmed)}
    measured = {name: value for name, value in motion.items() if name in model.axes.measured}
    for name, value in {**surfaces, **further, **measured}.items():
        if name in model.columns and name not in trimmed.balanced:
            row[model.columns.index(name)] = value
    for name in trimmed.balanced:
        if name in model.columns:
            row[model.columns.index(name)] = getattr(trimmed, name)
    return row


def trimmed_state(model: AerodynamicModel, trimmed: Trim, altitude: float = 0.0) -> NDArray[np.float64]:
    """The state (n,) of a trimmed flight at an altitude [m]."""
    along, aside = trimmed.airspeed * np.cos(trimmed.beta), trimmed.airspeed * np.sin(trimmed.beta)
    velocity = {"u": along * np.cos(trimmed.alpha), "v": aside, "w": along * np.sin(trimmed.alpha)}
    return state_vector(model.axes, {**velocity, "phi": trimmed.phi, "theta": _pitch(trimmed), "h": altitude})


def _pitch(trimmed: Trim) -> float:
    """The pitch angle [rad] of level flight: the angle of attack where the wings are level."""
    if trimmed.phi == 0.0:
        return trimmed.alpha
    along = np.cos(trimmed.beta) * np.cos(trimmed.alpha)
    down = np.cos(trimmed.beta) * np.sin(trimmed.alpha)
    return float(np.arctan2(np.sin(trimmed.beta) * np.sin(trimmed.phi) + down * np.cos(trimmed.phi), along))


def fly(
    model: AerodynamicModel,
    trimmed: Trim,
    time: NDArray[np.float64],
    elevator: NDArray[np.float64],
    *,
    density: float,
    mass: float,
    noise: Mapping[str, float],
    seed: int,
    further_inputs: Mapping[str, NDArray[np.float64]] | None = None,
    name: str = "simulated",
) -> FlightLog:
    """The log of a simulated manoeuvre of the elevator from trim; the rest as `fly_controls`.

    Parameters
    ----------
    elevator : ndarray, shape (N,)
        Deflection from trim at the samples [rad], linear in between.
    """
    return fly_controls(
        model,
        trimmed,
        time,
        {"delta_e": elevator},
        density=density,
        mass=mass,
        noise=noise,
        seed=seed,
        further_inputs=further_inputs,
        name=name,
    )


def flown_controls(model: AerodynamicModel) -> tuple[str, ...]:
    """The surfaces that trim the motion of a model and act in its terms: elevator, aileron, rudder."""
    there = controls_of(model)
    moving = [balance for balance in BALANCES if balance.moves(model.axes)]
    return tuple(name for balance in moving for name in balance.unknowns if name in there)


def fly_controls(
    model: AerodynamicModel,
    trimmed: Trim,
    time: NDArray[np.float64],
    deflections: Mapping[str, NDArray[np.float64]],
    *,
    density: float,
    mass: float,
    noise: Mapping[str, float],
    seed: int,
    further_inputs: Mapping[str, NDArray[np.float64]] | None = None,
    name: str = "simulated",
) -> FlightLog:
    """The log of a simulated manoeuvre from trim.

    Parameters
    ----------
    time : ndarray, shape (N,)
        s.
    deflections : mapping of str to ndarray, shape (N,)
        Of controls from trim at the samples [rad], linear in between.
    density, mass : float
        kg/m^3, kg.
    noise : mapping of str to float
        Standard deviation of white noise on each channel to be recorded, SI; outputs, controls and what the case
        measures of the motion. What is not named is not recorded.
    seed : int
        Of the noise.
    further_inputs : mapping of str to ndarray, shape (N,), optional
        Other inputs that terms name; recorded without noise.

    Raises
    ------
    EstimationError
        Where the simulation leaves |alpha| < 1.5 rad.
    """
    inputs = np.tile(trimmed_inputs(model, trimmed, density, mass), (time.size, 1))
    for control, deflection in deflections.items():
        inputs[:, model.columns.index(control)] += deflection
    for channel, values in (further_inputs or {}).items():
        inputs[:, model.columns.index(channel)] = values
    substeps = max(1, int(np.ceil(float(np.max(np.diff(time))) / 0.005 - 1e-9)))
    rows = len(model.axes.outputs)
    none, still = np.zeros((0, rows)), np.zeros((rows, 3))
    flight = Flight(time, inputs, none, still, substeps, np.zeros(len(model.extra_columns)))
    start = trimmed_state(model, trimmed, ALTITUDE)
    outputs, _ = simulate_outputs(start, flight, np.array(model.values), model.table, model.constants)
    if not np.isfinite(outputs).all():
        raise EstimationError(f"the simulated manoeuvre {name} leaves |alpha| < 1.5 rad; reduce the input's amplitude.")
    given = (*deflections, *model.axes.measured)
    truth = {channel: inputs[:, model.columns.index(channel)] for channel in given}
    truth |= dict(zip(model.axes.outputs, outputs.T, strict=True))
    generator = np.random.default_rng(seed)
    channels = {
        channel: truth[channel] + deviation * generator.standard_normal(time.size)
        for channel, deviation in noise.items()
    }
    channels.update(further_inputs or {})
    units = {channel: CHANNELS[channel].unit if channel in CHANNELS else "1" for channel in channels}
    return FlightLog(name, time, channels, units)


def doublet(time: NDArray[np.float64], start: float, width: float, amplitude: float) -> NDArray[np.float64]:
    """One push and one pull of `width` s each from `start`: (N,) rad; steps are ramps over one sample."""
    return steps(time, start, [(width, amplitude), (width, -amplitude)])


def three_two_one_one(time: NDArray[np.float64], start: float, unit: float, amplitude: float) -> NDArray[np.float64]:
    """Steps of 3, 2, 1 and 1 `unit` s of alternating sign from `start`: (N,) rad."""
    return steps(time, start, [(3 * unit, amplitude), (2 * unit, -amplitude), (unit, amplitude), (unit, -amplitude)])


def steps(time: NDArray[np.float64], start: float, levels: list[tuple[float, float]]) -> NDArray[np.float64]:
    """A sequence of (duration s, level rad) from `start`, zero elsewhere: (N,)."""
    values = np.zeros(time.size)
    for duration, level in levels:
        values[(time >= start - 1e-9) & (time < start + duration - 1e-9)] = level
        start += duration
    return values


def input_row(
    model: AerodynamicModel, density: float, thrust: float, mass: float, speed_of_sound: float = SPEED_OF_SOUND
) -> NDArray[np.float64]:
    """The model's inputs of symmetric flight at one instant, (I,), SI: all that is not given is zero."""
    given = dict(zip(ATMOSPHERE_AND_BODY, (density, thrust, mass, speed_of_sound), strict=True))
    return np.array([given.get(name, 0.0) for name in model.columns])
