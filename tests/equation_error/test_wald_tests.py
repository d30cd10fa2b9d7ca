"""t-ratios of effects with several parameters."""

import pytest

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor_position import sensor_place
from aerosid.effects.step_change import step_change
from aerosid.equation_error.selection.wald_tests import EffectEstimate


def estimated(active: ActiveEffect, errors: tuple[float, ...]) -> EffectEstimate:
    hypothesis = Hypothesis(active.effect.kind, active.effect.where, effects=(active,))
    return EffectEstimate(hypothesis, active, active.values[0], errors[0], errors, 20.0, "coefficients")


def test_a_step_change_is_as_significant_as_its_size_however_far_its_instant_moved() -> None:
    """On an approach to the stall a step of C_Z of -.089 +- .032 was named: its instant had moved by .3 +- .02 s."""
    moved = ActiveEffect(step_change("C_Z", 8.0, 0.02), (-0.089, 8.3), "flight")
    assert estimated(moved, (0.032, 0.02)).ratio == pytest.approx(0.089 / 0.032)


def test_of_a_displaced_sensor_the_most_significant_direction_counts() -> None:
    displaced = ActiveEffect(sensor_place("a_z", "xz"), (0.1, 0.9))
    assert estimated(displaced, (0.2, 0.3)).ratio == pytest.approx(3.0)
