"""Open-loop comparison of a model with a log: measured inputs, estimated initial state, no feedback."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import KINDS, ActiveEffect, StateEffect, frozen
from aerosid.effects.sudden import at_moment, is_sudden, moment
from aerosid.errors import EstimationError
from aerosid.estimation.effects_in_flight import OutOfRangeError, acting_flight, acting_model, recorded
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.motion_loop import self_consistent
from aerosid.flight_model.aerodynamics import CONSTANT, AerodynamicModel
from aerosid.flight_model.flight import Flight, simulate_outputs

_INITIAL_STATE = RefinementSettings(steps=20, step_tolerance=0.01, hold_variance=True, filtering=False)


@dataclass(frozen=True)
class Response:
    """One simulation beside its log.

    Attributes
    ----------
    outputs : ndarray, shape (N, m)
        In the order of the case's outputs, SI; NaN from where the simulation left its range.
    states : ndarray, shape (N, n)
        u, w, q, theta, h.
    rms : dict of str to float or None
        Root-mean-square of measured minus simulated of each measured channel; None where the simulation left its range.
    """

    outputs: NDArray[np.float64]
    states: NDArray[np.float64]
    rms: dict[str, float | None]


def respond(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    variance: NDArray[np.float64],
    *,
    effects: Sequence[ActiveEffect] = (),
    constants_of: tuple[str, ...] = (),
    zeros: bool = False,
    state: NDArray[np.float64] | None = None,
) -> Response:
    """The open-loop response of `model` to the inputs of a log.

    Parameters
    ----------
    model : AerodynamicModel
        Kept as it is, but for the constants named.
    manoeuvre : Manoeuvre
        Its measurements give the initial state, and nothing else.
    variance : ndarray, shape (m,)
        Weights of the outputs in that estimate, SI squared.
    effects : sequence of ActiveEffect
        Effects that are no term, with their numbers, which are kept as well.
    constants_of : tuple of str
        Coefficients whose constants are also estimated on this log: trim, centre of gravity and instrument zeros
        differ between flights.
    zeros : bool
        Whether the zeros of instruments that the effects hold are estimated on this log too.
    state : ndarray, shape (n,), optional
        Where the search of the initial state begins, if it is finite; by default at the first samples.
    """
    constants = [(coefficient, CONSTANT) for coefficient in constants_of]
    model = model.extended(constants)
    try:
        fitted = refine(
            model,
            [manoeuvre],
            constants,
            effects=[active if zeros and _is_zero(active) else frozen(active) for active in effects],
            states=None if state is None or not np.isfinite(state).all() else [state],
            variance=variance,
            settings=_INITIAL_STATE,
        )
    except EstimationError:
        left, gone = _left(model, manoeuvre.flight)
        return Response(left, gone, dict.fromkeys(manoeuvre.outputs))
    outputs, states = simulate(fitted.model, manoeuvre, fitted.states[0], fitted.effects)
    difference = manoeuvre.flight.measured - outputs
    rms: dict[str, float | None] = {}
    for i, name in enumerate(manoeuvre.axes.outputs):
        if name in manoeuvre.outputs:
            present = np.isfinite(manoeuvre.flight.measured[:, i])
            error = difference[present, i]
            rms[name] = float(np.sqrt(np.mean(error**2))) if np.isfinite(error).all() else None
    return Response(outputs, states, rms)


def _is_zero(active: ActiveEffect) -> bool:
    """Whether an effect is the zero of an instrument, which differs between flights."""
    kind = KINDS.get(active.effect.kind)
    return kind is not None and kind.is_zero


def simulate(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect] = (),
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What the sensors record, (N, m), and the states, (N, n), of a flight with the manoeuvre's inputs.

    Parameters
    ----------
    state : ndarray, shape (n,)
        The initial one.

    Returns
    -------
    NaN from where the simulation leaves |alpha| < 1.5 rad.
    """
    model = acting_model(model, effects)
    flight, _ = acting_flight(model, manoeuvre, effects)
    if any(isinstance(active.effect, StateEffect) for active in effects):
        try:
            flight, _ = self_consistent(model, flight, model.values, state, effects, manoeuvre.ground)
        except OutOfRangeError:
            return _left(model, flight)
    outputs, states = simulate_outputs(state, flight, np.array(model.values), model.table, model.constants)
    recorded(outputs, manoeuvre, effects)
    return outputs, states


