"""Decision by the equations on flights of an independent simulation with planted errors, in calm and turbulent air."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from equations_decided import decided, declared, identified

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.effects.cg_shift import cg_shift
from aerosid.effects.family import at_null
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.calibration import VANE, posterior_size
from aerosid.equation_error.selection.candidates import (
    effect_candidates,
    linearised,
    position_hypotheses,
    with_aircraft_limits,
)
from aerosid.equation_error.selection.cross_validation import validation_residuals
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from benchmarks.field_detection import FIRST, written
from benchmarks.planted_aircraft import Body
from benchmarks.plants import finely_lagged
from benchmarks.turbulent_flights import BODIES, NOTHING, Wrong, aircraft_of, flown

SINGLE, GLIDER = BODIES[:2]
AT_CENTRE = {channel: np.zeros(3) for channel in ("alpha", "a_z")}

SEEDS = 5000
"""Of tests; published tables and trials begin elsewhere."""


def pair(
    seed: int, wrong: Wrong = NOTHING, air: float = 0.0, body: Body = SINGLE
) -> tuple[Aircraft, list[FlightLog], list[FlightLog]]:
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS + seed))
    logs = [
        flown(name, body, SEEDS + 10 * seed + n, air=air, wrong=wrong, seconds=24.0)
        for n, name in enumerate(("one", "two"))
    ]
    return aircraft, logs[:1], logs[1:]


PLANTED = {
    "late vane": (Wrong(delay={"alpha": 0.12}), {("sensor_delay", "alpha"), ("sensor_lag", "alpha")}, 0.12, 0.02),
    "theta scale": (Wrong(scale={"theta": 0.93}), {("sensor_scale", "theta")}, 0.93, 0.01),
    "bent moment": (Wrong(terms={("C_m", "alpha^2"): -2.5}), {("aero_term", "C_m")}, -2.5, 0.5),
    "bent drag": (Wrong(terms={("C_X", "alpha^2"): 4.0}), {("aero_term", "C_X")}, 4.0, 0.8),
}


@pytest.mark.parametrize("name", PLANTED)
def test_the_planted_effect_is_found_first_with_its_value(name: str) -> None:
    wrong, accepted, value, tolerance = PLANTED[name]
    found = decided(*pair(1, wrong))
    first = found.findings[0]
    assert (first.hypothesis.kind, first.hypothesis.where) in accepted
    assert first.value == pytest.approx(value, abs=tolerance)
    assert abs(first.value - value) < 4.0 * first.std_error
    assert first.ratio > 3.0


def test_nothing_is_selected_for_a_complete_model() -> None:
    found = decided(*pair(2))
    assert found.findings == ()
    assert all(after.r2 == pytest.approx(before.r2, abs=1e-6) for before, after in found.coefficient_fits)


def test_a_correct_model_explains_coefficients_in_measured_gusts() -> None:
    """Airspeed 55 m/s, gusts of 1 m/s, which move alpha as much as the elevator does."""
    found = decided(*pair(9, air=1.0))
    assert not found.findings
    assert len(found.coefficient_fits) == 6
    assert all(min(before.r2, after.r2) > 0.95 for before, after in found.coefficient_fits)


def test_kinematics_identify_an_instrument_error_and_coefficients_a_term() -> None:
    wrong = Wrong(delay={"alpha": 0.12}, terms={("C_X", "alpha^2"): 4.0})
    found = decided(*pair(3, wrong))
    sources = {row.hypothesis.where: row.source for row in found.findings}
    assert sources["alpha"] == "kinematics"
    assert sources["C_X"] == "coefficients"
    validation = [(before.r2, after.r2) for before, after in found.coefficient_fits if not after.fitted]
    assert len(validation) == 3
    assert all(after >= before - 0.005 for before, after in validation)


def test_a_lagging_noisy_vane_gives_no_step_at_the_start_of_the_record() -> None:
    """Noise of .003 rad becomes .03 rad when a lag of .3 s is corrected, and the first sample has no neighbour."""
    aircraft, logs, others = pair(43, air=0.6, body=BODIES[2])
    found = decided(aircraft, [slow_vane(log, 0) for log in logs], [slow_vane(log, 1) for log in others])
    (row,) = found.findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_lag", "alpha")
    assert abs(row.value - 0.3) < 3.0 * row.std_error


@pytest.mark.parametrize("seed", [44, 45])
def test_a_lagging_accelerometer_is_found_in_gusts(seed: int) -> None:
    """If lift responded to gusts at once, the accelerometer would appear late and the lift a third too small."""
    aircraft, logs, others = pair(seed, air=0.6)
    found = decided(aircraft, [slow_accelerometer(log) for log in logs], [slow_accelerometer(log) for log in others])
    (row,) = found.findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("sensor_lag", "a_z")
    assert abs(row.value - 0.2) < 3.0 * row.std_error
    place = found.completed.design.unknowns.index(("term", ("C_Z", parse_term("alpha"))))
    slope, error = found.completed.solution.values[place], np.sqrt(found.covariance[place, place])
    assert abs(slope - SINGLE.terms["C_Z", "alpha"]) < 3.0 * error
    calibration = posterior_size(0.0, np.inf, VANE)  # before the kinematics
    assert error < np.hypot(0.02, calibration) * abs(slope)


def slow_accelerometer(log: FlightLog) -> FlightLog:
    return replace(log, channels={**log.channels, "a_z": finely_lagged(log.time, log["a_z"], 0.2)})


def slow_vane(log: FlightLog, seed: int) -> FlightLog:
    noise = 0.003 * np.random.default_rng([43, seed]).standard_normal(log.time.size)
    return replace(log, channels={**log.channels, "alpha": finely_lagged(log.time, log["alpha"], 0.3) + noise})


def test_nothing_is_selected_in_turbulence_for_a_complete_model() -> None:
    assert decided(*pair(2, air=0.6)).findings == ()


@pytest.mark.parametrize("name", ["late vane", "bent moment"])
def test_only_the_planted_effect_is_found_in_turbulence(name: str) -> None:
    wrong, accepted, value, _ = PLANTED[name]
    found = decided(*pair(1, wrong, air=0.6))
    assert {(row.hypothesis.kind, row.hypothesis.where) for row in found.findings} <= accepted
    (row,) = found.findings
    assert abs(row.value - value) < 4.0 * row.std_error


@pytest.mark.parametrize("body", [SINGLE, GLIDER])
def test_a_delay_as_long_as_the_elevator_steps_is_no_lag_even_in_gusts(
    body: Body,
) -> None:
    found = decided(*pair(4, Wrong(elevator_delay=0.1), air=0.6, body=body))
    (row,) = found.findings
    assert (row.hypothesis.kind, row.hypothesis.where) == ("control_delay", "delta_e")
    assert row.value == pytest.approx(0.1, abs=0.004)


def test_gusts_do_not_imply_a_shift_of_the_centre_of_gravity() -> None:
    flights = 16
    ratios = [shift_ratio(100 + n, 0.3 + 0.1 * (n % 8), BODIES[n % 8]) for n in range(flights)]
    # Once in a thousand by chance. If the lever arm used the measured pitch acceleration, which responds to the same
    # gusts as the lift, the mean would be 1.8 standard errors and exceed this bound nearly always.
    assert abs(np.mean(ratios)) < 3.3 / np.sqrt(flights)


def shift_ratio(seed: int, air: float, body: Body) -> float:
    """First-order estimate of the shift along x by the declared structure's regression, in standard errors."""
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEEDS + seed))
    before = declared(aircraft, [flown("one", body, SEEDS + 10 * seed, air=air, seconds=24.0)], [])
    shift = Hypothesis("cg_shift", "x", effects=(at_null(cg_shift("x")),))
    (candidate,) = effect_candidates(before.problem, before, [shift])
    solution, _ = linearised(before, candidate)
    return float(solution.values[-1] / np.sqrt(solution.covariance[-1, -1]))


