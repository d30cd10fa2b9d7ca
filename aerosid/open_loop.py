"""Compare logs with open-loop simulations: measured inputs only, initial state estimated on that log, no feedback."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aerodynamics import CONSTANT, AerodynamicModel
from aerosid.errors import EstimationError
from aerosid.longitudinal import OUTPUTS
from aerosid.manoeuvre import Manoeuvre
from aerosid.prediction import simulate_outputs
from aerosid.refinement import RefinementSettings, refine

_INITIAL_STATE = RefinementSettings(steps=20, rounds=1, step_tolerance=0.01)


@dataclass(frozen=True)
class Response:
    """One simulation beside its log.

    Attributes
    ----------
    outputs : ndarray, shape (N, 8)
        In the order of OUTPUTS, SI; NaN from where the simulation left its range.
    states : ndarray, shape (N, 5)
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
    constants_of: tuple[str, ...] = (),
) -> Response:
    """The open-loop response of `model` to the inputs of a log.

    Parameters
    ----------
    model : AerodynamicModel
        Kept as it is, but for the constants named.
    manoeuvre : Manoeuvre
        Its measurements give the initial state, and nothing else.
    variance : ndarray, shape (8,)
        Weights of the outputs in that estimate, SI squared.
    constants_of : tuple of str
        Coefficients whose constants are also estimated on this log: trim, centre of gravity and instrument zeros
        differ between flights.
    """
    constants = [(coefficient, CONSTANT) for coefficient in constants_of]
    model = model.extended(constants)
    try:
        fitted = refine(
            model,
            [manoeuvre],
            constants,
            variance=variance,
            hold_variance=True,
            filtering=False,
            settings=_INITIAL_STATE,
        )
    except EstimationError:
        empty = np.full(manoeuvre.flight.measured.shape, np.nan)
        return Response(empty, empty[:, :5], dict.fromkeys(manoeuvre.outputs))
    model = fitted.model
    outputs, states = simulate_outputs(fitted.states[0], manoeuvre.flight, model.values, model.table, model.constants)
    difference = manoeuvre.flight.measured - outputs
    rms: dict[str, float | None] = {}
    for i, name in enumerate(OUTPUTS):
        if name in manoeuvre.outputs:
            held = np.isfinite(manoeuvre.flight.measured[:, i])
            error = difference[held, i]
            rms[name] = float(np.sqrt(np.mean(error**2))) if np.isfinite(error).all() else None
    return Response(outputs, states, rms)
