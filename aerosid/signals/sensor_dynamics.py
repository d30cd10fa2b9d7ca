"""Sensor dynamics as a state-space model: lag, delay and scale as process noise meets them.

A simulated response goes through a sensor's own operator, exactly. The noise along the way (gusts, the recorded
surface, forces of any shape) is known by its statistics alone: there the sensor is a linear system of a few states
beside those of the aircraft. A delay is its second-order Pade approximation, good to a phase of some 3 rad.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline

Array = NDArray[np.float64]


class SensorDynamics(NamedTuple):
    """A sensor in continuous time: s' = `memory` s + `entry` y, record = `read` s + `direct` y; M states."""

    memory: Array
    entry: Array
    read: Array
    direct: float

    def then(self, after: SensorDynamics) -> SensorDynamics:
        """The record of this sensor through another one."""
        from scipy.linalg import block_diag  # late: files are read and refused without it

        memory = block_diag(self.memory, after.memory)
        own = self.entry.size
        memory[own:, :own] = np.outer(after.entry, self.read)
        return SensorDynamics(
            memory,
            np.concatenate([self.entry, after.entry * self.direct]),
            np.concatenate([after.direct * self.read, after.read]),
            self.direct * after.direct,
        )


def scaled(factor: float) -> SensorDynamics:
    """A sensor that answers at once."""
    return SensorDynamics(np.zeros((0, 0)), np.zeros(0), np.zeros(0), factor)


AT_ONCE = scaled(1.0)
"""A sensor that shows what is there."""


def lagging(constant: float) -> SensorDynamics:
    """First-order lag with a time constant, s; none at zero or below."""
    if constant <= 0.0:
        return AT_ONCE
    return SensorDynamics(np.array([[-1.0 / constant]]), np.array([1.0 / constant]), np.ones(1), 0.0)


def late(delay: float) -> SensorDynamics:
    """(12 - 6 ds + d^2 s^2)/(12 + 6 ds + d^2 s^2); a record that is early is taken for one at once."""
    if delay <= 0.0:
        return AT_ONCE
    return SensorDynamics(
        np.array([[-6.0 / delay, -12.0 / delay**2], [1.0, 0.0]]),
        np.array([1.0, 0.0]),
        np.array([-12.0 / delay, 0.0]),
        1.0,
    )


class SensorStates(NamedTuple):
    """The outputs' sensors from sample to sample, true signals being linear in between; M states in all.

    State m moves as s+ = `memory` s + `old` y + `new` y+, y the true output `source` (M,) before and y+ after; it
    begins at `steady` y. Record i is `read` (m, M) s + `direct` (m,) y_i, of m outputs.
    """

    memory: Array
    old: Array
    new: Array
    steady: Array
    source: NDArray[np.int64]
    read: Array
    direct: Array


def sensor_states(sensors: Iterable[tuple[int, SensorDynamics]], interval: float, outputs: int) -> SensorStates:
    """Of so many outputs, sampled every `interval` s; `sensors` gives each output's, from the motion to the record."""
    chains: dict[int, SensorDynamics] = {}
    for i, sensor in sensors:
        chains[i] = chains.get(i, AT_ONCE).then(sensor)
    from scipy.linalg import block_diag, expm  # late: files are read and refused without it

    direct = np.ones(outputs)
    blocks: list[Array] = []
    old: list[float] = []
    new: list[float] = []
    steady: list[float] = []
    source: list[int] = []
    read = np.zeros((outputs, sum(sensor.entry.size for sensor in chains.values())))
    for i, sensor in chains.items():
        size = sensor.entry.size
        direct[i] = sensor.direct
        if size == 0:
            continue
        # The signal and its slope beside the states: what they are at the end of an interval in which it is a ramp.
        ramp = np.zeros((size + 2, size + 2))
        ramp[:size, :size], ramp[:size, size] = sensor.memory * interval, sensor.entry * interval
        ramp[size, size + 1] = 1.0
        end = expm(ramp)
        read[i, len(source) : len(source) + size] = sensor.read
        blocks.append(end[:size, :size])
        old.extend(end[:size, size] - end[:size, size + 1])
        new.extend(end[:size, size + 1])
        steady.extend(-np.linalg.solve(sensor.memory, sensor.entry))
        source.extend([i] * size)
    return SensorStates(
        np.ascontiguousarray(block_diag(*blocks)) if blocks else np.zeros((0, 0)),
        np.array(old),
        np.array(new),
        np.array(steady),
        np.array(source, dtype=np.int64),
        read,
        direct,
    )


@cache
def no_sensor_states(outputs: int) -> SensorStates:
    """Sensors of so many outputs that show what is there."""
    return sensor_states((), 1.0, outputs)


@njit_inline
def read_row(outputs_x: Array, outputs_u: Array, i: int, sensors: SensorStates, row: Array, states: int) -> None:
    """Slopes of record i with respect to so many states, the input errors (E) and the sensors' states, into `row`."""
    extra = outputs_u.shape[1]
    for a in range(states):
        row[a] = sensors.direct[i] * outputs_x[i, a]
    for j in range(extra):
        row[states + j] = sensors.direct[i] * outputs_u[i, j]
    for m in range(sensors.source.shape[0]):
        row[states + extra + m] = sensors.read[i, m]