def test_alternatives_lie_within_their_margin_and_gains_are_those_of_the_whole_structure() -> None:
    found = decided(*pair(3, Wrong(delay={"alpha": 0.03}, terms={("C_X", "alpha^2"): 1.5})))
    gains = {row.hypothesis.label: row.gain for row in found.findings}
    assert len(found.alternatives) > 1
    for row in found.alternatives:
        assert row.deficit < row.margin
        # The gain of a replacement is that of the finding less the deficit.
        assert row.gain + row.deficit == pytest.approx(gains[row.replaces.label])
        assert row.hypothesis.label not in found.refuted


def test_sensor_positions_lie_inside_the_aircraft() -> None:
    inside, vane = position_hypotheses(["a_z", "alpha"])[::-1]
    assert (inside.where, vane.where) == ("a_z", "alpha")
    for place, length, farthest in ((inside, 14.0, 7.0), (vane, 14.0, 9.1), (inside, None, 8.0), (vane, None, 10.4)):
        (active,) = with_aircraft_limits(place, AT_CENTRE, 2.0, length).effects
        assert active.effect.parameters[0].highest == pytest.approx(farthest)
        assert active.effect.parameters[0].lowest == pytest.approx(-farthest)


def test_a_position_error_counts_from_the_declared_place() -> None:
    """A vane declared 8 m ahead may be 1.1 m further ahead, and anywhere behind that the aircraft has."""
    _, vane = position_hypotheses(["a_z", "alpha"])[::-1]
    (active,) = with_aircraft_limits(vane, {"alpha": np.array([8.0, 0.0, 0.5])}, 2.0, 14.0).effects
    assert (active.effect.parameters[0].lowest, active.effect.parameters[0].highest) == pytest.approx((-17.1, 1.1))


