"""Simulated manoeuvres against an independent integration, and the trim they start from."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from oracles.flight import Airframe, simulate, state_rates
from problems import BOTH_SQUARES, LIFT_AND_DRAG, LIGHT, SILENT, UNSTABLE, Problem, entry

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.simulation import doublet, fly, three_two_one_one, trim


def frame_of(aircraft: Aircraft) -> Airframe:
    return Airframe(
        aircraft.wing_area,
        aircraft.mean_chord,
        aircraft.I_yy,
        aircraft.airspeed,
        aircraft.airspeed or 100.0,
        aircraft.thrust_incidence,
        aircraft.thrust_z_arm,
    )


@pytest.mark.parametrize(
    "problem",
    [
        Problem(undeclared=BOTH_SQUARES, duration=4.0, noise=SILENT),
        Problem(LIFT_AND_DRAG, {("C_m", "alpha_dot_hat"): -5.0}, duration=3.0, interval=0.1, noise=SILENT),
        Problem(UNSTABLE, elevator="3211", amplitude=0.005, duration=3.0, noise=SILENT),
    ],
    ids=["alpha squared", "lift and drag with alpha dot", "unstable"],
)
def test_flight_is_the_solution_of_the_equations(problem: Problem) -> None:
    log = problem.fly()
    model = problem.truth
    terms = {(c, str(t)): float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}
    level = trim(model, problem.airspeed, problem.aircraft.density, problem.aircraft.mass)
    start = [100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha), 0.0, level.alpha, 1500.0]
    inputs = {
        "rho": problem.aircraft.density,
        "mass": problem.aircraft.mass,
        "thrust": level.thrust,
        "delta_e": level.delta_e + problem.deflection,
    }
    _, outputs = simulate(start, problem.time, inputs, terms, frame_of(problem.aircraft))
    for i, name in enumerate(LONGITUDINAL.outputs):
        assert_allclose(log[name], outputs[:, i], rtol=0.0, atol=2e-6 * (1.0 + np.ptp(outputs[:, i])), err_msg=name)


@pytest.mark.parametrize("aircraft", [LIGHT, LIFT_AND_DRAG, UNSTABLE], ids=["light", "lift and drag", "unstable"])
@pytest.mark.parametrize("airspeed", [70.0, 100.0])
def test_trim_is_level_flight_without_acceleration(aircraft: Aircraft, airspeed: float) -> None:
    model = declared_model(aircraft, 100.0)
    level = trim(model, airspeed, aircraft.density, aircraft.mass)
    terms = {(c, str(t)): float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}
    state = [airspeed * np.cos(level.alpha), airspeed * np.sin(level.alpha), 0.0, level.alpha, 0.0]
    inputs = {"rho": aircraft.density, "mass": aircraft.mass, "thrust": level.thrust, "delta_e": level.delta_e}
    assert_allclose(state_rates(state, inputs, terms, frame_of(aircraft)), 0.0, atol=1e-9)


def test_a_speed_that_cannot_be_held_has_no_trim() -> None:
    with pytest.raises(EstimationError, match="no trim was found at 20 m/s"):
        trim(declared_model(LIGHT, 100.0), 20.0, LIGHT.density, LIGHT.mass)


def test_a_manoeuvre_that_tumbles_is_refused() -> None:
    problem = Problem(UNSTABLE, duration=12.0, amplitude=0.2)
    with pytest.raises(EstimationError, match=r"flight leaves \|alpha\|"):
        problem.fly()


def test_noise_is_that_asked_for_and_the_seed_repeats_it() -> None:
    problem = Problem(duration=30.0)
    quiet = Problem(duration=30.0, noise=SILENT).fly()
    one, again, other = problem.fly(seed=3), problem.fly(seed=3), problem.fly(seed=4)
    for name, deviation in problem.noise.items():
        error = one[name] - quiet[name]
        # A chi-square with 1000 degrees of freedom: 0.1 is 4.5 standard deviations of the ratio.
        assert error.std() / deviation == pytest.approx(1.0, abs=0.1), name
        assert (one[name] == again[name]).all()
        assert (one[name] != other[name]).all()
    table = np.corrcoef([one[name] - quiet[name] for name in problem.noise])
    assert np.abs(table - np.eye(len(problem.noise))).max() < 0.17


def test_what_has_no_noise_named_is_not_recorded() -> None:
    log = Problem(noise={"V": 0.0, "alpha": 0.0, "q": 0.0, "delta_e": 0.0}, duration=3.0).fly()
    assert set(log.channels) == {"V", "alpha", "q", "delta_e", "thrust"}


def test_further_inputs_drive_the_flight() -> None:
    problem = Problem(undeclared={("C_m", "delta_f"): -0.3}, duration=6.0, elevator="none", noise=SILENT)
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    flap = doublet(problem.time, 1.0, 1.0, 0.05)
    log = fly(
        problem.truth,
        level,
        problem.time,
        problem.deflection,
        density=LIGHT.density,
        mass=LIGHT.mass,
        noise=SILENT,
        seed=0,
        further_inputs={"delta_f": flap},
    )
    # The flap's moment alone: as the elevator's times -0.3/-1.94, without the elevator's lift.
    assert log["q_dot"][problem.time < 1.0] == pytest.approx(0.0, abs=1e-9)
    first = int(np.argmax(flap > 0.0))
    pressure = 0.5 * LIGHT.density * log["V"][first] ** 2
    moment = pressure * LIGHT.wing_area * LIGHT.mean_chord * -0.3 * 0.05 / LIGHT.I_yy
    assert log["q_dot"][first] == pytest.approx(moment, rel=0.1)
    assert (log["delta_f"] == flap).all()


def test_simulation_ends_where_it_leaves_its_range() -> None:
    model = declared_model(UNSTABLE, 100.0)
    level = trim(model, 100.0, LIGHT.density, LIGHT.mass)
    time = np.arange(0.0, 20.0, 0.05)
    inputs = np.zeros((time.size, len(model.columns)))
    inputs[:, :4] = LIGHT.density, level.thrust, LIGHT.mass, 340.0
    inputs[:, 8] = level.delta_e + doublet(time, 1.0, 1.0, 0.1)
    flight = Flight(time, inputs, np.full((time.size, 8), np.nan), np.zeros((8, 3)), 3, np.zeros(1))
    start = np.array([100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha), 0.0, level.alpha, 0.0])
    outputs, states = simulate_outputs(start, flight, model.values, model.table, model.constants)
    inside = np.isfinite(outputs[:, 0])
    assert 10 < inside.sum() < time.size
    assert inside[: inside.sum()].all()
    assert np.abs(outputs[inside, 1]).max() < 1.5
    assert np.isnan(states[~inside]).all()


def test_shapes_of_the_usual_inputs() -> None:
    time = np.arange(0.0, 10.0, 0.1)
    assert doublet(time, 1.0, 0.5, 0.1).tolist() == [
        *([0.0] * 10), *([0.1] * 5), *([-0.1] * 5), *([0.0] * 80)
    ]  # fmt: skip
    levels = three_two_one_one(time, 0.0, 0.2, 1.0)
    assert levels[:16].tolist() == [1.0] * 6 + [-1.0] * 4 + [1.0] * 2 + [-1.0] * 2 + [0.0] * 2


@pytest.mark.parametrize("value", [-1.2, 0.0], ids=["the last term acts", "the last term is a candidate too"])
def test_candidates_of_zero_value_leave_every_bit(value: float) -> None:
    """Between terms that act, and after the last of them."""
    problem = Problem(duration=2.0)
    model, manoeuvre = problem.prepared(problem.fly())
    square = entry("C_m", "alpha^2")

    def flown(*terms: Entry) -> np.ndarray:
        longer = model.extended(terms)
        values = np.array(longer.values)
        if terms:
            values[longer.index(square)] = value
        outputs, _ = simulate_outputs(manoeuvre.first_state, manoeuvre.flight, values, longer.table, longer.constants)
        return np.asarray(outputs)

    among_candidates = flown(entry("C_m", "alpha^3"), square, entry("C_X", "alpha^3"))
    np.testing.assert_array_equal(among_candidates, flown(square))
    assert np.array_equal(among_candidates, flown()) == (value == 0.0)


def test_a_body_without_forces_falls() -> None:
    """Every term is zero: gravity and the rates' inertia alone, by Newton."""
    problem = Problem(duration=1.0)
    model, manoeuvre = problem.prepared(problem.fly())
    inputs = manoeuvre.flight.inputs.copy()
    inputs[:, model.columns.index("thrust")] = 0.0
    flight = manoeuvre.flight._replace(inputs=inputs)
    state = np.array([100.0, 0.0, 0.0, 0.0, 500.0])
    _, states = simulate_outputs(state, flight, np.zeros(model.values.size), model.table, model.constants)
    time = flight.time - flight.time[0]
    assert_allclose(states[:, 1], 9.80665 * time, rtol=1e-9, atol=1e-9)
    assert_allclose(states[:, 4], 500.0 - 0.5 * 9.80665 * time**2, rtol=1e-9)
