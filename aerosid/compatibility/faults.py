"""The catalogue of instrument faults in the kinematic equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import DRIVING
from aerosid.compatibility.recording import Recording, spread
from aerosid.effects.limits import LARGEST_BIAS
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.nomenclature import CHANNELS
from aerosid.signals.delay_and_lag import delayed, lagged
from aerosid.signals.sensor_dynamics import AT_ONCE, SensorDynamics, lagging, late, scaled

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fault:
    """One number of one instrument that may not be what it is taken for.

    Attributes
    ----------
    kind : str
        sensor_bias, sensor_scale, sensor_delay, sensor_lag, or sensor_position.
    channel : str
        The channel of the instrument.
    unit : str
        Of the number.
    null : float
        The number at which nothing is wrong.
    lowest, highest : float
        Beyond these it is no fault of an instrument any more but a channel that means something else.
    step : float
        For differences with respect to it.
    trials : tuple of float
        Distances from `null` over which it is looked at: a delay is not linear in its number.
    axis : str
        Of a position: x or z of the body axes.
    """

    kind: str
    channel: str
    unit: str
    null: float
    lowest: float
    highest: float
    step: float
    trials: tuple[float, ...]
    axis: str = ""

    @property
    def drives(self) -> bool:
        """Whether the channel drives the path; otherwise it sees it."""
        return self.channel in DRIVING

    @property
    def place(self) -> int:
        """The channel's place among the driving inputs, or among the outputs."""
        return DRIVING.index(self.channel) if self.drives else LONGITUDINAL.outputs.index(self.channel)


_ORDER = {"sensor_position": 0, "sensor_lag": 1, "sensor_delay": 2, "sensor_scale": 3, "sensor_bias": 4}
"""From the motion to the record: where the instrument sits, how slowly and how late it answers, its calibration."""


def catalogue(recordings: Sequence[Recording]) -> tuple[Fault, ...]:
    """Every fault that is asked after: bias, scale, delay and lag of each channel, and the positions that matter.

    The altitude's zero acts on nothing and is left out. Of positions, those are asked after that a pitching motion
    shows: the vane's and the vertical accelerometer's ahead of the centre of gravity, the axial one's below it.
    """
    outputs = dict.fromkeys(name for recording in recordings for name in recording.outputs)
    found: list[Fault] = []
    for channel in (*DRIVING, *outputs):
        unit = CHANNELS[channel].unit
        noise = max(spread(recordings, channel), 1e-9)
        if channel != "h":
            limit = LARGEST_BIAS[unit]
            found.append(Fault("sensor_bias", channel, unit, 0.0, -limit, limit, noise, (noise,)))
        found.append(Fault("sensor_scale", channel, "1", 1.0, 0.5, 2.0, 1e-4, (1e-4,)))
        found.append(Fault("sensor_delay", channel, "s", 0.0, -0.1, 1.0, 1e-3, (0.02, -0.02, 0.1, 0.3)))
        found.append(Fault("sensor_lag", channel, "s", 0.0, 0.0, 1.5, 1e-3, (0.02, 0.1, 0.3)))
    for channel, axis in (("alpha", "x"), ("a_z", "x"), ("a_x", "z")):
        found.append(Fault("sensor_position", channel, "m", 0.0, -30.0, 30.0, 1e-2, (1e-2,), axis))
    return tuple(found)


def true_inputs(recording: Recording, faults: Sequence[Fault], values: Sequence[float]) -> Array:
    """What drove the path, (N, 7): the recorded inputs with the faults taken off, at the centre of gravity."""
    inputs = recording.inputs.copy()
    for fault, value in _in_order(faults, values, reverse=True):
        if fault.drives and fault.kind != "sensor_position":
            inputs[:, fault.place] = _undone(recording.time, inputs[:, fault.place], fault, value)
    positions = {name: np.array(recording.positions.get(name, (0.0, 0.0, 0.0))) for name in ("a_x", "a_z")}
    for fault, value in zip(faults, values, strict=True):
        if fault.drives and fault.kind == "sensor_position":
            positions[fault.channel]["xyz".index(fault.axis)] += value
    if any(position.any() for position in positions.values()):
        _move_to_centre(recording.time, inputs, positions["a_x"], positions["a_z"])
    return inputs


def seen(faults: Sequence[Fault], values: Sequence[float]) -> list[tuple[Fault, float]]:
    """The faults of what sees the path, in the order in which they act; positions of the vane are not among them."""
    return [
        (fault, value)
        for fault, value in _in_order(faults, values)
        if not fault.drives and fault.kind != "sensor_position"
    ]


def recorded(time: Array, values: Array, fault: Fault, value: float, *, slope: bool = False) -> Array:
    """The record (N, C) that a faulty instrument makes of true values; `slope`: of their derivatives."""
    if fault.kind == "sensor_bias":
        return values if slope else values + value
    if fault.kind == "sensor_scale":
        return value * values
    if fault.kind == "sensor_delay":
        return delayed(time, values, value)
    return lagged(time, np.ascontiguousarray(values), value)


def dynamics(fault: Fault, value: float) -> SensorDynamics:
    """A faulty instrument as noise on its way meets it."""
    if fault.kind == "sensor_scale":
        return scaled(value)
    if fault.kind == "sensor_delay":
        return late(value)
    return lagging(value) if fault.kind == "sensor_lag" else AT_ONCE


def vane_position(recording: Recording, faults: Sequence[Fault], values: Sequence[float]) -> tuple[float, float]:
    """Position of the angle-of-attack vane along x and z from the centre of gravity, m."""
    x, _, z = recording.positions.get("alpha", (0.0, 0.0, 0.0))
    for fault, value in zip(faults, values, strict=True):
        if fault.kind == "sensor_position" and fault.channel == "alpha":
            x, z = (x + value, z) if fault.axis == "x" else (x, z + value)
    return x, z


def _in_order(faults: Sequence[Fault], values: Sequence[float], *, reverse: bool = False) -> list[tuple[Fault, float]]:
    pairs = list(zip(faults, values, strict=True))
    return sorted(pairs, key=lambda pair: _ORDER[pair[0].kind], reverse=reverse)


def _undone(time: Array, values: Array, fault: Fault, value: float) -> Array:
    """True values (N,) from a recorded channel."""
    if fault.kind == "sensor_bias":
        return values - value
    if fault.kind == "sensor_scale":
        return values / value
    if fault.kind == "sensor_delay":
        return delayed(time, values[:, None], -value)[:, 0]
    # The path is an integral of this: what differentiation does to the noise is undone by it.
    return np.asarray(values + value * np.gradient(values, time))


def _move_to_centre(time: Array, inputs: Array, at_x: Array, at_z: Array) -> None:
    """Accelerations at their sensors to those at the centre of gravity, in place; p' and r' are taken as zero."""
    q, p, r = inputs[:, 2], inputs[:, 3], inputs[:, 4]
    q_dot = np.gradient(q, time)
    inputs[:, 0] -= -(q * q + r * r) * at_x[0] + p * q * at_x[1] + (q_dot + p * r) * at_x[2]
    inputs[:, 1] -= (p * r - q_dot) * at_z[0] + q * r * at_z[1] - (p * p + q * q) * at_z[2]
