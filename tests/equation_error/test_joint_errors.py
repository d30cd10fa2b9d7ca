"""Instrument errors from kinematics and coefficients jointly, on planted flights in gusts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from equations_decided import decided, identified
from scipy.signal import lfilter

from aerosid.aircraft import load_aircraft
from aerosid.equation_error.decision import decide
from aerosid.equation_error.joint_selection import selected_jointly
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.joint_errors import kinematic_errors, with_errors_held
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written
from benchmarks.planted_aircraft import Body
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

SEEDS = 7000
"""Of tests; published tables and trials begin elsewhere."""


@pytest.mark.parametrize(
    ("body", "late"),
    [pytest.param(BODIES[0], 0.12, marks=pytest.mark.slow), (BODIES[4], 0.05)],
    ids=["single", "business jet"],
)
def test_the_joint_delay_of_a_vane_is_more_accurate_than_the_kinematic_one_in_gusts(body: Body, late: float) -> None:
    logs = [flown(name, body, SEEDS + n, air=0.6, wrong=Wrong(delay={"alpha": late})) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    errors = identified(aircraft, logs[:1], logs[1:])
    alone = float(np.sqrt(kinematic_errors(errors.selected.estimate).covariance[0, 0]))
    (row,) = decide(errors, aircraft.coefficients).findings
    assert (row.hypothesis.kind, row.source) == ("sensor_delay", "kinematics")
    assert abs(row.value - late) < 4.0 * row.std_error
    assert row.std_error < 0.5 * alone


def test_forces_distinguish_a_lag_from_a_delay() -> None:
    body = BODIES[5]
    logs = [flown(name, body, SEEDS + 20 + n, air=0.3) for n, name in enumerate("ab")]
    slow = [with_lagging_vane(log, 0.2) for log in logs]
    found = decided(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 20)), slow[:1], slow[1:])
    row = found.findings[0]
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_lag", "alpha")
    assert abs(row.value - 0.2) < 4.0 * row.std_error


def with_lagging_vane(log: FlightLog, constant: float) -> FlightLog:
    """The log with its vane behind a first-order lag, bilinear."""
    a = 0.5 * float(log.time[1] - log.time[0]) / constant
    alpha = log["alpha"]
    late = alpha[0] + lfilter([a / (1 + a), a / (1 + a)], [1.0, -(1 - a) / (1 + a)], alpha - alpha[0])
    return replace(log, channels={**log.channels, "alpha": late})


def test_a_vane_delay_hidden_by_gusts_is_identified_jointly() -> None:
    body = BODIES[1]
    logs = [
        flown(name, body, SEEDS + 40 + n, air=0.6, wrong=Wrong(delay={"alpha": 0.12})) for n, name in enumerate("ab")
    ]
    found = decided(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 40)), logs[:1], logs[1:])
    (row,) = found.findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_delay", "alpha")
    assert abs(row.value - 0.12) < 4.0 * row.std_error


def test_a_low_pitot_tube_is_distinguished_from_a_high_accelerometer() -> None:
    body = BODIES[2]
    logs = [flown(name, body, SEEDS + 60 + n, air=0.0) for n, name in enumerate("ab")]
    low = [replace(log, channels={**log.channels, "V": log["V"] + 1.5 * log["q"]}) for log in logs]
    found = decided(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 60)), low[:1], low[1:])
    (row,) = found.findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_position", "V")
    assert abs(row.value - 1.5) < 4.0 * row.std_error
    assert ("sensor_position", "a_x") in {
        (other.hypothesis.kind, other.hypothesis.where) for other in found.alternatives
    }


@pytest.mark.slow
def test_a_residual_error_of_a_lag_is_eliminated_when_a_delay_replaces_it(tmp_path: Path) -> None:
    """Kinematics alone take the pitot's delay for a lag, and the remainder for another one of a_x."""
    _, (plant,), _ = written(tmp_path, [FIRST, 5, 34], 34)
    assert plant.label == "delay V 0.615"
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    (row,) = decided(load_aircraft(str(tmp_path / "aircraft.toml")), logs[:1], logs[1:]).findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_delay", "V")
    assert abs(row.value - 0.615) < 3.0 * row.std_error


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_the_coefficients_refute_a_delay_that_the_vane_does_not_have_and_no_other(late: float) -> None:
    """Whatever kinematics say, lift tells from the same gusts and the same motion whether the vane is late."""
    body = BODIES[0]
    wrong = Wrong(delay={"alpha": late}) if late else NOTHING
    logs = [flown(name, body, SEEDS + 60 + n, air=0.6, wrong=wrong, seconds=24.0) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 60))
    errors = identified(aircraft, logs[:1], logs[1:])
    search = selected_jointly(errors, errors.selected, aircraft.coefficients, DeclaredValues({}, 0.0, 0.0)).search
    whole = replace(search.fitted, all_fitted=True)
    (delay,) = [h.effects[0] for h in errors.hypotheses if (h.kind, h.where) == ("sensor_delay", "alpha")]
    on_time = estimate(whole, errors.start)
    delayed = estimate(whole, with_errors_held(errors.start, (replace(delay, values=(0.3,)),)))
    assert search.refutes(on_time, delayed, penalty=12.0) is (late == 0.0)
    assert not search.refutes(delayed, delayed, penalty=12.0)
    # The unseen flight by itself: heard against what was hardly proven, and not against any proof.
    assert search.is_outvoted(on_time, delayed, proven=1.0) is (late == 0.0)
    assert not search.is_outvoted(on_time, delayed, proven=1e4)
    assert not search.is_outvoted(delayed, delayed, proven=0.0)
