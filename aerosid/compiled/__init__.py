"""Compile hot loops, with the settings that every kernel of this package shares.

Kernels are kept on disk by content (kernel_cache.py here), so that a user pays for compilation once, whatever the
number of clones and environments. Division by zero gives infinity as in numpy: kernels are called with checked input
and must not carry exception paths in inner loops.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar, cast

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Kernel:
    """A function that numba compiles when it is first called; numba itself is imported no earlier.

    Wrong usage and files that cannot be read are told in a fraction of the time that this import takes. What numba's
    dispatchers have beyond the call (`overloads`, `compile`) is found here as well.

    Parameters
    ----------
    function : callable
        The source.
    merged : bool
        Whether compiled callers take it in in place of calling it.
    optimised : bool
        Whether it is optimised by itself before they do.
    options : mapping of str to Any
        Of `numba.njit`.
    """

    def __init__(self, function: Callable[..., Any], merged: bool, optimised: bool = False, **options: Any) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.optimised = optimised
        self._merged, self._options = merged, {"error_model": "numpy", "nogil": True, **options}

    @functools.cached_property
    def dispatcher(self) -> Any:
        """What numba makes of the function."""
        import numba

        from aerosid.compiled.kernel_cache import KernelCache
        from aerosid.compiled.merged_kernels import merge_into_callers

        compiler: Any = numba.njit  # whose annotations do not know all of its options
        dispatcher = compiler(**self._options)(self.py_func)
        dispatcher._cache = KernelCache(dispatcher)
        return merge_into_callers(dispatcher, self.optimised) if self._merged else dispatcher

    @property
    def options(self) -> dict[str, Any]:
        """The options that its dispatcher has, known before one is made."""
        return {"boundscheck": None, "nopython": True, **self._options}

    @property
    def _numba_type_(self) -> Any:
        """What numba takes this for where a compiled function names it."""
        return self.dispatcher._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """The compiled function of these arguments."""
        return self.dispatcher(*arguments)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # asked by whoever inspects an object; none of them needs a compiler
            raise AttributeError(name)
        return getattr(self.dispatcher, name)

    def __reduce__(self) -> str:
        return self.py_func.__qualname__


def njit(function: _Function) -> _Function:
    """The function compiled by numba in nopython mode, cached on disk, holding no global lock."""
    return cast(_Function, Kernel(function, False))


def njit_for(function: _Function, signature: tuple[Any, ...]) -> _Function:
    """As `njit`, for these argument types alone; functions among the arguments are passed as pointers."""
    dispatcher = Kernel(function, False).dispatcher
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
    return cast(_Function, Kernel(function, True, inline="never", forceinline=True, _nrt=False))


def njit_inline_vector(function: _Function) -> _Function:
    """As `njit_inline`, for products of small matrices: optimised before its callers take it in.

    Its loops become vector instructions while their lengths are unknown. In a caller that knows them they are unrolled
    first and stay scalar: the step of the recursion takes a third more time then.
    """
    return cast(_Function, Kernel(function, True, optimised=True, inline="never", forceinline=True, _nrt=False))


def njit_inline_room(function: _Function) -> _Function:
    """As `njit_inline`, for a function that allocates work arrays of sizes that its caller knows."""
    return cast(_Function, Kernel(function, True, inline="never", forceinline=True))
