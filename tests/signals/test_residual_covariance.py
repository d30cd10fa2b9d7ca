"""Covariances for coloured residuals against dense double sums, and against the scatter of repeated estimates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import linalg, signal

from aerosid.signals.autoregressive_noise import akaike_order, extended, levinson
from aerosid.signals.noise import autocovariance
from aerosid.signals.residual_covariance import (
    ResidualCovariance,
    _block_length_and_order,
    _noise_autocovariances,
    _orthogonal,
    coloured_covariance,
    coloured_covariance_groups,
    published_covariance_groups,
)
from aerosid.signals.settings import COLOUR


def autoregressive(rng: np.random.Generator, coefficients: list[float], count: int) -> np.ndarray:
    denominator = np.concatenate(([1.0], -np.array(coefficients)))
    return signal.lfilter([1.0], denominator, rng.standard_normal(count + 400))[400:]


def problem(rng: np.random.Generator, count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Slow regressors, scales far apart, and the residuals of an ordinary least-squares fit to AR(1) noise."""
    slow = signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal((count, 2)), axis=0)
    regressors = np.column_stack((np.ones(count), slow)) * [1.0, 1e3, 1e-3]
    noise = autoregressive(rng, [0.8], count)
    return regressors, noise - regressors @ np.linalg.lstsq(regressors, noise, rcond=None)[0]


def test_published_is_the_double_sum_of_morelli_and_klein() -> None:
    regressors, residual = problem(np.random.default_rng(1))
    count = residual.size
    middle = np.zeros((3, 3))
    for i in range(count):
        for j in range(count):
            lag = abs(i - j)
            middle += np.outer(regressors[i], regressors[j]) * (residual[: count - lag] @ residual[lag:]) / count
    inverse = np.linalg.inv(regressors.T @ regressors)
    expected = inverse @ middle @ inverse
    deviations = np.sqrt(np.diag(inverse))
    error = (coloured_covariance(regressors, residual).published - expected) / np.outer(deviations, deviations)
    np.testing.assert_allclose(error, 0.0, atol=1e-9)


def test_white_is_the_textbook_formula() -> None:
    regressors, residual = problem(np.random.default_rng(2))
    expected = residual @ residual / (residual.size - 3) * np.linalg.inv(regressors.T @ regressors)
    np.testing.assert_allclose(coloured_covariance(regressors, residual).white, expected, rtol=3e-4)


def residual_map(groups: list[tuple[np.ndarray, float]]) -> np.ndarray:
    """The matrix that turns the stacked noise of all groups into their stacked residuals."""
    stacked = np.vstack([x for x, _ in groups])
    weights = np.concatenate([np.full(len(x), w) for x, w in groups])
    return np.eye(len(stacked)) - stacked @ np.linalg.solve(
        stacked.T @ (weights[:, None] * stacked), stacked.T * weights
    )


def test_the_corrected_noise_leaves_the_measured_residuals() -> None:
    """Dense expectation over two channels with different colours, weights and missing samples."""
    rng = np.random.default_rng(3)
    counts, weights, orders = [70, 50], [1.0, 4.0], [2, 1]
    rows = [signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal((n, 3)), axis=0) for n in counts]
    noise = np.concatenate((autoregressive(rng, [0.6, 0.1], 70), 0.5 * autoregressive(rng, [0.4], 50)))
    mask = np.ones(120, dtype=bool)
    mask[[5, 6, 30, 90]] = False
    for x, there in zip(rows, np.split(mask, [70]), strict=True):
        x[~there] = 0.0
    to_residual = residual_map(list(zip(rows, weights, strict=True))) * mask
    residuals = np.split(np.where(mask, to_residual @ np.where(mask, noise, 0.0), np.nan), [70])
    measured = [autocovariance(r, r.size - 1) for r in residuals]
    orthogonal, _ = _orthogonal(rows, weights, np.eye(3))
    found = _noise_autocovariances(orthogonal, weights, np.split(mask, [70]), measured, orders)
    covariance = linalg.block_diag(*[linalg.toeplitz(gamma) for gamma in found]) * np.outer(mask, mask)
    expected = to_residual @ covariance @ to_residual.T * np.outer(mask, mask)
    for there, block, gamma, order in zip(
        np.split(mask, [70]), (expected[:70, :70], expected[70:, 70:]), measured, orders, strict=True
    ):
        for lag in range(order + 1):
            pairs = np.sum(there[: there.size - lag] & there[lag:])
            scaled = np.trace(block, lag) / pairs * (there.size - lag) / there.size
            assert scaled == pytest.approx(gamma[lag], abs=2e-3 * gamma[0])


