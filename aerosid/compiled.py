"""Compile hot loops, with the settings that every kernel of this package shares.

Kernels are cached on disk, so that a command pays for compilation once per installation. Division by zero gives
infinity as in numpy: kernels are called with checked input and must not carry exception paths in inner loops.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def njit(function: _Function) -> _Function:
    """The function compiled by numba in nopython mode, cached on disk, holding no global lock."""
    return cast(_Function, numba.njit(cache=True, error_model="numpy", nogil=True)(function))


def njit_inline(function: _Function) -> _Function:
    """As `njit`, merged into its callers: for what inner loops call.

    A call passes each array as seven numbers, a `Workspace` as a hundred: between 50 ns and more than the work itself.
    Sizes that the caller knows are known inside as well, and loops over them are unrolled.
    """
    return cast(
        _Function, numba.njit(cache=True, error_model="numpy", nogil=True, inline="never", forceinline=True)(function)
    )
