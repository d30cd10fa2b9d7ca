"""find, check and close-loop on whole flights: JSON, cuts that can be read back, one sentence in place of minutes."""

from __future__ import annotations

import functools
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from whole_flights import JET, Flight, fly_test, stepwise

import aerosid
from aerosid.cli.main import main
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.log_writing import channel_map_text, native_csv
from aerosid.logs.spans import expand
from aerosid.manoeuvres import KINDS, whole_flight_sentence


@functools.cache
def _flown(quiet: float) -> Flight:
    flight = Flight(JET, seed=11)
    unit, level = 0.09, 0.03
    for levels in ([(3, 1), (2, -1), (1, 1), (1, -1)], [(1, 1), (1, -1)]):
        flight.cruise(quiet)
        kind = "3211" if len(levels) == 4 else "doublet"
        inputs = stepwise([(n * unit, sign * level) for n, sign in levels])
        fly_test(flight, kind, sum(n for n, _ in levels) * unit, 0.8, delta_e=inputs)
    flight.cruise(quiet)
    return flight


@pytest.fixture(scope="module")
def flight_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("flights") / "flight.csv"
    path.write_text(native_csv(_flown(20.0).log(), "a simulated flight", 9))
    return path


def test_json_lists_kind_start_and_stop_on_the_recordings_clock(
    flight_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["find", str(flight_file), "--json"]) == 0
    listing = json.loads(capsys.readouterr().out)
    flight = _flown(20.0)
    for kind, start, stop in flight.truth:
        entry = next(entry for entry in listing["manoeuvres"] if entry["kind"] == kind)
        assert entry["start"] == pytest.approx(start, abs=0.3)
        assert entry["stop"] == pytest.approx(stop, abs=0.5 * flight.unit)
        assert entry["cut"]["from"] < entry["start"]
    assert {entry["kind"] for entry in listing["manoeuvres"]} <= set(KINDS)


def test_kinds_can_be_chosen(flight_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["find", str(flight_file), "--json", "--kinds", "doublet"]) == 0
    assert [entry["kind"] for entry in json.loads(capsys.readouterr().out)["manoeuvres"]] == ["doublet"]
    assert main(["find", str(flight_file), "--kinds", "duoblet"]) == 2
    assert "give one or more of" in capsys.readouterr().err


def test_cuts_read_back_as_the_recording_holds_them(flight_file: Path, tmp_path: Path) -> None:
    assert main(["find", str(flight_file), "--out", str(tmp_path)]) == 0
    log = aerosid.read_log(flight_file)
    listed = json.loads((tmp_path / "manoeuvres.json").read_text())["manoeuvres"]
    cuts = sorted((tmp_path / "cuts").glob("*.csv"))
    assert len(cuts) == len(listed)
    entry = next(entry for entry in listed if entry["kind"] == "doublet")
    cut = aerosid.read_log(next(path for path in cuts if "doublet" in path.name))
    whole = log.between(entry["cut"]["from"], entry["cut"]["to"])
    np.testing.assert_allclose(cut.time, whole.time, atol=1e-6)
    for name in whole.channels:
        np.testing.assert_allclose(cut[name], whole[name], rtol=1e-8, atol=1e-12)
    page = (tmp_path / "manoeuvres.html").read_text()
    assert page.count("<svg") == len(listed) + 1
    assert "3-2-1-1" in page
    caption = page[page.index("</b> 3-2-1-1,") :].partition("</figcaption>")[0]
    for phrase in ("Moved: elevator", "; air calm", "Expected standard errors:"):
        assert phrase in caption
    # The segment file is accepted by close-loop and batch.
    spans = expand([tmp_path / "segments.csv"])
    assert [span.start for span in spans] == [e["cut"]["from"] for e in listed if e["kind"] in ("3211", "doublet")]
    assert all(span.path == flight_file for span in spans)


def test_a_cuts_map_keeps_sensor_positions(tmp_path: Path) -> None:
    log = replace(_flown(2.0).log(), positions={"a_z": (1.5, 0.0, -0.25)})
    text = channel_map_text(log, "a cut")
    assert tomllib.loads(text)["channels"]["a_z"]["position"] == [1.5, 0.0, -0.25]
    (tmp_path / "cut.csv").write_text(native_csv(log, "a cut", 9))
    (tmp_path / "cut.csv.channels.toml").write_text(text)
    again = aerosid.read_log(tmp_path / "cut.csv")
    assert again.positions["a_z"] == (1.5, 0.0, -0.25)
    np.testing.assert_allclose(again["a_z"], log["a_z"], rtol=1e-8)


def test_a_whole_flight_is_refused_with_spans_that_look_useful(
    flight_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["close-loop", str(flight_file), "--aircraft", "light_transport"]) == 3
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "choose a span" in error
    assert "3211" in error
    assert "doublet" in error
    assert main(["check", str(flight_file), "--quiet"]) == 3
    assert "cannot be used by close-loop as it is" in capsys.readouterr().out


