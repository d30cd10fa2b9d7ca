"""Streaming estimator: d(t), causal prefilter and recursive least squares, sample by sample.

What comes out at a sample is what the batch recursions give there: `estimate_continuous`, `respond` on the candidates
at its states, one causal filter on d^ and on the responses alike, and `recursive_least_squares`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aerosid.errors import EstimationError, UsageError
from aerosid.model_error.estimators.continuous import Estimate, Interval, Slopes, advance, make_scratch, model_error_at
from aerosid.model_error.estimators.functions import BY_DIFFERENCES, Partials, model_functions
from aerosid.model_error.estimators.response import ResponseStep, response_at, response_scratch, response_step
from aerosid.model_error.estimators.weights import Weights
from aerosid.signals.least_squares import RecursiveLeastSquares
from aerosid.signals.recursive_filter import butterworth_sections, filtered, steady_state

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StreamingSettings:
    """Settings of the chain, each with the reason for its value.

    Attributes
    ----------
    forgetting : float
        Weight of the past after each sample, in (0, 1]. 1 keeps all: coefficients of an aircraft do not change.
    filter_order : int
        Of the Butterworth low-pass; 2 costs the least delay that still takes out noise.
    cut_off_hz : float or None
        Its half-power frequency, Hz; None: no filter. Filtering d^ and the responses alike biases no coefficient.
    skipped_samples : int
        First samples left out of the least squares: they carry the error of the initial state.
    equations : tuple of int or None
        State equations whose d^ enters the least squares; None: those with a model error, Q2^-1 above zero.
    equation_weights : tuple of float or None
        Weight of each of these equations, inverse variances of d^'s noise; None: equal weights. Give them where the
        equations differ in units.
    unknown_initial : bool
        Whether the error of the initial state is estimated beside the coefficients, by its own response.
    """

    forgetting: float = 1.0
    filter_order: int = 2
    cut_off_hz: float | None = None
    skipped_samples: int = 0
    equations: tuple[int, ...] | None = None
    equation_weights: tuple[float, ...] | None = None
    unknown_initial: bool = False


@dataclass(frozen=True)
class StreamingSample:
    """What the chain knows after a sample.

    Attributes
    ----------
    time : float
        s.
    state : (n,)
        x^.
    model_error : (n,)
        d^, state units / s.
    S : (n, n)
        Riccati matrix; 2 S is the covariance of x^.
    innovation : (p,)
        y - h at the open-loop prediction; NaN where missing.
    filtered_model_error : (n,)
        d^ after the causal filter, as the least squares takes it.
    responses : (n, m)
        What each candidate would show there, filtered alike.
    coefficients : (m,)
        Of the candidates; NaN until the samples determine them.
    deviations : (m,)
        Their standard deviations for white residuals; NaN until determined.
    """

    time: float
    state: Array
    model_error: Array
    S: Array
    innovation: Array
    filtered_model_error: Array
    responses: Array
    coefficients: Array
    deviations: Array


class _CausalFilter:
    """Butterworth low-pass on many channels at once, started in the steady state of the first sample."""

    def __init__(self, order: int, cut_off_hz: float, interval: float) -> None:
        if not 0.0 < cut_off_hz * interval < 0.5:
            raise UsageError(
                f"a cut-off of {cut_off_hz:g} Hz cannot be had from samples every {interval:g} s: choose one below "
                f"{0.5 / interval:g} Hz."
            )
        self._sections = butterworth_sections(order, cut_off_hz, interval)
        self._state: Array | None = None

    def update(self, values: Array) -> Array:
        if self._state is None:
            self._state = steady_state(self._sections, values)
        return np.asarray(filtered(self._sections, np.ascontiguousarray(values[None, :]), self._state)[0])


class StreamingModelError:
    """The chain as an object that takes one sample at a time.

    Parameters
    ----------
    f, h : callable
        As for `estimate_continuous`; compiled functions run compiled.
    x0 : (n,)
        State at the first sample.
    weights : Weights
        Constant in time.
    candidates : callable
        candidates(x, u, t) -> (n, m): the rates that a unit of each coefficient adds to each state equation.
    interval : float
        Time between samples that the digital filter is designed for, s; the recursions use each sample's own time.
    settings : StreamingSettings
    partials, substeps
        As for `estimate_continuous`.

    Raises
    ------
    UsageError
        Where shapes do not fit, or the cut-off is beyond half the sampling frequency.

    References
    ----------
    Parameswaran & Raol 1994, section 3.3: the digital filter inside the recursive structure, and recursive least
    squares.
    """

    def __init__(
        self,
        f: Callable[..., Any],
        h: Callable[..., Any],
        x0: ArrayLike,
        weights: Weights,
        candidates: Callable[..., Any],
        *,
        interval: float,
        settings: StreamingSettings = StreamingSettings(),
        partials: Partials = BY_DIFFERENCES,
        substeps: int = 1,
    ) -> None:
        self._x = np.array(x0, dtype=np.float64)
        n, p = self._x.size, weights.Q1.shape[-1]
        if weights.Q1.ndim != 2 or weights.Q2_inverse.shape != (n, n) or weights.S0.shape != (n, n):
            raise UsageError(f"streaming takes constant weights for {n} states, as (p, p), ({n}, {n}) and ({n}, {n}).")
        self._functions = model_functions(
            f, h, n=n, p=p, partials=partials, substeps=substeps
        )  # fmt: skip
        self._candidates, self._settings, self._interval = candidates, settings, float(interval)
        self._Q1, self._W = np.array(weights.Q1), 0.5 * weights.Q2_inverse
        self._S = np.array(weights.S0)
        self._equations = _equations(settings.equations, weights.Q2_inverse)
        self._row_weights = _row_weights(settings, len(self._equations))
        self._scratch = make_scratch(n, p)
        self._F, self._H, self._H_step = np.empty((n, n)), np.empty((p, n)), np.empty((p, n))
        self._count = 0
        self._filter: _CausalFilter | None = None
        if settings.cut_off_hz is not None:
            self._filter = _CausalFilter(settings.filter_order, settings.cut_off_hz, self._interval)

    def update(self, time: float, y: ArrayLike, u: ArrayLike = ()) -> StreamingSample:
        """What is known after one more sample.

        Parameters
        ----------
        time : float
            s, after that of the sample before.
        y : (p,)
            Measurements; NaN where missing.
        u : (m,), optional
            Inputs.

        Raises
        ------
        UsageError
            Where time does not increase or an input is not finite.
        EstimationError
            Where the state stops being finite.
        """
        t, measured, inputs = float(time), np.array(y, dtype=np.float64), np.array(u, dtype=np.float64)
        if not np.all(np.isfinite(inputs)):
            raise UsageError(f"u is not finite at {t:g} s; the model cannot run without its inputs.")
        innovation = np.empty(measured.size)
        if self._count == 0:
            self._begin(t, measured, inputs)
            innovation[:] = self._residual
        else:
            self._advance(t, measured, inputs, innovation)
        self._count += 1
        d, response = np.empty(self._x.size), np.empty_like(self._epsilon)
        model_error_at(self._S, self._H, self._Q1, self._residual, d, self._scratch)
        response_at(self._S, self._H, self._Q1, self._present, self._epsilon, response, self._response_scratch)
        filtered_d, filtered = self._low_pass(d, response)
        self._regress(filtered_d, filtered)
        m = self._width
        deviations = np.sqrt(np.diag(self._least_squares.covariance) * self._least_squares.residual_variance)
        return StreamingSample(
            t, self._x.copy(), d, self._S.copy(), innovation, filtered_d, filtered[:, :m],
            self._least_squares.coefficients[:m], deviations[:m],
        )  # fmt: skip

    def _begin(self, t: float, y: Array, u: Array) -> None:
        functions = self._functions
        self._t, self._u = t, u
        self._residual = y - functions.h(self._x, u, t)
        self._present = np.isfinite(y).astype(np.float64)
        self._H = np.array(functions.h_x(self._x, u, t))
        self._c = self._evaluate_candidates(self._x, u, t)
        n = self._x.size
        self._width = self._c.shape[1]
        if self._settings.unknown_initial:
            self._epsilon = np.hstack([np.zeros((n, self._width)), np.eye(n)])
            self._c = np.hstack([self._c, np.zeros((n, n))])
        else:
            self._epsilon = np.zeros((n, self._width))
        self._response_scratch = response_scratch(n, y.size, self._epsilon.shape[1])
        # Forgetting is of samples; the least squares takes one row an equation.
        forgetting = self._settings.forgetting ** (1.0 / len(self._equations))
        self._least_squares = RecursiveLeastSquares(self._epsilon.shape[1], forgetting=forgetting)

    def _advance(self, t: float, y: Array, u: Array, innovation: Array) -> None:
        if not t > self._t:
            raise UsageError(f"time does not increase from {self._t:g} to {t:g} s at sample {self._count}.")
        functions, n = self._functions, self._x.size
        x, after, S, H = np.empty(n), np.empty(y.size), np.empty((n, n)), np.empty_like(self._H)
        interval = Interval(self._t, t, self._u, u, y, self._Q1, self._W)
        slopes = Slopes(self._F, self._H_step, H)
        known, reached = Estimate(self._x, self._residual, self._S), Estimate(x, after, S)
        if not advance(
            functions.step, functions.h, functions.f_x, functions.h_x, interval, known, reached, innovation, slopes,
            self._scratch,
        ):  # fmt: skip
            raise EstimationError(f"the estimate stops being finite at sample {self._count} (t = {t:g} s).")
        present = np.isfinite(y).astype(np.float64)
        c = self._evaluate_candidates(x, u, t)
        c = np.hstack([c, np.zeros((n, self._epsilon.shape[1] - self._width))])
        step = ResponseStep(
            t - self._t, self._S, self._F, self._W, self._Q1, self._H, self._H_step, H, self._present, present,
            self._c, c,
        )  # fmt: skip
        if not response_step(step, self._epsilon, self._response_scratch):
            raise EstimationError(f"the response to the candidates stops being finite at sample {self._count}.")
        self._t, self._u, self._x, self._S, self._H = t, u, x, S, H
        self._residual, self._present, self._c = after, present, c

    def _evaluate_candidates(self, x: Array, u: Array, t: float) -> Array:
        value = np.array(self._candidates(x, u, t), dtype=np.float64, order="C")
        if value.ndim != 2 or value.shape[0] != x.size:
            raise UsageError(f"candidates(x, u, t) returned shape {value.shape} where ({x.size}, m) was expected.")
        return value

    def _low_pass(self, d: Array, response: Array) -> tuple[Array, Array]:
        if self._filter is None:
            return d, response
        filtered = self._filter.update(np.concatenate([d, response.ravel()]))
        return filtered[: d.size], filtered[d.size :].reshape(response.shape)

    def _regress(self, d: Array, response: Array) -> None:
        if self._count <= self._settings.skipped_samples:
            return
        for equation, weight in zip(self._equations, self._row_weights, strict=True):
            self._least_squares.update(response[equation], float(d[equation]), weight)


def _equations(given: Sequence[int] | None, Q2_inverse: Array) -> tuple[int, ...]:
    return tuple(int(i) for i in np.flatnonzero(np.diag(Q2_inverse) > 0.0)) if given is None else tuple(given)


def _row_weights(settings: StreamingSettings, count: int) -> tuple[float, ...]:
    weights = (1.0,) * count if settings.equation_weights is None else settings.equation_weights
    if len(weights) != count:
        raise UsageError(f"equation_weights has {len(weights)} values where {count} equations enter.")
    return weights
