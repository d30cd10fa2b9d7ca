"""Values with which no flight can be computed: speeds, densities and masses of zero, holes in controls, no motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.constant_channels import dead_channel, is_constant
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.settings import QUALITY
from aerosid.nomenclature import is_surface
from aerosid.notation import number, plain

POSITIVE = ("V", "rho", "q_bar", "mass")
"""Channels that the equations divide by."""


@dataclass(frozen=True)
class Hole:
    """Samples of a channel that are missing in one piece: from and to, s; all of them, `count`."""

    start: float
    stop: float
    count: int

    def __str__(self) -> str:
        """The hole in words."""
        return f"{self.count} samples from {plain(self.start, 6)} to {plain(self.stop, 6)} s"


def first_not_positive(log: FlightLog, name: str) -> str:
    """The first value of zero or less of a channel that has to be positive, in words; empty where there is none."""
    if name not in POSITIVE or name not in log:
        return ""
    wrong = np.flatnonzero(log[name] <= 0.0)
    if not wrong.size:
        return ""
    first = int(wrong[0])
    unit = f" {log.units[name]}" if log.units.get(name, "1") != "1" else ""
    return (
        f"{wrong.size} of {log.samples} samples; the first is sample {first + 1} at {plain(float(log.time[first]), 6)} "
        f"s: {number(float(log[name][first]), 4)}{unit}"
    )


def longest_hole(log: FlightLog, name: str) -> Hole | None:
    """The longest hole of a control, if it is too long to be interpolated; None otherwise.

    A channel slower than the log misses samples throughout: its own interval counts.
    """
    present = np.flatnonzero(np.isfinite(log[name]))
    if not is_surface(name) or present.size < 2:
        return None
    time = log.time
    intervals, seconds = QUALITY.hole
    usual = max(intervals * float(np.median(np.diff(time[present]))), seconds)
    edges = np.concatenate([[-1], present, [log.samples]])
    # Where the whole record has a gap no sample of the control is missing.
    lengths = np.where(np.diff(edges) > 1, np.diff(time[np.clip(edges, 0, log.samples - 1)]), 0.0)
    n = int(np.argmax(lengths))
    if lengths[n] <= usual:
        return None
    first, last = int(edges[n]) + 1, int(edges[n + 1]) - 1
    return Hole(float(time[first]), float(time[last]), last - first + 1)


def require_computable(logs: Sequence[FlightLog], unseen: Sequence[FlightLog], required: Sequence[str]) -> None:
    """Refuse fitted and unseen logs with which no flight, or no model, can be computed, as the next two functions.

    Raises
    ------
    LogError
        As those.
    """
    for log in (*logs, *unseen):
        require_possible_values(log, required)
    require_moving_control(logs)


def require_possible_values(log: FlightLog, required: Sequence[str]) -> None:
    """Refuse a log through which no flight can be computed; `required`: the channels that show its motion.

    Raises
    ------
    LogError
        With the channel, the sample, its time and what was found.
    """
    label = log.path or log.name
    if log.interval < QUALITY.shortest_interval:
        raise LogError(
            f"{label}: time runs from {plain(float(log.time[0]), 6)} to {plain(float(log.time[-1]), 6)} s in steps of "
            f"{number(log.interval)} s, but no flight recorder samples that fast; correct the unit of time."
        )
    for name in POSITIVE:
        if found := first_not_positive(log, name):
            raise LogError(
                f"{label}: channel {name} has to be positive ({found}); leave those fields empty, correct the column "
                "or choose another span."
            )
    for name in log.channels:
        if (hole := longest_hole(log, name)) is not None:
            raise LogError(
                f"{label}: channel {name} lacks {hole}, and no response can be simulated without it; choose a span "
                "without that hole, or fill it."
            )
    moving = [name for name in required if name in log and name not in ("rho", "mass")]
    if moving and all(is_constant(log[name]) for name in moving):
        raise LogError(
            f"{label}: channels {', '.join(moving)} never change, but a manoeuvre has motion; check the recording, or "
            "choose another span."
        )
    for name in required:
        if (dead := dead_channel(log, name)) is not None:
            raise LogError(
                f"{label}: channel {name} is dead ({dead}); correct the column or the channel map, or use another "
                "recording."
            )


def require_moving_control(logs: Sequence[FlightLog]) -> None:
    """Refuse logs in none of which a control surface ever moves: nothing determines the controls' derivatives.

    Raises
    ------
    LogError
        With the controls and their constant values.
    """
    controls = [(log, name) for log in logs for name in log.channels if is_surface(name)]
    if not controls or not all(is_constant(log[name]) for log, name in controls):
        return
    log, name = controls[0]
    value = float(log[name][np.isfinite(log[name])][0])
    raise LogError(
        f"{log.path or log.name}: no control surface moves ({name} is {number(value, 4)} {log.units.get(name, '')} "
        "throughout); fly a doublet or a 3-2-1-1, check the sensor, or choose another span."
    )
