"""Turbulence from two witnesses: what the vane sees beyond the inertial path, the lift answers by its own slope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.deviations import corrected_covariance
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
    the inertial path holds gusts and vane noise; the lift answers the gusts in it with its alpha derivative.
    """
    model, design = found.point.model, found.design
    slope = sum(_sign(e) * v for e, v in zip(model.entries, model.values, strict=True) if _is_lift(e))
    if slope == 0.0 or ("gust", "C_Z") not in design.unknowns:
        return None
    place = design.unknowns.index(("gust", "C_Z"))
    answer = float(found.solution.values[place]) / slope
    error = float(np.sqrt(corrected_covariance(design, found.solution)[place, place])) / abs(slope)
    # The vane's noise makes the answer smaller, wherever it is not small beside the gusts.
    if answer < CERTAIN * error or not 0.5 - SLOPE * error < answer < 1.0 + SLOPE * error:
        return None
    winds: list[Array] = []
    memories: list[float] = []
    independent = 0.0
    for n, recording in enumerate(found.frame.recordings):
        if (n, "alpha") not in kinematic.design.segments or (n, "C_Z") not in design.segments:
            continue
        seen = kinematic.solution.residuals[kinematic.design.rows(kinematic.design.segments.index((n, "alpha")))]
        speed = float(np.mean(recording.channels["V"]))
        kept = float(seen[1:] @ seen[:-1]) / max(float(seen @ seen), 1e-300)
        step = recording.interval * recording.band.step
        memory = -step / float(np.log(np.clip(kept, 1e-3, 0.999)))
        winds.append(seen * speed)
        memories.append(memory * speed)
        independent += seen.size * step / max(2.0 * memory, step)
    sigma = float(np.std(np.concatenate(winds)) * np.sqrt(min(answer, 1.0)))
    return Turbulence(
        sigma, sigma / float(np.sqrt(2.0 * max(independent, 2.0))), float(np.median(memories)), answer, error
    )


def _is_lift(entry: tuple[str, object]) -> bool:
    return entry[0] in ("C_Z", "C_L") and str(entry[1]) == "alpha"


def _sign(entry: tuple[str, object]) -> float:
    return -1.0 if entry[0] == "C_L" else 1.0
