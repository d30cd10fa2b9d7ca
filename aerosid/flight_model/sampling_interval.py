"""Runge-Kutta integration over one sampling interval, with the sensitivities of its end.

Classical fourth-order Runge-Kutta in equal substeps; inputs are linear between samples, or held from each to the next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.layout import Layout, leading_columns, state_count, state_places
from aerosid.flight_model.terms import TermTable
from aerosid.flight_model.workspace import Workspace
from aerosid.signals.trace import StateSizes


class Stages(NamedTuple):
    """Room to integrate one substep: `end` (n) and `middle` (n) of it; `state` (n), `inputs` (I) of a stage.

    `last` (I): inputs at the end of the interval.
    """

    end: NDArray[np.float64]
    middle: NDArray[np.float64]
    state: NDArray[np.float64]
    inputs: NDArray[np.float64]
    last: NDArray[np.float64]


@njit
def make_stages(extra_inputs: int, layout: Layout) -> Stages:
    """`Stages` for `extra_inputs` inputs past the leading columns."""
    n = state_count(layout)
    columns = leading_columns(layout) + extra_inputs
    return Stages(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(columns), np.zeros(columns))


@njit_inline
def inputs_at_end(
    u0: NDArray[np.float64], u1: NDArray[np.float64], held: NDArray[np.int64], ramp: float, u: NDArray[np.float64]
) -> None:
    """Write the inputs at the end of the interval between two samples into `u`, before columns `held` jump.

    A held input that moves to the next sample's value in the last `ramp` of an interval, 1, has the same mean over it
    as one that makes that share of the change linearly and jumps at the sample.
    """
    for j in range(u1.shape[0]):
        u[j] = u1[j]
    for n in range(held.shape[0]):
        j = held[n]
        u[j] = u0[j] + ramp * (u1[j] - u0[j])


@njit_inline
def hold_columns(
    start: NDArray[np.float64], end: NDArray[np.float64], held: NDArray[np.int64], ramp: float, leading: int
) -> None:
    """Turn the sensitivities (n, E) to inputs at an interval's two ends into those to its two samples, in place."""
    for n in range(held.shape[0]):
        j = held[n] - leading
        if j >= 0:
            for a in range(start.shape[0]):
                start[a, j] += (1.0 - ramp) * end[a, j]
                end[a, j] *= ramp


@njit_inline
def inputs_at(fraction: float, u0: NDArray[np.float64], u1: NDArray[np.float64], u: NDArray[np.float64]) -> None:
    """Write the inputs at a fraction of the interval between two samples into `u`."""
    for j in range(u0.shape[0]):
        u[j] = (1.0 - fraction) * u0[j] + fraction * u1[j]


@njit_inline
def integrate(
    x: NDArray[np.float64],
    u0: NDArray[np.float64],
    u1: NDArray[np.float64],
    interval: float,
    first: int,
    last: int,
    substeps: int,
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    positions: NDArray[np.float64],
    work: Workspace,
    stages: Stages,
) -> None:
    """Move `x` from the beginning of substep `first` to that of `last`, out of `substeps` in the interval.

    `work.rates` holds the rates at `x` and is overwritten: whoever has evaluated them for another reason saves that
    evaluation. `stages.end` is left at `x`, and `stages.middle` in the middle of the last substep, of third order:
    x + h (5/24 k1 + 1/6 k2 + 1/6 k3 - 1/24 k4).
    """
    h, count = interval / substeps, state_count(constants.layout)
    for s in range(first, last):
        for n in range(4):
            if n > 0 or s > first:
                reach = 0.0 if n == 0 else h if n == 3 else 0.5 * h
                for i in range(count):
                    stages.state[i] = x[i] + reach * work.rates[i]
                inputs_at((s + (0.0 if n == 0 else 1.0 if n == 3 else 0.5)) / substeps, u0, u1, stages.inputs)
                evaluate(stages.state, stages.inputs, parameters, table, constants, positions, work, False, False)
            weight = h / 6.0 if n == 0 or n == 3 else h / 3.0
            half = h * 5.0 / 24.0 if n == 0 else -h / 24.0 if n == 3 else h / 6.0
            for i in range(count):
                stages.end[i] = (x[i] if n == 0 else stages.end[i]) + weight * work.rates[i]
                stages.middle[i] = (x[i] if n == 0 else stages.middle[i]) + half * work.rates[i]
        for i in range(count):
            x[i] = stages.end[i]


