"""Work arrays of one evaluation of the equations of motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.flight_model.layout import (
    Layout,
    leading_columns,
    load_places,
    output_count,
    output_places,
    state_count,
    state_places,
)
from aerosid.flight_model.terms import TermTable, value_count

AIR_DIRECTIONS = ("V", "alpha", "beta", "p", "q", "r", "phi", "theta")
"""What the coefficients are differentiated by before the states: rows of `Workspace.by_air`."""


class Workspace(NamedTuple):
    """Arrays that one evaluation writes: rates f, outputs y and their partial derivatives.

    Shapes, with n states, m outputs and K coefficients of the case, E extra inputs (those past the leading columns)
    and T terms: `rates` (n), `rates_x` (n, n), `rates_u` (n, E), `rates_p` (n, T), `outputs` (m), `outputs_x` (m, n),
    `outputs_u` (m, E), `outputs_p` (m, T). `values` as `TermTable` orders them, the variables first; `coefficients`
    (K); `slopes` (values, K) of the coefficients with respect to the variables, `by_air` (8, K) with respect to
    `AIR_DIRECTIONS`; `reach` (n, K) the rates that a unit of each coefficient makes; `inertial_x` (n, n) the part of
    `rates_x` that no force or moment makes; `column` (n, 3) and `implicit` (n) room to work.
    """

    rates: NDArray[np.float64]
    rates_x: NDArray[np.float64]
    rates_u: NDArray[np.float64]
    rates_p: NDArray[np.float64]
    outputs: NDArray[np.float64]
    outputs_x: NDArray[np.float64]
    outputs_u: NDArray[np.float64]
    outputs_p: NDArray[np.float64]
    values: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    slopes: NDArray[np.float64]
    by_air: NDArray[np.float64]
    reach: NDArray[np.float64]
    inertial_x: NDArray[np.float64]
    column: NDArray[np.float64]
    implicit: NDArray[np.float64]


@njit
def make_workspace(extra_inputs: int, table: TermTable, layout: Layout) -> Workspace:
    """A `Workspace` for `extra_inputs` inputs past the leading columns and the terms of `table`."""
    states, outputs, loads = state_count(layout), output_count(layout), load_places(layout).total
    values, terms = value_count(table, leading_columns(layout) + extra_inputs), table.coefficient.shape[0]
    work = Workspace(
        np.zeros(states),
        np.zeros((states, states)),
        np.zeros((states, extra_inputs)),
        np.zeros((states, terms)),
        np.zeros(outputs),
        np.zeros((outputs, states)),
        np.zeros((outputs, extra_inputs)),
        np.zeros((outputs, terms)),
        np.zeros(values),
        np.zeros(loads),
        np.zeros((values, loads)),
        np.zeros((len(AIR_DIRECTIONS), loads)),
        np.zeros((states, loads)),
        np.zeros((states, states)),
        np.zeros((states, 3)),
        np.zeros(states),
    )
    _write_unit_rows(work.outputs_x, layout)
    return work


@njit
def _write_unit_rows(outputs_x: NDArray[np.float64], layout: Layout) -> None:
    """Sensors that see a state itself, once and for all."""
    there, at, row = layout.outputs, state_places(layout), output_places(layout)
    if len(there.p) > 0:
        outputs_x[row.p, at.p] = 1.0
    if len(there.q) > 0:
        outputs_x[row.q, at.q] = 1.0
    if len(there.r) > 0:
        outputs_x[row.r, at.r] = 1.0
    if len(there.phi) > 0:
        outputs_x[row.phi, at.phi] = 1.0
    if len(there.theta) > 0:
        outputs_x[row.theta, at.theta] = 1.0
    if len(there.psi) > 0:
        outputs_x[row.psi, at.psi] = 1.0
    if len(there.h) > 0:
        outputs_x[row.h, at.h] = 1.0
