"""Misfits of a log with an event at each of several instants, predicted by the linearised response to its steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect
from aerosid.effects.step_input import instant_of, with_fixed_instant
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.likelihood import Likelihood, Trial
from aerosid.signals.column_products import output_products


def predicted_misfits(
    likelihood: Likelihood,
    effects: Sequence[ActiveEffect],
    variance: NDArray[np.float64],
    state: NDArray[np.float64],
    events: Sequence[Sequence[ActiveEffect]],
) -> NDArray[np.float64] | None:
    """Sum of squared normalised errors with each of several events beside what acts, from the likeliest initial state.

    Parameters
    ----------
    likelihood : Likelihood
        Of one manoeuvre, without free terms.
    effects : sequence of ActiveEffect
        Those that act, with no free parameter.
    variance : ndarray, shape (m,)
        Noise variances of the outputs, SI squared.
    state : ndarray, shape (n,)
        Near the initial state.
    events : sequence of sequence of ActiveEffect
        The step changes of each event, with their sizes, at an instant of its own.

    Returns
    -------
    ndarray, shape (len(events),), or None
        None where the simulation without an event leaves the model's range.

    Notes
    -----
    The response to a step is linearised along the simulation without one, as are those to the initial state: with
    residual r, responses c to the event and J to the state, min over x of |r - c - J x|^2. All events share one
    simulation, and its products of columns.
    """
    steps = [_of_size_alone(active) for event in events for active in event]
    count = 1 + state.size + len(steps)
    products = np.zeros((count, count))
    constant = 0.0
    try:
        for part in likelihood.whitened(Trial(likelihood.model.values, [state], effects, variance, steps)):
            measured = np.flatnonzero(part.held.any(axis=0))
            products += output_products(part.block, measured).sum(axis=0)
            constant += part.log_sum
    except OutOfRangeError:
        return None
    responses = np.zeros((count, len(events)))
    responses[0] = 1.0
    first = 1 + state.size
    for n, event in enumerate(events):
        responses[first : first + len(event), n] = [-active.numbers[0] for active in event]
        first += len(event)
    moved = products @ responses
    free = 1 + np.flatnonzero(likelihood.active(()) & (np.diag(products)[1 : 1 + state.size] > 0.0))
    scale = np.sqrt(np.diag(products)[free])
    information = products[np.ix_(free, free)] / np.outer(scale, scale)
    pull = moved[free] / scale[:, None]
    explained = np.einsum("in,in->n", pull, np.linalg.pinv(information, rcond=1e-13, hermitian=True) @ pull)
    return np.asarray(constant + np.einsum("in,in->n", responses, moved) - explained)


def _of_size_alone(active: ActiveEffect) -> ActiveEffect:
    """A step change with its instant fixed, so that its size is the only parameter."""
    assert isinstance(active.effect, InputEffect)
    return ActiveEffect(with_fixed_instant(active.effect, instant_of(active)), active.numbers[:1], active.log)
