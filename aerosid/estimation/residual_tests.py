"""Residual tests: whiteness and size of each channel's residual against its noise."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.fit_settings import RESIDUAL_TESTS
from aerosid.estimation.likelihood import Whitened
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, whiten
from aerosid.signals.fit_statistics import is_coloured, noise_memories

KEPT = 1_000_000
"""Numerical: size of an estimate's residuals up to which they are kept, 8 MB."""


def unexplained_channels(
    refinement: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    *,
    noise_hidden: bool = False,
    memory: float = RESIDUAL_TESTS.recorder_memory,
    least_share: float = 0.0,
    whitened: Iterable[Whitened] | None = None,
) -> tuple[str, ...]:
    """The channels whose residual exceeds their noise and is coloured, which shows a model error.

    A sensor's own noise may be coloured too; `noise_memories` distinguishes the two. Where a recorder hides the noise,
    a residual counts that exceeds the white noise by more and whose means over `memory` s, longer than filtered noise
    repeats itself, leave a share of the channel's variance and are coloured; the last digits of a log may show a
    twentieth of such noise. Elsewhere it counts with more than the `least_share`, 1, of the channel's variance.
    `whitened`: the estimate's stretches, where they are known.
    """
    level = np.sqrt(refinement.variance)
    least = RESIDUAL_TESTS.recorded_ratio if noise_hidden else RESIDUAL_TESTS.noise_ratio
    least_share = RESIDUAL_TESTS.recorded_share if noise_hidden else least_share
    unexplained: dict[str, None] = {}
    residuals = _residuals(refinement, manoeuvres) if whitened is None else ((w.log, w.residual) for w in whitened)
    for log, residuals_of_log in residuals:
        manoeuvre = manoeuvres[log]
        ratios: dict[int, float] = {}
        for i in range(len(manoeuvre.axes.outputs)):
            residual = residuals_of_log[np.isfinite(residuals_of_log[:, i]), i]
            if residual.size < RESIDUAL_TESTS.fewest or manoeuvre.noise[i] == 0.0:
                continue  # too few samples, or a quantised record that holds its last sample: its noise is not known
            size = float(np.sqrt(np.mean(residual**2))) * level[i]
            ratio = size / manoeuvre.noise[i]
            if size**2 <= least_share * manoeuvre.spread[i] ** 2:
                continue
            if noise_hidden:
                slow = _means(manoeuvre.flight.time, residuals_of_log[:, i], memory)
                share = float(np.mean(slow**2)) * level[i] ** 2 / manoeuvre.spread[i] ** 2
                if share <= least_share or not is_coloured(slow):
                    continue
            if ratio > least and is_coloured(residual):
                ratios[i] = ratio
        if not ratios:
            continue
        memories = noise_memories(manoeuvre.flight.time, residuals_of_log)
        for i, ratio in ratios.items():
            if not ratio < RESIDUAL_TESTS.as_remembered * _noise_understatement(memories[i]):
                unexplained[manoeuvre.axes.outputs[i]] = None
    return tuple(unexplained)


def _residuals(refinement: Refinement, manoeuvres: Sequence[Manoeuvre]) -> Iterable[tuple[int, NDArray[np.float64]]]:
    """The whitened residuals (N, m) of each stretch, with the index of its manoeuvre; those of short records once."""
    logs = tuple(manoeuvre.span for manoeuvre in manoeuvres)
    if logs in refinement.residuals:
        return refinement.residuals[logs]
    residuals = ((part.log, part.residual) for part in whiten(refinement, manoeuvres, columns=()))
    if sum(manoeuvre.flight.measured.size for manoeuvre in manoeuvres) > KEPT:
        return residuals
    refinement.residuals[logs] = tuple(residuals)
    return refinement.residuals[logs]


def _means(time: NDArray[np.float64], residual: NDArray[np.float64], interval: float) -> NDArray[np.float64]:
    """Means (M,) of a residual (N,) over intervals [s], those without samples left out."""
    present = np.isfinite(residual)
    places = ((time - time[0]) / interval).astype(np.int64)[present]
    counts = np.bincount(places)
    sums = np.bincount(places, weights=residual[present])
    return sums[counts > 0] / counts[counts > 0]


def _noise_understatement(memory: float) -> float:
    """Ratio of coloured noise of a `memory` per sample to its estimate from second differences; NaN of NaN."""
    return float(np.sqrt(3.0 / ((3.0 - memory) * (1.0 - memory)))) if memory < 1.0 else np.nan


def coloured_noise(refinement: Refinement, manoeuvres: Sequence[Manoeuvre]) -> tuple[tuple[str, str, float], ...]:
    """Log, channel and memory (correlation of successive samples) of each sensor whose own noise is coloured."""
    found = []
    for log, residuals in _residuals(refinement, manoeuvres):
        manoeuvre = manoeuvres[log]
        memories = noise_memories(manoeuvre.flight.time, residuals)
        for i, name in enumerate(manoeuvre.axes.outputs):
            residual = residuals[:, i]
            if memories[i] > 0.0 and is_coloured(residual[np.isfinite(residual)]):
                found.append((manoeuvre.name, name, float(memories[i])))
    return tuple(found)
