"""Instrument errors that neither kinematics nor coefficients identify alone, on planted flights in gusts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from equations_decided import identified, terms_lie_within
from problems import with_channels
from scipy.stats import chi2

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor import sensor_bias
from aerosid.equation_error.decision import decide
from aerosid.equation_error.selection.candidates import is_instrument_error, with_plausible_limits
from aerosid.equation_error.selection.kinematic_evidence import kinematic_evidence
from aerosid.equation_error.selection.penalties import KinematicEvidence
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks import six_axis_flights
from benchmarks.field_detection import FIRST, written
from benchmarks.plants import sensed_lagging
from benchmarks.sideways_detection import GUST, planted
from benchmarks.sideways_plants import SidePlant, catalogue
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEEDS = 7400
"""Of tests; published tables and trials begin elsewhere."""

JET = next(each for each in six_axis_flights.BODIES if each.name == "regional jet")


def test_the_gain_is_quadratic_about_the_kinematic_estimate() -> None:
    support = KinematicEvidence((0.2,), np.array([[0.05**2]]), gain=7.0, credit=7.0)
    assert support.gain_at((0.2,)) == 7.0
    # One parameter: the fall of ln L is half of chi-square.
    fall = 2.0 * (support.gain - support.gain_at((0.2 + 1.96 * 0.05,)))
    assert chi2(1).sf(fall) == pytest.approx(0.05, abs=1e-3)
    assert support.agrees((0.34,), 3.0)
    assert not support.agrees((0.36,), 3.0)


@pytest.mark.slow
def test_a_pitot_bias_hidden_by_gusts_is_identified_jointly() -> None:
    """The aircraft slows down: forces at a wrong dynamic pressure look like terms in the airspeed."""
    body = BODIES[0]
    bias = -0.08 * body.airspeed
    wrong = Wrong(bias={"V": bias}, terms={("C_X", "1"): -0.02})
    logs = [flown(name, body, SEEDS + n, air=0.5, wrong=wrong, seconds=45.0) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    errors = identified(aircraft, logs[:1], logs[1:])
    assert not errors.selected.chosen
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    assert ("sensor_bias", "V", "") in kinematic_evidence(errors.selected, sensors)
    (row,) = decide(errors, aircraft.coefficients).findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_bias", "V")
    assert abs(row.value - bias) < 4.0 * row.std_error


def test_a_pitot_bias_without_kinematic_evidence_is_identified_by_the_forces(tmp_path: Path) -> None:
    """A glider's 1.66 m/s in gusts: with two terms of airspeed in its place C_m_delta_e is 30 standard errors off."""
    written(tmp_path, [FIRST, 141, 4], 4)
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    aircraft = load_aircraft(tmp_path / "aircraft.toml")
    errors = identified(aircraft, logs[:1], logs[1:])
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    shown = kinematic_evidence(errors.selected, sensors)["sensor_bias", "V", ""]
    assert shown.gain < errors.selected.estimate.problem.settings.support
    (row,) = decide(errors, aircraft.coefficients).findings
    assert row.hypothesis.label == ("sensor_bias", "V", "")
    assert abs(row.value - 1.66) < 3.0 * row.std_error


def test_a_longitudinal_accelerometer_below_its_place_is_no_displaced_centre_of_gravity() -> None:
    """In gusts kinematics hide it; the centre of gravity, which moves the moment too, is at most its alternative."""
    body, below = BODIES[3], 0.3
    logs = [flown(name, body, SEEDS + 60 + n, air=0.5, seconds=30.0) for n, name in enumerate("ab")]
    logs = [with_channels(log, a_x=log["a_x"] + below * np.gradient(log["q"], log.time)) for log in logs]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    errors = identified(aircraft, logs[:1], logs[1:])
    assert not errors.selected.chosen
    (row,) = decide(errors, aircraft.coefficients).findings
    assert row.hypothesis.label == ("sensor_position", "a_x", "")
    assert row.value == pytest.approx(below, abs=3.0 * row.std_error)


