"""Holes of a measured channel, bridged by the kinematics of the other channels.

A straight line across half a short period is an error of the channel as large as the motion, and effects are then found
that explain it. The path integrated from gyros and accelerometers follows the motion; the difference of measurement and
path is slow, and a line bridges that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.equations.kinematic import reconstruct
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.logs.stamps import holes

Array = NDArray[np.float64]

BY_GYROS = ("theta", "phi", "psi")
"""Physical: channels whose path needs gyros alone."""

ROUNDS = 2
"""Numerical: times that a path is integrated: it turns with the angle of attack and the airspeed that it bridges."""


def channel_holes(manoeuvre: Manoeuvre) -> dict[str, Array]:
    """Last instant before and first after each hole, s, (n, 2), of every measured channel that has one.

    Samples that a channel slower than the log lacks regularly are no hole, and neither is a gap of the whole record.
    """
    time = manoeuvre.flight.time
    found = {}
    for name in manoeuvre.outputs:
        missing = ~np.isfinite(manoeuvre.measured(name))
        edges = holes(time[~missing])
        lacking = missing[np.searchsorted(time, edges[:, 0]) + 1]
        if lacking.any():
            found[name] = edges[lacking]
    return found


def has_path(manoeuvre: Manoeuvre, name: str) -> bool:
    """Whether a channel is predicted by integration of others: those of the air data need the accelerometers."""
    case = equations_of(manoeuvre.axes)
    if name not in case.kinematic or (name == "V" and "theta" not in manoeuvre.outputs):
        return False
    return name in BY_GYROS or case.has_path(manoeuvre.outputs)


def bridged_by_kinematics(recording: Recording, manoeuvre: Manoeuvre, settings: EquationErrorSettings) -> Recording:
    """The record with the holes of channels that have a path bridged by it; itself where there are none.

    Parameters
    ----------
    recording : Recording
        With holes bridged by lines.
    manoeuvre : Manoeuvre
        As it was measured, with the holes.
    """
    bridged = {name: edges for name, edges in channel_holes(manoeuvre).items() if has_path(manoeuvre, name)}
    for _ in range(ROUNDS if bridged else 0):
        path = reconstruct(recording, (), recording.channels, settings).path
        along = {name: _along(recording, name, path[name], edges) for name, edges in bridged.items()}
        recording = _with_channels(recording, along)
    return recording


def _along(recording: Recording, name: str, path: Array, edges: Array) -> Array:
    """A channel, (N,), that follows its path, (N,), inside its holes."""
    time, values = recording.time, recording.channels[name]
    inside = np.zeros(time.size, dtype=bool)
    for before, after in edges:
        inside |= (time > before + 1e-9) & (time < after - 1e-9)
    difference = np.interp(time, time[~inside], (values - path)[~inside])
    return np.where(inside, path + difference, values)


def _with_channels(recording: Recording, changed: Mapping[str, Array]) -> Recording:
    """The record with other values, (N,), of some channels."""
    manoeuvre = recording.manoeuvre
    measured = manoeuvre.flight.measured.copy()
    for name, values in changed.items():
        measured[:, manoeuvre.axes.outputs.index(name)] = values
    return replace(
        recording,
        manoeuvre=replace(manoeuvre, flight=manoeuvre.flight._replace(measured=measured)),
        channels={**recording.channels, **changed},
    )
