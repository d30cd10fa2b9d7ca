"""The autocorrelations as drawn: whiteness must be readable from the band."""

from __future__ import annotations

import numpy as np
from problems_report import closed_loop

from aerosid.reporting.figures.autocorrelations import autocorrelations
from aerosid.reporting.figures.chart import Band, Line


def test_the_completed_models_residual_is_white_and_the_declared_ones_is_not() -> None:
    """In the simulated flights `after` leaves only noise and `before` a wrong frequency, in every affected channel."""
    result = closed_loop()
    log = result.simulated[0].log
    chart = autocorrelations([row for row in result.fit if row.log == log.name], log.samples)
    assert len(chart.panels) == len(result.simulated[0].measured)
    for panel in chart.panels:
        band = next(mark for mark in panel.marks if isinstance(mark, Band))
        assert band.high == -band.low == 1.96 / np.sqrt(log.samples)
        lines = {mark.role: mark for mark in panel.marks if isinstance(mark, Line)}
        assert lines["after"].y[0] == 1.0
        assert np.mean(np.abs(lines["after"].y[1:]) <= band.high) > 0.75
        assert lines["after"].x.tolist() == list(range(lines["after"].y.size))
    theta = next(panel for panel in chart.panels if panel.y.label == "θ")
    before = next(mark for mark in theta.marks if isinstance(mark, Line) and mark.role == "before")
    assert before.y[1] > 3.0 * band.high