def test_groups_of_different_weight_on_white_noise() -> None:
    """Two channels, weights inverse to their variances: the plain covariance is the inverse information."""
    rng = np.random.default_rng(4)
    rows = [rng.standard_normal((4000, 2)), rng.standard_normal((4000, 2))]
    noise = [0.1 * rng.standard_normal(4000), 3.0 * rng.standard_normal(4000)]
    weights = [100.0, 1.0 / 9.0]
    information = sum(w * x.T @ x for x, w in zip(rows, weights, strict=True))
    estimate = np.linalg.solve(information, sum(w * x.T @ e for x, e, w in zip(rows, noise, weights, strict=True)))
    groups = [(x, e - x @ estimate, w) for x, e, w in zip(rows, noise, weights, strict=True)]
    found = coloured_covariance_groups(groups)
    np.testing.assert_allclose(np.diag(found.white), np.diag(np.linalg.inv(information)), rtol=0.1)
    np.testing.assert_allclose(np.diag(found.corrected), np.diag(np.linalg.inv(information)), rtol=0.25)
    present = [np.ones(4000, dtype=bool)] * 2
    measured = [autocovariance(r, r.size - 1) for _, r, _ in groups]
    orthogonal, _ = _orthogonal(rows, weights, np.eye(2))
    noise_found = _noise_autocovariances(orthogonal, weights, present, measured, list(found.orders))
    variances = [gamma[0] for gamma in noise_found]
    np.testing.assert_allclose(np.sqrt(variances), [0.1, 3.0], rtol=0.05)


def test_units_leave_the_relative_errors() -> None:
    regressors, residual = problem(np.random.default_rng(5))
    scale = np.array([1e-6, 1.0, 1e6])
    reference = coloured_covariance(regressors, residual)
    scaled = coloured_covariance(regressors * scale, 10.0 * residual)
    for name in ("white", "published", "corrected"):
        one, other = np.diag(getattr(reference, name)), np.diag(getattr(scaled, name))
        np.testing.assert_allclose(other * scale**2 / 100.0, one, rtol=1e-6)


def test_missing_samples_count_as_absent() -> None:
    rng = np.random.default_rng(6)
    regressors = signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal((3000, 3)), axis=0)
    noise = autoregressive(rng, [0.8], 3000)
    missing = rng.random(3000) < 0.2
    kept = regressors[~missing]
    residual = noise - regressors @ np.linalg.lstsq(kept, noise[~missing], rcond=None)[0]
    residual[missing] = np.nan
    found = coloured_covariance(regressors, residual)
    inverse = np.linalg.inv(kept.T @ kept)
    truth = linalg.toeplitz(0.8 ** np.arange(3000) / (1.0 - 0.64))[np.ix_(~missing, ~missing)]
    expected = np.diag(inverse @ kept.T @ truth @ kept @ inverse)
    np.testing.assert_allclose(np.diag(found.corrected), expected, rtol=0.25)


def test_nearly_collinear_regressors_keep_their_covariance() -> None:
    """The coefficient of z1 + z3/2^26 beside z1 is 2^26 times that of z3: variances were negative, or of any size."""
    regressors, residual = problem(np.random.default_rng(16), 400)
    apart = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0**-26]])
    regressors[:, 2] *= 1e3  # as long as the constant
    reference, found = coloured_covariance(regressors, residual), coloured_covariance(regressors @ apart, residual)
    for name in ("white", "published", "corrected"):
        variances = np.diag(np.linalg.inv(apart) @ getattr(reference, name) @ np.linalg.inv(apart).T)
        np.testing.assert_allclose(np.diag(getattr(found, name)), variances, rtol=1e-5)
    variances = np.diag(coloured_covariance(regressors @ apart, residual).published)
    np.testing.assert_allclose(
        np.diag(published_covariance_groups([(regressors @ apart, residual, 1.0)])), variances, rtol=1e-9
    )


