"""Every verb: --json is one document, --quiet prints nothing, errors name the verb, --out is checked first."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import typer
from broken_inputs import GOOD

import aerosid
from aerosid.aircraft.bundled import bundled_folder
from aerosid.cli.main import app, main
from aerosid.cli.output import mode

FLIGHTS = bundled_folder("flight_data")
DOUBLET = str(FLIGHTS / "light_transport_doublet.csv")


def verbs() -> dict[str, Any]:
    """Every command by its arguments."""
    found: dict[str, Any] = {}

    def walk(command: Any, words: tuple[str, ...]) -> None:
        for name, below in command.commands.items():
            if hasattr(below, "commands"):
                walk(below, (*words, name))
            else:
                found[" ".join((*words, name))] = below

    walk(typer.main.get_command(app), ())
    return found


VERBS = verbs()
WRITING = sorted(verb for verb, command in VERBS.items() if any("--out" in p.opts for p in command.params))

CALLS = {
    "check": "check {log}",
    "find": "find {log} --out {out}",
    "close-loop": "close-loop {doublet} --aircraft light_transport --static --no-next-flight --out {out}",
    "reproduce": "reproduce --seeds 2 --out {out}",
    "study": "study --aircraft light_transport --runs 2 --snr inf --catalogue known --workers 1 --out {out}",
    "fly": "fly c310 --duration 6 --out {out}/a.csv",
    "export": "export light_transport --format csv --out {out}/a.csv",
    "batch": "batch {doublet} --aircraft light_transport --catalogue terms --no-reports --workers 1 --out {out}",
    "cross-check": "cross-check c310 --seeds 2 --out {out}",
    "channels": "channels {log} --out {out}/map.toml",
    "replay": "replay {doublet} --aircraft light_transport --step 2 --out {out}",
    "warm-up": "warm-up",
    "schema": "schema check --out {out}/check.json",
    "formats": "formats",
    "aircraft list": "aircraft list",
    "aircraft check": "aircraft check light_transport",
}
LONG = ("close-loop", "reproduce", "study", "batch", "cross-check", "warm-up")
FLOWN = ("fly", "cross-check")


def test_every_verb_is_called_here() -> None:
    assert set(CALLS) == set(VERBS)


def words_of(verb: str, folder: Path) -> list[str]:
    if verb in FLOWN:
        pytest.importorskip("jsbsim", reason="JSBSim flies here")
    log = folder / "flight.csv"
    log.write_text(GOOD)
    return CALLS[verb].format(log=log, doublet=DOUBLET, out=folder / "out").split()


@pytest.mark.parametrize(
    "verb", [pytest.param(verb, marks=pytest.mark.slow if verb in LONG else ()) for verb in sorted(CALLS)]
)
def test_json_is_one_document_and_quiet_is_silence(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = words_of(verb, tmp_path)
    assert main([*words, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] >= 1
    assert document["aerosid"] == aerosid.__version__
    assert main(["--quiet", *words]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    # With --quiet a check prints only its verdict sentence.
    assert captured.out.count("\n") == (1 if verb == "check" else 0)
    assert mode().quiet is False


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_a_wrong_option_points_at_the_help_of_its_verb(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*verb.split(), "--no-such-option"]) == 2
    captured = capsys.readouterr()
    assert f"See `aerosid {verb} --help`." in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert "--quiet" in (VERBS[verb].epilog or "")


@pytest.mark.parametrize("verb", WRITING)
def test_where_nothing_can_be_written_is_said_before_anything_is_read(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # No named file exists: if one had been opened first, the error would be about that file.
    taken = tmp_path / "file"
    taken.write_text("")
    needed = [p for p in VERBS[verb].params if p.required and "--out" not in p.opts]
    words = [word for p in needed for word in ([p.opts[0], "none"] if p.param_type_name == "option" else ["none.csv"])]
    assert main([*verb.split(), *words, "--out", str(taken / "below" / "a.csv")]) == 2
    error = capsys.readouterr().err
    assert "cannot be written" in error
    assert "--out" in error
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_folder_is_no_file_to_write(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "light_transport", "--format", "csv", "--out", str(tmp_path)]) == 2
    assert "is a folder, expected the name of a file" in capsys.readouterr().err
