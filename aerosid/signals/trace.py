"""A simulated response with its sensitivities and its linearisation from sample to sample, as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline


class Trace(NamedTuple):
    """Outputs of one stretch with their derivatives, and the linearisation along the way; E extra inputs, C columns.

    `outputs` (n, 8); `block` (n, 8, C): column 0 is left for the residual, then free terms, initial state (5), and what
    directions move; `transition` (n, 5, 5), `start` and `end` (n, 5, E) from each sample to the next; `outputs_x`
    (n, 8, 5) and `outputs_u` (n, 8, E).
    """

    outputs: NDArray[np.float64]
    block: NDArray[np.float64]
    transition: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    outputs_x: NDArray[np.float64]
    outputs_u: NDArray[np.float64]


def among_inputs(trace: Trace, places: NDArray[np.int64]) -> Trace:
    """The trace with the slopes by some of the extra inputs alone."""
    start, end, outputs_u = (np.ascontiguousarray(a[:, :, places]) for a in (trace.start, trace.end, trace.outputs_u))
    return trace._replace(start=start, end=end, outputs_u=outputs_u)


@njit_inline
def carry_columns(transition: NDArray[np.float64], columns: NDArray[np.float64], moved: NDArray[np.float64]) -> None:
    """Write the columns (5, M) after a span with `transition` (5, 5) into `moved` (5, M)."""
    width = columns.shape[1]
    for i in range(5):
        by_u, by_w, by_q, by_theta = transition[i, 0], transition[i, 1], transition[i, 2], transition[i, 3]
        for c in range(width):
            moved[i, c] = (by_u * columns[0, c] + by_w * columns[1, c]) + (
                by_q * columns[2, c] + by_theta * columns[3, c]
            )
    for c in range(width):
        moved[4, c] += columns[4, c]  # nothing depends on h but itself
