"""Model functions given by the user: Python functions as they are, compiled ones inside compiled loops.

An estimator's driver is written once. It receives four functions of fixed signature,

    step(x, u0, u1, t, dt) -> (n,)    the open-loop state at the end of a step,
    h(x, u, t) -> (p,)                the observation,
    f_x(x, u, t) -> (n, n), h_x(x, u, t) -> (p, n)    their partial derivatives,

and runs as it stands for Python functions; `compiled_driver` compiles the same source, once and cached on disk, for
functions that are numba dispatchers (they are passed as function pointers, so that a new model compiles only itself).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar, cast

import numba
import numpy as np
from numba.extending import is_jitted, register_jitable
from numpy.typing import ArrayLike, NDArray

from aerosid.compiled import njit_for
from aerosid.errors import UsageError

Array = NDArray[np.float64]
Function = Callable[[Array, Array, float], Array]
StepFunction = Callable[[Array, Array, Array, float, float], Array]

# Central differences: truncation ~ step^2 and rounding ~ eps / step balance at the cube root of eps.
_DIFFERENCE = float(np.finfo(np.float64).eps) ** (1.0 / 3.0)

_typeof: Callable[[Any], Any] = numba.typeof
_vector = numba.float64[::1]
_matrix = numba.float64[:, ::1]
VECTOR_FUNCTION = numba.types.FunctionType(_vector(_vector, _vector, numba.float64))
MATRIX_FUNCTION = numba.types.FunctionType(_matrix(_vector, _vector, numba.float64))
STEP_FUNCTION = numba.types.FunctionType(_vector(_vector, _vector, _vector, numba.float64, numba.float64))


_Jitable = TypeVar("_Jitable", bound=Callable[..., Any])


def jitable(function: _Jitable) -> _Jitable:
    """The function, callable from Python with Python functions and from compiled code with compiled ones."""
    return register_jitable(function)


@dataclass(frozen=True)
class Partials:
    """Partial derivatives of a model's functions: as given, by central differences where absent.

    Attributes
    ----------
    f_x : callable, optional
        f_x(x, u, t) -> (n, n), of f to the states.
    h_x : callable, optional
        h_x(x, u, t) -> (p, n), of h to the states.
    state_scale : (n,), optional
        Magnitude below which a state counts as zero when its difference step is chosen, state units; 1 by default.
    """

    f_x: Callable[..., Any] | None = None
    h_x: Callable[..., Any] | None = None
    state_scale: ArrayLike | None = None


BY_DIFFERENCES = Partials()
"""Neither derivative is known."""


class ModelFunctions(NamedTuple):
    """The model as an estimator's driver calls it; all compiled, or none."""

    f: Function
    step: StepFunction
    h: Function
    f_x: Function
    h_x: Function
    compiled: bool


def _central_differences(f: Function, size: int, scale: Array) -> Function:
    def partials(x: Array, u: Array, t: float) -> Array:
        n = x.shape[0]
        out = np.zeros((size, n))
        shifted = x.copy()
        for j in range(n):
            delta = _DIFFERENCE * max(abs(x[j]), scale[j])
            shifted[j] = x[j] + delta
            above = f(shifted, u, t)
            upper = shifted[j]
            shifted[j] = x[j] - delta
            below = f(shifted, u, t)
            inverse = 1.0 / (upper - shifted[j])
            for i in range(size):
                out[i, j] = (above[i] - below[i]) * inverse
            shifted[j] = x[j]
        return out

    return partials


def _runge_kutta(f: Function, substeps: int) -> StepFunction:
    def step(x: Array, u0: Array, u1: Array, t: float, dt: float) -> Array:
        """The state at t + dt by the classical fourth-order method, inputs linear in time."""
        tau = dt / substeps
        slope = (u1 - u0) / dt
        x = x.copy()
        for i in range(substeps):
            start = i * tau
            u_start = u0 + slope * start
            u_half = u0 + slope * (start + 0.5 * tau)
            u_end = u0 + slope * (start + tau)
            k1 = f(x, u_start, t + start)
            k2 = f(x + 0.5 * tau * k1, u_half, t + start + 0.5 * tau)
            k3 = f(x + 0.5 * tau * k2, u_half, t + start + 0.5 * tau)
            k4 = f(x + tau * k3, u_end, t + start + tau)
            x = x + tau / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return x

    return step


