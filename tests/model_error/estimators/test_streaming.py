"""The streaming chain against the batch recursions composed by hand, and what it finds while flying."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.errors import EstimationError, UsageError
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.functions import Partials
from aerosid.model_error.estimators.response import respond
from aerosid.model_error.estimators.streaming import StreamingModelError, StreamingSettings
from aerosid.model_error.estimators.weights import continuous_weights
from aerosid.signals.least_squares import recursive_least_squares
from aerosid.signals.prefilter import Butterworth, apply

DT = 0.04
WEIGHTS = continuous_weights(np.diag([1e-4, 4e-4]), DT, np.diag([0.5, 0.0]), np.eye(2) * 1e-3)


def truth(x, u, t):
    return np.array([(u[0] - 0.32 * x[0] - x[1] - 0.05 * x[1] ** 3) / 2.56, x[0]])


def lacking(x, u, t):
    return np.array([(u[0] - 0.32 * x[0]) / 2.56, x[0]])


def candidates(x, u, t):
    return np.array([[x[1], x[1] ** 2, x[1] ** 3], [0.0, 0.0, 0.0]])


def record(N=400, noise=0.01, seed=0):
    time = np.arange(N) * DT
    u = 2.5 * np.cos(time)[:, None]
    x, states = np.array([1.0, 0.5]), []
    for k in range(N):
        states.append(x)
        for i in range(8):
            h, t = DT / 8, k * DT + i * DT / 8
            a, b, c = (np.array([2.5 * np.cos(t + s * h)]) for s in (0.0, 0.5, 1.0))
            k1 = truth(x, a, t)
            k2 = truth(x + h / 2 * k1, b, t)
            k3 = truth(x + h / 2 * k2, b, t)
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + truth(x + h * k3, c, t))
    y = np.array(states) + noise * np.random.default_rng(seed).normal(size=(N, 2))
    return time, u, y, np.array(states)


@pytest.mark.parametrize("unknown_initial", [False, True])
@pytest.mark.parametrize("cut_off_hz", [None, 3.0])
def test_streaming_equals_the_batch_recursions_to_rounding(cut_off_hz, unknown_initial):
    time, u, y, _ = record(N=250)
    y[30, 0] = y[77] = np.nan
    settings = StreamingSettings(
        forgetting=0.995, cut_off_hz=cut_off_hz, skipped_samples=7, unknown_initial=unknown_initial
    )
    stream = StreamingModelError(
        lacking, lambda x, u, t: x.copy(), [1.1, 0.4], WEIGHTS, candidates, interval=DT, settings=settings
    )
    samples = [stream.update(t, row, drive) for t, row, drive in zip(time, y, u, strict=True)]

    history = estimate_continuous(lacking, lambda x, u, t: x.copy(), time, y, [1.1, 0.4], WEIGHTS, u=u)
    columns = np.array([candidates(x, None, t) for x, t in zip(history.states, time, strict=True)])
    initial = None
    if unknown_initial:
        columns, initial = (
            np.concatenate([columns, np.zeros((250, 2, 2))], axis=2),
            np.hstack([np.zeros((2, 3)), np.eye(2)]),
        )
    d, response = history.model_error[:, 0], respond(history, columns, initial)[:, 0, :]
    if cut_off_hz is not None:
        low_pass = Butterworth(2, cut_off_hz, zero_phase=False)
        d = apply(low_pass, time, d)
        response = np.column_stack([apply(low_pass, time, column) for column in response.T])
    fit = recursive_least_squares(response[7:], d[7:], forgetting=0.995)

    np.testing.assert_allclose([s.state for s in samples], history.states, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose([s.model_error for s in samples], history.model_error, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([s.S for s in samples], history.S, rtol=1e-12)
    np.testing.assert_allclose([s.innovation for s in samples], history.innovations, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose([s.filtered_model_error[0] for s in samples], d, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose([s.coefficients for s in samples[40:]], fit.history[33:, :3], rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(
        [s.deviations for s in samples[40:]], fit.standard_error_history[33:, :3], rtol=1e-6, atol=1e-10
    )


def test_streaming_finds_the_coefficients_while_flying():
    time, u, y, X = record(N=1200, noise=0.002)
    stream = StreamingModelError(
        lacking, lambda x, u, t: x.copy(), X[0], WEIGHTS, candidates, interval=DT,
        settings=StreamingSettings(cut_off_hz=4.0),
    )  # fmt: skip
    for t, row, drive in zip(time, y, u, strict=True):
        last = stream.update(t, row, drive)
    np.testing.assert_allclose(last.coefficients, [-0.390625, 0.0, -0.01953125], atol=2e-3)
    assert np.all(last.deviations > 0.0)


def test_wrong_use_is_refused_with_a_sentence():
    def make(**changes):
        return StreamingModelError(
            lacking, lambda x, u, t: x.copy(), [1.0, 0.5], WEIGHTS, changes.get("candidates", candidates),
            interval=DT, settings=StreamingSettings(**changes.get("settings", {})),
        )  # fmt: skip

    with pytest.raises(UsageError, match=r"choose one below 12\.5 Hz"):
        make(settings={"cut_off_hz": 20.0})
    with pytest.raises(UsageError, match="equation_weights has 2 values where 1"):
        make(settings={"equation_weights": (1.0, 1.0)})
    with pytest.raises(UsageError, match="returned shape"):
        make(candidates=lambda x, u, t: x).update(0.0, [1.0, 0.5], [0.0])
    stream = make()
    stream.update(0.0, [1.0, 0.5], [0.0])
    with pytest.raises(UsageError, match="time does not increase"):
        stream.update(0.0, [1.0, 0.5], [0.0])
    with pytest.raises(UsageError, match="u is not finite"):
        stream.update(0.1, [1.0, 0.5], [np.nan])
    broken = StreamingModelError(
        lambda x, u, t: x * np.inf, lambda x, u, t: x.copy(), [1.0, 0.5], WEIGHTS, candidates, interval=DT,
        partials=Partials(f_x=lambda x, u, t: np.eye(2)),
    )  # fmt: skip
    broken.update(0.0, [1.0, 0.5])
    with np.errstate(all="ignore"), pytest.raises(EstimationError, match="sample 1"):
        broken.update(0.1, [1.0, 0.5])
