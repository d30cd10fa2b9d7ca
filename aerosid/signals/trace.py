"""A simulated response with its sensitivities and its linearisation from sample to sample, as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline


class StateSizes(NamedTuple):
    """How many states something depends on, `coupled`, and how many of them only themselves, `alone`, which come last.

    The lengths of the tuples say so: numba knows them when it compiles, and unrolls loops up to them.
    """

    coupled: tuple[int, ...]
    alone: tuple[int, ...]


class Trace(NamedTuple):
    """Outputs of one stretch with their derivatives, and the linearisation along the way.

    With n states, m outputs, E extra inputs and C columns, of N samples: `outputs` (N, m); `block` (N, m, C): column 0
    is left for the residual, then free terms, initial state (n), and what directions move; `transition` (N, n, n),
    `start` and `end` (N, n, E) from each sample to the next; `outputs_x` (N, m, n) and `outputs_u` (N, m, E); `sizes`
    of the state.
    """

    outputs: NDArray[np.float64]
    block: NDArray[np.float64]
    transition: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    outputs_x: NDArray[np.float64]
    outputs_u: NDArray[np.float64]
    sizes: StateSizes


def among_inputs(trace: Trace, places: NDArray[np.int64]) -> Trace:
    """The trace with the slopes by some of the extra inputs alone."""
    start, end, outputs_u = (np.ascontiguousarray(a[:, :, places]) for a in (trace.start, trace.end, trace.outputs_u))
    return trace._replace(start=start, end=end, outputs_u=outputs_u)


@njit_inline
def carry_columns(
    transition: NDArray[np.float64], columns: NDArray[np.float64], moved: NDArray[np.float64], sizes: StateSizes
) -> None:
    """Write the columns (n, M) after a span with `transition` (n, n) into `moved` (n, M)."""
    width, coupled = columns.shape[1], len(sizes.coupled)
    for i in range(coupled + len(sizes.alone)):
        for c in range(width):
            total = transition[i, 0] * columns[0, c]
            for k in range(1, coupled):
                total += transition[i, k] * columns[k, c]
            moved[i, c] = total
    for i in range(coupled, coupled + len(sizes.alone)):
        for c in range(width):
            moved[i, c] += columns[i, c]
