"""The title block: everything that a signature refers to, and nothing that changes between equal runs."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hostile_pages import Page
from problems_report import closed_loop

from aerosid.aircraft import load_aircraft
from aerosid.cli.close_loop import command_line, loop_settings, provenance
from aerosid.errors import UsageError
from aerosid.loop.provenance import Provenance
from aerosid.loop.result import ClosedLoop
from aerosid.reporting import report_html, write_report
from aerosid.reporting.flight_condition import FOOT, flight_condition
from aerosid.reporting.title_block import title_block


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    made = closed_loop(samples=60)
    signed = Provenance(
        "2026-11-22", {"priors": True, "chain.filtering": "off"}, "aerosid close-loop a.csv", "A. Analyst", "Vane anew."
    )
    log = dataclasses.replace(made.identification[0], channel_map="maps/recorder.toml", channel_map_sha256="ab" * 32)
    return dataclasses.replace(made, provenance=signed, identification=(log,))


def test_the_page_names_run_files_condition_and_references(result: ClosedLoop) -> None:
    text = " ".join(Page(report_html(result, interactive=False)).text.split())
    wanted = [
        "2026-11-22",
        "A. Analyst",
        "Vane anew.",
        "aerosid close-loop a.csv",
        "priors: yes (default no); chain, filtering: off (default zero-phase)",
        "maps/recorder.toml",
        "ab" * 32,
        result.aircraft.sha256,
        *(log.sha256 for log in (*result.identification, *result.validation)),
        "wing area S 23.23 m², mean chord c 1.5875 m",
        "airspeed U0 100 m/s",
        "6940 kg m²",
        "centre of gravity; moments and accelerations refer to it",
        "trailing edge down",
        "calibrated airspeed",
        "centre of gravity, flaps and gear",
        "not recorded",
    ]
    for words in wanted:
        assert words in text, words


def test_the_span_of_every_log_is_told(result: ClosedLoop) -> None:
    files = title_block(result)["files"]
    spans = [(file.role, file.span) for file in files if file.span]
    assert spans == [("identification", "0 to 1.77"), ("validation", "0 to 1.77")]


def test_a_held_out_flight_stands_in_the_title_block_and_no_folder_does(result: ClosedLoop) -> None:
    away = dataclasses.replace(result.validation[0], path="/home/someone/flights/third.csv", sha256="cd" * 32)
    block = title_block(dataclasses.replace(result, hold_out=(away,)))
    third = block["files"][2]
    assert (third.path, third.role, third.span, third.sha256) == ("third.csv", "hold-out", "0 to 1.77", "cd" * 32)
    assert block["logs"][-1] == (away.name, "hold-out")
    text = report_html(dataclasses.replace(result, hold_out=(away,)), interactive=False)
    assert "cd" * 32 in text
    assert "/home/someone" not in text


def test_the_condition_is_that_of_the_recording(result: ClosedLoop) -> None:
    log = result.identification[0]
    flat = {**log.channels, "h": np.full(log.samples, 3000.0), "V": np.full(log.samples, 120.0)}
    steady = dataclasses.replace(log, channels={**flat, "mass": np.full(log.samples, 2100.0)})
    units = {**steady.units, "mass": "kg"}
    condition = flight_condition(dataclasses.replace(steady, units=units), result.aircraft)
    assert condition["altitude"] == "3000 m, 9843 ft"
    assert condition["mass"] == "2100 kg"
    assert condition["true airspeed"] == "120.0 m/s"
    # At 3000 m on a standard day the speed of sound is 328.58 m/s; 120 m/s are 202 kt CAS.
    assert condition["Mach number"] == "0.365 (standard day)"
    assert condition["calibrated airspeed"] == "202 kt (standard day)"
    assert pytest.approx(0.3048) == FOOT


def test_the_configuration_is_that_of_the_aircraft_file(result: ClosedLoop) -> None:
    flown = {"centre_of_gravity": "25 % of the mean chord", "gear": "down"}
    aircraft = dataclasses.replace(result.aircraft, configuration=flown)
    condition = flight_condition(result.identification[0], aircraft)
    assert (condition["centre of gravity"], condition["gear"]) == ("25 % of the mean chord", "down")
    assert condition["flaps"] == "not recorded"


def test_a_configuration_is_read_from_the_file(tmp_path: Path) -> None:
    file = tmp_path / "craft.toml"
    file.write_text(load_aircraft("light_transport").text + '\n[configuration]\nflaps = "20 deg"\n')
    assert dict(load_aircraft(file).configuration) == {"flaps": "20 deg"}


def test_who_says_nothing_gets_no_empty_lines() -> None:
    run = dict(title_block(closed_loop(samples=60))["run"])
    assert set(run) == {"Program"}


def test_the_command_says_nothing_of_where_files_go() -> None:
    words = ["close-loop", "a log.csv", "--out", "somewhere", "--priors", "--out=elsewhere", "--aircraft", "x"]
    assert command_line(words) == "aerosid close-loop 'a log.csv' --priors --aircraft x"


def test_the_date_is_that_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = loop_settings("off", None, priors=True, seed=0)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    made = provenance(["close-loop", "a.csv"], settings, "A", "")
    assert made.date == "1970-01-02"
    assert dict(made.settings) == {"priors": True, "chain.filtering": "off"}
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(UsageError, match="SOURCE_DATE_EPOCH"):
        provenance([], settings, "", "")


def test_a_signed_report_is_the_same_twice(result: ClosedLoop, tmp_path: Path) -> None:
    one, other = (write_report(result, tmp_path / name, interactive=False) for name in ("one", "other"))
    for first, second in zip(one, other, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.name
