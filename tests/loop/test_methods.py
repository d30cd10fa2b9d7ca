"""Which method decides, and what the result tells of it, on a flight in moving air."""

import numpy as np
import pytest

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sensor import sensor_bias, sensor_delay, sensor_lag
from aerosid.effects.sensor_position import sensor_position
from aerosid.equation_error.selection.penalties import KinematicEvidence
from aerosid.equation_error.selection.structure import SelectedEffect
from aerosid.equation_error.selection.time_delays import DelayDiscrepancy
from aerosid.equation_error.selection.turbulence import Turbulence
from aerosid.equation_error.selection.vane_position import IdentifiedVane
from aerosid.equation_error.selection.wald_tests import EffectEstimate
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.equation_error_notes import (
    note_on_delay,
    note_on_supported_error,
    note_on_unsized_turbulence,
    note_on_vane,
)
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from benchmarks.turbulent_flights import BODIES, Wrong, aircraft_of, flown

BRIEF = LoopSettings(next_flight=False, linear_analysis=False, paper_chain=False)
SEEDS = 7000


@pytest.fixture(scope="module")
def moved() -> ClosedLoop:
    aircraft = aircraft_of(BODIES[0], 0.08, np.random.default_rng(SEEDS))
    wrong = Wrong(delay={"alpha": 0.12})
    logs = [flown(name, BODIES[0], SEEDS + n, air=0.6, wrong=wrong, seconds=24.0) for n, name in enumerate("ab")]
    return close_loop(logs[:1], aircraft, logs[1:], settings=BRIEF)


def test_in_moving_air_the_equations_decide_and_the_result_says_so(moved: ClosedLoop) -> None:
    assert any("method equations" in note for note in moved.notes)
    assert moved.second_opinion is None
    assert sum("was not used as a cross-check" in note for note in moved.notes) == 1
    first = moved.effects[0]
    assert (first.kind, first.where) in {("sensor_delay", "alpha"), ("sensor_lag", "alpha")}
    assert abs(first.value - 0.12) < 4.0 * first.std_error


def test_its_shares_are_those_of_the_regression_and_no_unseen_one_falls(moved: ClosedLoop) -> None:
    unseen = [row for row in moved.coefficients if row.log == "b"]
    assert {row.coefficient for row in unseen} == {"C_X", "C_Z", "C_m"}
    for row in unseen:
        assert row.r2_after > row.r2_before - 0.002
        assert row.r2_after > 0.7


def test_its_derivatives_are_those_of_the_regression(moved: ClosedLoop) -> None:
    body = BODIES[0]
    rows = {row.term: row for row in moved.derivatives if row.coefficient == "C_m"}
    for term in ("alpha", "delta_e"):
        deviation = rows[term].std_error
        assert deviation is not None
        assert abs(rows[term].value - body.terms["C_m", term]) < 4.0 * deviation


def test_two_witnesses_of_a_late_vane_are_told_with_their_numbers() -> None:
    slow, late = (
        ActiveEffect(made("alpha"), (value,), "") for made, value in ((sensor_lag, 0.1379), (sensor_delay, 0.2147))
    )
    said = note_on_delay(DelayDiscrepancy("alpha", late, 0.0223, slow, 0.0099))
    assert "kinematics alone give a delay of 0.215 ± 0.022 s" in said
    assert "together with forces and moments a lag of 0.1379 ± 0.0099 s, which the completed model uses." in said


def test_turbulence_of_two_independent_gusts_is_told_and_has_no_size_to_be_named_with() -> None:
    """On a pull-up of the Citation .43 +- .21 m/s, the correlation of the wind as long as half the record."""
    seen = Turbulence("gust", 0.428, 0.214, 4171.0, 0.8, 0.1)
    assert not seen.has_known_size(3.0)
    assert Turbulence("gust", 0.428, 0.142, 300.0, 0.8, 0.1).has_known_size(3.0)
    assert "vertical turbulence of 0.43 ± 0.21 m/s (standard deviation) over 4200 m" in note_on_unsized_turbulence(seen)


def test_a_fault_that_two_witnesses_name_together_is_told_with_what_each_shows() -> None:
    active = ActiveEffect(sensor_bias("V", "m/s", 0.1), (-6.05,), "")
    hypothesis = Hypothesis("sensor_bias", "V", effects=(active,))
    row = EffectEstimate(hypothesis, active, -6.05, 0.5, (0.5,), 47.0, "coefficients")
    said = note_on_supported_error(row, KinematicEvidence((-5.2,), np.array([[1.44]]), 8.4, 8.4))
    assert said.startswith(
        "sensor_bias of V of −6.05 ± 0.50 m/s is identified from kinematics and coefficients together"
    )
    assert "kinematics alone give −5.2 ± 1.2 m/s, 2 ln L 16.8, which is not significant" in said


def test_a_vane_placed_beside_its_lag_is_told_with_the_lag_alone() -> None:
    ahead = ActiveEffect(sensor_position("alpha", "x"), (5.98,), "")
    alone = ActiveEffect(sensor_lag("alpha"), (0.1532,), "")
    hypothesis = Hypothesis("sensor_position", "alpha", effects=(ahead,))
    vane = IdentifiedVane(SelectedEffect(hypothesis, kinematic=False, gain=13.2), alone, 0.0085)
    said = note_on_vane(vane, EffectEstimate(hypothesis, ahead, 5.98, 1.04, (1.04,), 13.2, "coefficients"))
    assert "identified as 6.0 ± 1.0 m ahead of the centre of gravity" in said
    assert "Without the position the lag is 0.1532 ± 0.0085 s and 2 ln L is 26 lower." in said
    assert said.endswith("declare it in the channel map.")
    both = vane._replace(instead=(("aero_term", "C_X", "q_hat"),), unplaced=("beta",))
    said = note_on_vane(both, EffectEstimate(hypothesis, ahead, 5.98, 1.04, (1.04,), 13.2, "coefficients"))
    assert "26 lower, although C_X q_hat is then identified." in said
    assert said.endswith("The vane of beta is late too; its position was not looked for beside this one.")
