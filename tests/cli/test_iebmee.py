"""`--method iebmee` and `replay` on unusable logs and aircraft: a one-sentence error, its exit code, no file."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from problems import Problem, native_csv

from aerosid.cli.main import main
from aerosid.logs.flight_log import FlightLog

FLIGHT = Problem(duration=8.0).fly(3)
STAGE = re.compile(r"aerosid: \d+ of \d+, ")
"""Beginning of a line of progress."""

VERBS = (("close-loop", "--method", "iebmee"), ("replay", "--speed", "0"))


def run(
    verb: tuple[str, ...], folder: Path, log: FlightLog, aircraft: str, capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, list[str]]:
    """Exit code, standard error, and the files in the output folder."""
    (folder / "flight.csv").write_text(native_csv(log))
    out = folder / "out"
    name, *options = verb
    code = main([name, str(folder / "flight.csv"), "--aircraft", aircraft, "--out", str(out), *options])
    files = [str(path.relative_to(out)) for path in out.rglob("*")] if out.exists() else []
    return code, capsys.readouterr().err, files


def with_channels(**changes: np.ndarray) -> FlightLog:
    return replace(FLIGHT, channels={**FLIGHT.channels, **changes})


def is_one_sentence(error: str) -> bool:
    lines = [line for line in error.strip().splitlines() if line and not STAGE.match(line)]
    return "Traceback" not in error and sum(line.startswith("aerosid: ") for line in lines) == 1


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb[0])
def test_a_flight_on_which_the_model_runs_away_breaks_down_in_a_sentence(
    verb: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Degrees labelled as radians: no model of an aircraft follows them."""
    far = with_channels(alpha=np.degrees(FLIGHT["alpha"]), q=np.degrees(FLIGHT["q"]), theta=np.degrees(FLIGHT["theta"]))
    code, error, files = run(verb, tmp_path, far, "light_transport", capsys)
    assert code in {3, 4}
    assert is_one_sentence(error)
    assert files == []


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb[0])
def test_a_channel_that_is_not_there_is_named(
    verb: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    less = replace(FLIGHT, channels={name: v for name, v in FLIGHT.channels.items() if name != "q"})
    code, error, files = run(verb, tmp_path, less, "light_transport", capsys)
    assert code == 3
    assert re.search(r"\bq\b", error)
    assert is_one_sentence(error)
    assert files == []


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb[0])
def test_a_flight_of_three_samples_is_refused(
    verb: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = replace(FLIGHT, time=FLIGHT.time[:3], channels={name: v[:3] for name, v in FLIGHT.channels.items()})
    code, error, files = run(verb, tmp_path, short, "light_transport", capsys)
    assert code == 3
    assert is_one_sentence(error)
    assert files == []


def test_an_aircraft_of_six_axes_asks_for_the_channels_of_six(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, error, files = run(VERBS[0], tmp_path, FLIGHT, "navion", capsys)
    assert code == 3
    assert "channel p is missing" in error
    assert is_one_sentence(error)
    assert files == []
