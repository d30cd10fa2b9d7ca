"""Open-loop comparison of a model with a log: measured inputs, estimated initial state, no feedback."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import KINDS, ActiveEffect, StateEffect, frozen
from aerosid.effects.step_input import is_step_change
from aerosid.errors import EstimationError
from aerosid.estimation.effects_in_flight import OutOfRangeError, acting_flight, acting_model, recorded
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.motion_loop import self_consistent
from aerosid.estimation.unseen_step_changes import fitted_step_changes, instants_of, matched_step_changes
from aerosid.flight_model.aerodynamics import CONSTANT, AerodynamicModel
from aerosid.flight_model.flight import Flight, simulate_outputs

_INITIAL_STATE = RefinementSettings(steps=20, step_tolerance=0.01, hold_variance=True, filtering=False)


@dataclass(frozen=True)
class Response:
    """One simulation compared with its log.

    Attributes
    ----------
    outputs : ndarray, shape (N, m)
        In the order of the case's outputs, SI; NaN from where the simulation left its range.
    states : ndarray, shape (N, n)
        In the order of the case's integrated states, SI.
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
    biases: bool = False,
    state: NDArray[np.float64] | None = None,
) -> Response:
    """The open-loop response of `model` to the inputs of a log.

    Parameters
    ----------
    model : AerodynamicModel
        Held, except for the constants named.
    manoeuvre : Manoeuvre
        Its measurements only determine the initial state.
    variance : ndarray, shape (m,)
        Noise variances of the outputs in that estimate, SI squared.
    effects : sequence of ActiveEffect
        Effects other than terms, with their parameters, which are held as well.
    constants_of : tuple of str
        Coefficients whose constants are also estimated on this log: trim, centre of gravity and instrument biases
        differ between flights.
    biases : bool
        Whether the instrument biases among the effects are estimated on this log too.
    state : ndarray, shape (n,), optional
        Start value of the initial state, if it is finite; by default from the first samples.
    """
    constants = [(coefficient, CONSTANT) for coefficient in constants_of]
    model = model.extended(constants)
    try:
        fitted = refine(
            model,
            [manoeuvre],
            constants,
            effects=[active if biases and _is_bias(active) else frozen(active) for active in effects],
            states=None if state is None or not np.isfinite(state).all() else [state],
            variance=variance,
            settings=_INITIAL_STATE,
        )
    except EstimationError:
        outputs, states = _out_of_range_response(model, manoeuvre.flight)
        return Response(outputs, states, dict.fromkeys(manoeuvre.outputs))
    outputs, states = simulate(fitted.model, manoeuvre, fitted.states[0], fitted.effects)
    difference = manoeuvre.flight.measured - outputs
    rms: dict[str, float | None] = {}
    for i, name in enumerate(manoeuvre.axes.outputs):
        if name in manoeuvre.outputs:
            present = np.isfinite(manoeuvre.flight.measured[:, i])
            error = difference[present, i]
            rms[name] = float(np.sqrt(np.mean(error**2))) if np.isfinite(error).all() else None
    return Response(outputs, states, rms)


def prediction_errors(
    at: Refinement, manoeuvre: Manoeuvre, fuller: Refinement | None = None
) -> dict[str, float | None]:
    """Root-mean-square errors of an estimate's open-loop response to a log, its effects `on_log`, computed once."""
    log = manoeuvre.span
    if log not in at.errors_on:
        at.errors_on[log] = respond(at.model, manoeuvre, at.variance, effects=on_log(at, manoeuvre, fuller)).rms
    return at.errors_on[log]


def _is_bias(active: ActiveEffect) -> bool:
    """Whether an effect is an instrument's bias, which differs between flights."""
    kind = KINDS.get(active.effect.kind)
    return kind is not None and kind.is_bias


def simulate(
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: NDArray[np.float64],
    effects: Sequence[ActiveEffect] = (),
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Recorded outputs, (N, m), and states, (N, n), of a simulation with the manoeuvre's inputs.

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
            return _out_of_range_response(model, flight)
    outputs, states = simulate_outputs(state, flight, np.array(model.values), model.table, model.constants)
    recorded(outputs, manoeuvre, effects)
    return outputs, states


def _out_of_range_response(model: AerodynamicModel, flight: Flight) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Outputs (N, m) and states (N, n) of a simulation that left its range at once."""
    samples, axes = flight.time.size, model.axes
    return np.full((samples, len(axes.outputs)), np.nan), np.full((samples, len(axes.integrated)), np.nan)


def on_log(completed: Refinement, manoeuvre: Manoeuvre, fuller: Refinement | None = None) -> tuple[ActiveEffect, ...]:
    """The completed model's effects as they act on a log that may not have been fitted.

    All effects act as estimated except step changes, which no channel shows: on a log where none was found the instant
    of each event is estimated on that log, with its size held, or it is left out, like the initial state.

    Where the coefficient equations looked for step changes of that log, theirs are the instants.

    `fuller`: a model with an effect more that was simulated on that log. The instants are estimated from its own, and
    what it leaves out is left out.
    """
    own = tuple(active for active in completed.effects if active.acts_on(manoeuvre.name))
    step_changes = [active for active in completed.effects if is_step_change(active) and active.log != manoeuvre.name]
    if not step_changes or any(active.log == manoeuvre.name for active in completed.effects):
        return own
    log = manoeuvre.span
    if log not in completed.placed:
        theirs = None if fuller is None else fuller.placed.get(log)
        near = None if theirs is None else instants_of(theirs, manoeuvre)
        seen = completed.seen_on_others.get(manoeuvre.name)
        if seen is not None:
            matched, step_changes, near = matched_step_changes(step_changes, seen, manoeuvre)
            own = (*own, *matched)
        if step_changes:
            state = respond(completed.model, manoeuvre, completed.variance, effects=own).states[0]
            own = (*own, *fitted_step_changes(completed, manoeuvre, own, step_changes, state, near))
        completed.placed[log] = own
    return completed.placed[log]
