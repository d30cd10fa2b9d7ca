"""--json prints one document only, --quiet prints nothing; errors name the verb; progress is one line per stage."""

from __future__ import annotations

import io
import json
from pathlib import Path

import pytest
from broken_inputs import GOOD

import aerosid
from aerosid.cli.main import main
from aerosid.cli.output import command_line, mode
from aerosid.cli.progress_bar import progress_bar
from aerosid.cli.stage_progress import BEGUN, remaining, stages


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "flight.csv"
    path.write_text(GOOD)
    return path


def calls(log: Path, folder: Path) -> dict[str, list[str]]:
    return {
        "check": ["check", str(log)],
        "formats": ["formats"],
        "aircraft list": ["aircraft", "list"],
        "aircraft check": ["aircraft", "check", "light_transport"],
        "export": ["export", "light_transport", "--format", "csv"],
        "export to a file": ["export", "light_transport", "--format", "csv", "--out", str(folder / "a.csv")],
    }


@pytest.mark.parametrize("verb", list(calls(Path(), Path())))
def test_json_is_one_document_and_quiet_is_nothing(
    verb: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = calls(log, tmp_path)[verb]
    assert main(["--json", *words]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["schema"], document["aerosid"]) == (1, aerosid.__version__)
    assert str(tmp_path) not in json.dumps({**document, "files": []})
    assert main(["--quiet", *words]) == 0
    captured = capsys.readouterr()
    # With --quiet an export prints the model itself, and a check its verdict sentence.
    assert (captured.out == "") is (verb not in ("export", "check"))
    assert captured.out.count("\n") <= 1 or verb == "export"
    assert captured.err == ""
    assert mode().quiet is False


@pytest.mark.parametrize(
    ("words", "verb"),
    [
        (["check"], "aerosid check"),
        (["check", "a.csv", "--no-such-option"], "aerosid check"),
        (["aircraft", "check"], "aerosid aircraft check"),
        (["no-such-verb"], "aerosid"),
    ],
)
def test_wrong_usage_points_at_the_verbs_help(words: list[str], verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert f"See `{verb} --help`." in capsys.readouterr().err


def test_the_command_line_is_the_same_wherever_files_go(tmp_path: Path) -> None:
    words = ["close-loop", str(tmp_path / "a b.csv"), "--aircraft", "x.toml"]
    assert command_line(words) == "aerosid close-loop 'a b.csv' --aircraft x.toml"
    assert command_line([*words, "--out", str(tmp_path)]) == command_line(words)
    assert command_line([*words, "--strict", "--quiet"]) == command_line(words)
    assert command_line([*words, f"--out={tmp_path}", "--seed", "1"]) == command_line([*words, "--seed", "1"])


def test_redirected_progress_is_one_line_a_stage() -> None:
    stream = io.StringIO()
    with stages(stream) as progress:
        for stage in BEGUN:
            progress(stage)
    lines = stream.getvalue().splitlines()
    assert len(lines) == len(BEGUN)
    for number, (stage, line) in enumerate(zip(BEGUN, lines, strict=True), start=1):
        assert f"{number} of {len(BEGUN)}, {stage}" in line


def test_what_remains_is_a_range_that_follows_from_what_passed() -> None:
    assert remaining("preparing the logs", 3.0) is None
    assert remaining("a stage that nobody timed", 3.0) is None
    for stage, (low, high) in BEGUN.items():
        shown = remaining(stage, 60.0)
        assert (shown is None) is (low < 0.03)
        # Whatever fraction within the range has elapsed, the remaining time is within the range shown.
        for share in (low, 0.5 * (low + high), high):
            assert shown is None or shown[0] <= 60.0 / share - 60.0 + 1e-9 <= shown[1] + 2e-9


def test_redirected_runs_are_told_now_and_then(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("runs") as (announce, tick):
        announce(1000, 100)
        for _ in range(900):
            tick(1)
    lines = capsys.readouterr().err.splitlines()
    assert 10 <= len(lines) <= 30
    assert "100 of 1000" in lines[0]
    assert "1000 of 1000" in lines[-1]
    assert "about 0 s remaining" in lines[-1]
