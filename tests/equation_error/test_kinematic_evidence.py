"""Sensor faults that neither kinematics nor coefficients prove alone, on planted flights in gusts."""

from pathlib import Path

import numpy as np
import pytest
from equations_decided import proved
from scipy.stats import chi2

from aerosid.aircraft import load_aircraft
from aerosid.equation_error.decision import decide
from aerosid.equation_error.selection.candidates import is_instrument_error
from aerosid.equation_error.selection.kinematic_evidence import kinematic_evidence
from aerosid.equation_error.selection.penalties import KinematicEvidence
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7400
"""Of tests; published tables and trials begin elsewhere."""


def test_support_is_a_parabola_about_its_own_number() -> None:
    support = KinematicEvidence((0.2,), np.array([[0.05**2]]), gain=7.0, credit=7.0)
    assert support.gain_at((0.2,)) == 7.0
    # One number: the likelihood's fall is half of chi-square.
    fall = 2.0 * (support.gain - support.gain_at((0.2 + 1.96 * 0.05,)))
    assert chi2(1).sf(fall) == pytest.approx(0.05, abs=1e-3)
    assert support.agrees((0.34,), 3.0)
    assert not support.agrees((0.36,), 3.0)


def test_a_pitot_bias_that_gusts_hide_from_kinematics_is_named_where_forces_show_the_same() -> None:
    """The aircraft slows down: forces at a wrong dynamic pressure look like terms in the airspeed."""
    body = BODIES[0]
    bias = -0.08 * body.airspeed
    wrong = Wrong(bias={"V": bias}, terms={("C_X", "1"): -0.02})
    logs = [flown(name, body, SEEDS + n, air=0.5, wrong=wrong, seconds=45.0) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    faults = proved(aircraft, logs[:1], logs[1:])
    assert not faults.selected.chosen
    sensors = [hypothesis for hypothesis in faults.hypotheses if is_instrument_error(hypothesis)]
    assert ("sensor_bias", "V", "") in kinematic_evidence(faults.selected, sensors)
    (row,) = decide(faults, aircraft.coefficients).findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_bias", "V")
    assert abs(row.value - bias) < 4.0 * row.std_error


def test_a_pitot_bias_of_which_kinematics_say_nothing_is_asked_of_all_forces(tmp_path: Path) -> None:
    """A glider's 1.66 m/s in gusts: with two terms of airspeed in its place C_m_delta_e is 30 deviations off."""
    written(tmp_path, [FIRST, 141, 4], 4)
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    aircraft = load_aircraft(tmp_path / "aircraft.toml")
    faults = proved(aircraft, logs[:1], logs[1:])
    sensors = [hypothesis for hypothesis in faults.hypotheses if is_instrument_error(hypothesis)]
    shown = kinematic_evidence(faults.selected, sensors)["sensor_bias", "V", ""]
    assert shown.gain < faults.selected.estimate.problem.settings.support
    (row,) = decide(faults, aircraft.coefficients).findings
    assert row.hypothesis.label == ("sensor_bias", "V", "")
    assert abs(row.value - 1.66) < 3.0 * row.std_error
