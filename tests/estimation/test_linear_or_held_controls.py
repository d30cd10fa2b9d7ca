"""Controls held between samples: the simulation against an independent one, and what the likelihood selects."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.flight import Airframe, simulate
from problems import LIGHT, NOISE, Problem, terms_of, with_channels, with_thrust

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.linear_or_held_controls import (
    INTERPOLATION,
    notes_on_held_controls,
    stepped_controls,
    with_likelier_interpolation,
)
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import refine
from aerosid.estimation.movement_between_samples import movement_between_samples
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import simulate_outputs
from aerosid.flight_model.simulation import fly, trim
from aerosid.logs.flight_log import FlightLog
from aerosid.signals.delay_and_lag import lagged
from benchmarks.flights import long_flight

Array = NDArray[np.float64]
ELEVATOR = len(declared_model(LIGHT, 100.0).columns) - 1
ANSWERED = INTERPOLATION.answered
FREE = tuple((d.coefficient, d.term) for d in LIGHT.derivatives)


def finely_flown(move: float, seed: int = 0, lag: float = 0.0, every: int = 8) -> FlightLog:
    """A log at 25 Hz of a flight simulated at 200 Hz whose elevator moves in the last `move` s before each sample."""
    fine = Problem(elevator="3211", duration=16.0, interval=0.005)
    coarse = replace(fine, interval=0.005 * every)
    time, own = fine.time, coarse.time
    knots = np.sort(np.concatenate([own, own[1:] - max(move, 1e-9)]))
    levels = np.concatenate([[0.0], np.repeat(coarse.deflection[:-1], 2)])
    levels[2::2] = coarse.deflection[1:]
    levels[1::2] = coarse.deflection[:-1]
    surface = np.interp(time, knots, levels)
    if lag > 0.0:
        surface = lagged(time, surface[:, None], lag)[:, 0]
    density, mass = LIGHT.density, LIGHT.mass
    assert density is not None
    level = trim(fine.truth, fine.airspeed, density, mass)
    flown = fly(fine.truth, level, time, surface, density=density, mass=mass, noise=NOISE, seed=seed)
    sampled = FlightLog(
        "flight", own, {name: values[::every] for name, values in flown.channels.items()}, dict(flown.units)
    )
    noise = NOISE["delta_e"] * np.random.default_rng(seed + 1).standard_normal(own.size)
    return with_thrust(with_channels(sampled, delta_e=level.delta_e + coarse.deflection + noise), level.thrust)


def prepared(log: FlightLog) -> Manoeuvre:
    return prepare(log, LIGHT, declared_model(LIGHT, 100.0).columns)


def selected(log: FlightLog) -> Manoeuvre:
    return with_likelier_interpolation([prepared(log)], declared_model(LIGHT, 100.0), FREE)[0]


def test_a_held_elevator_flies_as_an_independent_integration_of_its_jumps() -> None:
    problem = Problem(elevator="3211", duration=4.0, interval=0.04)
    model = problem.truth
    level = trim(model, problem.airspeed, problem.aircraft.density, problem.aircraft.mass)
    just_before = problem.time[1:] - 1e-9
    time = np.sort(np.concatenate([problem.time, just_before]))
    elevator = np.empty(time.size)
    elevator[0::2], elevator[1::2] = problem.deflection, problem.deflection[:-1]
    body = problem.aircraft
    frame = Airframe(body.wing_area, body.mean_chord, body.I_yy, 100.0, 100.0, body.thrust_incidence, body.thrust_z_arm)
    start = [100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha), 0.0, level.alpha, 1500.0]
    inputs = {"rho": body.density, "mass": body.mass, "thrust": level.thrust, "delta_e": level.delta_e + elevator}
    _, wanted = simulate(start, time, inputs, terms_of(model), frame)
    log = problem.fly()
    flight = prepare(log, body, model.columns).flight
    exact = flight.inputs.copy()
    exact[:, ELEVATOR] = level.delta_e + problem.deflection
    held = flight._replace(inputs=exact, held=np.array([ELEVATOR]))
    found, _ = simulate_outputs(np.array(start), held, model.values, model.table, model.constants)
    for i, name in enumerate(LONGITUDINAL.outputs):
        size = np.ptp(wanted[:, i])
        assert_allclose(found[:, i], wanted[0::2, i], rtol=0.0, atol=1e-5 * (1.0 + size), err_msg=name)


@pytest.mark.parametrize("move", [0.0, 0.005, 0.01])
def test_an_elevator_held_by_another_simulation_is_found_with_its_movement(move: float) -> None:
    manoeuvre = selected(finely_flown(move))
    assert manoeuvre.flight.held.tolist() == [ELEVATOR]
    # A simulation at 200 Hz shows no movement that is shorter than its step.
    assert manoeuvre.flight.ramp == pytest.approx(max(move, 0.005) / 0.04, abs=0.06)
    assert "held at each sample" in notes_on_held_controls([manoeuvre])[0]


@pytest.mark.parametrize(("move", "lag"), [(0.04, 0.0), (0.0, 0.04), (0.0, 0.1)], ids=["linear", "lag", "slow lag"])
def test_a_linear_elevator_and_one_that_lags_remain_linear(move: float, lag: float) -> None:
    log = finely_flown(move, lag=lag)
    assert stepped_controls(prepared(log)) == ("delta_e",)
    assert selected(log).flight.held.size == 0


def test_held_between_samples_the_derivatives_are_unbiased() -> None:
    """Linear interpolation, half an interval early, biases them by many standard errors."""
    distances: dict[bool, list[float]] = {False: [], True: []}
    for seed in (0, 10):
        log = finely_flown(0.0, seed)
        for held, manoeuvre in ((False, prepared(log)), (True, selected(log))):
            found = refine(declared_model(LIGHT, 100.0), [manoeuvre], FREE, settings=WRONG_STRUCTURE)
            errors = np.sqrt(np.diag(found.covariance))[: len(FREE)]
            true = {(d.coefficient, d.term): float(d.value) for d in LIGHT.derivatives}
            off = [abs(found.model.value(entry) - true[entry]) for entry in FREE]
            distances[held].append(max(o / e for o, e in zip(off, errors, strict=True)))
    assert max(distances[True]) < 4.0
    assert min(distances[False]) > 8.0


def test_a_pilots_movement_over_several_samples_is_no_step() -> None:
    log = finely_flown(0.0)
    smooth = np.convolve(np.pad(log["delta_e"], 2, mode="edge"), np.full(5, 0.2), mode="valid")
    assert stepped_controls(prepared(with_channels(log, delta_e=smooth))) == ()


def test_moving_in_the_whole_interval_is_linear_interpolation() -> None:
    flight = prepared(finely_flown(0.0)).flight
    model = declared_model(LIGHT, 100.0)
    start = prepared(finely_flown(0.0)).first_state
    found = [
        simulate_outputs(start, each, model.values, model.table, model.constants)[0]
        for each in (flight, flight._replace(held=np.array([ELEVATOR]), ramp=1.0))
    ]
    assert_allclose(found[1], found[0], rtol=1e-12, atol=1e-12)


def test_shares_of_the_movement_change_the_response_evenly() -> None:
    """Equal steps of the ramp shift the surface in time by equal steps."""
    flight = prepared(finely_flown(0.0)).flight
    model, start = declared_model(LIGHT, 100.0), prepared(finely_flown(0.0)).first_state
    row = LONGITUDINAL.outputs.index("q")
    seen = [
        simulate_outputs(
            start, flight._replace(held=np.array([ELEVATOR]), ramp=ramp), model.values, model.table, model.constants
        )[0][:, row]
        for ramp in (0.0, 0.5, 1.0)
    ]
    steps = [after - before for before, after in itertools.pairwise(seen)]
    assert np.ptp(steps[0]) > 1e-4
    assert_allclose(steps[0], steps[1], rtol=0.0, atol=0.02 * float(np.ptp(steps[0])))


@pytest.mark.parametrize("move", [0.0, 0.01, 0.02, 0.04])
def test_angular_rates_tell_when_an_elevator_moves_within_the_interval(move: float) -> None:
    """The mean part of a step that acts in its interval is half the part of the interval in which it moves."""
    found = movement_between_samples(prepared(finely_flown(move, seed=9500)), ("delta_e",), ANSWERED)
    assert found is not None
    assert found.now == pytest.approx(0.5 * max(move, 0.005) / 0.04, abs=4.0 * found.now_error + 0.01)
    assert found.before == pytest.approx(0.0, abs=4.0 * found.before_error)
    assert found.now_error < 0.02


def test_a_late_elevator_acts_in_the_interval_after_its_step() -> None:
    found = movement_between_samples(prepared(finely_flown(0.0, seed=9501, lag=0.04)), ("delta_e",), ANSWERED)
    assert found is not None
    # In the mean of the first interval after its step 1/e of an elevator with a lag of one interval has acted.
    assert found.before == pytest.approx(np.exp(-1.0) - 1.0, abs=0.15)
    assert found.before < -10.0 * found.before_error


def test_an_incomplete_structure_does_not_make_a_linear_elevator_a_held_one() -> None:
    """Of 20,000 samples without the flown C_m alpha^2 the likelihood prefers a held elevator by 221."""
    manoeuvre = prepared(long_flight(20_000, seed=9502, interval=0.01))
    assert stepped_controls(manoeuvre) == ("delta_e",)
    (found,) = with_likelier_interpolation([manoeuvre], declared_model(LIGHT, 100.0), FREE)
    assert found.flight.held.size == 0


def test_rates_that_do_not_answer_a_control_tell_nothing() -> None:
    log = finely_flown(0.0, seed=9503)
    noise = np.random.default_rng(9504).standard_normal(log["q"].size)
    assert movement_between_samples(prepared(with_channels(log, q=noise)), ("delta_e",), ANSWERED) is None


def test_flights_of_one_recorder_are_interpolated_alike() -> None:
    """A quiet flight tells for one whose rates are too noisy; one sampled at another rate is asked by itself."""
    quiet, coarse, noisy = finely_flown(0.04, seed=9510), finely_flown(0.0, 9511, every=10), finely_flown(0.0, 9513)
    noisy = with_channels(noisy, q=noisy["q"] + 0.05 * np.random.default_rng(9512).standard_normal(noisy["q"].size))
    assert selected(noisy).flight.held.size == 1
    flights = [prepared(log) for log in (quiet, noisy, coarse)]
    found = with_likelier_interpolation(flights, declared_model(LIGHT, 100.0), FREE)
    assert [each.flight.held.size for each in found] == [0, 0, 1]
