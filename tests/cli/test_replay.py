"""The verb replay: frames independent of later samples, a page with a time slider, invalid input."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from lateral_flights import PITCH, SIDE, Lateral, aircraft
from problems import BOTH_SQUARES, LIGHT, Problem, native_csv

from aerosid.aircraft import load_aircraft
from aerosid.cli.main import main
from aerosid.logs.formats import read_log
from aerosid.loop.identification import replayed
from aerosid.model_error.paper_chain.in_flight import Frame, InFlightSettings
from aerosid.reporting.replay_page import frames_json, render_replay

FLIGHT = Problem(undeclared=BOTH_SQUARES).fly(3)


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    return list(replayed(FLIGHT, LIGHT, 0.5))


def test_the_missing_terms_are_named_while_the_manoeuvre_runs(frames: list[Frame]) -> None:
    last = frames[-1]
    assert {(name.coefficient, name.term) for name in last.names} == set(BOTH_SQUARES)
    assert all(name.time < FLIGHT.time[-1] for name in last.names)
    rows = {(row.coefficient, row.term): row for row in last.derivatives}
    for key, true in BOTH_SQUARES.items():
        assert abs(rows[key].value - true) < 4.0 * rows[key].deviation + 0.03 * abs(true)


def test_names_never_leave_and_time_goes_on(frames: list[Frame]) -> None:
    assert all(a.time < b.time and a.names == b.names[: len(a.names)] for a, b in pairwise(frames))


def test_a_frame_has_seen_no_later_sample(frames: list[Frame]) -> None:
    """Except for the weights, which are set beforehand: invalid data at the end give the same d(t) before them."""
    spoilt = {name: values.copy() for name, values in FLIGHT.channels.items()}
    spoilt["q"][-40:] += 0.05
    other = list(replayed(replace(FLIGHT, channels=spoilt), LIGHT, 0.5))
    early = [frame for frame in frames if frame.time < FLIGHT.time[-41] - 0.5]
    assert len(early) > 15
    for a, b in zip(early, other, strict=False):
        np.testing.assert_allclose(a.model_error, b.model_error, rtol=0.2, atol=2e-3)


def test_every_candidate_says_why_it_is_not_named(frames: list[Frame]) -> None:
    limit = InFlightSettings().false_alarm
    reasons = [(row, row.reason) for frame in frames for row in frame.candidates]
    assert {reason.split(":")[0].split(" from ")[0] for _, reason in reasons} >= {
        "not significant",
        "not distinguishable",
    }
    for row, reason in reasons:
        assert (row.p_value > limit) == reason.startswith(("not significant", "collinear")), reason
    labels = {row.label for row, _ in reasons} | {name.split(" from ")[1] for _, name in reasons if " from C_" in name}
    assert all(name.split()[0] in LIGHT.axes.coefficients for name in labels)
    page = render_replay(frames, "log", "aircraft", LIGHT.axes.coefficients)
    assert "reason for rejection" in page
    assert frames[-1].candidates[0].reason in page


def test_the_page_holds_every_frame_and_loads_nothing(frames: list[Frame]) -> None:
    page = render_replay(frames, "<log>", "a & b", LIGHT.axes.coefficients)
    data = re.search(r'<script type="application/json" id="replay-data">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    assert [frame["time"] for frame in json.loads(data[1])] == pytest.approx([f.time for f in frames], rel=1e-4)
    assert "<log>" not in page
    assert "&lt;log&gt;" in page
    assert "default-src &#39;none&#39;" in page or "default-src 'none'" in page
    assert not re.search(r"(?:src|href)\s*=\s*[\"']?https?:", page)


def test_what_is_not_known_yet_is_null(frames: list[Frame]) -> None:
    first = json.loads(frames_json(frames))[0]
    assert first["derivatives"][0]["value"] is None


def test_the_verb_writes_the_page_and_prints_the_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "flight.csv").write_text(native_csv(FLIGHT))
    out = tmp_path / "out"
    assert main(["replay", str(tmp_path / "flight.csv"), "--aircraft", "light_transport", "--out", str(out)]) == 0
    assert "C_m alpha^2 identified at" in capsys.readouterr().out
    assert (out / "replay.html").read_text(encoding="utf-8").startswith("<!doctype html>")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--step", "0"), 2, "--step is 0"),
        (("--speed", "-1"), 2, "--speed -1"),
        (("--aircraft", "no_such"), 2, "no_such"),
    ],
)
def test_wrong_usage_is_one_sentence_and_leaves_no_file(
    arguments: tuple[str, ...], code: int, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "flight.csv").write_text(native_csv(FLIGHT))
    out = tmp_path / "out"
    command = ["replay", str(tmp_path / "flight.csv"), "--aircraft", "light_transport", "--out", str(out), *arguments]
    assert main(command) == code
    assert message in capsys.readouterr().err
    assert not (out / "replay.html").exists()


def test_a_log_without_alpha_is_said_in_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    channels = {name: values for name, values in FLIGHT.channels.items() if name != "alpha"}
    (tmp_path / "flight.csv").write_text(native_csv(replace(FLIGHT, channels=channels)))
    command = ["replay", str(tmp_path / "flight.csv"), "--aircraft", "light_transport", "--out", str(tmp_path / "out")]
    assert main(command) == 3
    assert "alpha" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("declared", "term"),
    [(SIDE, ("C_n", "beta^3")), pytest.param({**PITCH, **SIDE}, ("C_m", "beta^2"), marks=pytest.mark.slow)],
    ids=["lateral", "six degrees of freedom"],
)
def test_the_other_axes_are_followed_too(
    declared: dict[tuple[str, str], float], term: tuple[str, str], tmp_path: Path
) -> None:
    """d(t) of every modelled coefficient; the missing effect is identified before the end of the flight."""
    planted = {("C_n", "beta^3"): 1.2, ("C_m", "beta^2"): -1.0}[term]
    log, flown = Lateral(extra={term: planted}, size=1.5).log(), aircraft(declared)
    frames = list(replayed(log, flown, 0.5))
    assert [(name.coefficient, name.term) for name in frames[-1].names] == [term]
    assert frames[-1].names[0].time < log.time[-1] - 2.0
    (row,) = (row for row in frames[-1].derivatives if (row.coefficient, row.term) == term)
    assert abs(row.value - planted) < 4.0 * row.deviation + 0.03 * abs(planted)
    page = render_replay(frames, "log", "aircraft", flown.axes.coefficients)
    assert page.count('replay-strip"') == len(flown.axes.coefficients) == len(frames[-1].model_error)


@pytest.mark.slow
def test_no_term_is_named_in_the_place_of_a_late_rudder() -> None:
    """JSBSim's Navion, whose rudder lags by 0.12 s: C_n alpha*delta_r was named, with three more terms."""
    log = read_log(Path(__file__).parents[2] / "flight_data" / "navion_identify.csv")
    last = list(replayed(log, load_aircraft("navion"), 0.5))[-1]
    assert last.names == ()
    assert "not distinguishable from delta_r late" in {row.reason for row in last.candidates}
