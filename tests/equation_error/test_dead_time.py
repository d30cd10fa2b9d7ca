"""A vane's dead time beside its lag, on flights in gusts by equations that share no code with ours."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided, identified, named_values, terms_lie_within

from aerosid.aircraft import Aircraft
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.selection.dead_time import is_causal
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.equation_error_notes import note_on_vane
from benchmarks.planted_aircraft import Body
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

SEED = 505_000
"""Of tests; the rule was built on flights of other seeds."""

SINGLE, GLIDER, TWIN, TRAINER, JET = BODIES[:5]
AIRLINER = BODIES[6]


def flights(
    body: Body, seed: int, lag: float, delay: float, air: float
) -> tuple[Aircraft, list[FlightLog], list[FlightLog]]:
    wrong = Wrong(delay={"alpha": delay}, lag={"alpha": lag} if lag else {})
    logs = [flown(name, body, seed + n, air=air, wrong=wrong, seconds=40.0) for n, name in enumerate("ab")]
    return aircraft_of(body, 0.08, np.random.default_rng(seed)), logs[:1], logs[1:]


@functools.cache
def decision(body: Body, seed: int, lag: float, delay: float, air: float) -> EquationErrorDecision:
    return decided(*flights(body, seed, lag, delay, air))


IN_GUSTS = (TRAINER, SEED + 30, 0.1, 0.1, 1.0)

CASES = [
    pytest.param(GLIDER, SEED, 0.2, 0.15, 0.0, marks=pytest.mark.slow),
    # In these gusts kinematics have a delay alone, and forces were given a displaced centre of gravity and more.
    IN_GUSTS,
    pytest.param(SINGLE, SEED + 10, 0.1, 0.06, 1.0, marks=pytest.mark.slow),
    pytest.param(TWIN, SEED + 20, 0.2, 0.1, 0.5, marks=pytest.mark.slow),
    pytest.param(JET, SEED + 40, 0.3, 0.1, 0.5, marks=pytest.mark.slow),
    pytest.param(AIRLINER, SEED + 50, 0.3, 0.25, 1.0, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("body", "seed", "lag", "delay", "air"), CASES)
def test_both_are_identified_and_nothing_in_their_place(
    body: Body, seed: int, lag: float, delay: float, air: float
) -> None:
    found = decision(body, seed, lag, delay, air)
    rows = named_values(found)
    assert set(rows) == {("sensor_lag", "alpha"), ("sensor_delay", "alpha")}
    for kind, true in (("sensor_lag", lag), ("sensor_delay", delay)):
        value, error = rows[kind, "alpha"]
        assert abs(value - true) < 4.0 * error
    assert terms_lie_within(found, body.terms, 4.0)


def test_where_forces_tell_them_apart_the_remark_says_what_one_of_them_leaves() -> None:
    found = decision(*IN_GUSTS)
    assert found.vane is not None
    (row,) = (row for row in found.findings if row.hypothesis is found.vane.effect.hypothesis)
    remark = note_on_vane(found.vane, row)
    assert "alpha lags and is recorded late" in remark
    assert "With a delay alone" in remark
    # One alone is late by about the sum.
    assert found.vane.timing.values[0] == pytest.approx(0.2, abs=0.05)


@pytest.mark.parametrize(
    ("body", "seed", "lag", "delay", "air"),
    [
        (TWIN, SEED + 60, 0.2, 0.0, 0.5),
        pytest.param(SINGLE, SEED + 70, 0.0, 0.2, 1.0, marks=pytest.mark.slow),
        pytest.param(JET, SEED + 80, 0.0, 0.3, 0.3, marks=pytest.mark.slow),
        pytest.param(AIRLINER, SEED + 90, 0.4, 0.0, 0.3, marks=pytest.mark.slow),
        pytest.param(TRAINER, SEED + 100, 0.1, 0.0, 1.0, marks=pytest.mark.slow),
    ],
)
def test_one_alone_stays_alone(body: Body, seed: int, lag: float, delay: float, air: float) -> None:
    found = decision(body, seed, lag, delay, air)
    kind, true = ("sensor_lag", lag) if lag else ("sensor_delay", delay)
    assert set(named_values(found)) == {(kind, "alpha")}
    value, error = named_values(found)[kind, "alpha"]
    assert abs(value - true) < 4.0 * error
    assert found.vane is None


@pytest.mark.parametrize(
    ("lag", "delay"), [(0.1, 0.0), pytest.param(0.0, 0.06, marks=pytest.mark.slow)], ids=["lag", "delay"]
)
def test_in_strong_gusts_a_late_vane_is_shown_by_forces_and_moments(lag: float, delay: float) -> None:
    """Kinematics do not show it there; C_X was given a term in the elevator, and derivatives were five s.e. off."""
    found = decision(GLIDER, SEED + 120, lag, delay, 1.0)
    kind, true = ("sensor_lag", lag) if lag else ("sensor_delay", delay)
    assert set(named_values(found)) == {(kind, "alpha")}
    value, error = named_values(found)[kind, "alpha"]
    assert abs(value - true) < 4.0 * error
    # Their gain has to be that of no chance; kinematics may not contradict them, and gain next to nothing.
    assert found.joint_evidence[kind, "alpha", ""].credit == 0.0


@pytest.mark.slow
def test_an_early_vane_is_not_told_by_forces_and_moments_alone() -> None:
    """Lift and moments that lag the flow angle make it look early."""
    assert ("sensor_delay", "alpha") not in named_values(decision(GLIDER, SEED + 130, 0.0, -0.05, 1.0))


def test_kinematics_find_both_of_an_attitude_and_no_lag_with_a_lead() -> None:
    wrong = Wrong(delay={"theta": 0.1}, lag={"theta": 0.2})
    logs = [flown(name, TWIN, SEED + 110 + n, air=0.5, wrong=wrong, seconds=40.0) for n, name in enumerate("ab")]
    found = identified(aircraft_of(TWIN, 0.08, np.random.default_rng(SEED)), logs[:1], logs[1:]).selected
    assert set(found.labels) == {("sensor_lag", "theta", ""), ("sensor_delay", "theta", "")}
    point = found.estimate.point
    assert is_causal(point)
    early = (replace(a, values=(-0.05,)) if a.effect.kind == "sensor_delay" else a for a in point.effects)
    assert not is_causal(replace(point, effects=tuple(early)))