def slow_fit(rng: np.random.Generator, count: int, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slow regressors, and the residuals of a fit to AR(1) noise on the samples of a mask, NaN elsewhere."""
    regressors = np.column_stack((np.ones(count), signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal(count))))
    noise = autoregressive(rng, [0.8], count)
    estimate = np.linalg.lstsq(regressors[mask], noise[mask], rcond=None)[0]
    return regressors, np.where(mask, noise - regressors @ estimate, np.nan)


def test_every_other_sample_missing_is_the_record_of_the_others() -> None:
    """Odd lags never occur: what is said of them must not matter."""
    mask = np.arange(400) % 2 == 0
    regressors, residual = slow_fit(np.random.default_rng(13), 400, mask)
    found, dense = coloured_covariance(regressors, residual), coloured_covariance(regressors[mask], residual[mask])
    assert found.orders == (2 * dense.orders[0],)
    for name in ("white", "published", "corrected"):
        np.testing.assert_allclose(getattr(found, name), getattr(dense, name), rtol=1e-9)


@pytest.mark.parametrize(("period", "present"), [(2, (0,)), (3, (1,)), (5, (0, 1))])
def test_lags_that_never_occur_are_as_the_others_predict_them(period: int, present: tuple[int, ...]) -> None:
    """Dense: the residuals have the measured autocovariance at every lag that occurs, the noise is a process at all."""
    order, count = 6, 200
    mask = np.isin(np.arange(count) % period, present)
    regressors, residual = slow_fit(np.random.default_rng(15), count, mask)
    rows = np.where(mask[:, None], regressors, 0.0)
    measured = autocovariance(residual, count - 1)
    orthogonal, _ = _orthogonal([rows], [1.0], np.eye(2))
    gamma = _noise_autocovariances(orthogonal, [1.0], [mask], [measured], [order])[0]
    noise = linalg.toeplitz(gamma)
    assert np.linalg.eigvalsh(noise)[0] > 0.0
    to_residual = residual_map([(rows, 1.0)]) * mask
    left = (to_residual @ (noise * np.outer(mask, mask)) @ to_residual.T) * np.outer(mask, mask)
    for lag in range(order + 1):
        pairs = int(np.sum(mask[: count - lag] & mask[lag:]))
        if pairs:
            scaled = np.trace(left, lag) / pairs * (count - lag) / count
            assert scaled == pytest.approx(measured[lag], abs=2e-3 * measured[0])
        else:
            shorter, _, _ = levinson(gamma, lag - 1)
            assert gamma[lag] == pytest.approx(shorter @ gamma[lag - 1 : 0 : -1], abs=1e-9)


@pytest.mark.parametrize("coefficient", [-0.5, 0.0, 0.5, 0.9])
def test_the_noise_model_of_an_autoregressive_residual_has_its_spectrum_at_zero(coefficient: float) -> None:
    """The sum of its autocorrelation over all lags is that by which the variance of a mean is larger."""
    residual = autoregressive(np.random.default_rng(7), [coefficient], 20000)
    measured = autocovariance(residual, residual.size - 1)
    model, _, leading = levinson(measured, akaike_order(measured, residual.size))
    gamma = extended(model, leading, residual.size)
    inflation = 1.0 + 2.0 * np.sum(gamma[1:]) / gamma[0]
    assert inflation == pytest.approx((1.0 + coefficient) / (1.0 - coefficient), rel=0.15)


def test_a_constant_zero_residual_has_no_error() -> None:
    found = coloured_covariance(np.column_stack((np.ones(40), np.arange(40.0))), np.zeros(40))
    for matrix in (found.white, found.published, found.corrected):
        np.testing.assert_array_equal(matrix, 0.0)


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ([], "no group"),
        ([(np.ones((5, 1)), np.full(5, np.nan), 1.0)], "no group"),
        ([(np.ones((5, 1)), np.zeros(4), 1.0)], "do not match"),
        ([(np.ones((5, 1)), np.zeros(5), 1.0), (np.ones((5, 2)), np.zeros(5), 1.0)], "do not match"),
        ([(np.ones((5, 2)), np.zeros(5), 1.0)], "collinear"),
        ([(np.zeros((5, 1)), np.zeros(5), 1.0)], "zero throughout"),
    ],
)
def test_wrong_arguments_are_named(groups: list[tuple[np.ndarray, np.ndarray, float]], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        coloured_covariance_groups(groups)


def doublet_regressors(count: int) -> np.ndarray:
    """1, alpha, q, delta_e, alpha^2 of a doublet through a short period, 30 ms."""
    time = 0.03 * np.arange(count)
    elevator = np.where((time >= 1.0) & (time < 2.0), 1.0, np.where((time >= 2.0) & (time < 3.0), -1.0, 0.0))
    system = (np.array([[-1.2, 1.0], [-9.0, -1.8]]), np.array([[-0.1], [-12.0]]), np.eye(2), np.zeros((2, 1)))
    _, response, _ = signal.lsim(system, elevator, time)
    alpha, q = response.T
    return np.column_stack((np.ones(count), alpha, q, elevator, alpha**2))


def coverage(coefficients: list[float], flights: int) -> dict[str, np.ndarray]:
    """Share of flights of 470 samples in which 1.96 standard errors cover the truth, per coefficient."""
    rng = np.random.default_rng(8)
    regressors = doublet_regressors(470)
    solver = np.linalg.pinv(regressors)
    covered = {name: np.zeros(5) for name in ("white", "published", "corrected")}
    for _ in range(flights):
        noise = autoregressive(rng, coefficients, 470)
        estimate = solver @ noise
        found: ResidualCovariance = coloured_covariance(regressors, noise - regressors @ estimate)
        for name, count in covered.items():
            count += np.abs(estimate) < 1.96 * np.sqrt(np.diag(getattr(found, name)))
    return {name: count / flights for name, count in covered.items()}


@pytest.mark.parametrize("coefficients", [[], [0.8]])
def test_corrected_errors_cover_where_the_published_do_not(coefficients: list[float]) -> None:
    shares = coverage(coefficients, 400)
    assert np.all(shares["corrected"] > 0.90)
    assert np.all(shares["corrected"] < 0.985)
    assert np.mean(shares["corrected"]) > np.mean(shares["published"]) + 0.03
    if coefficients:
        assert np.all(shares["white"] < 0.7)


@pytest.mark.parametrize(("interval", "smoothed"), [(0.02, True), (0.04, True), (0.02, False), (0.01, True)])
def test_corrected_errors_are_those_of_noise_that_a_recorder_or_a_smoother_leaves(
    interval: float, smoothed: bool
) -> None:
    """The past of such noise predicts it to a thousandth: a model of it had a sixth of its level at zero frequency."""
    rng = np.random.default_rng(11)
    count = round(22.0 / interval)
    filter_ = signal.butter(2, 5.0, fs=1.0 / interval)
    slow = signal.butter(2, 0.5, fs=1.0 / interval)
    ratios = []
    for _ in range(60):
        regressors = signal.lfilter(*slow, rng.standard_normal((count + 500, 6)), axis=0)[500:]
        passed = (signal.filtfilt if smoothed else signal.lfilter)(*filter_, rng.standard_normal(count + 400))
        noise = passed[200 : 200 + count]
        noise = noise + 0.02 * noise.std() * rng.standard_normal(count)
        estimate = np.linalg.lstsq(regressors, noise, rcond=None)[0]
        found = coloured_covariance(regressors, noise - regressors @ estimate)
        ratios.append(estimate / np.sqrt(np.diag(found.corrected)))
    # Of 360 ratios whose standard errors scatter by a tenth: 1.01, known to 0.05.
    assert 0.88 < float(np.sqrt(np.mean(np.square(ratios)))) < 1.16


def test_blocks_are_no_longer_than_leave_enough_whole_ones() -> None:
    rng = np.random.default_rng(12)
    residual = signal.lfilter(*signal.butter(2, 0.05), rng.standard_normal(1000))
    regressors = signal.lfilter(*signal.butter(2, 0.005), rng.standard_normal((1000, 2)), axis=0)
    assert _block_length_and_order(regressors, residual)[0] > 5
    assert residual.size // _block_length_and_order(regressors, residual)[0] >= COLOUR.fewest_blocks
    residual[rng.random(1000) < 0.7] = np.nan
    assert _block_length_and_order(regressors, residual)[0] == 1


@pytest.mark.slow
@pytest.mark.parametrize(("coefficients", "least"), [([], 0.925), ([0.8], 0.92), ([1.5, -0.7], 0.92), ([0.95], 0.89)])
def test_coverage_side_by_side(
    coefficients: list[float], least: float, record_property: Callable[[str, object], None]
) -> None:
    shares = coverage(coefficients, 3000)
    for name, share in shares.items():
        record_property(name, np.round(share, 3).tolist())
    assert np.all(shares["corrected"] > least), shares
    assert np.all(shares["corrected"] < 0.965), shares
    assert np.all(shares["corrected"] >= shares["published"]), shares