@pytest.mark.slow
def test_a_step_in_the_validation_flight_does_not_refute_an_elevator_lag(tmp_path: Path) -> None:
    """Both lack a flap, a lag of the elevator and a step of all coefficients, which no other flight can predict."""
    _, plants, _ = written(tmp_path, [FIRST, 5, 25], 25)
    assert [plant.label for plant in plants][1] == "control lag 0.148"
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    found = decided(load_aircraft(str(tmp_path / "aircraft.toml")), logs[:1], logs[1:])
    (row,) = [row for row in found.findings if row.hypothesis.kind == "control_lag"]
    assert abs(row.value - 0.148) < 3.0 * row.std_error
    assert not found.refuted


def test_level_shifts_of_a_validation_flight_are_fitted_like_constants() -> None:
    aircraft, logs, others = pair(9, air=0.3)
    errors = identified(aircraft, logs, others)
    problem = replace(errors.selected.estimate.problem, kinds=COEFFICIENT, all_fitted=True)
    found = estimate(problem, errors.start)
    plain = validation_residuals(problem, found)
    samples = plain[1, "C_m"].residual.size
    step = np.repeat([0.0, 1.0], [samples // 3, samples - samples // 3])
    freed = validation_residuals(problem, found, {(1, "C_m"): step[:, None]})
    assert set(freed) == set(plain)
    np.testing.assert_allclose(freed[1, "C_Z"].residual, plain[1, "C_Z"].residual, atol=1e-12)
    # Projection orthogonal to the step: the residual has no component along it, and the removed part is orthogonal.
    before, after = plain[1, "C_m"].residual, freed[1, "C_m"].residual
    assert abs(after @ step) < 1e-9 * np.linalg.norm(after) * np.linalg.norm(step)
    assert abs(after @ (before - after)) < 1e-9 * float(before @ before)
    assert np.linalg.norm(before - after) > 0.0
