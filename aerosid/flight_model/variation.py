"""Variational equations over spans of two substeps: how sensitivities are propagated.

The state moves without partial derivatives. These are evaluated at the start, in the middle and at the end of a span of
two substeps; the variational equations dS/dt = F S + g then pass through two Runge-Kutta steps of their own, with F and
g of the quarter points from the parabola through the three. The columns err by the fourth power of the substep as the
state does, for a third of the work that partial derivatives in every stage would be.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.layout import Layout, state_count, state_places
from aerosid.flight_model.sampling_interval import pass_on_through
from aerosid.flight_model.workspace import Workspace

NODES = 3
"""Numerical: instants of a span at which partial derivatives are evaluated: its start, its middle and its end."""


class Span(NamedTuple):
    """What one span holds; n states, v of them moving, E extra inputs, F free terms.

    `rates_x` (3, n, n), `rates_u` (3, v, E) and `rates_p` (3, v, F): partial derivatives at start, middle and end, of
    the last two those of moving states alone. `transition` (n, n) of the span; `passed` (5, n, v): how a rate of a
    moving state added at each quarter moves the end. The rest is room to work, for each half.
    """

    rates_x: NDArray[np.float64]
    rates_u: NDArray[np.float64]
    rates_p: NDArray[np.float64]
    transition: NDArray[np.float64]
    passed: NDArray[np.float64]
    quarters: NDArray[np.float64]
    halves_passed: NDArray[np.float64]
    halves: NDArray[np.float64]
    by_node: NDArray[np.float64]


@njit
def make_span(extra_inputs: int, free: int, layout: Layout) -> Span:
    """A `Span` for `extra_inputs` inputs past the leading columns and `free` terms."""
    n, moving = state_count(layout), state_places(layout).moving
    return Span(
        np.zeros((NODES, n, n)),
        np.zeros((NODES, moving, extra_inputs)),
        np.zeros((NODES, moving, free)),
        np.zeros((n, n)),
        np.zeros((2 * NODES - 1, n, moving)),
        np.zeros((2, n, n)),
        np.zeros((2, 4, n, n)),
        np.zeros((2, n, n)),
        np.zeros((NODES, moving, n)),
    )


@njit_inline
def note(work: Workspace, free: NDArray[np.int64], node: int, span: Span, layout: Layout) -> None:
    """Keep the partial derivatives of an evaluation at start, middle or end (`node` 0, 1, 2) of the span."""
    at = state_places(layout)
    for i in range(at.total):
        for k in range(at.coupled):
            span.rates_x[node, i, k] = work.rates_x[i, k]
    for r in range(at.moving):  # inputs and terms make forces and moments
        for j in range(span.rates_u.shape[2]):
            span.rates_u[node, r, j] = work.rates_u[r, j]
        for c in range(free.shape[0]):
            span.rates_p[node, r, c] = work.rates_p[r, free[c]]


@njit_inline
def cross(span: Span, length: float, layout: Layout) -> None:
    """Work out `transition` and `passed` of a span of `length` s from what was noted at its three nodes."""
    x, quarters, at, sizes = span.rates_x, span.quarters, state_places(layout), layout.sizes
    for i in range(at.total):
        for k in range(at.coupled):
            begin, middle, end = x[0, i, k], x[1, i, k], x[2, i, k]
            quarters[0, i, k] = 0.375 * begin + 0.75 * middle - 0.125 * end
            quarters[1, i, k] = 0.375 * end + 0.75 * middle - 0.125 * begin
    h = 0.5 * length
    first, second = span.halves_passed[0], span.halves_passed[1]
    onward, before = span.halves[1], span.halves[0]
    pass_on_through(x[0], quarters[0], quarters[0], x[1], h, first, before, sizes)
    pass_on_through(x[1], quarters[1], quarters[1], x[2], h, second, onward, sizes)
    for i in range(at.total):
        for r in range(at.moving):
            first[1, i, r] += first[2, i, r]  # both middle stages stand at the same quarter
    for i in range(at.total):
        for k in range(at.coupled):
            total = onward[i, 0] * before[0, k]
            for m in range(1, at.coupled):
                total += onward[i, m] * before[m, k]
            span.transition[i, k] = total + before[i, k] if i >= at.coupled else total
        for k in range(at.coupled, at.total):
            span.transition[i, k] = 1.0 if i == k else 0.0
        for r in range(at.moving):
            for n in range(3):
                stage = n if n < 2 else 3
                moved = onward[i, 0] * first[stage, 0, r]
                for m in range(1, at.coupled):
                    moved += onward[i, m] * first[stage, m, r]
                span.passed[n, i, r] = moved + first[stage, i, r] if i >= at.coupled else moved
            span.passed[2, i, r] += second[0, i, r]
            span.passed[3, i, r] = second[1, i, r] + second[2, i, r]
            span.passed[4, i, r] = second[3, i, r]


@njit_inline
def force_terms(span: Span, columns: NDArray[np.float64], layout: Layout) -> None:
    """Add to the first F columns (n, M) what the free terms push over the span."""
    at = state_places(layout)
    for i in range(at.total):
        for r in range(at.moving):
            start, quarter, middle = span.passed[0, i, r], span.passed[1, i, r], span.passed[2, i, r]
            further, end = span.passed[3, i, r], span.passed[4, i, r]
            span.by_node[0, r, i] = start + 0.375 * quarter - 0.125 * further
            span.by_node[1, r, i] = middle + 0.75 * (quarter + further)
            span.by_node[2, r, i] = end + 0.375 * further - 0.125 * quarter
    for r in range(at.moving):
        for c in range(span.rates_p.shape[2]):
            begin, middle, end = span.rates_p[0, r, c], span.rates_p[1, r, c], span.rates_p[2, r, c]
            if begin == 0.0 and middle == 0.0 and end == 0.0:
                continue  # a term acts on one equation, seldom on two
            for i in range(at.total):
                columns[i, c] += (
                    span.by_node[0, r, i] * begin + span.by_node[1, r, i] * middle + span.by_node[2, r, i] * end
                )


@njit_inline
def force_inputs(
    span: Span, fraction: float, share: float, first: int, columns: NDArray[np.float64], layout: Layout
) -> None:
    """Add what the extra inputs push over the span to the columns of their values at two samples.

    Those of the sample before are columns `first` to `first` + E - 1 of `columns` (n, M), those of the sample after it
    the next E. The span begins at a `fraction` of the interval between the samples and is a `share` of it.
    """
    extra, at = span.rates_u.shape[2], state_places(layout)
    for j in range(extra):
        for r in range(at.moving):
            begin, middle, end = span.rates_u[0, r, j], span.rates_u[1, r, j], span.rates_u[2, r, j]
            if begin == 0.0 and middle == 0.0 and end == 0.0:
                continue
            for n in range(2 * NODES - 1):
                rate = begin if n == 0 else middle if n == 2 else end
                if n == 1:
                    rate = 0.375 * begin + 0.75 * middle - 0.125 * end
                elif n == 3:
                    rate = 0.375 * end + 0.75 * middle - 0.125 * begin
                later = fraction + 0.25 * n * share
                for i in range(at.total):
                    pushed = span.passed[n, i, r] * rate
                    columns[i, first + j] += (1.0 - later) * pushed
                    columns[i, first + extra + j] += later * pushed
