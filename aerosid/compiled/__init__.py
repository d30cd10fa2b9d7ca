"""Compile hot loops, with the settings that every kernel of this package shares.

Kernels are kept on disk by content (kernel_cache.py here), so that a user pays for compilation once, whatever the
number of clones and environments. Division by zero gives infinity as in numpy: kernels are called with checked input
and must not carry exception paths in inner loops.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

from aerosid.compiled.kernel_cache import KernelCache
from aerosid.compiled.merged_kernels import merge_into_callers

_Function = TypeVar("_Function", bound=Callable[..., Any])


_njit: Any = numba.njit  # whose annotations do not know all of its options


def njit(function: _Function) -> _Function:
    """The function compiled by numba in nopython mode, cached on disk, holding no global lock."""
    return cast(_Function, _compiled(function))


def njit_for(function: _Function, signature: tuple[Any, ...]) -> _Function:
    """As `njit`, for these argument types alone; functions among the arguments are passed as pointers."""
    dispatcher = _compiled(function)
    dispatcher.compile(signature)
    dispatcher.disable_compile()
    return cast(_Function, dispatcher)


def njit_inline(function: _Function) -> _Function:
    """As `njit`, merged into its callers: for what inner loops call, and those loops themselves.

    A call passes each array as seven numbers, a `Workspace` as a hundred: between 50 ns and more than the work itself.
    Sizes that the caller knows are known inside as well, and loops over them are unrolled.

    Nothing in it may allocate an array, nor assign to a slice. In exchange no array is counted as referenced when a
    row of it is taken or handed on: those counts are atomic, and take more time in an inner loop than its arithmetic.
    So a kernel allocates in a function of `njit` and loops in one of these.
    """
    return cast(_Function, merge_into_callers(_compiled(function, inline="never", forceinline=True, _nrt=False)))


def njit_inline_room(function: _Function) -> _Function:
    """As `njit_inline`, for a function that allocates work arrays of sizes that its caller knows."""
    return cast(_Function, merge_into_callers(_compiled(function, inline="never", forceinline=True)))


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    dispatcher = _njit(error_model="numpy", nogil=True, **options)(function)
    dispatcher._cache = KernelCache(dispatcher)
    return dispatcher
