"""Turbulence from two witnesses: what the vane sees beyond the inertial path, the lift answers by its own slope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from aerosid.equation_error.estimate import Estimate

Array = NDArray[np.float64]

SLOPE = 3.0
"""Deviations from one within which the lift's answer must lie, 1."""

CERTAIN = 6.0
"""Deviations from zero that it must have, 1: vane noise answers nothing."""


@dataclass(frozen=True)
class Turbulence:
    """Vertical gusts: standard deviation m/s and its own, scale m, and the answer of the lift over the expected one."""

    sigma: float
    sigma_error: float
    length: float
    answer: float
    answer_error: float


def turbulence_of(kinematic: Estimate, found: Estimate) -> Turbulence | None:
    """The turbulence that alpha's kinematic equation and C_Z show together; None where they do not agree on any.

    `kinematic`: the estimate of the kinematic equations, `found` that of the coefficients. The residual of alpha over
    the inertial path holds gusts and vane noise; that of C_Z holds its alpha derivative times the gusts, as far as the
    regressor alpha is the inertial one (faster than `blend`).
    """
    model = found.point.model
    slope = sum(_sign(e) * v for e, v in zip(model.entries, model.values, strict=True) if _is_lift(e))
    if slope == 0.0:
        return None
    products: list[Array] = []
    squares: list[Array] = []
    gusts: list[Array] = []
    memories: list[float] = []
    design = found.design
    for n, recording in enumerate(found.frame.recordings):
        if (n, "alpha") not in kinematic.design.segments or (n, "C_Z") not in design.segments:
            continue
        seen = kinematic.solution.residuals[kinematic.design.rows(kinematic.design.segments.index((n, "alpha")))]
        answered = found.solution.residuals[design.rows(design.segments.index((n, "C_Z")))] / slope
        step = recording.interval * recording.band.step
        width = found.frame.settings.blend / step
        fast = seen - gaussian_filter1d(seen, width, mode="nearest")
        products.append(fast * answered)
        squares.append(fast * fast)
        speed = float(np.mean(recording.channels["V"]))
        gusts.append(seen * speed)
        kept = float(seen[1:] @ seen[:-1]) / max(float(seen @ seen), 1e-300)
        memories.append(-step / np.log(np.clip(kept, 1e-3, 0.999)) * speed)
    if not products:
        return None
    total = float(np.sum(np.concatenate(squares)))
    answer = float(np.sum(np.concatenate(products))) / max(total, 1e-300)
    scores = np.concatenate([p - answer * s for p, s in zip(products, squares, strict=True)])
    lagged = sum(2.0 * (1.0 - lag / 7.0) * float(scores[lag:] @ scores[:-lag]) for lag in range(1, 7))
    error = float(np.sqrt(max(float(scores @ scores) + lagged, 1e-300))) / max(total, 1e-300)
    # The vane's noise makes the answer smaller, wherever it is not small beside the gusts.
    if answer < CERTAIN * error or not 0.5 - SLOPE * error < answer < 1.0 + SLOPE * error:
        return None
    wind = np.concatenate(gusts)
    sigma = float(np.std(wind) * np.sqrt(min(answer, 1.0)))
    length = float(np.median(memories))
    independent = max(wind.size * step * speed / max(2.0 * length, step * speed), 2.0)
    return Turbulence(sigma, sigma / float(np.sqrt(2.0 * independent)), length, answer, error)


def _is_lift(entry: tuple[str, object]) -> bool:
    return entry[0] in ("C_Z", "C_L") and str(entry[1]) == "alpha"


def _sign(entry: tuple[str, object]) -> float:
    return -1.0 if entry[0] == "C_L" else 1.0
