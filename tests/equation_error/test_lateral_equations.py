"""Kinematic and coefficient equations with lateral motion, on flights of the suite's own rigid-body simulation."""

from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest
from equations_decided import decided, identified, questioned
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.equation_error.decision import EquationErrorDecision, decide
from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.equations.coefficient import CoefficientEquations
from aerosid.equation_error.equations.kinematic import inconsistent_heading, predicted_records, reconstruct
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.logs.flight_log import FlightLog

Array = NDArray[np.float64]

SETTINGS = EquationErrorSettings()
LATERAL = commuter.aircraft(commuter.SIDE)
SIX = commuter.aircraft({**commuter.PITCH, **commuter.SIDE})
PLACES = {"beta": (2.0, 0.0, -0.5), "a_y": (-1.0, 0.3, 0.6), "alpha": (3.0, 0.5, 0.2), "a_z": (0.5, 0.2, -0.4)}


def named(decision: EquationErrorDecision) -> set[tuple[str, str]]:
    return {(row.hypothesis.kind, row.hypothesis.where) for row in decision.findings}


@pytest.mark.parametrize("aircraft", [LATERAL, SIX], ids=["lateral", "six"])
def test_paths_and_coefficients_are_those_of_an_independent_rigid_body(aircraft: Aircraft) -> None:
    flight = commuter.Lateral(noise=0.0, positions=PLACES, interval=0.02, duration=12.0)
    log = replace(flight.log(), positions=PLACES)
    model, manoeuvre = questioned(aircraft, log)
    (recording,) = read_recordings([manoeuvre], [], SETTINGS)
    motion = reconstruct(recording, (), recording.channels, SETTINGS)
    paths = predicted_records(recording, (), motion)
    assert set(paths) == set(equations_of(aircraft.axes).kinematic)
    for name, path in paths.items():
        difference = path - recording.channels[name]
        assert np.ptp(difference - difference.mean()) < 2e-3 * np.ptp(recording.channels[name])
    equations = CoefficientEquations(recording, model, (), motion, ())
    nothing = CoefficientEquations(recording, model.with_values(0.0 * model.values), (), motion, ())
    assert set(equations.names) == set(aircraft.coefficients)
    for name in equations.names:
        # The controls are stepped: the spline's derivative of a rate rings there, and nowhere else.
        assert np.median(np.abs(equations.target(name))) < 2e-3 * np.ptp(nothing.target(name))


@pytest.mark.parametrize("mean", [-0.6, 0.0, 0.6])
def test_a_side_gust_does_not_bias_the_path_in_the_plane_of_symmetry(mean: float) -> None:
    """The vane measures the gust and the aircraft hardly responds: r v and p v by the vane would bias other paths."""
    generator, correlation = np.random.default_rng(5), np.exp(-commuter.SPEED * 0.04 / 150.0)
    air = [0.0]
    for shock in generator.standard_normal(commuter.Lateral().time.size - 1):
        air.append(correlation * air[-1] + 1.5 * np.sqrt(1.0 - correlation**2) * shock)
    gust = np.array(air) - np.mean(air) + mean
    log = commuter.Lateral(inputs={"side_gust": gust}, noise=0.0, size=2.0).log()
    (recording,) = read_recordings([questioned(SIX, log)[1]], [], SETTINGS)
    path = reconstruct(recording, (), recording.channels, SETTINGS).path
    for name, most in (("alpha", 0.35 * 1.2e-3), ("V", 0.6 * 0.12)):
        difference = path[name] - recording.channels[name]
        difference -= np.polyval(np.polyfit(recording.time, difference, 1), recording.time)
        assert np.std(difference) < most, name


def test_an_inconsistent_heading_is_left_out() -> None:
    log = commuter.Lateral(noise=1.0, duration=12.0).log()
    swinging = replace(log, channels={**log.channels, "psi": 0.1 * np.sin(log.time)})
    for each, expected in ((log, ()), (swinging, ("psi",))):
        (recording,) = read_recordings([questioned(LATERAL, each)[1]], [], SETTINGS)
        assert inconsistent_heading(recording, SETTINGS) == expected


