"""What the README promises is what there is: its code runs, its files parse, its commands and folders exist."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from aerosid import errors
from aerosid.cli.main import app

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
CODE = re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```$", "", README, flags=re.MULTILINE | re.DOTALL))
COMMANDS = [line.strip() for line in re.findall(r"^    .*$", README, re.MULTILINE)]


def blocks(language: str) -> list[str]:
    return [text for name, text in BLOCKS if name == language]


def table(header: str) -> list[str]:
    """The first cells of the table under a header, without backticks."""
    rows = re.search(rf"^\| {header} \|.*\n\|[-| ]+\|\n((?:\|.*\n)+)", README, re.MULTILINE)
    assert rows is not None, header
    return [row.split("|")[1].strip().strip("`") for row in rows[1].splitlines()]


def test_there_is_something_to_run() -> None:
    assert blocks("python")
    assert {name for name, _ in BLOCKS} <= {"python", "text"}


def test_verbs_are_those_of_the_command_line() -> None:
    """Each way: what is documented exists, and what exists is documented."""
    command = typer.main.get_command(app)
    verbs = set(getattr(command, "commands", {}))
    assert set(table("verb")) == verbs
    named = {match[1] for text in [*CODE, *COMMANDS] for match in re.finditer(r"\baerosid ([a-z][\w-]*)", text)}
    assert named <= verbs
    assert "close-loop" in named


def test_options_of_close_loop_exist() -> None:
    command = getattr(typer.main.get_command(app), "commands", {})["close-loop"]
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    lines = [line for line in COMMANDS if line.startswith("aerosid close-loop")]
    wanted = re.findall(r"--[\w-]+", " ".join(lines))
    assert wanted
    assert set(wanted) <= known


def test_make_has_every_target_that_is_named() -> None:
    targets = set(re.findall(r"^([\w-]+):(?!=)", MAKEFILE, re.MULTILINE))
    named = {match[1] for text in [*CODE, *COMMANDS] for match in re.finditer(r"\bmake ([a-z][\w-]*)", text)}
    assert {"demo", "test"} <= named
    assert named <= targets
    phony = re.search(r"^\.PHONY:(.*)$", MAKEFILE, re.MULTILINE)
    assert phony is not None
    assert named <= set(phony[1].split())


def test_it_is_read_in_two_minutes() -> None:
    assert README.count("\n") <= 120


def test_the_printed_verdict_is_what_the_code_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = blocks("python")
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {"__name__": "readme"})  # noqa: S102
    assert capsys.readouterr().out.split() == blocks("text")[0].split()


@pytest.mark.slow
def test_the_six_axis_command_names_what_its_flight_lacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (command,) = [line.split("#")[0].split() for line in COMMANDS if "navion_identify" in line]
    monkeypatch.chdir(ROOT)
    asked = [sys.executable, "-m", *command, "--out", str(tmp_path), "--no-next-flight", "--static"]
    done = subprocess.run(asked, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))["effects"]
    assert {(each["kind"], each["where"]) for each in found} == {("control_lag", "delta_r"), ("sensor_position", "a_y")}


def test_exit_codes_are_those_of_the_errors() -> None:
    raised = {kind.exit_code for kind in vars(errors).values() if isinstance(kind, type) and hasattr(kind, "exit_code")}
    assert raised <= {int(code) for code in table("exit code")}
