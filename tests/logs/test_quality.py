"""Each fault is planted in a valid log and found; the valid log has none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from recordings import recording

from aerosid.aircraft.bundled import bundled_folder
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.logs.quality import Finding, Problem, check_log
from aerosid.reporting.quality_tables import closing_sentence

Arrays = dict[str, NDArray[np.float64]]


def good_channels(seed: int = 0) -> tuple[NDArray[np.float64], Arrays]:
    """A simulated, kinematically consistent manoeuvre, 20 s at 20 ms."""
    random = np.random.default_rng(seed)
    time = 0.02 * np.arange(1000)
    delta_e = 0.05 * np.sign(np.sin(1.1 * time)) * (time > 1.0) * (time < 12.0)
    # A time constant of half a second: the elevator's part of the pitch rate, which determines its sign.
    answer = np.convolve(delta_e, np.exp(-2.0 * time), mode="full")[: time.size] * 0.02
    q = 0.056 * np.cos(0.7 * time) + 0.02 * np.cos(2.9 * time) - 2.0 * answer
    theta = np.concatenate([[0.0], np.cumsum(0.5 * (q[1:] + q[:-1]) * 0.02)])
    alpha = 0.05 + 0.02 * np.sin(2.9 * time - 0.4)
    true = {
        "V": 100.0 + 3.0 * np.cos(0.7 * time),
        "alpha": alpha,
        "q": q,
        "theta": theta,
        "a_x": 9.81 * np.sin(theta),
        "a_z": -9.81 - 250.0 * (alpha - 0.05),
        "delta_e": delta_e,
    }
    noise = {"V": 0.1, "alpha": 0.0005, "q": 0.0008, "theta": 0.0006, "a_x": 0.01, "a_z": 0.05, "delta_e": 1e-4}
    return time, {name: values + noise[name] * random.standard_normal(time.size) for name, values in true.items()}


def findings(time: NDArray[np.float64], channels: Arrays) -> tuple[Finding, ...]:
    return check_log(FlightLog("flight", time, channels)).findings


def found(time: NDArray[np.float64], channels: Arrays) -> set[tuple[Problem, str]]:
    return {(finding.problem, finding.subject) for finding in findings(time, channels)}


@pytest.mark.parametrize("seed", range(5))
def test_a_good_log_is_without_findings(seed: int) -> None:
    assert found(*good_channels(seed)) == set()


def _spike(c: Arrays) -> None:
    c["alpha"][300] += 0.1


def _missing(c: Arrays) -> None:
    c["theta"][50:60] = np.nan


def _empty(c: Arrays) -> None:
    c["a_x"][:] = np.nan


def _stuck(c: Arrays) -> None:
    c["theta"][400:800] = c["theta"][400]


def _constant(c: Arrays) -> None:
    c["theta"][:] = 0.0


def _cut(c: Arrays) -> None:
    c["q"][:] = np.minimum(c["q"], 0.06)


def _coarse(c: Arrays) -> None:
    c["alpha"][:] = 0.004 * np.round(c["alpha"] / 0.004)


def _weak(c: Arrays) -> None:
    c["V"][:] = 100.0 + 0.1 * np.random.default_rng(5).standard_normal(1000)


def _bank(c: Arrays) -> None:
    c["phi"] = np.linspace(0.0, 0.5, 1000)


def _degrees(c: Arrays) -> None:
    c["theta"][:] = np.degrees(c["theta"])


def _thousandths(c: Arrays) -> None:
    c["theta"][:] = 1000.0 * c["theta"]


def _negative(c: Arrays) -> None:
    c["theta"][:] = -c["theta"]


def _upward(c: Arrays) -> None:
    c["a_z"][:] = -c["a_z"]


def _reversed(c: Arrays) -> None:
    c["delta_e"][:] = -c["delta_e"]


def _still(c: Arrays) -> None:
    c["delta_e"][:] = 1e-4 * np.random.default_rng(5).standard_normal(1000)


@pytest.mark.parametrize(
    ("spoil", "problem", "subject"),
    [
        (_spike, Problem.SPIKES, "alpha"),
        (_missing, Problem.MISSING, "theta"),
        (_empty, Problem.EMPTY, "a_x"),
        (_stuck, Problem.STUCK, "theta"),
        (_constant, Problem.CONSTANT, "theta"),
        (_cut, Problem.SATURATED, "q"),
        (_coarse, Problem.COARSE, "alpha"),
        (_weak, Problem.WEAK, "V"),
        (_bank, Problem.LATERAL, "phi"),
        (_degrees, Problem.ANGLE_UNIT, "theta, q"),
        (_thousandths, Problem.RATE_UNIT, "theta, q"),
        (_negative, Problem.ANGLE_SIGN, "theta, q"),
        (_upward, Problem.LOAD_FACTOR, "a_z"),
        (_reversed, Problem.CONTROL_SIGN, "delta_e, q"),
        (_still, Problem.CONTROL_AT_REST, "delta_e"),
    ],
)
def test_a_planted_fault_is_found_and_no_other(spoil: Callable[[Arrays], None], problem: Problem, subject: str) -> None:
    time, channels = good_channels()
    spoil(channels)
    assert found(time, channels) == {(problem, subject)}


def test_a_log_whose_controls_rest_can_be_used_as_close_loop_says_that_nothing_is_excited() -> None:
    time, channels = good_channels()
    _still(channels)
    quality = check_log(FlightLog("flight", time, channels))
    assert quality.usable
    sentence, usable = closing_sentence(quality, None, None)
    assert usable
    assert sentence.startswith(
        "The log can be read, but close-loop can identify little or nothing from it: delta_e: no"
    )


@pytest.mark.parametrize(
    ("name", "problem", "usable"),
    [
        ("V", Problem.LACKING, False),
        ("alpha", Problem.LACKING, False),
        ("q", Problem.LACKING, False),
        ("delta_e", Problem.NO_CONTROL, False),
        ("theta", Problem.HELPFUL, True),
        ("a_z", Problem.HELPFUL, True),
    ],
)
def test_what_close_loop_would_lack(name: str, problem: Problem, usable: bool) -> None:
    time, channels = good_channels()
    del channels[name]
    quality = check_log(FlightLog("flight", time, channels))
    assert [finding.problem for finding in quality.findings] == [problem]
    assert quality.usable is usable
    assert quality.findings[0].blocking is not usable


def test_gaps_and_uneven_sampling() -> None:
    time, channels = good_channels()
    keep = np.ones(time.size, dtype=bool)
    keep[200:240] = keep[600:610] = False
    cut = {name: values[keep] for name, values in channels.items()}
    quality = check_log(FlightLog("flight", time[keep], cut))
    assert [gap[0] for gap in quality.gaps] == pytest.approx([time[199], time[599]])
    assert [gap[1] for gap in quality.gaps] == pytest.approx([0.82, 0.22])
    assert {finding.problem for finding in quality.findings} == {Problem.GAPS}
    jitter = time + 0.004 * np.random.default_rng(3).uniform(-1.0, 1.0, time.size)
    assert (Problem.UNEVEN, "time") in found(jitter, channels)


def test_the_place_and_number_of_spikes() -> None:
    time, channels = good_channels()
    for k in (100, 500, 900):
        channels["q"][k] -= 0.5
    (finding,) = findings(time, channels)
    assert finding.detail == "3 at 2, 10, 18 s"
    by_name = {channel.name: channel for channel in check_log(FlightLog("flight", time, channels)).channels}
    assert by_name["q"].spikes == 3


def test_beside_a_spike_of_any_height_the_noise_is_known() -> None:
    time, channels = good_channels()
    channels["q"][500] *= 1e4
    assert found(time, channels) == {(Problem.SPIKES, "q")}


def test_resolution_is_measured() -> None:
    time, channels = good_channels()
    channels["alpha"] = np.round(channels["alpha"] / 0.003) * 0.003
    by_name = {channel.name: channel for channel in check_log(FlightLog("flight", time, channels)).channels}
    assert by_name["alpha"].quantum == pytest.approx(0.003)
    assert by_name["q"].quantum == 0.0


def test_noise_and_excitation_are_those_planted() -> None:
    time, channels = good_channels()
    by_name = {channel.name: channel for channel in check_log(FlightLog("flight", time, channels)).channels}
    assert by_name["q"].noise == pytest.approx(0.0008, rel=0.15)
    variation = np.sqrt(np.var(channels["q"]) - 0.0008**2)
    assert by_name["q"].excitation == pytest.approx(variation / 0.0008, rel=0.15)


def test_every_finding_is_a_sentence() -> None:
    for problem in Problem:
        text = str(Finding(problem, "q", "detail"))
        assert text.startswith("q (detail): ")
        assert text.endswith(".")


@pytest.mark.parametrize(
    ("name", "channel_map"),
    [
        ("hfb320/hfb320_1_10.asc", "hfb320"),
        ("attas/fAttasElv1.mat", "attas_mat"),
        ("attas/fAttas_qst01_withHeader.asc", "attas_stall"),
        ("twin_otter/totter_demo_018.csv", "twin_otter"),
        ("citation/seg_ref_20180312_shortperiod.csv", "citation"),
    ],
)
def test_real_manoeuvres_are_usable_and_free_of_false_alarms(name: str, channel_map: str) -> None:
    log = read_log(recording(name), Path(bundled_folder("flight_data")) / "channel_maps" / f"{channel_map}.toml")
    quality = check_log(log)
    assert quality.usable
    # The Citation's channels are filtered, ATTAS' alpha of the stall and altitude computed or recorded more slowly.
    assert {finding.problem for finding in quality.findings} <= {Problem.COARSE, Problem.NOISE_UNKNOWN}
    doubted = {finding.subject for finding in quality.findings if finding.problem is Problem.NOISE_UNKNOWN}
    assert not doubted or name.startswith(("citation", "attas"))


def test_unit_mistake_in_a_real_header_is_noticed(tmp_path: Path) -> None:
    """The stall recording's own row of units gives degrees where theta and q are in radians."""
    path = recording("attas/fAttas_qst01_withHeader.asc")
    channel_map = tmp_path / "map.toml"
    channel_map.write_text(
        'schema = 1\nformat = "ascii"\ntime = { column = "T" }\n[channels]\n'
        'theta = { column = "THE", unit = "rad" }\nq = { column = "QRGY" }\n'
    )
    problems = {finding.problem for finding in check_log(read_log(path, channel_map)).findings}
    assert Problem.ANGLE_UNIT in problems


def test_a_channel_that_differs_in_capital_letters_alone_is_named() -> None:
    time, channels = good_channels()
    channels["Alpha"] = channels.pop("alpha")
    (finding,) = findings(time, channels)
    assert finding.detail == "angle of attack; is Alpha meant?"
