"""The tutorial, step by step as typed by a reader, on the files that it creates."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
from pathlib import Path

import pytest

from aerosid.cli.main import main
from aerosid.logs.formats import read_log

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "tutorial.md").read_text(encoding="utf-8")
STEP = re.compile(r"^```(python|toml)\n([\s\S]*?)^```$|^    aerosid (.*)$|^> (.*)$", re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which every step of the page was run; text quoted on the page is in the output of the step before."""
    folder = tmp_path_factory.mktemp("tutorial")
    with pytest.MonkeyPatch.context() as patched, pytest.MonkeyPatch.context() as there:
        patched.setenv("SOURCE_DATE_EPOCH", "1795305600")
        there.chdir(folder)
        _walk(folder)
    return folder


def _walk(folder: Path) -> None:
    printed = folder / "printed.txt"
    for language, block, words, quoted in STEP.findall(PAGE):
        if language == "python":
            exec(compile(block, "tutorial", "exec"), {"__name__": "tutorial"})  # noqa: S102
        elif language == "toml":
            (folder / block.splitlines()[0].removeprefix("# ")).write_text(block, encoding="utf-8")
        elif words:
            output = _run(shlex.split(words))
            printed.write_text(output, encoding="utf-8")
        else:
            assert " ".join(quoted.split()) in " ".join(printed.read_text(encoding="utf-8").split()), quoted


def _run(words: list[str]) -> str:
    """Output of a command; every command of the page succeeds."""
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream):
        code = main(words)
    assert code == 0, words
    return stream.getvalue()


def test_the_files_are_a_recorder_s(folder: Path) -> None:
    lines = (folder / "flight_1.txt").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("CLOCK;TAS;AOA")
    assert re.fullmatch(r"09:14:30\.000;194,\d+;.*", lines[1])
    log = read_log(folder / "flight_1.txt", folder / "recorder.toml")
    assert log.time[0] == pytest.approx(9 * 3600 + 14 * 60 + 30)
    assert log["V"][0] == pytest.approx(100.05, abs=0.01)


def test_what_is_found_is_what_was_flown(folder: Path) -> None:
    document = json.loads((folder / "report" / "result.json").read_text(encoding="utf-8"))
    assert document["verdict"] == "explained"
    found = {(effect["where"], effect["term"]): effect for effect in document["effects"]}
    for entry, value in {("C_m", "alpha^2"): -1.715, ("C_X", "alpha^2"): 3.6089}.items():
        assert abs(found[entry]["value"] - value) < 4.0 * found[entry]["std_error"]
    assert len(found) == 2
    assert {entry["role"] for entry in document["inputs"]} == {"identification", "validation", "aircraft"}


def test_the_report_is_signed_and_marks_what_it_extrapolates(folder: Path) -> None:
    html = (folder / "report" / "report.html").read_text(encoding="utf-8")
    for words in ("A. Engineer", "Tutorial", "2026-11-22", "25 % of the mean chord", "† Extrapolated"):
        assert words in html
    for row in json.loads((folder / "report" / "result.json").read_text(encoding="utf-8"))["linear"]:
        phugoid = next(mode for mode in row["modes"] if mode["name"] == "phugoid")
        assert "period" in phugoid["extrapolated"]
        assert 40.0 < phugoid["numbers"]["period"]["value"] < 90.0  # about a minute, as stated on the page


def test_what_is_handed_on_is_the_completed_model(folder: Path) -> None:
    assert "alpha^2" in (folder / "derivatives.csv").read_text(encoding="utf-8")
    assert "DAVEfunc" in (folder / "model.dml").read_text(encoding="utf-8")