class Step(NamedTuple):
    """The response over one sampling interval: end state and its partial derivatives.

    `state` (n); `transition` (n, n) d x1/d x0; `start` and `end` (n, E) d x1/d extra input at the start and at the end
    (inputs are linear in between); `terms` (n, T) d x1/d term values. The rest is room to work: what each of the four
    Runge-Kutta stages saw (`rates_x`, `rates_u`, `rates_p`, moving states alone of the last two), and how a rate added
    at a stage moves the end of the step (`passed_on`).
    """

    state: NDArray[np.float64]
    transition: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    terms: NDArray[np.float64]
    stage_state: NDArray[np.float64]
    stage_input: NDArray[np.float64]
    state_total: NDArray[np.float64]
    rates_x: NDArray[np.float64]
    rates_u: NDArray[np.float64]
    rates_p: NDArray[np.float64]
    passed_on: NDArray[np.float64]
    substep: NDArray[np.float64]
    moved: NDArray[np.float64]


@njit
def make_step(extra_inputs: int, terms: int, layout: Layout) -> Step:
    """A `Step` for `extra_inputs` inputs past the leading columns and `terms` terms."""
    n, moving = state_count(layout), state_places(layout).moving
    return Step(
        np.zeros(n),
        np.zeros((n, n)),
        np.zeros((n, extra_inputs)),
        np.zeros((n, extra_inputs)),
        np.zeros((n, terms)),
        np.zeros(n),
        np.zeros(leading_columns(layout) + extra_inputs),
        np.zeros(n),
        np.zeros((4, n, n)),
        np.zeros((4, moving, extra_inputs)),
        np.zeros((4, moving, terms)),
        np.zeros((4, n, n)),
        np.zeros((n, n)),
        np.zeros(n),
    )


@njit
def advance(
    x: NDArray[np.float64],
    u0: NDArray[np.float64],
    u1: NDArray[np.float64],
    interval: float,
    substeps: int,
    parameters: NDArray[np.float64],
    table: TermTable,
    constants: Constants,
    positions: NDArray[np.float64],
    work: Workspace,
    step: Step,
    differentiate: bool,
) -> None:
    """Write the state after one sampling interval, and its sensitivities, into `step`.

    Classical fourth-order Runge-Kutta with `substeps` equal steps; the sensitivities are those of the discrete
    solution itself. Inputs are linear in time.
    """
    extra, terms = work.rates_u.shape[1], work.rates_p.shape[1]
    at = state_places(constants.layout)
    for i in range(at.total):
        step.state[i] = x[i]
    h = interval / substeps
    for s in range(substeps):
        for n in range(4):
            fraction = (s + (0.0 if n == 0 else 1.0 if n == 3 else 0.5)) / substeps
            for j in range(u0.shape[0]):
                step.stage_input[j] = (1.0 - fraction) * u0[j] + fraction * u1[j]
            reach = 0.0 if n == 0 else h if n == 3 else 0.5 * h
            weight = h / 6.0 if n == 0 or n == 3 else h / 3.0
            for i in range(at.total):
                step.stage_state[i] = step.state[i] + (reach * work.rates[i] if n > 0 else 0.0)
            evaluate(
                step.stage_state, step.stage_input, parameters, table, constants, positions, work, differentiate, False
            )
            for i in range(at.total):
                step.state_total[i] = (0.0 if n == 0 else step.state_total[i]) + weight * work.rates[i]
            if differentiate:
                for i in range(at.total):
                    for k in range(at.total):
                        step.rates_x[n, i, k] = work.rates_x[i, k]
                for i in range(at.moving):  # inputs and terms make forces and moments
                    for j in range(extra):
                        step.rates_u[n, i, j] = work.rates_u[i, j]
                    for t in range(terms):
                        step.rates_p[n, i, t] = work.rates_p[i, t]
        for i in range(at.total):
            step.state[i] += step.state_total[i]
        if differentiate:
            pass_on(step.rates_x, h, step.passed_on, step.substep, constants.layout.sizes)
            _sensitivities(step, s, substeps, constants.layout)


