"""Flights of benchmarks/wide_detection.py on which a false effect was named first, each with its reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from problems import NOISE, SILENT, Problem, with_channels
from scipy.signal import lfilter

from aerosid.aircraft import load_aircraft
from aerosid.compatibility import check_kinematics
from aerosid.estimation.maximum_likelihood import refine
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.identification import identify
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict, judge
from aerosid.search.turbulence_innovations import with_turbulence_innovations
from benchmarks.wide_detection import closed, gain, written


def loop(seed: int, number: int, folder: Path, plant: str = "one") -> ClosedLoop:
    """The loop on one pair of flights with one or two missing effects."""
    written(folder, plant, [seed, number], number)
    return closed(folder)


def names(result: ClosedLoop) -> list[tuple[str, str]]:
    return [(effect.kind, effect.where) for effect in result.effects]


def test_ground_effect_is_named_though_its_gain_and_reach_are_correlated(tmp_path: Path) -> None:
    """On a short flight neither parameter is significant, and their joint effect is."""
    result = loop(901, 16, tmp_path)
    assert names(result) == [("ground_effect", "C_Z")]
    (effect,) = result.effects
    assert abs(effect.value) < 4.0 * effect.std_error
    assert effect.evidence.p_value < 1e-6


@pytest.mark.slow
def test_the_penalty_of_one_step_change_is_without_the_two_tried_with_it(tmp_path: Path) -> None:
    """A step of the centre of gravity has two parameters; of all coefficients at once six, of one of them two."""
    result = loop(901, 8, tmp_path)
    assert names(result) == [("step_change", "C_m")]
    # It is the rarer of two hardly distinguishable effects, and is listed as an alternative.
    assert [(effect.kind, effect.where) for effect in result.alternatives] == [("cg_shift", "x")]


@pytest.mark.slow
def test_a_surface_seconds_behind_its_record_is_found_from_a_profile_of_limits(tmp_path: Path) -> None:
    result = loop(901, 23, tmp_path)
    assert names(result) == [("control_rate_limit", "delta_e")]
    assert result.effects[0].value == pytest.approx(0.039, rel=0.02)


@pytest.mark.slow
def test_separation_is_tried_where_only_the_validation_flight_shows_the_terms_to_be_inadequate(
    tmp_path: Path,
) -> None:
    assert names(loop(901, 31, tmp_path)) == [("flow_separation", "C_Z")]


@pytest.mark.slow
def test_gusts_shown_by_kinematics_are_distinguished_from_coloured_vane_noise(tmp_path: Path) -> None:
    """Kinematics give an initial estimate alone; the forces decide."""
    seen = {}
    for plant, number in (("one", 10), ("one", 31), ("one", 33), ("two", 13)):
        folder = tmp_path / f"{plant}{number}"
        written(folder, plant, [901, number], number)
        agreement = check_kinematics([read_log(folder / "identification.csv")])
        assert agreement is not None
        seen[plant, number] = agreement.is_gusty
    assert seen == {("one", 10): True, ("one", 31): False, ("one", 33): False, ("two", 13): True}


@pytest.mark.slow
def test_a_gust_and_a_scale_factor_error_are_found_together(tmp_path: Path) -> None:
    """By equation error, which decides where kinematics are inconsistent, and by the likelihood."""
    result = loop(901, 9, tmp_path, "two")
    assert result.decided_by == "equations"
    assert set(names(result)) == {("gust", ""), ("sensor_scale", "a_z")}
    assert result.effects[0].value == pytest.approx(1.13, abs=4.0 * result.effects[0].std_error)
    # No open-loop simulation follows either flight, and the innovations of a filter with that gust are noise.
    assert result.verdict is Verdict.EXPLAINED
    logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
    asked = LoopSettings(method="likelihood", paper_chain=False, next_flight=False, linear_analysis=False)
    by_likelihood = close_loop(logs[:1], load_aircraft(tmp_path / "aircraft.toml"), logs[1:], asked)
    assert set(names(by_likelihood)) == {("gust", ""), ("sensor_scale", "a_z")}


@pytest.mark.slow
def test_a_gust_does_not_explain_what_else_is_missing(tmp_path: Path) -> None:
    """The verdict on the same two flights without the scale factor, and without the lag of the elevator."""
    for number, kind in ((9, "sensor_scale"), (13, "control_lag")):
        written(tmp_path, "two", [901, number], number)
        logs = [read_log(tmp_path / f"{role}.csv") for role in ("identification", "validation")]
        identified = identify(logs[:1], load_aircraft(tmp_path / "aircraft.toml"), logs[1:])
        found, search = identified.found, identified.search
        assert found is not None
        assert search is not None
        assert {finding.kind for finding in found.findings} == {"gust", kind}
        assert judge(found, identified.manoeuvres, identified.validation).verdict is Verdict.EXPLAINED
        lacking = replace(found, completed=found.before, in_turbulence=None, dependence=None)
        lacking = with_turbulence_innovations(lacking, search)
        assert lacking.in_turbulence is not None
        assert judge(lacking, identified.manoeuvres).verdict is Verdict.PARTLY_EXPLAINED


@pytest.mark.slow
def test_two_errors_of_the_elevator_that_neither_flight_shows_alone_are_no_lack_of_excitation(tmp_path: Path) -> None:
    """Delay and dead band are refuted; the dead band gains nine times its penalty, and C_m alpha is known to 2.5 %."""
    assert loop(911, 0, tmp_path, "two").verdict is Verdict.UNEXPLAINED


@pytest.mark.slow
def test_a_gust_and_a_stall_are_found_together(tmp_path: Path) -> None:
    assert set(names(loop(901, 5, tmp_path, "two"))) == {("gust", ""), ("flow_separation", "C_Z")}


@pytest.mark.slow
def test_one_of_several_step_changes_is_retained_with_the_separation_that_explains_the_others(tmp_path: Path) -> None:
    assert set(names(loop(902, 2, tmp_path, "two"))) == {("cg_shift", "x"), ("flow_separation", "C_Z")}


@pytest.mark.slow
def test_separation_is_tried_in_place_of_many_terms(tmp_path: Path) -> None:
    assert set(names(loop(902, 18, tmp_path, "two"))) == {("sensor_scale", "a_z"), ("flow_separation", "C_Z")}


def unexplained(log: FlightLog) -> tuple[str, ...]:
    """The channels that the true structure, re-estimated, does not explain."""
    model, manoeuvre = Problem().prepared(log)
    return unexplained_channels(refine(model, [manoeuvre], model.entries), [manoeuvre])


@pytest.mark.parametrize("seed", range(3))
def test_held_samples_are_no_noise_and_coloured_noise_is(seed: int) -> None:
    generator = np.random.default_rng(seed)
    log, quiet = Problem().fly(seed), Problem(noise=SILENT).fly(seed)
    hanging = log["q"].copy()
    for start in generator.integers(40, hanging.size - 20, 6):
        hanging[start : start + 8] = hanging[start]
    shocks = NOISE["q"] * np.sqrt(1.0 - 0.7**2) * generator.standard_normal(log.time.size + 50)
    remembering = quiet["q"] + lfilter([1.0], [1.0, -0.7], shocks)[50:]
    assert unexplained(with_channels(log, q=hanging)) == ("q",)
    assert unexplained(with_channels(log, q=remembering)) == ()


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 4, 12])
def test_an_effect_outside_the_catalogue_is_neither_explained_nor_named_as_a_sensor_error(
    number: int, tmp_path: Path
) -> None:
    """A surface that floats, a rate gyro with a dead band, and a slow drift of the pitching moment.

    A term, or the air, may stand for a part of it, as long as it predicts the unseen flight no worse than the benchmark
    calls honest and the verdict says that more is missing.
    """
    result = loop(901, number, tmp_path, "outside")
    assert result.verdict in (Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED)
    assert [name for name in names(result) if name[0].startswith("sensor")] == []
    assert gain(result) >= 0.98


@pytest.mark.slow
def test_a_vane_at_its_stop_is_no_gust(tmp_path: Path) -> None:
    result = loop(903, 5, tmp_path, "outside")
    assert names(result) == []
    assert result.verdict is Verdict.UNEXPLAINED
