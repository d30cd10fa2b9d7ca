"""Lever arms: readings of vanes and accelerometers away from the centre of gravity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def by_lever_arm(channel: str, motion: Mapping[str, Array], place: Sequence[float]) -> Array:
    """The change (N,) of alpha, beta, a_x, a_y or a_z due to the sensor's position, SI.

    Parameters
    ----------
    channel : str
    motion : mapping of str to (N,)
        V, p, q, r, p_dot, q_dot and r_dot, SI.
    place : sequence of float
        Forward, right and below the centre of gravity, m; missing ones are zero.

    Notes
    -----
    A vane moves with omega x arm, an accelerometer additionally reads omega' x arm + omega x (omega x arm).
    """
    arm = np.array([*place, 0.0, 0.0][:3])
    turn = np.column_stack([motion[name] for name in "pqr"])
    if channel in ("alpha", "beta"):
        moved = np.cross(turn, arm)
        return np.asarray(moved[:, 2 if channel == "alpha" else 1] / motion["V"])
    spin = np.column_stack([motion[f"{name}_dot"] for name in "pqr"])
    felt = np.cross(spin, arm) + np.cross(turn, np.cross(turn, arm))
    return np.asarray(felt[:, "xyz".index(channel[-1])])