def _mapping(f: Function) -> StepFunction:
    def step(x: Array, u0: Array, u1: Array, t: float, dt: float) -> Array:  # noqa: ARG001
        return f(x, u0, t)

    return step


def _checked(function: Callable[..., Any], name: str, shape: tuple[int, ...]) -> Function:
    def call(x: Array, u: Array, t: float) -> Array:
        value = np.ascontiguousarray(function(x, u, t), dtype=np.float64)
        if value.shape != shape:
            raise UsageError(f"{name}(x, u, t) returned an array of shape {value.shape} where {shape} was expected.")
        return value

    return call


def model_functions(
    f: Callable[..., Any],
    h: Callable[..., Any],
    *,
    n: int,
    p: int,
    partials: Partials = BY_DIFFERENCES,
    substeps: int | None = None,
) -> ModelFunctions:
    """The four functions that a driver calls, from those given.

    Parameters
    ----------
    f : callable
        f(x, u, t) -> (n,): rates, or the next state of a discrete model.
    h : callable
        h(x, u, t) -> (p,).
    n, p : int
        Numbers of states and outputs.
    partials : Partials
        What is known of their derivatives.
    substeps : int, optional
        Runge-Kutta steps a sample for rates f; None where f is already the map from sample to sample.

    Returns
    -------
    ModelFunctions

    Raises
    ------
    UsageError
        Where some functions are compiled and others are not, or a Python function returns another shape.
    """
    f_x, h_x, state_scale = partials.f_x, partials.h_x, partials.state_scale
    given = [function for function in (f, h, f_x, h_x) if function is not None]
    jitted = [is_jitted(function) for function in given]
    if any(jitted) and not all(jitted):
        raise UsageError(
            "Some of f, h, f_x, h_x are compiled by numba and others are not: compile all of them or none."
        )
    scale = (1.0,) * n if state_scale is None else tuple(np.asarray(state_scale, dtype=np.float64).tolist())
    if all(jitted):
        made_f_x = _compiled_differences(f, n, scale) if f_x is None else f_x
        made_h_x = _compiled_differences(h, p, scale) if h_x is None else h_x
        return ModelFunctions(f, _compiled_step(f, substeps), h, made_f_x, made_h_x, True)
    f, h = _checked(f, "f", (n,)), _checked(h, "h", (p,))
    made_f_x = _central_differences(f, n, np.array(scale)) if f_x is None else _checked(f_x, "f_x", (n, n))
    made_h_x = _central_differences(h, p, np.array(scale)) if h_x is None else _checked(h_x, "h_x", (p, n))
    return ModelFunctions(f, _make_step(f, substeps), h, made_f_x, made_h_x, False)


def _make_step(f: Function, substeps: int | None) -> StepFunction:
    return _mapping(f) if substeps is None else _runge_kutta(f, substeps)


# Closures over the caller's functions are not cached on disk, since those may change without this file changing; within
# a process they are compiled once for each function.
_jit = numba.njit(error_model="numpy", nogil=True)


@functools.lru_cache(maxsize=64)
def _compiled_step(f: Function, substeps: int | None) -> StepFunction:
    return cast(StepFunction, _jit(_make_step(f, substeps)))


@functools.lru_cache(maxsize=64)
def _compiled_differences(f: Function, size: int, scale: tuple[float, ...]) -> Function:
    return cast(Function, _jit(_central_differences(f, size, np.array(scale))))


@functools.cache
def _compile(driver: Callable[..., Any], signature: tuple[Any, ...]) -> Callable[..., Any]:
    return njit_for(driver, signature)


def call_driver(driver: Callable[..., int], functions: ModelFunctions, *arguments: Any) -> int:
    """What `driver(step, h, f_x, h_x, *arguments)` returns, run compiled where the functions are compiled."""
    four = functions.step, functions.h, functions.f_x, functions.h_x
    if functions.compiled:
        types = STEP_FUNCTION, VECTOR_FUNCTION, MATRIX_FUNCTION, MATRIX_FUNCTION
        driver = _compile(driver, (*types, *map(_typeof, arguments)))
    return driver(*four, *arguments)