@njit_inline
def pass_on(
    rates_x: NDArray[np.float64],
    h: float,
    passed: NDArray[np.float64],
    transition: NDArray[np.float64],
    sizes: StateSizes,
) -> None:
    """How a rate added at each stage moves the end of a Runge-Kutta step, `passed` (4, n, n), and its `transition`.

    Backwards from the last stage: W_3 = h/6 I, W_n = b_n I + c_(n+1) W_(n+1) F_(n+1), with F the Jacobians of the
    stages, `rates_x` (4, n, n), b = h/6, h/3, h/3, h/6 their weights and c = 0, h/2, h/2, h how far each reaches along
    the one before it. Then Phi = I + sum W_n F_n, and a forcing f_n of the stages moves the end by sum W_n f_n: linear
    in the number of forcings, where carrying each through the stages costs the Jacobians' product for every one of
    them.
    """
    pass_on_through(rates_x[0], rates_x[1], rates_x[2], rates_x[3], h, passed, transition, sizes)


@njit_inline
def pass_on_through(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    third: NDArray[np.float64],
    fourth: NDArray[np.float64],
    h: float,
    passed: NDArray[np.float64],
    transition: NDArray[np.float64],
    sizes: StateSizes,
) -> None:
    """As `pass_on`, from the Jacobian (n, n) of each stage."""
    count = len(sizes.coupled) + len(sizes.alone)
    for i in range(count):
        for k in range(count):
            transition[i, k] = 1.0 if i == k else 0.0
            passed[3, i, k] = h / 6.0 if i == k else 0.0
    _pass_back(fourth, 3, h, h / 3.0, passed, transition, sizes)
    _pass_back(third, 2, 0.5 * h, h / 3.0, passed, transition, sizes)
    _pass_back(second, 1, 0.5 * h, h / 6.0, passed, transition, sizes)
    _pass_back(first, 0, 0.0, 0.0, passed, transition, sizes)


@njit_inline
def _pass_back(
    F: NDArray[np.float64],
    n: int,
    reach: float,
    weight: float,
    passed: NDArray[np.float64],
    transition: NDArray[np.float64],
    sizes: StateSizes,
) -> None:
    """Take stage `n` into the transition, and from it to the stage before, which has a `weight` of its own."""
    coupled, count = len(sizes.coupled), len(sizes.coupled) + len(sizes.alone)
    for i in range(count):
        for k in range(coupled):
            by = passed[n, i, 0] * F[0, k]
            for m in range(1, coupled):
                by += passed[n, i, m] * F[m, k]
            if i >= coupled:  # what stands alone passes on itself beside what moves it
                by += passed[n, i, i] * F[i, k]
            transition[i, k] += by
            if n > 0:
                passed[n - 1, i, k] = reach * by
        if n > 0:
            for k in range(coupled, count):
                passed[n - 1, i, k] = 0.0
            passed[n - 1, i, i] += weight


@njit_inline
def _sensitivities(step: Step, s: int, substeps: int, layout: Layout) -> None:
    """Carry the sensitivities over substep `s`: those so far through its transition, and what its stages add."""
    extra, terms, at = step.start.shape[1], step.terms.shape[1], state_places(layout)
    if s == 0:
        for i in range(at.total):
            for k in range(at.total):
                step.transition[i, k] = step.substep[i, k]
            for j in range(extra):
                step.start[i, j] = 0.0
                step.end[i, j] = 0.0
            for t in range(terms):
                step.terms[i, t] = 0.0
    else:
        _carried(step.substep, step.transition, step.moved, at.total)
        _carried(step.substep, step.start, step.moved, at.total)
        _carried(step.substep, step.end, step.moved, at.total)
        _carried(step.substep, step.terms, step.moved, at.total)
    for n in range(4):
        fraction = (s + (0.0 if n == 0 else 1.0 if n == 3 else 0.5)) / substeps
        for i in range(at.total):
            for r in range(at.moving):
                passed = step.passed_on[n, i, r]
                for j in range(extra):
                    step.start[i, j] += passed * (1.0 - fraction) * step.rates_u[n, r, j]
                    step.end[i, j] += passed * fraction * step.rates_u[n, r, j]
                for t in range(terms):
                    step.terms[i, t] += passed * step.rates_p[n, r, t]


@njit_inline
def _carried(
    transition: NDArray[np.float64], columns: NDArray[np.float64], moved: NDArray[np.float64], count: int
) -> None:
    """The columns (n, K) after a step with `transition` (n, n), in place."""
    for k in range(columns.shape[1]):
        for i in range(count):
            moved[i] = 0.0
            for m in range(count):
                moved[i] += transition[i, m] * columns[m, k]
        for i in range(count):
            columns[i, k] = moved[i]
