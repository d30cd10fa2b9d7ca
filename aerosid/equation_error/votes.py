"""The vote of recordings that are not fitted: explained variance of each coefficient, with and without an effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.channels import COEFFICIENT
from aerosid.equation_error.design import design_of
from aerosid.equation_error.estimate import Estimate, Frame
from aerosid.signals.fit_statistics import theil

Array = NDArray[np.float64]

LAGS = 10
"""Samples in the band over which the squares of residuals may be correlated."""


@dataclass(frozen=True)
class Share:
    """How well a model predicts one coefficient of one recording from the measured motion, constants free there.

    `r2` in the band of the motion; `theil`: Theil's inequality coefficient.
    """

    recording: str
    fitted: bool
    coefficient: str
    r2: float
    theil: float


def left_over(frame: Frame, found: Estimate) -> dict[tuple[int, str], tuple[Array, Array]]:
    """What was measured and what is left of it, (n,) each about its mean, of each coefficient and recording.

    The model's values are the estimate's own, on every recording.
    """
    design = design_of(frame.segments(found.point), frame.settings)
    shared = {
        unknown: value
        for unknown, value in zip(found.design.unknowns, found.solution.values, strict=True)
        if unknown[0] == "term"
    }
    values = np.array([shared.get(unknown, 0.0) for unknown in design.unknowns])
    own = [p for p, unknown in enumerate(design.unknowns) if unknown[0] == "one"]
    result = {}
    for s, (recording, equation) in enumerate(design.segments):
        if equation not in COEFFICIENT:
            continue
        rows = design.rows(s)
        left = design.target[rows] - design.columns[rows] @ values
        constant = design.columns[rows][:, own]
        constant = np.column_stack([np.ones(left.size), constant[:, np.any(constant != 0.0, axis=0)]])
        left = left - constant @ np.linalg.lstsq(constant, left, rcond=None)[0]
        result[recording, equation] = (design.target[rows] - design.target[rows].mean(), left)
    return result


def shares_of(frame: Frame, found: Estimate) -> tuple[Share, ...]:
    """R^2 and Theil's coefficient of every coefficient and recording."""
    rows = []
    for (place, equation), (measured, left) in left_over(frame, found).items():
        recording = frame.recordings[place]
        spread = max(float(measured @ measured), 1e-300)
        inequality = theil(measured, measured - left)
        rows.append(
            Share(
                recording.name,
                recording.fitted,
                equation,
                1.0 - float(left @ left) / spread,
                inequality.coefficient if inequality else 0.0,
            )
        )
    return tuple(rows)


def refused(frame: Frame, without: Estimate, found: Estimate, doubt: float, least: float) -> bool:
    """Whether an unseen recording's coefficient is predicted worse with an effect.

    By more than `doubt` deviations of the mean of the squares, and in R^2 by more than `least`.
    """
    before, after = left_over(frame, without), left_over(frame, found)
    for key, (measured, left) in after.items():
        if frame.recordings[key[0]].fitted:
            continue
        worse = left**2 - before[key][1] ** 2
        rise = float(worse.mean())
        if rise > doubt * _deviation_of_mean(worse) and rise > least * float(np.mean(measured**2)):
            return True
    return False


def _deviation_of_mean(values: Array) -> float:
    """Standard deviation of the mean of a coloured series (Newey & West, 1987)."""
    centred = values - values.mean()
    total = float(centred @ centred)
    for lag in range(1, min(LAGS, values.size - 1) + 1):
        total += 2.0 * (1.0 - lag / (LAGS + 1.0)) * float(centred[lag:] @ centred[:-lag])
    return float(np.sqrt(max(total, 0.0))) / values.size
