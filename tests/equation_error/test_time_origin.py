"""Several channels early by one time are identified as others that are late, where that takes fewer errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from equations_decided import identified

from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.regression.related_problems import coefficients_of_all
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.instrument_error_choice import CoefficientCheck
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.penalties import SelectionCriterion, criterion_for, effects_of
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, penalised_likelihood
from aerosid.equation_error.selection.time_origin import with_other_time_origin
from aerosid.logs.flight_log import FlightLog
from benchmarks import six_axis_flights as lateral
from benchmarks.planted_aircraft import Body
from benchmarks.sideways_plants import SidePlant
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

LATE = 0.15
"""Planted time delay or lead of the channels, s."""

BODY = BODIES[0]


def delayed(log: FlightLog, channels: Sequence[str], delay: float) -> FlightLog:
    """The log with some channels delayed, by linear interpolation between samples."""
    moved = {c: np.interp(log.time - delay, log.time, log[c]) for c in channels}
    return replace(log, channels={**log.channels, **moved})


def early(errors: InstrumentErrors, channels: Sequence[str]) -> tuple[SelectedStructure, SelectionCriterion]:
    """A structure in which the delays of some channels are free, starting early."""
    estimated, point, chosen = errors.declared, errors.declared.point, []
    for hypothesis in errors.hypotheses:
        if hypothesis.kind == "sensor_delay" and hypothesis.where in channels:
            (active,) = hypothesis.effects
            point = with_hypothesis(point, replace(hypothesis, effects=(replace(active, values=(-LATE,)),)))
            chosen.append(SelectedEffect(hypothesis, kinematic=True, gain=0.0))
    criterion = criterion_for(errors.hypotheses, estimated.design.target.size, 0.01, 0.3)
    return SelectedStructure(estimate(estimated.problem, point), tuple(chosen)), criterion


def found_delays(
    errors: InstrumentErrors, initial: SelectedStructure, criterion: SelectionCriterion
) -> dict[tuple[str, str], float]:
    """Kind, channel and value of the selected delays after the other origin was tried."""
    sensors = [h for h in errors.hypotheses if h.kind in ("sensor_delay", "sensor_lag")]
    problem = coefficients_of_all(
        errors.declared.problem.recordings, errors.declared.problem.settings, errors.start.model
    )
    check = CoefficientCheck(problem, errors.start)
    found = with_other_time_origin(initial, initial, sensors, criterion, lambda _found, _hypothesis: True, check)
    assert penalised_likelihood(found, criterion) >= penalised_likelihood(initial, criterion)
    numbers = {}
    for each in found.chosen:
        (active,) = effects_of(found.estimate.point, each.hypothesis)
        numbers[each.hypothesis.kind, each.hypothesis.where] = active.values[0]
    return numbers


def test_one_late_vane_is_preferred_to_three_early_sensors() -> None:
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(8400))
    log = delayed(flown("one", BODY, 8401, air=0.2, seconds=24.0), ["alpha"], LATE)
    errors = identified(aircraft, [log], [])
    initial, criterion = early(errors, ["q", "theta", "a_z"])
    assert len(initial.chosen) == 3
    assert found_delays(errors, initial, criterion) == {("sensor_delay", "alpha"): pytest.approx(LATE, abs=0.03)}


def test_a_single_early_channel_remains_early() -> None:
    aircraft = aircraft_of(BODY, 0.08, np.random.default_rng(8410))
    log = delayed(flown("one", BODY, 8411, air=0.2, seconds=24.0), ["a_z"], -LATE)
    errors = identified(aircraft, [log], [])
    initial, criterion = early(errors, ["a_z"])
    assert found_delays(errors, initial, criterion) == {("sensor_delay", "a_z"): pytest.approx(-LATE, abs=0.03)}


def selected_delays(errors: InstrumentErrors) -> dict[tuple[str, str], float]:
    """Kind, channel and value of everything that kinematics identify."""
    found = errors.selected
    return {
        each.hypothesis.label[:2]: effects_of(found.estimate.point, each.hypothesis)[0].values[0]
        for each in found.chosen
    }


@pytest.mark.parametrize(("body", "seed"), [(BODIES[6], 8460), (BODIES[7], 8470)])
def test_two_channels_of_one_late_bus_are_late_and_the_rate_is_not_early(body: Body, seed: int) -> None:
    """The early rate is one error in place of two, by kinematics; but then the elevator would be late as well."""
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(seed))
    logs = [delayed(flown(name, body, seed + n, air=0.3), ["theta", "alpha"], 0.08) for n, name in enumerate("ab")]
    found = selected_delays(identified(aircraft, logs[:1], logs[1:]))
    late = pytest.approx(0.08, abs=0.03)
    assert found == {("sensor_delay", "theta"): late, ("sensor_delay", "alpha"): late}


@pytest.mark.parametrize(("body", "seed"), [(BODIES[3], 8480), pytest.param(BODIES[5], 8490, marks=pytest.mark.slow)])
def test_where_all_but_the_inertial_channels_are_late_these_are_not_early(body: Body, seed: int) -> None:
    """An early rate and acceleration are two errors in place of four; the elevator would then be late as well."""
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(seed))
    late = ["theta", "alpha", "V", "h"]
    logs = [delayed(flown(name, body, seed + n, air=0.1), late, 0.06) for n, name in enumerate("ab")]
    found = selected_delays(identified(aircraft, logs[:1], logs[1:]))
    assert {("sensor_delay", "theta"), ("sensor_delay", "alpha")} <= found.keys()
    assert {where for _, where in found} <= set(late)
    assert list(found.values()) == pytest.approx([0.06] * len(found), abs=0.015)


def test_rates_to_whose_lead_the_coefficients_object_are_on_time_beside_others_that_are_late() -> None:
    """In lateral motion the coefficients are asked before an error enters, and refused the lead of p and of r."""
    body, seed = next(each for each in lateral.BODIES if each.name == "survey drone"), 8450
    at = lateral.Circumstances(body, 0.04, 30.0, gust=0.005 * body.airspeed, memory=0.3, off=0.06)
    nothing = SidePlant("")
    aircraft = lateral.aircraft_of(at, nothing, "lateral", np.random.default_rng(seed))
    logs = [delayed(lateral.flown(name, at, nothing, seed + n), ["phi", "beta"], LATE) for n, name in enumerate("ab")]
    found = selected_delays(identified(aircraft, logs[:1], logs[1:]))
    late = pytest.approx(LATE, abs=0.03)
    assert found == {("sensor_delay", "phi"): late, ("sensor_delay", "beta"): late}
