"""Moderated t-test (empirical Bayes) of a parameter determined by few blocks of a record, in non-stationary noise.

Least squares assumes the noise to be equally large throughout. Where a control is sampled too coarsely for its steps,
or the air is rough for a while, some blocks contain more of it than others, and an effect that is large in one or two
of them alone is fitted to their noise: its gain in likelihood refers to noise of the usual size. The dispersion of the
blocks' powers beyond chance indicates how reliable the usual size is for any one of them: powers of d degrees of
freedom scatter about a common one as a scaled inverse chi squared of d0 degrees of freedom (Smyth, Statistical
Applications in Genetics and Molecular Biology 3 (1), 2004, article 3). A parameter's variance is the average of that of
its own blocks (bias-reduced form, its degrees of freedom by Satterthwaite: Bell & McCaffrey, Survey Methodology 28,
2002) and the usual one, weighted by degrees of freedom. In stationary noise d0 is infinite, and the test that of least
squares.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma, polygamma, stdtr

from aerosid.equation_error.regression.design import Design
from aerosid.equation_error.regression.least_squares import Solution
from aerosid.equation_error.regression.standard_errors import rows_of_blocks
from aerosid.equation_error.settings import DEVIATIONS

Array = NDArray[np.float64]

STATIONARY = 1e-6
"""Numerical: variance of the powers' logarithms beyond chance below which their degrees of freedom are infinite."""

NEWTON = 20
"""Numerical: steps of Newton's method at most; each gains two digits."""


def moderated_p_value(design: Design, solution: Solution, index: int, distance: float) -> float:
    """Two-sided probability that noise alone takes a parameter so far from its null value.

    Parameters
    ----------
    index : int
        Of the parameter among the unknowns.
    distance : float
        From its null value, in its unit.
    """
    rotated, freedom = block_variance(design, solution, index)
    usual = usual_freedom(design, solution, _mainly(design, solution, index))
    plain = float(solution.covariance[index, index])
    variance = plain if np.isinf(usual) else (freedom * rotated + usual * plain) / (freedom + usual)
    return float(2.0 * stdtr(freedom + usual, -abs(distance) / np.sqrt(max(variance, 1e-300))))


def block_variance(design: Design, solution: Solution, index: int) -> tuple[float, float]:
    """Variance of a parameter from the residuals of the blocks that determine it, and its degrees of freedom.

    With the slopes S_b and innovations e_b of a block, the parameter's row c of the covariance and the symmetric root
    R_b of (1 - S_b C S_b')^-1: sum of (a_b' e_b)^2, a_b = R_b S_b c'; degrees of freedom (sum |a_b|^2)^2 / sum |a_b|^4.
    """
    bread = solution.covariance
    variance, weights = 0.0, []
    for rows in rows_of_blocks(design):
        slopes = solution.slopes[rows]
        leverages, directions = np.linalg.eigh(slopes @ bread @ slopes.T)
        rotated = directions.T @ (slopes @ bread[index])
        rotated = rotated / np.sqrt(1.0 - np.clip(leverages, 0.0, DEVIATIONS.most_followed))
        variance += float(rotated @ (directions.T @ solution.whitened[rows])) ** 2
        weights.append(float(rotated @ rotated))
    total = sum(weights)
    if total <= 0.0:
        return 0.0, 1.0
    return variance, total**2 / sum(weight**2 for weight in weights)


def usual_freedom(design: Design, solution: Solution, equation: str) -> float:
    """Degrees of freedom of the usual noise of an equation as prior of any one block; infinite where all are alike.

    With the mean squares s^2 of blocks of n innovations each, the variance of ln s^2 - psi(n/2) + ln(n/2) about each
    record's own mean, less the mean of psi'(n/2), is psi'(d0/2).
    """
    apart, expected, recordings = [], [], 0
    for s, (_, name) in enumerate(design.segments):
        if name != equation:
            continue
        rows = design.rows(s)
        blocks = [part[(part >= rows.start) & (part < rows.stop)] for part in rows_of_blocks(design)]
        half = np.array([0.5 * part.size for part in blocks if part.size])
        power = np.array([np.mean(solution.whitened[part] ** 2) for part in blocks if part.size])
        level = np.log(np.maximum(power, 1e-300)) - digamma(half) + np.log(half)
        apart.append(level - level.mean())
        expected.append(polygamma(1, half))
        recordings += 1
    every = np.concatenate(apart)
    if every.size <= recordings:
        return np.inf
    beyond = float(every @ every) / (every.size - recordings) - float(np.mean(np.concatenate(expected)))
    return 2.0 * _trigamma_inverse(beyond) if beyond > STATIONARY else np.inf


def _trigamma_inverse(value: float) -> float:
    """Inverse of psi' by Newton's method on 1/psi', which is convex and nearly straight (Smyth's appendix)."""
    x = 0.5 + 1.0 / value
    for _ in range(NEWTON):
        here = float(polygamma(1, x))
        step = here * (1.0 - here / value) / float(polygamma(2, x))
        x += step
        if abs(step) < 1e-9 * x:
            break
    return x


def _mainly(design: Design, solution: Solution, index: int) -> str:
    """The equation with most information on a parameter."""
    shown: dict[str, float] = {}
    for s, (_, equation) in enumerate(design.segments):
        part = solution.slopes[design.rows(s), index]
        shown[equation] = shown.get(equation, 0.0) + float(part @ part)
    return max(shown, key=lambda equation: shown[equation])
