"""Helpers are merged into their callers without a machine code of their own, and give the same from Python."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit, njit_inline, njit_inline_room


@njit_inline
def weighted(x: float, weights: NDArray[np.float64]) -> float:
    return (weights[0] * x + weights[1]) * x + weights[2]


@njit_inline
def summed(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    total = 0.0
    for i in range(values.shape[0]):
        total += np.sin(weighted(values[i], weights))
    return total


@njit_inline_room
def scaled(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    work = np.empty(values.shape[0])
    for i in range(values.shape[0]):
        work[i] = 2.0 * values[i]
    return summed(work, weights)


@njit
def entry(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    return summed(values, weights) + scaled(values, weights)


@njit
def half_precision(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    return weighted(np.float32(values[0]), weights)


def test_a_kernel_with_merged_helpers_is_what_numba_makes_of_the_same_functions() -> None:
    values, weights = np.linspace(-1.0, 2.0, 37), np.array([0.3, -1.7, 0.2])
    plain = numba.njit(error_model="numpy", nogil=True)
    by_numba = {}
    for function in (weighted, summed, scaled, entry):
        source = function.py_func
        by_numba[source.__name__] = plain(
            type(source)(source.__code__, {**source.__globals__, **by_numba}, source.__name__)
        )
    assert entry(values, weights) == by_numba["entry"](values, weights)
    assert not weighted.overloads
    assert not summed.overloads
    assert not scaled.overloads


def test_a_helper_can_be_called_from_python_before_and_after_its_callers() -> None:
    values, weights = np.linspace(-1.0, 2.0, 37), np.array([0.3, -1.7, 0.2])
    assert weighted(0.5, weights) == (0.3 * 0.5 - 1.7) * 0.5 + 0.2
    total = entry(values, weights)
    assert summed(values, weights) + scaled(values, weights) == total


def test_a_helper_is_merged_once_for_each_type_of_its_arguments() -> None:
    weights = np.array([0.3, -1.7, 0.2])
    values = np.array([0.1])
    x = float(np.float32(0.1))
    assert half_precision(values, weights) == (0.3 * x - 1.7) * x + 0.2
    assert entry(values, weights) == np.sin((0.3 * 0.1 - 1.7) * 0.1 + 0.2) + np.sin((0.3 * 0.2 - 1.7) * 0.2 + 0.2)
