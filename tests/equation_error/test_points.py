"""Residuals of the coefficient equations without columns against those of the stacked regression."""

import numpy as np
import pytest
from equations_decided import decided

from aerosid.effects.family import at_null
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor import sensor_delay
from aerosid.equation_error.regression.design import design_of
from aerosid.equation_error.regression.estimate import residual_of
from aerosid.equation_error.selection.candidates import joined
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown


@pytest.mark.parametrize("seconds", [0.0, 0.03])
def test_residuals_need_no_columns(seconds: float) -> None:
    body = BODIES[2]
    logs = [flown(name, body, 6000 + n, air=0.5, seconds=20.0) for n, name in enumerate(("one", "two"))]
    found = decided(aircraft_of(body, 0.08, np.random.default_rng(6)), logs[:1], logs[1:]).before
    late = Hypothesis("sensor_delay", "q", effects=(at_null(sensor_delay("q")),))
    point = joined(found.point, late)
    point = point.with_effects([point.effects[-1].beside(0, seconds)])
    design = design_of(found.frame.segments(point), found.frame.settings)
    values = np.random.default_rng(7).standard_normal(len(design.unknowns))
    assert ("gust", "C_m") in design.unknowns
    left = residual_of(found.frame, dict(zip(design.unknowns, values, strict=True)), point)
    np.testing.assert_allclose(left, design.target - design.columns @ values, atol=1e-11 * np.abs(left).max())
