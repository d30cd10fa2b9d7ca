"""Recorded channels that the declared model does not use, as candidate terms.

Each is offered as a term, linear in every coefficient; thrust as C_T = thrust/(q_bar S), an error of the engine model
along x and of its moment arm in C_m, a slipstream in C_l and C_n.
Channels of names that are not in the glossary are candidates too, unless they follow the measured response so closely
that they are another response and no input: a response in a term would feed the measurement back into the simulation
that is compared with it.
Source: Jategaonkar, Flight Vehicle System Identification, 2nd ed., AIAA 2015 (extended models).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.effects.aerodynamic_terms import POWERED, is_symmetric
from aerosid.effects.limits import OFFERED
from aerosid.flight_model.axes import ACCELERATIONS, Axes
from aerosid.flight_model.terms import Term, parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS
from aerosid.signals.noise import estimate_noise

KNOWN = ("delta_h", "delta_f", "beta")
"""Inputs of the glossary that the library of terms does not contain; an output of the case is no input there."""


def logged_channels(logs: Sequence[FlightLog], coefficient: str, axes: Axes) -> Iterator[Term]:
    """A term for each channel of all logs that varies and is an input."""
    names = [name for name in logs[0].channels if name not in CHANNELS and name.isidentifier()]
    candidates = []
    known = [name for name in KNOWN if name not in axes.outputs]
    for name in (*known, *names):
        if all(name in log and np.isfinite(log[name]).mean() > OFFERED.least_present for log in logs):
            moving = [log for log in logs if _varies(log, name)]
            if moving and (name in known or not any(_is_response(log, name, axes) for log in moving)):
                candidates.append(name)
    yield from map(parse_term, candidates[: OFFERED.most_channels])
    if all("thrust" in log for log in logs) and any(_thrust_varies(log) for log in logs):
        yield parse_term("C_T")
        if not is_symmetric(coefficient):
            yield from map(parse_term, POWERED)


def _varies(log: FlightLog, name: str) -> bool:
    values = log[name]
    present = values[np.isfinite(values)]
    deviation = float(present.std())
    if present.size < OFFERED.fewest or deviation <= 1e-9 * max(float(np.abs(present).max()), 1e-300):
        return False
    return deviation > OFFERED.least_noise_ratio * float(estimate_noise(log.time, values))


def _is_response(log: FlightLog, name: str, axes: Axes) -> bool:
    responses = [other for other in axes.outputs if other in log]
    states = [other for other in responses if other not in ACCELERATIONS]
    by_one_acceleration = [_explained(log, name, [other]) for other in responses if other in ACCELERATIONS]
    return (
        _explained(log, name, states) > OFFERED.like_the_states
        or max(by_one_acceleration, default=0.0) > OFFERED.like_an_acceleration
    )


def _explained(log: FlightLog, name: str, others: Sequence[str]) -> float:
    """Fraction of a channel's variance explained by a linear combination of others (R^2); 1 where undetermined."""
    responses = [log[other] for other in others]
    present = np.isfinite(log[name]) & np.all([np.isfinite(values) for values in responses], axis=0)
    if present.sum() < 4 * len(responses):
        return 1.0  # a response as a term would do harm
    regressors = np.column_stack([np.ones(present.sum()), *(_scaled(values[present]) for values in responses)])
    target = _scaled(log[name][present])
    fitted = regressors @ np.linalg.lstsq(regressors, target, rcond=None)[0]
    return 1.0 - float(np.var(target - fitted))


def _scaled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values standardised to zero mean and unit standard deviation."""
    deviation = float(values.std())
    return (values - values.mean()) / deviation if deviation > 0.0 else np.zeros_like(values)


def _thrust_varies(log: FlightLog) -> bool:
    thrust = log["thrust"][np.isfinite(log["thrust"])]
    return bool(thrust.size and np.ptp(thrust) > OFFERED.least_thrust * np.abs(thrust).mean() > 0.0)
