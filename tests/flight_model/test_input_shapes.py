"""Inputs to be flown: they hold their rate and amplitude, leave from trim and return to it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aerosid.flight_model.input_shapes import Multisine, Steps, neighbours, patterns

LEVELS = st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=6)
STEP = 0.01
FINE = np.arange(0.0, 22.0, STEP)
BEGIN = 100  # sample of the first step


@settings(max_examples=40, deadline=None)
@given(levels=LEVELS, base=st.integers(20, 300), amplitude=st.floats(0.005, 0.3), rate=st.floats(0.02, 2.0))
def test_steps_follow_the_commanded_levels_at_a_limited_rate(
    levels: list[float], base: int, amplitude: float, rate: float
) -> None:
    # Levels of whole samples: where a level began between two, the sampled surface would be late by a part of a
    # sample at every one of them, which adds up over triangles.
    shape = Steps("any", (base * STEP,) * len(levels), tuple(levels))
    flown = shape.deflection(FINE, BEGIN * STEP, amplitude, rate)
    command = np.zeros_like(FINE)
    for place, level in enumerate(levels):
        command[BEGIN + place * base : BEGIN + (place + 1) * base] = level * amplitude
    # A surface that follows its command sample by sample, no faster than the rate.
    surface, value = np.zeros_like(FINE), 0.0
    for k in range(1, FINE.size):
        value += float(np.clip(command[k - 1] - value, -STEP * rate, STEP * rate))
        surface[k] = value
    assert flown == pytest.approx(surface, abs=1e-9)
    assert np.max(np.abs(np.diff(flown))) <= STEP * rate * (1.0 + 1e-9)


def test_steps_are_exact_at_their_corners() -> None:
    shape = Steps("doublet", (1.0, 1.0), (1.0, -1.0))
    times, values = shape.corners(2.0, 0.1, 0.5)
    assert times == pytest.approx([2.0, 2.2, 3.0, 3.4, 4.0, 4.2])
    assert values == pytest.approx([0.0, 0.1, 0.1, -0.1, -0.1, 0.0])


@pytest.mark.parametrize("harmonics", [(1,), (1, 2, 3, 4), tuple(range(1, 9))])
@pytest.mark.parametrize("rate", [0.05, 10.0])
def test_a_multisine_begins_and_ends_at_trim_within_its_limits(harmonics: tuple[int, ...], rate: float) -> None:
    shape = Multisine("multisine", 10.0, harmonics)
    time = np.arange(0.0, 14.0, 0.001)
    flown = shape.deflection(time, 1.0, 0.08, rate)
    assert np.max(np.abs(np.diff(flown))) <= 0.001 * rate * (1.0 + 1e-3)
    assert np.max(np.abs(flown)) <= 0.08 * (1.0 + 1e-5)  # the peak is sought on 4001 points of a period
    assert rate < 1.0 or np.max(np.abs(flown)) == pytest.approx(0.08, rel=1e-4)
    assert np.all(flown[time < 1.0] == 0.0)
    assert abs(np.interp(11.0, time, flown)) < 1e-4 * 0.08
    # Equal power in the harmonics, none elsewhere.
    period = shape.deflection(1.0 + np.arange(1000) * 0.01, 1.0, 0.08, rate)
    spectrum = np.abs(np.fft.rfft(period)) ** 2
    share = spectrum[list(harmonics)] / spectrum[1:].sum()
    assert share == pytest.approx(np.full(len(harmonics), 1.0 / len(harmonics)), rel=1e-3)


def test_patterns_are_not_longer_than_asked_and_stand_both_ways_round() -> None:
    shapes = patterns((0.5, 2.0), 7.0)
    assert all(shape.duration <= 7.0 + 1e-9 for shape in shapes)
    steps = [shape for shape in shapes if isinstance(shape, Steps)]
    assert {shape.mirrored() for shape in steps} == set(steps)
    assert {"doublet", "2-1-1", "3-2-1-1"} <= {shape.name for shape in steps}
    assert any(isinstance(shape, Multisine) for shape in shapes)


@given(levels=LEVELS, base=st.integers(2, 30))
def test_neighbours_differ_in_one_number_that_a_pilot_can_set(levels: list[float], base: int) -> None:
    shape = Steps("any", (base / 10,) * len(levels), tuple(round(20 * level) / 20 for level in levels))
    for other in neighbours(shape, 1.4, 0.3, 20.0):
        assert isinstance(other, Steps)
        changed = [a != b for a, b in zip(shape.durations + shape.levels, other.durations + other.levels, strict=True)]
        assert sum(changed) == 1
        assert all(round(10 * d) / 10 == pytest.approx(d) and d >= 0.2 for d in other.durations)
        assert all(abs(level) <= 1.0 for level in other.levels)
