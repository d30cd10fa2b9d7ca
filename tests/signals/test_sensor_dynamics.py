"""Sensors with a memory: sampled states against the operators that simulated outputs go through."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from aerosid.signals.delay_and_lag import delayed, lagged
from aerosid.signals.sensor_dynamics import SensorDynamics, lagging, late, scaled, sensor_states

Array = NDArray[np.float64]
TIME = 0.05 * np.arange(400)
SIGNAL = np.sin(1.5 * TIME) + 0.4 * np.cos(4.0 * TIME)


def record(sensors: list[tuple[int, SensorDynamics]], signal: Array) -> Array:
    """Output 1 step by step through the sampled states."""
    states = sensor_states(sensors, 0.05, 8)
    s = states.steady * signal[0]
    shown = [states.read[1] @ s + states.direct[1] * signal[0]]
    for before, after in pairwise(signal):
        s = states.memory @ s + states.old * before + states.new * after
        shown.append(states.read[1] @ s + states.direct[1] * after)
    return np.array(shown)


@pytest.mark.parametrize("constant", [0.01, 0.2, 3.0])
def test_a_lag_is_the_operator_that_outputs_go_through(constant: float) -> None:
    assert_allclose(record([(1, lagging(constant))], SIGNAL), lagged(TIME, SIGNAL[:, None], constant)[:, 0], atol=1e-12)


@pytest.mark.parametrize("delay", [0.02, 0.13, 0.4])
def test_a_delay_is_late_by_as_much(delay: float) -> None:
    """Pade of second order errs by (phase)^5/720; a sine taken for ramps between samples by (omega dt)^2/8."""
    shown, wanted = record([(1, late(delay))], SIGNAL), delayed(TIME, SIGNAL[:, None], delay)[:, 0]
    assert_allclose(shown[60:], wanted[60:], atol=0.4 * (4.0 * delay) ** 5 / 720.0 + 2.8e-3)


def test_faults_of_one_sensor_act_one_after_the_other() -> None:
    both = record([(1, lagging(0.3)), (1, scaled(1.2)), (1, lagging(0.1))], SIGNAL)
    assert_allclose(both, 1.2 * lagged(TIME, lagged(TIME, SIGNAL[:, None], 0.3), 0.1)[:, 0], atol=2e-3)
    assert_allclose(record([(1, scaled(1.2)), (4, lagging(0.3))], SIGNAL), 1.2 * SIGNAL, atol=1e-12)


def test_an_early_or_quick_sensor_has_no_states() -> None:
    states = sensor_states([(1, late(-0.1)), (2, lagging(0.0)), (3, scaled(2.0))], 0.05, 8)
    assert states.source.size == 0
    assert states.direct.tolist() == [1.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0]
