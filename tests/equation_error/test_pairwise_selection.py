"""Errors that mask each other: neither is significant alone, both are together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import identified

from aerosid.equation_error.selection.candidates import is_instrument_error
from aerosid.equation_error.selection.penalties import criterion_for, effects_of
from aerosid.equation_error.selection.stepwise import forward_selection
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.logs.flight_log import FlightLog
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

LATE = 0.004
"""Time delay of q, s."""


def late_gyro(log: FlightLog) -> FlightLog:
    """The log with q delayed, by linear interpolation between samples."""
    return replace(log, channels={**log.channels, "q": np.interp(log.time - LATE, log.time, log["q"])})


@pytest.mark.parametrize(("place", "scale"), [(3, 0.990), pytest.param(9, 0.994, marks=pytest.mark.slow)])
def test_an_attitude_scale_factor_and_a_gyro_delay_are_found_as_a_pair(place: int, scale: float) -> None:
    body = BODIES[place % len(BODIES)]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(9000 + place))
    wrong = Wrong(scale={"theta": scale})
    logs = [late_gyro(flown(n, body, 9100 + 10 * place + i, air=0.5, wrong=wrong)) for i, n in enumerate("ab")]
    errors = identified(aircraft, logs[:1], logs[1:])
    found, base = errors.selected, errors.declared

    numbers = {
        each.hypothesis.label[:2]: effects_of(found.estimate.point, each.hypothesis)[0].values[0]
        for each in found.chosen
    }
    # Attitude is the integral of the rate: a scale factor of one is the inverse of the other's.
    ratio = numbers.pop(("sensor_scale", "q"), None) or 1.0 / numbers.pop(("sensor_scale", "theta"))
    assert ratio == pytest.approx(1.0 / scale, abs=0.003)
    assert numbers == {("sensor_delay", "q"): pytest.approx(LATE, abs=0.002)}

    settings = base.problem.settings
    criterion = criterion_for(errors.hypotheses, base.design.target.size, settings.false_alarm, settings.factor_odds)
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    *_, alone = forward_selection(SelectedStructure(base, ()), criterion, sensors, kinematic=True, most=settings.most)
    assert alone.chosen == ()
