"""Compile hot loops, with the settings that every kernel of this package shares.

Kernels are cached on disk, so that a command pays for compilation once per installation. Division by zero gives
infinity as in numpy: kernels are called with checked input and must not carry exception paths in inner loops.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _cache_folder() -> str | None:
    """Where compiled code is kept: a folder of its own for every state of the kernels' sources.

    numba looks only at the file of the function that it loads, and not at those of its callees: a kernel compiled
    against another's old work arrays would write past their end. None where the user chose a folder, or where the
    package's own cannot be written; numba then takes its usual places.
    """
    package = Path(__file__).parent
    if "NUMBA_CACHE_DIR" in os.environ or not os.access(package, os.W_OK):
        return None
    state = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        source = path.read_bytes()
        if b"@njit" in source:
            state.update(source)
    return str(package / "__pycache__" / f"kernels-{state.hexdigest()[:12]}")


if (_folder := _cache_folder()) is not None:
    numba.config.CACHE_DIR = _folder  # type: ignore[attr-defined]


def njit(function: _Function) -> _Function:
    """The function compiled by numba in nopython mode, cached on disk, holding no global lock."""
    return cast(_Function, numba.njit(cache=True, error_model="numpy", nogil=True)(function))


def njit_inline(function: _Function) -> _Function:
    """As `njit`, merged into its callers: for what inner loops call, and those loops themselves.

    A call passes each array as seven numbers, a `Workspace` as a hundred: between 50 ns and more than the work itself.
    Sizes that the caller knows are known inside as well, and loops over them are unrolled.

    Nothing in it may allocate an array, nor assign to a slice. In exchange no array is counted as referenced when a
    row of it is taken or handed on: those counts are atomic, and take more time in an inner loop than its arithmetic.
    So a kernel allocates in a function of `njit` and loops in one of these.
    """
    return cast(_Function, _inlined(_nrt=False)(function))


def njit_inline_room(function: _Function) -> _Function:
    """As `njit_inline`, for a function that allocates work arrays of sizes that its caller knows."""
    return cast(_Function, _inlined()(function))


def _inlined(**options: bool) -> Callable[..., Any]:
    compiler: Any = numba.njit  # whose annotations do not know all of its options
    return cast(
        Callable[..., Any],
        compiler(cache=True, error_model="numpy", nogil=True, inline="never", forceinline=True, **options),
    )
