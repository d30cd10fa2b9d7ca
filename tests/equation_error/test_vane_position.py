"""A vane's position beside its time delay, on flights in gusts by equations that share no code with ours."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, identified, named_values, terms_lie_within
from scipy.signal import lfilter

from aerosid.aircraft import Aircraft
from aerosid.equation_error.decision import decide
from aerosid.equation_error.joint_selection import selected_jointly
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.selection.profiled_error import ProfiledError, likeliest_value
from aerosid.logs.flight_log import FlightLog
from benchmarks import six_axis_flights as lateral
from benchmarks.planted_aircraft import Body
from benchmarks.sideways_plants import SidePlant
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

SEED = 71_000
"""Of tests; the rule was built on other flights."""

GLIDER, TWIN, TRAINER, JET = BODIES[1:5]

LAG = 0.14
"""s."""


def with_vane(log: FlightLog, ahead: float, constant: float, vane: str = "alpha") -> FlightLog:
    """The log with a vane `ahead` of the centre of gravity, m, and behind a first-order lag, bilinear."""
    swing = -log["q"] if vane == "alpha" else log["r"]
    angle = log[vane] + ahead * swing / log["V"]
    a = 0.5 * float(log.time[1] - log.time[0]) / constant
    late = angle[0] + lfilter([a / (1 + a), a / (1 + a)], [1.0, -(1 - a) / (1 + a)], angle - angle[0])
    return replace(log, channels={**log.channels, vane: late})


def flights(body: Body, seed: int, ahead: float) -> tuple[Aircraft, list[FlightLog], list[FlightLog]]:
    fitted, unseen = (with_vane(flown(name, body, seed + n, air=0.4), ahead, LAG) for n, name in enumerate("ab"))
    return aircraft_of(body, 0.08, np.random.default_rng(seed)), [fitted], [unseen]


PAIRS = [
    (TWIN, SEED, 3.0),
    # Kinematics show the distance, and by themselves have the accelerometer 5.1 m aft, not the vane 5.4 m ahead.
    pytest.param(TRAINER, SEED + 10, 3.0, marks=pytest.mark.slow),
    pytest.param(TRAINER, SEED + 11, 3.0, marks=pytest.mark.slow),
    # The delay alone enters first, and with it C_X q_hat, which the vane at its position makes superfluous.
    pytest.param(GLIDER, SEED + 88, 2.0, marks=pytest.mark.slow),
    pytest.param(JET, SEED + 20, 3.0, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("body", "seed", "chords"), PAIRS)
def test_a_lagging_vane_on_a_boom_is_identified_with_its_position(body: Body, seed: int, chords: float) -> None:
    ahead = chords * body.mean_chord
    found = decided(*flights(body, seed, ahead))
    rows = named_values(found)
    assert set(rows) == {("sensor_lag", "alpha"), ("sensor_position", "alpha")}
    for kind, true in (("sensor_lag", LAG), ("sensor_position", ahead)):
        value, error = rows[kind, "alpha"]
        assert abs(value - true) < 4.0 * error
    assert terms_lie_within(found, body.terms, 4.0)
    assert found.vane is not None
    # The delay alone takes the distance over the airspeed up.
    assert found.vane.timing.values[0] > rows["sensor_lag", "alpha"][0]


@pytest.mark.parametrize(
    ("body", "seed"),
    [(JET, SEED + 30), *(pytest.param(b, SEED + 40 + n, marks=pytest.mark.slow) for n, b in enumerate(BODIES))],
)
def test_a_lag_alone_stays_a_lag(body: Body, seed: int) -> None:
    found = decided(*flights(body, seed, 0.0))
    assert set(named_values(found)) == {("sensor_lag", "alpha")}
    assert found.vane is None


@pytest.mark.slow
@pytest.mark.parametrize("ahead", [0.5, 0.0])
def test_a_declared_position_is_not_questioned(ahead: float) -> None:
    """Though the vane is elsewhere; zero is declared of a flow angle that is referred to the centre of gravity."""
    aircraft, fitted, unseen = flights(TWIN, SEED, 3.0 * TWIN.mean_chord)
    declared = [[replace(log, positions={"alpha": (ahead, 0.0, 0.0)}) for log in part] for part in (fitted, unseen)]
    assert decided(aircraft, *declared).vane is None


@pytest.mark.slow
def test_the_second_order_of_the_line_predicts_the_likelihood_at_other_positions() -> None:
    """And the errors' joint covariance is that of a delay that gives way as the vane moves ahead."""
    aircraft, fitted, unseen = flights(TWIN, SEED, 3.0 * TWIN.mean_chord)
    errors = identified(aircraft, fitted, unseen)
    joint = selected_jointly(errors, errors.selected, aircraft.coefficients, DeclaredValues({}, 0.0, 0.0))
    assert joint.vane is not None
    hypothesis = joint.vane.effect.hypothesis
    (timing,) = (each.hypothesis for each in joint.identified.chosen)
    place = next(active for active in joint.outcome.errors.effects if active.name == ("sensor_position", "alpha"))
    begun = ProfiledError(
        hypothesis, timing, 0.0, joint.identified, joint.outcome.errors, joint.outcome.structure.estimate
    )
    there = likeliest_value(begun.moved_to(place.values[0]))
    fall = there.log_likelihood - there.moved_to(there.value + 2.0 * there.std_error).log_likelihood
    assert fall == pytest.approx(2.0, rel=0.5)
    covariance = there.with_value_free().covariance
    assert np.linalg.eigvalsh(covariance).min() > 0.0
    correlation = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert -1.0 < correlation < -0.3
    moved = there.moved_to(there.value + 1.0)
    slope = moved.errors.effects[0].values[0] - there.errors.effects[0].values[0]
    assert slope == pytest.approx(covariance[0, 1] / covariance[1, 1], rel=0.3)


