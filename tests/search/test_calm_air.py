"""The output-error estimate of the structure found by equation error, on two records with different trim."""

from dataclasses import replace

import lateral_flights as commuter
import numpy as np
import pytest

from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_delay
from aerosid.effects.sensor_position import sensor_place, sensor_position
from aerosid.effects.step_change import step_change
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.identification import identify
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.search.calm_air import along_fewer_axes, output_error_in_calm_air, without_eliminated
from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.findings import Part
from benchmarks import six_axis_flights
from benchmarks.plants import sensed_lagging
from benchmarks.sideways_plants import SidePlant

EQUATIONS = LoopSettings(method="equations", next_flight=False, linear_analysis=False, paper_chain=False)
TURNED = {("C_l", "1"): 0.0008, ("C_n", "1"): 0.0006}


@pytest.fixture(scope="module")
def joint() -> ClosedLoop:
    late = {"delta_r": lambda time, given: np.interp(time - 0.08, time, given)}
    one = commuter.Lateral(seed=21, surfaces=late).log(name="one")
    two = commuter.Lateral(seed=22, surfaces=late, extra=TURNED).log(mirrored=True, name="two")
    return close_loop([one, two], commuter.aircraft(commuter.SIDE, 0.93), settings=EQUATIONS)


def test_the_rudder_delay_is_the_only_finding_and_is_measured_by_kinematics(joint: ClosedLoop) -> None:
    (rudder,) = joint.effects
    assert (rudder.kind, rudder.where) in {("control_delay", "delta_r"), ("control_lag", "delta_r")}
    assert abs(rudder.value - 0.08) < 4.0 * rudder.std_error


def test_derivatives_are_within_their_standard_errors_though_the_trims_differ(joint: ClosedLoop) -> None:
    rows = [row for row in joint.derivatives if row.term != "1" and row.shown]
    assert len(rows) >= 10
    for row in rows:
        truth = commuter.SIDE[row.coefficient, row.term]
        assert row.std_error is not None
        assert abs(row.value - truth) < 4.0 * row.std_error


def test_each_record_is_simulated_with_its_own_constants(joint: ClosedLoop) -> None:
    rows = [row for row in joint.errors if row.channel in ("p", "r", "phi", "beta", "a_y")]
    assert {row.log for row in rows} == {"one", "two"}
    for row in rows:
        assert row.after is not None
        assert row.after < 1.15 * commuter.NOISE[row.channel]


@pytest.mark.slow
def test_the_gain_of_an_effect_does_not_depend_on_the_trims_of_the_records() -> None:
    """Without the effect, too, each record has its own constants: in common ones 1.96 became 2.23."""
    late = {"delta_r": lambda time, given: np.interp(time - 0.08, time, given)}
    one = commuter.Lateral(seed=21, surfaces=late).log(name="one")
    unseen = commuter.Lateral(seed=40, surfaces=late).log(mirrored=True, name="unseen")
    gains = []
    for turned in (0.0, 6.0):
        extra = {key: turned * value for key, value in TURNED.items()}
        two = commuter.Lateral(seed=22, surfaces=late, extra=extra).log(mirrored=True, name="two")
        found = close_loop([one, two], commuter.aircraft(commuter.SIDE, 0.93), [unseen], settings=EQUATIONS)
        gains += [effect.evidence.validation_gain for effect in found.effects]
    assert gains[1] == pytest.approx(gains[0], rel=0.02)


def test_an_eliminated_part_is_removed_from_the_start_though_its_values_have_changed() -> None:
    begun = tuple(ActiveEffect(step_change(name, 6.8, 0.04), (3e-4, 6.8), "one") for name in ("C_n", "C_l"))
    moved = tuple(ActiveEffect(step_change(name, 7.7, 0.04), (1e-5, 7.7), "one") for name in ("C_n", "C_l"))
    gone = Part(None, moved[0], 1e-5, 0.0, 6e-5)
    assert without_eliminated(begun, (*moved, moved[1]), gone) == begun[1:]
    assert without_eliminated(begun, moved, Part(None, None, 0.0, 0.0, 1.0)) == begun


def test_an_axis_of_a_position_that_is_not_shown_is_given_up() -> None:
    begun = (
        ActiveEffect(sensor_place("a_y", "xz"), (-1.1, 0.6)),
        ActiveEffect(control_delay("delta_a", 0.02), (0.02,)),
    )
    moved = (replace(begun[0], values=(-0.41, 0.58)), begun[1])

    def parts(errors: tuple[float, float]) -> list[Part]:
        return [Part(None, moved[0], -0.41, 0.0, errors[0], errors), Part(None, moved[1], 0.02, 0.0, 1e-3)]

    assert along_fewer_axes(begun, moved, parts((0.1, 0.01)), 3.0) is None
    for errors, axis, value in (((0.16, 0.01), "z", 0.58), ((0.1, 0.2), "x", -0.41)):
        fewer = along_fewer_axes(begun, moved, parts(errors), 3.0)
        assert fewer == (ActiveEffect(sensor_position("a_y", axis), (value,)), begun[1])