def _left(model: AerodynamicModel, flight: Flight) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Outputs (N, m) and states (N, n) of a simulation that left its range at once."""
    samples, axes = flight.time.size, model.axes
    return np.full((samples, len(axes.outputs)), np.nan), np.full((samples, len(axes.integrated)), np.nan)


def on_log(completed: Refinement, manoeuvre: Manoeuvre) -> tuple[ActiveEffect, ...]:
    """The completed model's effects as they act on a log that may not have been fitted.

    Everything acts as it was found but a sudden change, which no channel announces: on a log where none was found it is
    placed, with its size kept, at the moment where it fits that log best, or nowhere, like the initial state.
    """
    own = tuple(active for active in completed.effects if active.acts_on(manoeuvre.name))
    jumps = [active for active in completed.effects if is_sudden(active) and active.log != manoeuvre.name]
    if not jumps or any(active.log == manoeuvre.name for active in completed.effects):
        return own
    time = manoeuvre.flight.time
    log = manoeuvre.name, float(time[0]), int(time.size)
    if log not in completed.placed:
        completed.placed[log] = _placed(completed, manoeuvre, own, jumps)
    return completed.placed[log]


def _placed(
    completed: Refinement, manoeuvre: Manoeuvre, own: tuple[ActiveEffect, ...], jumps: Sequence[ActiveEffect]
) -> tuple[ActiveEffect, ...]:
    """The effects of a log with sudden changes where they fit it best, or without them."""
    time = manoeuvre.flight.time
    shifts = [moment(active) - time[0] for active in jumps]
    span = float(np.ptp(time))
    likelihood = Likelihood(completed.model, (manoeuvre,), (), filtering=False)
    state = respond(completed.model, manoeuvre, completed.variance, effects=own).states[0]
    state = state if np.isfinite(state).all() else manoeuvre.first_state

    def misfit(start: float | None) -> float:
        at = () if start is None else tuple(at_moment(a, time[0] + start, manoeuvre.name, interval) for a in jumps)
        # Neighbouring moments hardly move the initial state: each step begins at the last one.
        nonlocal state
        squares, state = _from_likeliest_state(likelihood, (*own, *at), completed.variance, state)
        return squares

    interval = manoeuvre.interval
    grid: list[float | None] = [
        None,
        *np.clip(shifts, 0.0, span).tolist(),
        *(span * np.linspace(0.05, 0.95, 19)).tolist(),
    ]
    best = min(grid, key=misfit)
    if best is None:
        return own
    for reach in (span / 20.0, span / 200.0):
        best = min((best + reach * np.linspace(-1.0, 1.0, 9)).tolist(), key=misfit)
    return (*own, *(at_moment(active, time[0] + best, manoeuvre.name, interval) for active in jumps))


def _from_likeliest_state(
    likelihood: Likelihood,
    effects: Sequence[ActiveEffect],
    variance: NDArray[np.float64],
    state: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64]]:
    """Squared errors over their variances of a flight from its likeliest initial state, and that state (n,).

    One Gauss-Newton step from a `state` near it: to first order in the initial state, in which a flight is nearly
    linear. Infinite where the simulation from there leaves its range.
    """
    point = likelihood.evaluate(likelihood.model.values, [state], [frozen(active) for active in effects], variance)
    if point is None:
        return np.inf, state
    moved = likelihood.active(())
    pull = point.gradients.sum(axis=0)
    scale = np.sqrt(np.diag(point.information))
    moved &= scale > 0.0
    scaled = point.information[np.ix_(moved, moved)] / np.outer(scale[moved], scale[moved])
    step = np.zeros_like(state)
    step[moved] = np.linalg.pinv(scaled, rcond=1e-13, hermitian=True) @ (pull[moved] / scale[moved]) / scale[moved]
    return point.cost - float(pull @ step), state + step
