"""Near 1 g the scale factor of a_z is nearly its bias: what a search began with does not decide between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import identified

from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.bias_or_scale import with_either_begun
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.penalties import effects_of
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown


def errors_of(seed: int, wrong: Wrong, air: float) -> InstrumentErrors:
    """The instrument errors of two flights in moving air, m/s."""
    body = BODIES[seed % len(BODIES)]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(seed))
    logs = [flown(name, body, 10 * seed + n, air=air, wrong=wrong) for n, name in enumerate("ab")]
    return identified(aircraft, logs[:1], logs[1:])


def numbers_of(found: SelectedStructure) -> dict[tuple[str, str], float]:
    """Kind, channel and value of what a structure holds."""
    return {
        (each.hypothesis.kind, each.hypothesis.where): effects_of(found.estimate.point, each.hypothesis)[0].values[0]
        for each in found.chosen
    }


@pytest.mark.parametrize(
    "seed", [78008, pytest.param(78025, marks=pytest.mark.slow), pytest.param(78030, marks=pytest.mark.slow)]
)
def test_a_scale_factor_of_an_accelerometer_is_no_bias_with_another_error_to_make_up_for_it(seed: int) -> None:
    """Named were a bias of a_z of 1.5 m/s^2 and a scale factor of the altitude of 1.18."""
    found = numbers_of(errors_of(seed, Wrong(scale={"a_z": 0.85, "q": 0.9}), air=0.5).selected)
    # Attitude is the integral of the rate: a scale factor of one is the inverse of the other's.
    ratio = found.pop(("sensor_scale", "q"), None) or 1.0 / found.pop(("sensor_scale", "theta"))
    assert ratio == pytest.approx(0.9, abs=0.01)
    assert found == {("sensor_scale", "a_z"): pytest.approx(0.85, abs=0.01)}


def test_a_search_is_begun_otherwise_only_where_the_other_kind_explains_about_as_much() -> None:
    errors = errors_of(78040, Wrong(scale={"a_z": 0.85, "theta": 0.9}), air=0.3)

    def step(before: SelectedStructure, kind: str, where: str, value: float) -> SelectedStructure:
        hypothesis = next(h for h in errors.hypotheses if (h.kind, h.where) == (kind, where))
        at_value = replace(hypothesis, effects=(replace(hypothesis.effects[0], values=(value,)),))
        point = with_hypothesis(before.estimate.point, at_value)
        entered = SelectedEffect(at_value, kinematic=True, gain=0.0)
        return SelectedStructure(estimate(before.estimate.problem, point), (*before.chosen, entered))

    none = SelectedStructure(errors.declared, ())
    begun: list[SelectedStructure] = []

    def search(start: SelectedStructure) -> SelectedStructure:
        begun.append(start)
        return start

    bias = step(none, "sensor_bias", "a_z", 1.4)
    both = step(bias, "sensor_scale", "h", 1.15)
    found = with_either_begun(both, [none, bias, both], errors.hypotheses, errors.criterion, search)
    assert numbers_of(found) == {("sensor_scale", "a_z"): pytest.approx(0.85, abs=0.01)}
    # What entered last too, whose replacements are ranked to first order alone.
    assert numbers_of(with_either_begun(bias, [none, bias], errors.hypotheses, errors.criterion, search)) == {
        ("sensor_scale", "a_z"): pytest.approx(0.85, abs=0.02)
    }
    # Not where the other kind explains nothing, such as a bias of attitude that has a slope.
    begun.clear()
    scale = step(none, "sensor_scale", "a_z", 0.85)
    assert with_either_begun(scale, [none, scale], errors.hypotheses, errors.criterion, search) is scale
    theta = step(none, "sensor_scale", "theta", 0.9)
    then = step(theta, "sensor_scale", "a_z", 0.85)
    assert with_either_begun(then, [none, theta, then], errors.hypotheses, errors.criterion, search) is then
    assert begun == []