def test_a_lateral_accelerometer_beside_its_place_is_no_term_of_the_side_force() -> None:
    """On a jet in gusts its path hides it; C_Y was given beta*p_hat -5.4 +- 1.0, which the aircraft has not."""
    labels = [plant.label for plant in catalogue(1.0, 1.0, 20.0, 10.0)]
    at, plant, first = planted(labels.index("position a_y to the right"), SEEDS + 37, GUST)
    generator = np.random.default_rng(first)
    fitted, unseen = (six_axis_flights.flown(name, at, plant, first + n) for n, name in enumerate("ab"))
    aircraft = six_axis_flights.aircraft_of(at, plant, "lateral", generator)
    errors = identified(aircraft, [fitted], [unseen])
    assert not errors.selected.chosen
    (row,) = decide(errors, aircraft.coefficients).findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_position", "a_y")
    assert row.value == pytest.approx(plant.positions["a_y"][1], abs=3.0 * row.std_error)


def test_a_lateral_accelerometer_ahead_of_its_place_and_below_is_no_term_of_the_side_force() -> None:
    """Along one axis alone it explains too little on a jet in gusts: C_Y was given delta_a, .14 +- .002."""
    seed, place = SEEDS + 90, (0.08 * JET.span, 0.0, 0.03 * JET.span)
    at = six_axis_flights.Circumstances(JET, 0.04, 30.0, gust=0.005 * JET.airspeed, memory=0.3, off=0.06)
    plant = SidePlant("", positions={"a_y": place})
    aircraft = six_axis_flights.aircraft_of(at, plant, "lateral", np.random.default_rng(seed))
    fitted, unseen = (six_axis_flights.flown(name, at, plant, seed + n) for n, name in enumerate("ab"))
    (row,) = decide(identified(aircraft, [fitted], [unseen]), aircraft.coefficients).findings
    assert row.hypothesis.label == ("sensor_position", "a_y", "")
    assert [effect.effect.axes for effect in row.hypothesis.effects] == ["xz"]
    assert row.value == pytest.approx(place[0], abs=3.0 * row.std_error)


def test_without_a_normal_accelerometer_kinematics_tell_nothing_of_the_height_of_the_axial_one() -> None:
    """No equation holds it: any value agrees, and none gains."""
    body = BODIES[1]
    logs = [flown(name, body, SEEDS + 60 + n, air=0.3) for n, name in enumerate("ab")]
    logs = [replace(log, channels={k: v for k, v in log.channels.items() if k != "a_z"}) for log in logs]
    errors = identified(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 60)), logs[:1], logs[1:])
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    evidence = kinematic_evidence(errors.selected, sensors)
    (row,) = [each for name, each in evidence.items() if name[:2] == ("sensor_position", "a_x")]
    assert row.is_uninformative
    assert row.agrees((-0.7,), 3.0)
    assert row.gain_at((-0.7,)) == 0.0


def test_a_vane_that_is_compared_with_nothing_is_not_told_to_be_late() -> None:
    """Gusts at it show its delay where the accelerometers feel them; forces from its own rate do not."""
    body = BODIES[1]
    logs = [without_accelerometers(flown(name, body, SEEDS + 70 + n, air=0.5), 0.0) for n, name in enumerate("ab")]
    errors = identified(aircraft_of(body, 0.08, np.random.default_rng(SEEDS + 70)), logs[:1], logs[1:])
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    evidence = kinematic_evidence(errors.selected, sensors)
    assert not [name for name in evidence if name[:2] in (("sensor_delay", "alpha"), ("sensor_lag", "alpha"))]


@pytest.mark.parametrize("late", [0.3, 0.0])
def test_without_accelerometers_a_late_airspeed_is_shown_by_the_axial_force(late: float) -> None:
    """In its place C_X had a term in V_hat or q_hat, with derivatives up to twelve standard errors off."""
    body, seed = BODIES[1], SEEDS + 80
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(seed))
    logs = [without_accelerometers(flown(name, body, seed + n, air=0.0), late) for n, name in enumerate("ab")]
    found = decide(identified(aircraft, logs[:1], logs[1:]), aircraft.coefficients).findings
    assert [(row.hypothesis.kind, row.hypothesis.where) for row in found] == [("sensor_delay", "V")] * (late > 0.0)
    assert all(row.value == pytest.approx(late, abs=0.05) for row in found)


def without_accelerometers(log: FlightLog, late: float) -> FlightLog:
    """The log without them, its airspeed late [s]."""
    airspeed = np.interp(log.time - late, log.time, log["V"])
    channels = {name: values for name, values in log.channels.items() if name not in ("a_x", "a_z")}
    units = {name: unit for name, unit in log.units.items() if name in channels}
    return replace(log, channels=channels | {"V": airspeed}, units=units)


