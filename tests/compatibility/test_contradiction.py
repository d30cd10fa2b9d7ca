"""Channels that cannot belong to one motion are named, and nothing else is estimated; ordinary flights have none."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from contradicted_logs import judged, late
from problems import BOTH_SQUARES, LIGHT, Problem, with_channels
from pypdf import PdfReader
from scipy.signal import savgol_filter

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.compatibility import Agreement, check_kinematics
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.verdict import Verdict
from aerosid.reporting import write_report
from benchmarks.turbulent_flights import BODIES, Wrong, flown

SEEDS = 8_300
"""Of flights in turbulence; published tables and trials begin elsewhere."""

G = 9.80665
SLOW = {"V": 10.0, "h": 5.0}
"""Hz; rates of the airspeed and height of a small unmanned aircraft."""

FLOWN = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=15.0, amplitude=0.06)


@pytest.fixture(scope="module")
def log() -> FlightLog:
    return FLOWN.fly(4)


@pytest.mark.slow
def test_a_channel_with_the_wrong_sign_is_named_with_its_remedy(log: FlightLog) -> None:
    (found,) = judged(with_channels(log, alpha=-log["alpha"]))
    assert found.channels == ("alpha",)
    assert "sign" in found.remedy
    assert "alpha" in found.sentence


def test_a_contradicting_channel_may_lack_samples(log: FlightLog) -> None:
    """Moving its clock spread a missing sample over those that are compared, and no step could be computed."""
    alpha = -log["alpha"]
    alpha[100:103] = np.nan
    (found,) = judged(with_channels(log, alpha=alpha))
    assert found.channels == ("alpha",)
    assert "sign" in found.remedy


def test_what_is_told_as_unexplained_is_that_of_the_log_as_recorded() -> None:
    """The path bends to an alpha of the wrong sign: 8 % of it are unexplained, of another twice its variation."""
    log = read_log(bundled_folder("flight_data") / "light_transport_doublet.csv")
    (found,) = judged(with_channels(log, alpha=-log["alpha"]))
    assert found.channels == ("alpha",)
    assert found.misfit > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["a_z", "q", "theta"])
def test_any_channel_with_the_wrong_sign_is_named(log: FlightLog, channel: str) -> None:
    (found,) = judged(with_channels(log, **{channel: -log[channel]}))
    assert found.channels == (channel,)
    assert "sign" in found.remedy


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["q", "alpha", "theta"])
def test_degrees_taken_for_radians_are_named(log: FlightLog, channel: str) -> None:
    (found,) = judged(with_channels(log, **{channel: np.degrees(log[channel])}))
    assert found.channels == (channel,)
    assert "degrees" in found.remedy


@pytest.mark.parametrize(("channel", "height"), [("V", 80.0), pytest.param("q", 500.0, marks=pytest.mark.slow)])
def test_spikes_that_contradict_are_told_as_spikes(log: FlightLog, channel: str, height: float) -> None:
    spoiled = log[channel].copy()
    spoiled[[100, 200, 300]] += [height, -height, height]
    (found,) = judged(with_channels(log, **{channel: spoiled}))
    assert found.channels == (channel,)
    times = ", ".join(f"{log.time[k]:g}" for k in (100, 200, 300))
    assert found.sentence.endswith(f"it agrees once the spikes of {channel} (3 at {times} s) are left empty.")


@pytest.mark.slow
def test_a_contradiction_is_told_in_spite_of_spikes(log: FlightLog) -> None:
    spoiled = log["V"] / 3.6
    spoiled[200] += 30.0
    (found,) = judged(with_channels(log, V=spoiled))
    assert "m/s and not km/h" in found.sentence


@pytest.mark.slow
def test_an_acceleration_in_place_of_specific_force_is_named(log: FlightLog) -> None:
    (found,) = judged(with_channels(log, a_z=log["a_z"] + G))
    assert found.channels == ("a_z",)
    assert "9.81" in found.remedy


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["q", "alpha", "theta"])
def test_a_clock_that_is_seconds_off_is_named(log: FlightLog, channel: str) -> None:
    (found,) = judged(late(log, channel, 3.0))
    assert found.channels == (channel,)
    assert "3 s earlier" in found.remedy


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["alpha", "theta"])
def test_a_channel_of_another_flight_is_named(log: FlightLog, channel: str) -> None:
    other = replace(FLOWN, elevator="doublet", amplitude=-0.06).fly(5)
    (found,) = judged(with_channels(log, **{channel: other[channel]}))
    assert found.channels == (channel,)
    assert not found.remedy


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1.0 / 3.6, "m/s and not km/h (a factor of 3.600)"),
        (3.6, "km/h and not m/s (a factor of 0.2778)"),
        pytest.param(0.514444, "m/s and not knots (a factor of 1.944)", marks=pytest.mark.slow),
        pytest.param(1.0 / 0.514444, "knots and not m/s (a factor of 0.5144)", marks=pytest.mark.slow),
        pytest.param(1.0 / 1.852, "knots and not km/h (a factor of 1.852)", marks=pytest.mark.slow),
        pytest.param(0.3048, "m/s and not ft/s (a factor of 3.281)", marks=pytest.mark.slow),
    ],
)
def test_an_airspeed_in_another_unit_is_named_with_its_factor(log: FlightLog, factor: float, words: str) -> None:
    (found,) = judged(with_channels(log, V=factor * log["V"]))
    assert found.channels == ("V",)
    assert words in found.sentence


def test_an_airspeed_in_another_unit_is_named_in_moving_air() -> None:
    """Gusts of 1 m/s leave misfits of V and alpha that vanish with no unit."""
    log = FLOWN.fly(4)
    generator, gusts = np.random.default_rng(8), [0.0]
    remembered = np.exp(-0.5 * FLOWN.interval)
    for shock in generator.standard_normal(log.time.size - 1):
        gusts.append(remembered * gusts[-1] + 1.0 * np.sqrt(1.0 - remembered**2) * shock)
    moving = with_channels(log, alpha=log["alpha"] + np.array(gusts) / log["V"], V=log["V"] + np.roll(gusts, 90))
    assert not judged(moving)
    (found,) = judged(with_channels(moving, V=moving["V"] / 3.6))
    assert found.channels == ("V",)
    assert "m/s and not km/h (a factor of 3.600)" in found.sentence


@pytest.mark.parametrize("place", [pytest.param(0, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow), 4])
def test_an_airspeed_in_knots_is_named_in_turbulence_that_dominates_both_channels(place: int) -> None:
    """Gusts of 0.6 m/s leave a misfit of V and alpha with any unit; together they fall with the right one."""
    log = flown("a", BODIES[place % len(BODIES)], SEEDS + place, air=0.6, seconds=24.0)
    assert not judged(log)
    (found,) = judged(with_channels(log, V=log["V"] / 0.514444))
    assert found.channels == ("V",)
    assert "knots and not m/s" in found.remedy


@pytest.mark.parametrize(("factor", "words"), [(1.0 / 0.3048, "feet and not metres"), (0.3048, "metres and not feet")])
def test_a_height_in_another_unit_is_named(log: FlightLog, factor: float, words: str) -> None:
    """Scale factors and delays of airspeed and height, which are tolerated, had bent the path as far."""
    (found,) = judged(with_channels(log, h=factor * log["h"]))
    assert found.channels == ("h",)
    assert words in found.remedy


@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_a_scale_factor_error_of_height_is_no_unit(log: FlightLog, factor: float) -> None:
    assert not any("and not" in found.remedy for found in judged(with_channels(log, h=factor * log["h"])))


@pytest.mark.parametrize("factor", [*(pytest.param(factor, marks=pytest.mark.slow) for factor in (0.7, 0.85)), 1.3])
def test_a_scale_factor_error_of_airspeed_is_no_unit(log: FlightLog, factor: float) -> None:
    assert not any("and not" in found.remedy for found in judged(with_channels(log, V=factor * log["V"])))


def test_consistent_flights_have_no_contradiction_even_in_strong_noise() -> None:
    for seed, elevator in enumerate(("3211", "doublet", "none")):
        noise = {name: 4.0 * value for name, value in FLOWN.noise.items()}
        assert not judged(replace(FLOWN, elevator=elevator, noise=noise).fly(seed))


@pytest.mark.parametrize("as_recorded", ["held", "interpolated", "smoothed"])
def test_late_slow_channels_without_noise_of_their_own_are_no_contradiction(as_recorded: str) -> None:
    """By a noise of nought the path followed airspeed and height through gusts and delay; theta and alpha were bent."""
    wrong = Wrong(delay={"V": 0.25, "h": 0.3})
    log = flown("a", BODIES[1], SEEDS + 10, air=0.5, wrong=wrong, seconds=16.0, interval=0.02)
    assert not judged(log)
    assert not judged(with_channels(log, **{name: _slow(log, name, hz, as_recorded) for name, hz in SLOW.items()}))


@pytest.mark.parametrize("as_recorded", ["held", pytest.param("interpolated", marks=pytest.mark.slow)])
def test_an_airspeed_in_another_unit_is_named_where_it_is_slow(log: FlightLog, as_recorded: str) -> None:
    slow = with_channels(log, **{name: _slow(log, name, hz, as_recorded) for name, hz in SLOW.items()})
    assert not judged(slow)
    (found,) = judged(with_channels(slow, V=slow["V"] / 3.6))
    assert found.channels == ("V",)
    assert "m/s and not km/h (a factor of 3.600)" in found.sentence


def _slow(log: FlightLog, name: str, hz: float, as_recorded: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A channel whose instrument gives `hz` samples a second, in a faster log."""
    every = round(1.0 / (hz * float(np.median(np.diff(log.time)))))
    values = log[name]
    match as_recorded:
        case "held":
            return np.asarray(values[np.arange(values.size) // every * every])
        case "interpolated":
            return np.asarray(np.interp(log.time, log.time[::every], values[::every]))
        case _:
            return np.asarray(savgol_filter(savgol_filter(values, 41, 3), 41, 3))


def test_a_loop_on_contradicting_channels_estimates_no_aerodynamics_and_reports_why(
    log: FlightLog, tmp_path: Path
) -> None:
    swapped = replace(with_channels(log, alpha=-log["alpha"]), path="swapped.csv", sha256="0" * 64)
    result = close_loop([swapped], LIGHT)
    assert result.verdict is Verdict.INCONSISTENT_DATA
    assert not result.effects
    assert "alpha" in result.summary
    assert result.kinematics is not None
    assert result.kinematics.verdict is Agreement.INCONSISTENT
    write_report(result, tmp_path)
    document = json.loads((tmp_path / "result.json").read_text())
    assert document["verdict"] == "inconsistent_data"
    assert document["kinematics"]["contradictions"][0]["channels"] == ["alpha"]
    assert all(row["after"] is None for row in document["error"])
    page = (tmp_path / "report.html").read_text()
    assert "Data compatibility check" in page
    assert "Nothing was estimated" in page
    assert "nothing was fitted" in page
    paper = " ".join(" ".join(sheet.extract_text().split()) for sheet in PdfReader(tmp_path / "report.pdf").pages)
    body = paper.partition("Appendix B")[0]
    assert "Nothing was estimated" in body
    for untrue in (
        "No effect of the library",
        "not significant",
        "too little information",
        "completed model leaves",
        "diverged",
        "used in the fit",
        "fitted flights",
        "No other effect",
    ):
        assert untrue not in body
    assert "significant" not in (tmp_path / "completed_aircraft.toml").read_text()
    completed = load_aircraft(tmp_path / "completed_aircraft.toml")
    assert completed.derivatives == LIGHT.derivatives


def test_a_delay_that_an_instrument_may_have_is_no_contradiction(log: FlightLog) -> None:
    agreement = check_kinematics([late(log, "alpha", 0.25)])
    assert agreement is not None
    assert agreement.verdict is Agreement.CORRECTED
    assert agreement.findings[0].value == pytest.approx(0.25, abs=0.01)
