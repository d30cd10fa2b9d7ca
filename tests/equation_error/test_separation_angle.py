"""The angle at which the flow separates says whether it does: what only lags stands for something else."""

import pytest

from aerosid.effects import ActiveEffect
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.selection.wald_tests import EffectEstimate


def estimated(angle_error: float) -> EffectEstimate:
    """A separation whose lag is known to a quarter of itself."""
    active = ActiveEffect(flow_separation(0.12, "C_Z", ()), (0.092, 3.7, 0.4, 0.26), "")
    hypothesis = Hypothesis("flow_separation", "C_Z", effects=(active,))
    errors = (angle_error, 3.0, 0.8, 0.065)
    return EffectEstimate(hypothesis, active, 0.092, angle_error, errors, 300.0, "coefficients")


def test_a_lag_alone_makes_no_separation_significant() -> None:
    """A glider in gusts whose vane lagged by .1 s was given one that began at .092 +- .115 rad."""
    assert estimated(0.115).ratio == pytest.approx(0.8)
    assert estimated(0.0092).ratio == pytest.approx(10.0)
