"""Places of states, outputs and coefficients as numbers that the compiler knows.

A quantity is there or not by the type of a tuple: of length one where it is, empty where it is not. numba knows a
tuple's length when it compiles, so that sums of lengths are places, loops up to them are unrolled, and what a case does
not hold costs nothing: one source serves every case, and each is compiled and kept on the disk by itself.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from aerosid.compiled import njit_inline
from aerosid.flight_model.axes import COEFFICIENTS, MOTION, OUTPUTS, UNCOUPLED, Axes
from aerosid.signals.trace import StateSizes

There = tuple[int, ...]
"""Of length one where a quantity is there, empty where it is not."""


class MotionThere(NamedTuple):
    """Which motion quantities are integrated, in the order of `MOTION`."""

    u: There
    v: There
    w: There
    p: There
    q: There
    r: There
    phi: There
    theta: There
    h: There
    psi: There


class OutputsThere(NamedTuple):
    """Which outputs are compared, in the order of `OUTPUTS`."""

    V: There
    alpha: There
    beta: There
    p: There
    q: There
    r: There
    phi: There
    theta: There
    psi: There
    a_x: There
    a_y: There
    a_z: There
    p_dot: There
    q_dot: There
    r_dot: There
    h: There


class CoefficientsThere(NamedTuple):
    """Which coefficients a term may add to, in the order of `COEFFICIENTS`."""

    X: There
    Y: There
    Z: There
    l: There  # noqa: E741  the field's letter of the rolling moment
    m: There
    n: There
    L: There
    D: There


class Layout(NamedTuple):
    """`Axes` as compiled code takes them."""

    motion: MotionThere
    outputs: OutputsThere
    coefficients: CoefficientsThere
    sizes: StateSizes


@cache  # asked at each step of a fit, for one of a few cases
def layout_of(axes: Axes) -> Layout:
    """The layout of a case."""
    modelled = {*axes.coefficients, *axes.wind_axes}
    return Layout(
        MotionThere(*(_there(name in axes.integrated) for name in MOTION)),
        OutputsThere(*(_there(name in axes.outputs) for name in OUTPUTS)),
        CoefficientsThere(*(_there(name in modelled) for name in COEFFICIENTS)),
        StateSizes(
            tuple(0 for name in axes.integrated if name not in UNCOUPLED),
            tuple(0 for name in axes.integrated if name in UNCOUPLED),
        ),
    )


def _there(given: bool) -> There:
    return (0,) if given else ()


class States(NamedTuple):
    """Place of each state, `total` of all, `moving` of those that forces and moments act on, `coupled` of those that
    something depends on: these come first, in this order.
    """

    u: int
    v: int
    w: int
    p: int
    q: int
    r: int
    phi: int
    theta: int
    h: int
    psi: int
    moving: int
    coupled: int
    total: int


@njit_inline
def state_places(layout: Layout) -> States:
    """The places of the states; those that the case does not integrate have none, and must not be used."""
    there = layout.motion
    v = len(there.u)
    w = v + len(there.v)
    p = w + len(there.w)
    q = p + len(there.p)
    r = q + len(there.q)
    phi = r + len(there.r)
    theta = phi + len(there.phi)
    h = theta + len(there.theta)
    psi = h + len(there.h)
    return States(0, v, w, p, q, r, phi, theta, h, psi, phi, h, psi + len(there.psi))


class Rows(NamedTuple):
    """Place of each output, and `total` of all."""

    V: int
    alpha: int
    beta: int
    p: int
    q: int
    r: int
    phi: int
    theta: int
    psi: int
    a_x: int
    a_y: int
    a_z: int
    p_dot: int
    q_dot: int
    r_dot: int
    h: int
    total: int


@njit_inline
def output_places(layout: Layout) -> Rows:
    """The places of the outputs; those that the case does not compare have none, and must not be used."""
    there = layout.outputs
    alpha = len(there.V)
    beta = alpha + len(there.alpha)
    p = beta + len(there.beta)
    q = p + len(there.p)
    r = q + len(there.q)
    phi = r + len(there.r)
    theta = phi + len(there.phi)
    psi = theta + len(there.theta)
    a_x = psi + len(there.psi)
    a_y = a_x + len(there.a_x)
    a_z = a_y + len(there.a_y)
    p_dot = a_z + len(there.a_z)
    q_dot = p_dot + len(there.p_dot)
    r_dot = q_dot + len(there.q_dot)
    h = r_dot + len(there.r_dot)
    return Rows(0, alpha, beta, p, q, r, phi, theta, psi, a_x, a_y, a_z, p_dot, q_dot, r_dot, h, h + len(there.h))


class Loads(NamedTuple):
    """Place of each coefficient, and `total` of all."""

    X: int
    Y: int
    Z: int
    l: int  # noqa: E741  the field's letter of the rolling moment
    m: int
    n: int
    L: int
    D: int
    total: int


@njit_inline
def load_places(layout: Layout) -> Loads:
    """The places of the coefficients; those that the case does not model have none, and must not be used."""
    there = layout.coefficients
    y = len(there.X)
    z = y + len(there.Y)
    roll = z + len(there.Z)
    pitch = roll + len(there.l)
    yaw = pitch + len(there.m)
    lift = yaw + len(there.n)
    drag = lift + len(there.L)
    return Loads(0, y, z, roll, pitch, yaw, lift, drag, drag + len(there.D))


class Columns(NamedTuple):
    """Place of each measured motion quantity among the inputs, and `total` of the leading columns."""

    rho: int
    thrust: int
    mass: int
    speed_of_sound: int
    V: int
    alpha: int
    q: int
    theta: int
    phi: int
    p: int
    r: int
    beta: int
    total: int


@njit_inline
def input_places(layout: Layout) -> Columns:
    """The places of the leading input columns: `Axes.measured` after the first four.

    Airspeed and angle of attack stand for u and w, sideslip for v.
    """
    there = layout.motion
    first = 4
    alpha = first + 1 - len(there.u)
    q = alpha + 1 - len(there.w)
    theta = q + 1 - len(there.q)
    phi = theta + 1 - len(there.theta)
    p = phi + 1 - len(there.phi)
    r = p + 1 - len(there.p)
    beta = r + 1 - len(there.r)
    return Columns(0, 1, 2, 3, first, alpha, q, theta, phi, p, r, beta, beta + 1 - len(there.v))


@njit_inline
def state_count(layout: Layout) -> int:
    """How many states the case integrates."""
    return state_places(layout).total


@njit_inline
def output_count(layout: Layout) -> int:
    """How many outputs the case compares."""
    return output_places(layout).total


@njit_inline
def leading_columns(layout: Layout) -> int:
    """How many input columns come before those that terms name."""
    return input_places(layout).total
