"""Partial correlation of candidates with a model error in coloured noise, on plain arrays.

Neighbouring samples of a model error's noise repeat each other, so that a plain correlation with a smooth candidate is
great by chance. Target, known columns and candidates are passed through the filter that whitens the noise, what the
known columns explain is taken out of both, and the rest is correlated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import special

from aerosid.errors import UsageError

Array = NDArray[np.float64]

_TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class ColourSettings:
    """How the colour of the noise is modelled.

    Attributes
    ----------
    highest_order : int
        Of the autoregressive noise model; the corrected Akaike criterion chooses up to it. 0: white. Eight covers a
        sensor with a filter (two) on top of an unmodelled mode (two) twice.
    samples_per_order : int
        Samples that each coefficient asks for: twenty keep its standard error below a quarter.
    rounds : int
        Noise model and regression in turn; the second round moves a deviation by less than 2 % (own Monte Carlo).
    least_independence : float
        Share of a candidate's squares that the known columns must leave, in [0, 1); below, it is another name of them.
        1e-3: 3 % of its size is its own. At 1e-5 alphadot, told from q and alpha by less, was named on one in ten
        flights in coloured noise (100 own clean flights, seed 7211).
    well_apart : float
        Least eigenvalue of the candidates' correlations, in [0, 1], from which a regression on several is taken by
        products, which then lose no more than half of a number's digits; else by orthogonal columns.
    """

    highest_order: int = 8
    samples_per_order: int = 20
    rounds: int = 2
    least_independence: float = 1e-3
    well_apart: float = 1e-6


@dataclass(frozen=True)
class Coloured:
    """A regression in coloured noise.

    Attributes
    ----------
    coefficients : (m,) array
        Of the known columns; 0 where the record does not determine one.
    covariance : (m, m) array
        Of these; rows of what is not determined are infinite.
    residual : (N,) array
        Target minus known columns times coefficients.
    filters : tuple of (p + 1,) arrays
        The whitening filter of each group, 1 first.
    variances : (groups,) array
        Variance of the white noise behind each group.
    cost : float
        -2 ln L of the groups but for a constant, Akaike's charge for the noise models' coefficients included.
    white_target : (N,) array
        Residual through the filters, in units of its deviation; the rows that start a filter are zero.
    basis : (N, r) array
        Orthonormal basis of the known columns through the same filters.
    """

    coefficients: Array
    covariance: Array
    residual: Array
    filters: tuple[Array, ...]
    variances: Array
    cost: float
    white_target: Array
    basis: Array
    groups: tuple[slice, ...]
    freedom: int

    def whitened(self, columns: Array) -> Array:
        """Columns (N, c) through the filters, each group in units of its noise."""
        return _filtered(columns, self.groups, self.filters, self.variances)


@dataclass(frozen=True)
class PartialCorrelations:
    """What the known columns leave of a target, against what they leave of each candidate.

    Attributes
    ----------
    correlation : (c,) array
        Partial correlation in the whitened samples; 0 where the known columns leave nothing of a candidate.
    ratio : (c,) array
        Student's t of the candidate's coefficient.
    coefficient, deviation : (c,) arrays
        Of each candidate alone beside the known columns, with its standard deviation.
    independence : (c,) array
        Share of the candidate's squares that the known columns leave.
    p_value : (c,) array
        Of a ratio as great by chance, two-sided, times the number of candidates (Bonferroni), at most 1.
    """

    correlation: Array
    ratio: Array
    coefficient: Array
    deviation: Array
    independence: Array
    p_value: Array


def coloured_regression(
    target: Array, known: Array, lengths: Sequence[int], settings: ColourSettings = ColourSettings()
) -> Coloured:
    """Least squares of a target on known columns, in autoregressive noise that is estimated with it.

    Parameters
    ----------
    target : (N,) array
        Groups one after another: each channel of each record, uniformly spaced, missing samples left out.
    known : (N, m) array
        m may be 0.
    lengths : sequence of int
        Samples of each group; each has its own colour and size of noise.
    settings : ColourSettings

    Raises
    ------
    UsageError
        Where shapes disagree, a value is not finite, or there are no more samples than columns.

    Notes
    -----
    Cochrane and Orcutt's iteration with a noise model of higher order: regress, fit the noise model to the residual
    (Yule and Walker, order by the corrected Akaike criterion), filter all columns by it, regress again.

    References
    ----------
    Cochrane & Orcutt (1949), Journal of the American Statistical Association 44, 32-61.
    """
    y, X = np.asarray(target, dtype=np.float64), np.asarray(known, dtype=np.float64)
    groups = _groups(y, X, lengths)
    filters = tuple(np.ones(1) for _ in groups)
    variances = np.array([max(float(np.mean(y[part] ** 2)), _TINY) for part in groups])
    scale = np.linalg.norm(X, axis=0)
    shown = np.flatnonzero(scale > 0.0)
    solution = np.zeros(X.shape[1])
    residual = y
    basis, white = np.zeros((y.size, 0)), y
    inverse = np.zeros((0, 0))
    # The first pass finds the sizes of the groups' noise, the later ones their colour too.
    for turn in range(settings.rounds + 2):
        filtered = _filtered(np.column_stack([X[:, shown] / scale[shown], y]), groups, filters, variances)
        columns, white = filtered[:, :-1], filtered[:, -1]
        basis, strength, right = np.linalg.svd(columns, full_matrices=False) if shown.size else _nothing(y.size)
        clear = strength > 1e-10 * (strength[0] if strength.size else 1.0)
        basis = basis[:, clear]
        inverse = right[clear].T / strength[clear]
        solution = np.zeros(X.shape[1])
        solution[shown] = inverse @ (basis.T @ white) / scale[shown]
        residual = y - X @ solution
        if turn == settings.rounds + 1:
            break
        if turn > 0:
            filters = tuple(autoregression(residual[part], settings) for part in groups)
        rough = _filtered(residual[:, None], groups, filters, np.ones(len(groups)))[:, 0]
        variances = np.array([_variance(rough[p], f.size - 1) for p, f in zip(groups, filters, strict=True)])
    freedom = y.size - sum(f.size - 1 for f in filters) - basis.shape[1]
    if freedom < 1:
        raise UsageError(
            f"{y.size} samples do not determine {X.shape[1]} columns and their noise; give a longer record."
        )
    white = white - basis @ (basis.T @ white)
    spread = float(white @ white) / freedom
    covariance = np.full((X.shape[1], X.shape[1]), np.inf)
    covariance[np.ix_(shown, shown)] = spread * (inverse @ inverse.T) / np.outer(scale[shown], scale[shown])
    return Coloured(
        solution, covariance, residual, filters, variances, _cost(residual, groups, filters), white, basis, groups,
        freedom,
    )  # fmt: skip


def partial_correlations(
    fit: Coloured, candidates: Array, settings: ColourSettings = ColourSettings(), asked: int | None = None
) -> PartialCorrelations:
    """Partial correlation of each candidate (N, c) with the target of a regression in coloured noise.

    Parameters
    ----------
    fit : Coloured
        The regression on the known columns.
    candidates : (N, c) array
        In the same order of samples.
    asked : int, optional
        Number of candidates that the p-values answer for; by default c.

    Notes
    -----
    With the noise model held, rho = t / sqrt(t^2 + nu) for the t-ratio of the candidate's coefficient at nu degrees of
    freedom: partial correlation and significance are one number.
    """
    return correlated_alone(fit, remainders(fit, np.asarray(candidates, dtype=np.float64)), settings, asked)


@dataclass(frozen=True)
class Remainders:
    """Candidates (N, c) through the filters of a regression, less what its known columns explain.

    Attributes
    ----------
    own : (c,) array
        Squares of each candidate.
    left : (N, c) array
        What is left of it.
    squares : (c,) array
        Of that.
    """

    own: Array
    left: Array
    squares: Array

    def among(self, places: NDArray[np.int64]) -> Remainders:
        """Some of them."""
        return Remainders(self.own[places], self.left[:, places], self.squares[places])

    @property
    def independence(self) -> Array:
        """Share of each candidate's squares that the known columns leave."""
        return np.divide(self.squares, self.own, out=np.zeros_like(self.own), where=self.own > 0.0)