def test_the_sentence_says_when_the_flight_begins() -> None:
    log = _flown(20.0).log()
    time = np.arange(0.0, 200.0, log.interval)
    still = {name: np.full(time.size, 0.0) for name in log.channels} | {"h": np.full(time.size, 500.0)}
    joined = FlightLog(
        "flight",
        np.concatenate([time, time[-1] + log.interval + log.time]),
        {name: np.concatenate([still[name], log[name]]) for name in log.channels},
        log.units,
    )
    sentence = whole_flight_sentence(joined)
    assert sentence is not None
    assert "on the ground until 200 s" in sentence
    assert whole_flight_sentence(log.between(0.0, 100.0)) is None


def test_check_has_one_verdict_and_its_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = _flown(3.0).log().between(20.0, 60.0)
    good, lacking = tmp_path / "good.csv", tmp_path / "lacking.csv"
    good.write_text(native_csv(log, "good", 9))
    bare = replace(log, channels={name: log[name] for name in log.channels if name != "q"})
    lacking.write_text(native_csv(bare, "lacking", 9))
    assert main(["check", str(good)]) == 0
    output = capsys.readouterr().out
    assert output.count("by close-loop") == 1
    assert "Dynamic: " in output
    assert "3-2-1-1" in output
    assert main(["check", str(good), str(lacking)]) == 3
    output = capsys.readouterr().out
    assert output.count("can be used by close-loop") == 1
    assert output.count("cannot be used by close-loop: q") == 1


def test_check_refuses_contradicting_channels_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = _flown(3.0).log().between(25.0, 50.0)
    path = tmp_path / "opposed.csv"
    # Pitch angle with the wrong sign: an error of the map, not of an instrument.
    path.write_text(native_csv(replace(log, channels={**log.channels, "theta": -log["theta"]}), "opposed", 9))
    assert main(["check", str(path)]) == 3
    output = capsys.readouterr().out
    assert "contradict each other" in output
    assert "can be used by" not in output.replace("cannot be used by", "")


@pytest.mark.parametrize(
    ("added", "said"),
    [
        ("", "The log can be used by close-loop."),
        (
            '[[effects]]\nkind = "sensor_scale"\nwhere = "alpha"\nvalue = 1000',
            "has scale = 1000, expected from 0.2 to 5",
        ),
        (
            '[[effects]]\nkind = "control_lag"\nwhere = "delta_a"\nvalue = 0.1',
            "acts on delta_a, which no declared term",
        ),
        ('[derivatives.C_Y]\n"beta" = { value = -0.5 }', "C_Y"),
        ('[derivatives.C_m]\n"delta_f" = { value = -0.1 }', "delta_f"),
    ],
)
def test_check_promises_nothing_that_close_loop_refuses(
    added: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = Path(__file__).parents[2]
    log = root / "flight_data" / "light_transport_doublet.csv"
    text = (root / "aircraft_models" / "light_transport.toml").read_text()
    if added.startswith("[derivatives.C_m]"):
        text = text.replace("[derivatives.C_m]", added)
    else:
        text += "\n" + added
    aircraft = tmp_path / "aircraft.toml"
    aircraft.write_text(text)
    code = main(["check", str(log), "--aircraft", str(aircraft), "--quiet"])
    told = capsys.readouterr()
    assert said in told.out + told.err
    refused = main(["close-loop", str(log), "--aircraft", str(aircraft), "--out", str(tmp_path / "out"), "--static"])
    assert (code == 0) == (refused == 0)


def test_check_names_an_airspeed_in_a_wrong_unit_with_its_factor(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mislabelled.csv"
    text = (Path(__file__).parents[2] / "flight_data" / "light_transport_doublet.csv").read_text()
    assert "V [m/s]" in text
    path.write_text(text.replace("V [m/s]", "V [km/h]"))
    assert main(["check", str(path)]) == 3
    output = " ".join(capsys.readouterr().out.split())
    assert "V contradicts the other channels" in output
    assert "it agrees if its values are m/s and not km/h (a factor of 3.600)" in output


def test_check_takes_spans_and_json(flight_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight = _flown(20.0)
    _, start, stop = flight.truth[0]
    for words in ([f"{flight_file}@{start - 3:.1f}:{stop + 8:.1f}"], [str(flight_file), "--from", "1", "--to", "60"]):
        code = main(["check", *words, "--json"])
        (entry,) = json.loads(capsys.readouterr().out)["logs"]
        assert entry["usable"] == (code == 0)
        assert entry["stop"] - entry["start"] < 80.0
    assert main(["check", f"{flight_file}@1:60", "--from", "2"]) == 2
    assert "names its span already" in capsys.readouterr().err


def test_degrees_read_as_radians_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = _flown(3.0).log().between(0.0, 90.0)
    spoilt = {name: np.degrees(log[name]) if log.units[name] == "rad" else log[name] for name in log.channels}
    path = tmp_path / "degrees.csv"
    path.write_text(native_csv(replace(log, channels=spoilt), "degrees", 9))
    assert main(["close-loop", str(path), "--aircraft", "light_transport"]) == 3
    error = capsys.readouterr().err
    assert "in degrees and read as radians" in error
    assert error.count("\n") == 1
    assert main(["check", str(path), "--quiet"]) == 3
    assert "in degrees" in capsys.readouterr().out