@pytest.mark.parametrize(("airspeed", "most"), [(17.0, 2.55), (100.0, 8.0)])
def test_a_bias_of_the_airspeed_is_at_most_a_part_of_it(airspeed: float, most: float) -> None:
    bias = ActiveEffect(sensor_bias("V", "m/s", 0.1), (0.0,))
    hypothesis = with_plausible_limits(Hypothesis("sensor_bias", "V", "", (), (bias,)), 0.3, airspeed)
    (parameter,) = hypothesis.effects[0].effect.parameters
    assert (parameter.lowest, parameter.highest) == (pytest.approx(-most), pytest.approx(most))


@pytest.mark.parametrize("kind", ["lag", pytest.param("delay", marks=pytest.mark.slow)])
def test_a_late_longitudinal_accelerometer_is_no_term_of_the_pitch_rate(kind: str) -> None:
    """C_X q_hat was named in its place on forty of forty-eight pairs."""
    body, late = BODIES[2], 0.08
    wrong = Wrong(**{kind: {"a_x": late}})  # type: ignore[arg-type]
    logs = [flown(name, body, SEEDS + 110 + n, air=0.5, wrong=wrong) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    errors = identified(aircraft, logs[:1], logs[1:])
    assert not errors.selected.chosen
    (row,) = decide(errors, aircraft.coefficients).findings
    assert (row.hypothesis.kind, row.hypothesis.where) == (f"sensor_{kind}", "a_x")
    assert row.value == pytest.approx(late, abs=3.0 * row.std_error)


@pytest.mark.parametrize("value", [-1.5, pytest.param(1.5, marks=pytest.mark.slow)])
def test_a_term_of_the_pitch_rate_is_no_late_accelerometer(value: float) -> None:
    """To first order in calm air they are one; gusts turn the force and not the rate."""
    body, wrong = BODIES[2], Wrong(terms={("C_X", "q_hat"): value})
    logs = [flown(name, body, SEEDS + 120 + n, air=0.5, wrong=wrong) for n, name in enumerate("ab")]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS))
    (row,) = decide(identified(aircraft, logs[:1], logs[1:]), aircraft.coefficients).findings
    assert row.hypothesis.label == ("aero_term", "C_X", "q_hat")


def late_side_force(late: float, seed: int, gust: float) -> tuple[Aircraft, list[FlightLog]]:
    """A jet and two flights, its lateral accelerometer with a lag, s; `gust` over the airspeed, 1."""
    at = six_axis_flights.Circumstances(JET, 0.04, 30.0, gust=gust * JET.airspeed, memory=0.3, off=0.06)
    plant = SidePlant("", sensors={"a_y": lambda time, force: sensed_lagging(time, force, late)} if late else {})
    aircraft = six_axis_flights.aircraft_of(at, plant, "lateral", np.random.default_rng(seed))
    return aircraft, [six_axis_flights.flown(name, at, plant, seed + n) for n, name in enumerate("ab")]


@pytest.mark.parametrize("late", [0.08, pytest.param(0.0, marks=pytest.mark.slow)])
def test_a_late_lateral_accelerometer_is_told_from_a_derivative_by_the_yaw_rate(late: float) -> None:
    """It was not named, and C_Y r_hat ten to twenty standard errors off."""
    aircraft, logs = late_side_force(late, SEEDS + 130, 0.005)
    errors = identified(aircraft, logs[:1], logs[1:])
    assert not errors.selected.chosen
    found = decide(errors, aircraft.coefficients)
    assert {(row.hypothesis.kind, row.hypothesis.where) for row in found.findings} == (
        {("sensor_lag", "a_y")} if late else set()
    )
    assert all(row.value == pytest.approx(late, abs=3.0 * row.std_error) for row in found.findings)
    assert terms_lie_within(found, JET.terms, 3.5)


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2))])
def test_kinematic_evidence_is_as_sharp_as_its_gain_in_likelihood(seed: int) -> None:
    """Each structure with its own colours: noise of another colour may stand for a slow drift."""
    aircraft, logs = late_side_force(0.1, SEEDS + 140 + 2 * seed, 0.004)
    errors = identified(aircraft, logs[:1], logs[1:])
    sensors = [hypothesis for hypothesis in errors.hypotheses if is_instrument_error(hypothesis)]
    row = kinematic_evidence(errors.selected, sensors)["sensor_lag", "a_y", ""]
    assert row.agrees((0.1,), 3.0)