def remainders(fit: Coloured, candidates: Array) -> Remainders:
    """What the known columns of a regression leave of candidates (N, c)."""
    left = fit.whitened(candidates)
    own = np.einsum("ij,ij->j", left, left)
    left -= fit.basis @ (fit.basis.T @ left)
    return Remainders(own, left, np.einsum("ij,ij->j", left, left))


def correlated_alone(
    fit: Coloured, candidates: Remainders, settings: ColourSettings = ColourSettings(), asked: int | None = None
) -> PartialCorrelations:
    """As `partial_correlations`, of what is left of the candidates."""
    squares, independence = candidates.squares, candidates.independence
    apart = independence > settings.least_independence
    product = candidates.left.T @ fit.white_target
    size = np.sqrt(squares * float(fit.white_target @ fit.white_target))
    rho = np.clip(np.divide(product, size, out=np.zeros_like(size), where=apart & (size > 0.0)), -1.0, 1.0)
    nu = max(fit.freedom - 1, 1)
    ratio = rho * np.sqrt(nu / np.maximum(1.0 - rho**2, _TINY))
    coefficient = np.divide(product, squares, out=np.zeros_like(size), where=apart)
    deviation = np.divide(np.abs(coefficient), np.abs(ratio), out=np.full_like(size, np.inf), where=ratio != 0.0)
    count = squares.size if asked is None else asked
    p_value = np.minimum(1.0, 2.0 * special.stdtr(nu, -np.abs(ratio)) * count)
    return PartialCorrelations(rho, ratio, coefficient, deviation, independence, np.where(apart, p_value, 1.0))


