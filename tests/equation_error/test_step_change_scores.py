"""Score of a step change at every instant, against one dense regression for each."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.equation_error.regression.coloured_regression import colour_of
from aerosid.equation_error.selection.step_change_scores import step_change_scores


@pytest.mark.parametrize("ramp", [1.0, 3.4, 15.0])
@pytest.mark.parametrize("weights", [(1.0,), (1.0, -0.7), (1.0, -0.9, 0.3)], ids=str)
def test_scores_match_a_regression_with_the_step_as_additional_column(weights: tuple[float, ...], ramp: float) -> None:
    rng, count = np.random.default_rng(3), 120
    colour = colour_of(np.array(weights))
    time = np.arange(count)
    known = colour.whitened(np.column_stack([np.ones(count), np.sin(0.1 * time), rng.standard_normal(count)]))
    step = np.clip((time - 70) / ramp + 0.5, 0.0, 1.0)
    target = rng.standard_normal(count) + colour.whitened(30.0 * step[:, None])[:, 0]
    target -= known @ np.linalg.lstsq(known, target, rcond=None)[0]
    moments = np.arange(4, count - 4)
    found = step_change_scores(target, known, np.linalg.inv(known.T @ known), colour, ramp, moments)
    for moment, gain in zip(moments, found, strict=True):
        column = colour.whitened(np.clip((time - moment) / ramp + 0.5, 0.0, 1.0)[:, None])
        _, (rest,), *_ = np.linalg.lstsq(np.hstack([known, column]), target, rcond=None)
        assert gain == pytest.approx(target @ target - rest, rel=1e-8, abs=1e-9)
    assert abs(int(moments[np.argmax(found)]) - 70) <= 2