def late(delay: float) -> commuter.Lateral:
    return commuter.Lateral(
        sensors={"r": lambda _time, true: true - 0.015},
        surfaces={"delta_a": lambda time, given: np.interp(time - delay, time, given)},
        positions={"a_y": (0.3, 0.0, 0.6)},
    )


@pytest.mark.slow
def test_a_bias_a_position_error_and_a_control_delay_are_found_together() -> None:
    logs = [replace(late(0.04), seed=seed).log(mirrored=seed == 8, name=f"flight {seed}") for seed in (7, 8)]
    found = decided(commuter.aircraft(commuter.SIDE, 0.93), logs[:1], logs[1:])
    numbers = {(row.hypothesis.kind, row.hypothesis.where): row for row in found.findings}
    assert set(numbers) == {("sensor_bias", "r"), ("sensor_position", "a_y"), ("control_delay", "delta_a")}
    assert numbers["sensor_bias", "r"].value == pytest.approx(-0.015, abs=0.001)
    assert numbers["control_delay", "delta_a"].value == pytest.approx(0.04, abs=0.005)
    place = numbers["sensor_position", "a_y"].active
    assert place is not None
    below = dict(zip(place.effect.axes, place.values, strict=True))["z"]  # type: ignore[union-attr]
    assert below == pytest.approx(0.6, abs=0.1)


def gusts(seed: int, sigma: float, samples: int, interval: float, length: float = 200.0) -> Array:
    """A first-order Gauss-Markov wind from the side, m/s."""
    correlation = float(np.exp(-commuter.SPEED * interval / length))
    noise = np.random.default_rng(seed).standard_normal(samples)
    wind = np.empty(samples)
    wind[0] = sigma * noise[0]
    for k in range(1, samples):
        wind[k] = correlation * wind[k - 1] + sigma * np.sqrt(1.0 - correlation**2) * noise[k]
    return wind


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_nothing_is_selected_in_side_gusts_for_a_complete_model(seed: int) -> None:
    calm = commuter.Lateral(seed=seed, size=1.3)
    logs = [
        replace(calm, seed=10 * seed + n, inputs={"side_gust": gusts(20 * seed + n, 0.7, calm.time.size, 0.04)}).log(
            mirrored=n == 1, name=f"flight {n}"
        )
        for n in range(2)
    ]
    found = decided(commuter.aircraft(commuter.SIDE, 0.93), logs[:1], logs[1:])
    assert named(found) == set(), [(r.hypothesis.label, r.value, r.std_errors, r.gain) for r in found.findings]
    assert found.gust_fraction > SETTINGS.calm
    (air,) = found.turbulence
    assert air.kind == "side_gust"
    assert air.sigma == pytest.approx(0.7, rel=0.5)


@pytest.mark.slow
def test_a_position_error_hidden_by_gusts_is_identified_with_the_side_force() -> None:
    """A term of C_Y would do nearly the same; the position also changes the path of sideslip."""
    generator = np.random.default_rng(11)
    correlation = np.exp(-commuter.SPEED * 0.04 / 150.0)

    def flown(name: str, *, mirrored: bool) -> FlightLog:
        air = [0.0]
        for shock in generator.standard_normal(commuter.Lateral().time.size - 1):
            air.append(correlation * air[-1] + 0.5 * np.sqrt(1.0 - correlation**2) * shock)
        place = {"a_y": (0.0, 0.0, 1.2)}
        flight = commuter.Lateral(inputs={"side_gust": np.array(air)}, positions=place, size=1.5)
        return flight.log(mirrored=mirrored, name=name)

    logs = [flown("one", mirrored=False), flown("two", mirrored=True)]
    errors = identified(LATERAL, logs[:1], logs[1:])
    assert not errors.selected.chosen
    (row,) = decide(errors, LATERAL.coefficients).findings
    assert row.hypothesis.label == ("sensor_position", "a_y", "")
    assert abs(row.value - 1.2) < 3.0 * row.std_errors[0]