@pytest.mark.slow
def test_a_vane_that_is_ahead_and_not_late_is_no_late_one() -> None:
    """Kinematics took the position of some vanes for a lag of 0.02 s."""
    body = JET
    logs = [flown(name, body, SEED + 60 + n, air=0.4) for n, name in enumerate("ab")]
    ahead = [
        replace(log, channels={**log.channels, "alpha": log["alpha"] - 3.0 * body.mean_chord * log["q"] / log["V"]})
        for log in logs
    ]
    aircraft = aircraft_of(body, 0.08, np.random.default_rng(SEED + 60))
    found = decide(identified(aircraft, ahead[:1], ahead[1:]), aircraft.coefficients)
    assert set(named_values(found)) == {("sensor_position", "alpha")}


@pytest.mark.slow
@pytest.mark.parametrize("spans", [0.0, 0.35])
def test_a_sideslip_vane_is_placed_as_well(spans: float) -> None:
    body = next(each for each in lateral.BODIES if each.name == "survey drone")
    at, nothing = (
        lateral.Circumstances(body, 0.04, 30.0, gust=0.005 * body.airspeed, memory=0.3, off=0.06),
        SidePlant(""),
    )
    aircraft = lateral.aircraft_of(at, nothing, "lateral", np.random.default_rng(SEED + 70))
    fitted, unseen = (
        with_vane(lateral.flown(name, at, nothing, SEED + 70 + n), spans * body.span, LAG, "beta")
        for n, name in enumerate("ab")
    )
    rows = named_values(decided(aircraft, [fitted], [unseen]))
    assert abs(rows["sensor_lag", "beta"][0] - LAG) < 4.0 * rows["sensor_lag", "beta"][1]
    assert (("sensor_position", "beta") in rows) is (spans > 0.0)
    if spans > 0.0:
        value, error = rows["sensor_position", "beta"]
        assert abs(value - spans * body.span) < 4.0 * error
