"""Statistics of many runs: errors against the bound, true coverage of the intervals, detection, prediction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.effect_columns import with_columns_of
from aerosid.nomenclature import CHANNELS
from aerosid.studies.cramer_rao import Sensitivity, sensitivity
from aerosid.studies.journal import Row
from aerosid.studies.monte_carlo.plan import Snr
from aerosid.studies.monte_carlo.trial import Trials
from aerosid.studies.monte_carlo.truth import Truth
from aerosid.studies.workers import FAILURE

FloatArray = NDArray[np.float64]

WIDTH = 1.959963984540054
"""Standard: half width of a 95 % interval in standard deviations."""

KINDS = ("own", "published", "plain")
"""The three standard errors of a run: corrected here, as published by Morelli & Klein, as if residuals were white."""


@dataclass(frozen=True)
class DerivativeStatistics:
    """One derivative at one level; None where a number is unknown.

    A run whose model lacks the derivative counts with the value zero and as not covered.

    Attributes
    ----------
    coefficient, term : str
    true : float
    found : float
        Fraction of runs whose model contains it.
    bias, median_error, rmse : float
        Of the difference of estimated and true value.
    crlb, rmse_over_crlb : float or None
        The Cramer-Rao bound for a known structure, and the efficiency relative to it.
    std_error, std_error_published, std_error_plain : float or None
        Root mean square over the runs of the standard error reported by the chain, and of its two alternatives.
    coverage95, coverage95_published, coverage95_plain : float or None
        Fraction of runs whose interval of 1.96 of these standard errors contains the true value; None without noise.
    """

    coefficient: str
    term: str
    true: float
    found: float
    bias: float
    median_error: float
    rmse: float
    crlb: float | None
    rmse_over_crlb: float | None
    std_error: float | None
    std_error_published: float | None
    std_error_plain: float | None
    coverage95: float | None
    coverage95_published: float | None
    coverage95_plain: float | None


@dataclass(frozen=True)
class NamedShare:
    """An effect and the fraction of runs that identify it; `true` its flown value, None where not flown."""

    kind: str
    where: str
    term: str
    true: float | None
    share: float


@dataclass(frozen=True)
class PredictionStatistics:
    """Error of the flight used for prediction only: medians over the runs of its root mean square, SI.

    `signal` is the channel's standard deviation there; `departed` the fraction of completed models that leave their
    range.
    """

    channel: str
    unit: str
    signal: float
    before: float | None
    after: float | None
    departed: float


@dataclass(frozen=True)
class LevelStatistics:
    """All runs at one noise level.

    Attributes
    ----------
    snr : float, None or "recorded"
        None: no noise.
    noise_colour : float
        Correlation of neighbouring samples of the outputs' noise.
    runs, failed : int
        Runs with numbers, and runs without.
    detected : float or None
        Fraction of runs that identify every planted effect; None where none was planted or the structure was known.
    false_alarms : float or None
        Fraction of runs that identify any other effect.
    noise : mapping of str to float
        Standard deviation of each channel's noise, SI.
    named : tuple of NamedShare
        Planted effects first, then other identified effects, the most frequent first.
    prediction : tuple of PredictionStatistics
    derivatives : tuple of DerivativeStatistics
    """

    snr: Snr
    noise_colour: float
    runs: int
    failed: int
    detected: float | None
    false_alarms: float | None
    noise: Mapping[str, float]
    named: tuple[NamedShare, ...]
    prediction: tuple[PredictionStatistics, ...]
    derivatives: tuple[DerivativeStatistics, ...]


def bounds(trials: Trials) -> list[FloatArray | None]:
    """The Cramer-Rao bound of each true derivative, (F,), at each level; None where there is none."""
    truth = trials.truth
    flight = truth.identification
    without_inputs: Sensitivity | None = None
    computed = False
    found: list[FloatArray | None] = []
    for level, (snr, _) in enumerate(trials.levels):
        outputs, inputs = trials.deviations(level)
        if snr is None or not np.all(outputs > 0.0):
            found.append(None)
            continue
        if not computed:
            computed = True
            without_inputs = sensitivity(
                with_columns_of(truth.model, truth.acting),
                flight.manoeuvre,
                flight.state,
                truth.free,
                inputs > 0.0,
                truth.acting,
            )
        samples, count = flight.outputs.shape
        noise = np.multiply.outer(outputs, outputs)[:, :, None] * trials.source(level).autocovariance(samples, count)
        found.append(None if without_inputs is None else _bound(without_inputs, noise, inputs[inputs > 0.0] ** 2))
    return found


def _bound(held: Sensitivity, noise: FloatArray, input_variance: FloatArray) -> FloatArray | None:
    try:
        return held.bound(noise, input_variance)
    except ValueError:  # residuals resampled from few blocks may have a covariance without full rank
        return None


def level_statistics(trials: Trials, level: int, rows: Sequence[Row], bound: FloatArray | None) -> LevelStatistics:
    """Statistics of the runs of one level.

    Parameters
    ----------
    trials : Trials
        The true aircraft and its flights.
    level : int
        Number of the level.
    rows : sequence of dict
        The results of `run_trial`, in the order of the runs; failures among them.
    bound : ndarray, shape (F,), or None
        From `bounds`.
    """
    truth = trials.truth
    good = [row for row in rows if FAILURE not in row]
    outputs, inputs = trials.deviations(level)
    manoeuvre = truth.identification.manoeuvre
    noise = dict(zip(manoeuvre.outputs, outputs.tolist(), strict=True))
    noise.update({name: float(s) for name, s in zip(manoeuvre.extra_columns, inputs, strict=True) if s > 0.0})
    searched = trials.catalogue != "known" and bool(good)
    labels = [{(kind, where, term) for kind, where, term, *_ in row["found"]} for row in good]
    planted = {effect.label for effect in truth.planted}
    snr, colour = trials.levels[level]
    return LevelStatistics(
        snr=snr,
        noise_colour=colour,
        runs=len(good),
        failed=len(rows) - len(good),
        detected=float(np.mean([planted <= held for held in labels])) if searched and planted else None,
        false_alarms=float(np.mean([not held <= planted for held in labels])) if searched else None,
        noise=noise,
        named=_named(truth, labels) if searched else (),
        prediction=_prediction(truth, good),
        derivatives=_derivatives(truth, good, bound, noisy=snr is not None),
    )


def _named(truth: Truth, labels: Sequence[set[tuple[str, str, str]]]) -> tuple[NamedShare, ...]:
    counts = Counter(label for held in labels for label in held)
    planted = {effect.label: effect.value for effect in truth.planted}
    others = sorted((label for label in counts if label not in planted), key=lambda label: (-counts[label], label))
    return tuple(NamedShare(*label, planted.get(label), counts[label] / len(labels)) for label in (*planted, *others))


def _prediction(truth: Truth, rows: Sequence[Row]) -> tuple[PredictionStatistics, ...]:
    if truth.validation is None or not rows:
        return ()
    before, after = (_numbers(row.get(key) for row in rows) for key in ("before", "after"))
    signal = np.nanstd(truth.validation.outputs, axis=0)
    return tuple(
        PredictionStatistics(
            name,
            CHANNELS[name].unit,
            float(signal[i]),
            _median(before[:, i]) if before.size else None,
            _median(after[:, i]),
            float(np.mean(~np.isfinite(after[:, i]))),
        )
        for i, name in enumerate(truth.validation.manoeuvre.outputs)
    )


def _median(values: FloatArray) -> float | None:
    """A run whose simulation departed ranks worse than all others."""
    middle = float(np.median(np.where(np.isfinite(values), values, np.inf)))
    return middle if np.isfinite(middle) else None


def _numbers(lists: Iterable[Sequence[float | None] | None]) -> FloatArray:
    """Rows of numbers as an array, NaN for None; empty where there are no rows."""
    return np.array([[np.nan if x is None else x for x in row] for row in lists if row is not None], dtype=np.float64)


def _derivatives(
    truth: Truth, rows: Sequence[Row], bound: FloatArray | None, noisy: bool
) -> tuple[DerivativeStatistics, ...]:
    if not rows:
        return ()
    true = np.array([truth.model.value(entry) for entry in truth.free])
    values = _numbers(row["values"] for row in rows)
    error = np.nan_to_num(values) - true
    spreads = {kind: _numbers(row[kind] for row in rows) for kind in KINDS}
    with np.errstate(invalid="ignore"):
        covered = {
            kind: np.mean(np.isfinite(values) & (np.abs(error) <= WIDTH * spread), axis=0)
            for kind, spread in spreads.items()
        }
    size = {kind: _root_mean_square(spread) for kind, spread in spreads.items()}
    rmse = np.sqrt(np.mean(error**2, axis=0))
    return tuple(
        DerivativeStatistics(
            coefficient=coefficient,
            term=str(term),
            true=float(true[n]),
            found=float(np.mean(np.isfinite(values[:, n]))),
            bias=float(np.mean(error[:, n])),
            median_error=float(np.median(error[:, n])),
            rmse=float(rmse[n]),
            crlb=None if bound is None or not np.isfinite(bound[n]) else float(bound[n]),
            rmse_over_crlb=None if bound is None or not np.isfinite(bound[n]) else float(rmse[n] / bound[n]),
            std_error=size["own"][n],
            std_error_published=size["published"][n],
            std_error_plain=size["plain"][n],
            coverage95=float(covered["own"][n]) if noisy else None,
            coverage95_published=float(covered["published"][n]) if noisy else None,
            coverage95_plain=float(covered["plain"][n]) if noisy else None,
        )
        for n, (coefficient, term) in enumerate(truth.free)
    )


def _root_mean_square(spread: FloatArray) -> list[float | None]:
    present = np.isfinite(spread)
    counts = present.sum(axis=0)
    squares = np.where(present, spread, 0.0) ** 2
    return [float(np.sqrt(s / n)) if n else None for s, n in zip(squares.sum(axis=0), counts, strict=True)]
