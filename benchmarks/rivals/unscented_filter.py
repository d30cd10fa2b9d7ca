"""An unscented Kalman filter from filterpy that estimates states and derivatives together.

Given: the equations of motion (compiled), the sensors' deviations, the structure, the declared derivatives with half
their size as first deviation (one of 2 for those that are not declared). Derivatives are constant; the state's process
noise is what the elevator's noise does to it within a sample.
"""

from __future__ import annotations

import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from numpy.typing import NDArray

from benchmarks.rivals.equations import STATES, advance, observe
from benchmarks.rivals.task import SENSORS, Answer, Record, Task, table_of

Array = NDArray[np.float64]

SPREAD = 0.1
"""alpha of Merwe's sigma points: how far they lie from the mean."""


def unscented_filter(task: Task, record: Record) -> Answer:
    """Estimate."""
    free, body = task.structure, task.body
    begin = task.declared[free]
    size = STATES + begin.size
    interval = float(record.time[1] - record.time[0])

    def table(x: Array) -> Array:
        return table_of(x[STATES:], free, 0.0)

    def move(x: Array, dt: float, before: float, after: float) -> Array:
        return np.concatenate([advance(x[:STATES], before, after, dt, table(x), body), x[STATES:]])

    def look(x: Array, elevator: float) -> Array:
        return np.asarray(observe(x[:STATES], elevator, table(x), body))

    points = MerweScaledSigmaPoints(size, alpha=SPREAD, beta=2.0, kappa=3.0 - size)
    filtered = UnscentedKalmanFilter(size, task.deviations.size, interval, look, move, points)
    filtered.x = np.concatenate([record.start, begin])
    V, alpha, q, theta, _, _, h = task.deviations
    speed = float(np.hypot(record.start[0], record.start[1]))
    filtered.P = np.diag(np.concatenate([
        np.array([V, speed * alpha, q, theta, h]) ** 2 / 5.0,
        np.where(begin == 0.0, 2.0, 0.5 * np.abs(begin)) ** 2,
    ]))  # fmt: skip
    moved = [advance(record.start, delta, delta, interval, task.declared, body)
             for delta in record.elevator[0] + SENSORS["delta_e"] * np.array([1.0, -1.0])]  # fmt: skip
    push = 0.5 * (moved[0] - moved[1])
    filtered.Q = np.zeros((size, size))
    filtered.Q[:STATES, :STATES] = np.outer(push, push)
    filtered.R = np.diag(task.deviations**2)
    filtered.update(record.measured[0], elevator=record.elevator[0])
    for before, after, seen in zip(record.elevator[:-1], record.elevator[1:], record.measured[1:], strict=True):
        filtered.predict(before=before, after=after)
        filtered.update(seen, elevator=after)
    deviations = np.sqrt(np.diag(filtered.P))[STATES:]
    return Answer(table_of(filtered.x[STATES:], free, 0.0), table_of(deviations, free, np.nan), None)
