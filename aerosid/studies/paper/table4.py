"""Table 4: the two coefficients of the light transport from noisy records, by our chain and by that of the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.model_error.estimators.consistency import judge_consistency, most_likely_weights
from aerosid.model_error.estimators.history import ModelErrorHistory
from aerosid.model_error.estimators.response import respond
from aerosid.model_error.estimators.weights import Weights
from aerosid.signals.least_squares import recursive_least_squares
from aerosid.signals.prefilter import Butterworth, apply, choose_cut_off
from aerosid.studies.paper import published
from aerosid.studies.paper.flight_example import ALPHA2, SAMPLES, STATES, Flight, noisy, reference_flight
from aerosid.studies.paper.table3 import estimate
from aerosid.studies.paper.view import TableView, number

Array = NDArray[np.float64]

SNRS: tuple[float | None, ...] = (None, 20.0, 10.0)
PASSES = 4
"""Design: passes of our chain: estimate, regress, complete the model, repeat. The fourth changes no digit
shown."""

FILTER_ORDER = 2
"""Design: order of the Butterworth filter."""


@dataclass(frozen=True)
class NoiseLevel:
    """One row of table 4.

    Attributes
    ----------
    snr : float or None
        None: no noise.
    ours, direct : (seeds, 2)
        C_X_alpha2 and C_m_alpha2 of each seed, by our chain and by the paper's, step by step.
    density : float
        Density of the model error, chosen by likelihood on the first record.
    cut_off_hz : float or None
        Cut-off of the digital filter in the paper's chain.
    """

    snr: float | None
    ours: Array
    direct: Array
    density: float
    cut_off_hz: float | None


def make_table4(
    seeds: int, tick: Callable[[], None] = lambda: None, flight: Flight | None = None
) -> tuple[NoiseLevel, ...]:
    """Table 4.

    Parameters
    ----------
    seeds : int
        Noise seeds per signal-to-noise ratio.
    tick : callable
        Called after every record.
    flight : Flight, optional
        `reference_flight` by default.
    """
    flown = reference_flight() if flight is None else flight
    return tuple(_level(flown, snr, 1 if snr is None else seeds, tick) for snr in SNRS)


def _level(flight: Flight, snr: float | None, seeds: int, tick: Callable[[], None]) -> NoiseLevel:
    measured, deviation = noisy(flight, snr, 0)
    density = _most_likely_density(flight, measured, deviation)
    cut_off = None if snr is None else _cut_off(flight, measured, deviation)
    ours, direct = np.empty((seeds, 2)), np.empty((seeds, 2))
    for seed in range(seeds):
        measured, deviation = noisy(flight, snr, seed)
        ours[seed] = our_chain(flight, measured, deviation, density)
        direct[seed] = paper_chain(flight, measured, deviation, density, cut_off)
        tick()
    return NoiseLevel(snr, ours, direct, density, cut_off)


def our_chain(flight: Flight, measured: Array, deviation: Array, density: float) -> Array:
    """Both coefficients, (2,), by passing candidates through the estimator and completing the model in turn.

    The error of the initial state is estimated with them by its own response.
    """
    coefficients = np.zeros(2)
    # True minus given initial state: zero response to the candidates at first, one column for each state.
    initial = np.hstack([np.zeros((4, 2)), np.eye(4)])
    for _ in range(PASSES):
        history = estimate(
            flight, measured, deviation, (density, density), (float(coefficients[0]), float(coefficients[1]))
        )
        candidate = np.concatenate([flight.candidate(np.asarray(history.states), (2,)), np.zeros((SAMPLES, 4, 4))], 2)
        response = respond(history, candidate, initial)
        d = history.model_error[:, [0, 2]]
        weights = np.tile(1.0 / np.mean(d**2, axis=0), SAMPLES)
        fit = recursive_least_squares(response[:, [0, 2], :].reshape(-1, 6), d.reshape(-1), weights=weights)
        coefficients = coefficients + fit.coefficients[:2]
    return coefficients


def paper_chain(flight: Flight, measured: Array, deviation: Array, density: float, cut_off_hz: float | None) -> Array:
    """Both coefficients, (2,), as in section 3.3: d̂ and the states filtered, then recursive least squares."""
    history = estimate(flight, measured, deviation, (density, density))
    states, d = np.array(history.states), np.array(history.model_error)
    if cut_off_hz is not None:
        low_pass = Butterworth(FILTER_ORDER, cut_off_hz, zero_phase=False)
        states = np.column_stack([apply(low_pass, flight.time, column) for column in states.T])
        d = np.column_stack([apply(low_pass, flight.time, column) for column in d.T])
    candidate = flight.candidate(states, (2,))
    axial = recursive_least_squares(candidate[:, 0, :1], d[:, 0]).coefficients[0]
    pitch = recursive_least_squares(candidate[:, 2, 1:], d[:, 2]).coefficients[0]
    return np.array([axial, pitch])


def _most_likely_density(flight: Flight, measured: Array, deviation: Array) -> float:
    def evaluate(weights: Weights) -> Any:
        value = float(weights.Q2_inverse[0, 0])
        history: ModelErrorHistory = estimate(flight, measured, deviation, (value, value))
        return judge_consistency(history, measured, np.diag(deviation**2), history.states)

    start = Weights(np.eye(4), np.diag([1.0, 0.0, 1.0, 0.0]), np.eye(4))
    return most_likely_weights(evaluate, start).factor


def _cut_off(flight: Flight, measured: Array, deviation: Array) -> float | None:
    channels = {name: measured[:, i] for i, name in enumerate(STATES)}
    noise = {name: float(deviation[i]) for i, name in enumerate(STATES)}
    return choose_cut_off(flight.time, channels, noise, inputs=()).cut_off_hz


def json_rows(levels: tuple[NoiseLevel, ...]) -> list[dict[str, Any]]:
    """Rows of tables.json: means over the seeds, by our chain."""
    return [
        {"snr": level.snr, "C_X_alpha2": float(level.ours[:, 0].mean()), "C_m_alpha2": float(level.ours[:, 1].mean())}
        for level in levels
    ]


def view(levels: tuple[NoiseLevel, ...]) -> TableView:
    """Table 4 for the page."""
    rows = [("true", *(number(value, 4) for value in ALPHA2), "", "", "")]
    for level in levels:
        name = "no noise" if level.snr is None else f"SNR {level.snr:g}"
        printed = published.TABLE_4[level.snr]
        rows.append(
            (f"{name}, printed", number(printed[0], 3), number(printed[1], 3), *_errors(np.array([printed])), "")
        )
        for words, values in (("ours", level.ours), ("paper's chain", level.direct)):
            mean = values.mean(axis=0)
            rows.append((f"{name}, {words}", number(mean[0], 4), number(mean[1], 4), *_errors(values), _spread(values)))
    seeds = max(len(level.ours) for level in levels)
    cut_offs = ", ".join(f"{level.cut_off_hz:.2g} Hz at SNR {level.snr:g}" for level in levels if level.cut_off_hz)
    return TableView(
        "Table 4. Coefficients from noisy records",
        ("record", "C_X_α2", "C_m_α2", "error C_X_α2", "error C_m_α2", "deviation of one record"),
        tuple(rows),
        (
            (
                f"Means over {seeds} noise seeds per ratio; signal-to-noise ratio is the standard deviation of each "
                "channel (u, w, q, theta) about its mean over that of its white noise. Only the two coefficients are "
                "unknown, as in the paper."
            ),
            (
                "Our chain passes the candidates through the estimator, estimates the error of the initial state "
                f"beside the coefficients, and completes the model in turn, {PASSES} times. The weight of the model "
                "error is the most likely one on the first record."
            ),
            (
                "The paper's chain, step by step: one estimate with the deficient model at the same weight, d̂ and "
                f"the states through one causal digital filter (Butterworth of order {FILTER_ORDER}, cut-off from the "
                f"channels' spectra: {cut_offs}), recursive least squares of each error on its own candidate. It "
                "misses by up to a few per cent, as the printed numbers do: d̂ answers late and in part, a filtered "
                "noisy state makes a noisy regressor, and these two errors may cancel. The printed errors are of one "
                "record each, at a weight, a filter, an input and a flight condition that are not printed; nothing "
                "here is tuned to them."
            ),
        ),
    )


def _errors(values: Array) -> tuple[str, str]:
    error = 100.0 * (values.mean(axis=0) / np.array(ALPHA2) - 1.0)
    return (f"{error[0]:+.2f} %".replace("-", "−"), f"{error[1]:+.2f} %".replace("-", "−"))


def _spread(values: Array) -> str:
    if len(values) < 2:
        return ""
    deviation = 100.0 * values.std(axis=0, ddof=1) / np.abs(ALPHA2)
    return f"{deviation[0]:.2f} %, {deviation[1]:.2f} %"