@pytest.mark.slow
def test_two_step_changes_of_one_coefficient_keep_their_own_values_and_instants() -> None:
    """Both were given the value of one, and the completed aircraft was 'wrong' on the same flight flown again."""
    flown = commuter.Lateral(seed=31, duration=24.0, extra={("C_n", "gear"): 1.0})
    unseen = commuter.Lateral(seed=33, duration=24.0).log(mirrored=True, name="unseen")
    flown = replace(flown, inputs={"gear": 0.004 * (flown.time >= 4.2) - 0.006 * (flown.time >= 16.5)})
    found = close_loop([flown.log(name="one")], commuter.aircraft(commuter.SIDE, 0.95), [unseen], EQUATIONS)
    later, earlier = sorted(found.effects, key=lambda effect: -(effect.time or 0.0))
    for effect, size, instant in ((later, -0.006, 16.5), (earlier, 0.004, 4.2)):
        assert (effect.kind, effect.where) == ("step_change", "C_n")
        assert effect.std_error is not None
        assert abs(effect.value - size) < 4.0 * effect.std_error
        assert effect.time == pytest.approx(instant, abs=0.05)
        assert effect.evidence.validation_gain is not None


@pytest.mark.slow
def test_behind_a_recorder_the_variances_contain_the_regression_s_and_the_values_are_the_same() -> None:
    logs = [commuter.Lateral(seed=seed).log(mirrored=seed > 41, name=str(seed)) for seed in (41, 42)]
    aircraft = commuter.aircraft(commuter.SIDE, 0.93)
    identified = identify(logs[:1], aircraft, logs[1:], EQUATIONS)
    search = identified.search
    assert search is not None
    assert identified.found is not None
    assert identified.found.predictions is not None
    decision = identified.found.predictions.decision
    found = attribute_by_equations(decision, identified.manoeuvres)
    plain, hidden = (output_error_in_calm_air(found, decision, search, noise_hidden=each) for each in (False, True))
    assert plain.completed.free == hidden.completed.free == found.completed.free
    assert np.array_equal(plain.completed.model.values, hidden.completed.model.values)
    assert found.completed_deviations.beside_effects is not None
    forces = np.diag(found.completed_deviations.beside_effects)
    expected = np.sqrt(plain.completed_deviations.corrected**2 + forces)
    assert hidden.completed_deviations.corrected == pytest.approx(expected, rel=1e-9)
    # Correlations are the simulation's.
    ratios = hidden.completed_deviations.corrected / plain.completed_deviations.corrected
    widened = plain.completed_deviations.covariance * np.outer(ratios, ratios)
    assert hidden.completed_deviations.covariance == pytest.approx(widened, rel=1e-9)
    assert hidden.deviations_of is not None
    again = hidden.deviations_of(hidden.completed)
    assert again.corrected == pytest.approx(hidden.completed_deviations.corrected, rel=0.02)


@pytest.mark.slow
def test_a_late_lateral_accelerometer_is_estimated_with_the_derivatives_that_depend_on_it() -> None:
    """With the kinematic value held, .127 +- .02 s of .1, C_Y r_hat was eight of its standard errors off."""
    body, late = next(each for each in six_axis_flights.BODIES if each.name == "regional jet"), 0.1
    at = six_axis_flights.Circumstances(body, 0.04, 30.0, gust=0.0, memory=0.3, off=0.06, recorder="filtered")
    plant = SidePlant("", sensors={"a_y": lambda time, force: sensed_lagging(time, force, late)})
    logs = [six_axis_flights.flown(str(seed), at, plant, seed) for seed in (7550, 7551)]
    aircraft = six_axis_flights.aircraft_of(at, plant, "lateral", np.random.default_rng(7550))
    found = close_loop(logs[:1], aircraft, logs[1:], EQUATIONS)
    (error,) = found.effects
    assert (error.kind, error.where) == ("sensor_lag", "a_y")
    assert error.value == pytest.approx(late, abs=3.0 * error.std_error)
    for row in found.derivatives:
        if row.coefficient == "C_Y" and row.term != "1":
            assert row.std_error is not None
            assert abs(row.value - body.terms["C_Y", row.term]) < 3.5 * row.std_error