def multiple_correlation(
    fit: Coloured, columns: Array, settings: ColourSettings = ColourSettings()
) -> tuple[float, tuple[float, ...], float]:
    """What several candidates (N, k) explain together: chi-square of k numbers, their coefficients, independence.

    Parameters
    ----------
    fit : Coloured
        The regression on the known columns.
    columns : (N, k) array
        They enter together or not at all.

    Returns
    -------
    The fall of the squares in units of the noise, the coefficients, and the least share of a candidate's squares that
    the known columns leave; nothing is explained where that is too little.
    """
    return correlated_together(fit, remainders(fit, np.asarray(columns, dtype=np.float64)), settings)


def correlated_together(
    fit: Coloured, columns: Remainders, settings: ColourSettings = ColourSettings()
) -> tuple[float, tuple[float, ...], float]:
    """As `multiple_correlation`, of what is left of the candidates."""
    count = columns.own.size
    independence = float(np.min(columns.independence))
    if independence <= settings.least_independence:
        return 0.0, (0.0,) * count, max(independence, 0.0)
    scale = np.sqrt(columns.squares)
    scaled = columns.left / scale
    products, aims = scaled.T @ scaled, scaled.T @ fit.white_target
    if np.linalg.eigvalsh(products)[0] > settings.well_apart:
        solution = np.linalg.solve(products, aims)
    else:
        solution, *_ = np.linalg.lstsq(scaled, fit.white_target, rcond=1e-8)
    explained = float(aims @ solution)
    rest = max(float(fit.white_target @ fit.white_target) - explained, _TINY)
    gain = explained / rest * max(fit.freedom - count, 1)
    return gain, tuple(np.asarray(solution / scale).tolist()), independence


def autoregression(residual: Array, settings: ColourSettings = ColourSettings()) -> Array:
    """The filter (p + 1,), 1 first, that makes a residual (N,) white; order by the corrected Akaike criterion."""
    count = residual.size
    highest = min(settings.highest_order, count // settings.samples_per_order)
    best, least = np.ones(1), np.inf
    if highest < 1:
        return best
    # A few lags: their sums outright are cheaper than by Fourier transform.
    gamma = np.array([residual[: count - lag] @ residual[lag:] for lag in range(highest + 1)]) / count
    if not gamma[0] > 0.0:
        return best
    past, innovation = np.zeros(0), float(gamma[0])
    for order in range(highest + 1):
        if order:  # Levinson's recursion
            reflection = float(gamma[order] - past @ gamma[order - 1 : 0 : -1]) / innovation
            past = np.concatenate([past - reflection * past[::-1], [reflection]])
            innovation = max(innovation * (1.0 - reflection**2), _TINY)
        charge = 2.0 * (order + 1) * count / max(count - order - 2, 1)
        if count * np.log(innovation) + charge < least:
            least, best = count * np.log(innovation) + charge, np.concatenate([[1.0], -past])
    return best


def _nothing(samples: int) -> tuple[Array, Array, Array]:
    return np.zeros((samples, 0)), np.zeros(0), np.zeros((0, 0))


def _groups(target: Array, known: Array, lengths: Sequence[int]) -> tuple[slice, ...]:
    if target.ndim != 1 or known.ndim != 2 or known.shape[0] != target.size or sum(lengths) != target.size:
        raise UsageError(
            f"a target of shape {target.shape}, known columns of shape {known.shape} and groups of {list(lengths)} "
            "samples do not match."
        )
    if not (np.isfinite(target).all() and np.isfinite(known).all()):
        raise UsageError("target or known columns hold a value that is not finite; leave missing samples out.")
    ends = np.cumsum(lengths).tolist()
    return tuple(slice(end - length, end) for end, length in zip(ends, lengths, strict=True) if length)


def _filtered(columns: Array, groups: Sequence[slice], filters: Sequence[Array], variances: Array) -> Array:
    """Columns (N, c) through each group's filter over its noise; the rows that start a filter are zero."""
    found = np.zeros_like(columns)
    if not columns.shape[1]:
        return found
    for part, taps, variance in zip(groups, filters, variances, strict=True):
        order = taps.size - 1
        rows, length = columns[part], part.stop - part.start
        through = found[part.start + order : part.stop]
        for lag, tap in enumerate(taps):
            through += tap * rows[order - lag : length - lag]
        through /= np.sqrt(variance)
    return found


def _variance(rough: Array, order: int) -> float:
    return max(float(np.mean(rough[order:] ** 2)), _TINY)


def _cost(residual: Array, groups: Sequence[slice], filters: Sequence[Array]) -> float:
    """Sum over groups of N (ln s^2 + 1) and 2 for each coefficient of a noise model."""
    rough = _filtered(residual[:, None], groups, filters, np.ones(len(groups)))[:, 0]
    total = 0.0
    for part, taps in zip(groups, filters, strict=True):
        total += (part.stop - part.start) * (np.log(_variance(rough[part], taps.size - 1)) + 1.0) + 2.0 * (
            taps.size - 1
        )
    return float(total)
