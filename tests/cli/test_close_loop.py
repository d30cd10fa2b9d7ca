"""`aerosid close-loop`: its files and their columns, exit codes, no partial output, reproducible bytes."""

from __future__ import annotations

import csv
import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from broken_inputs import BROKEN, GOOD, Broken
from problems import LIGHT, Problem, native_csv, with_channels

from aerosid.aircraft import load_aircraft
from aerosid.cli.main import main
from aerosid.cli.stage_progress import BEGUN

FILES = {"result.json", "derivatives.csv", "residuals.csv", "report.html", "report.pdf", "completed_aircraft.toml"}
PLANTED = Problem(undeclared={("C_m", "alpha^2"): -1.715}, duration=6.0)
DERIVATIVE_KEYS = (
    "coefficient",
    "term",
    "declared",
    "refitted",
    "value",
    "std_error",
    "std_error_white",
    "rls",
    "rls_std_error",
    "correlation_max",
    "shown",
)


def run(*arguments: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "aerosid", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs and one run of the command, in a process of its own."""
    folder = tmp_path_factory.mktemp("flights")
    (folder / "doublet.csv").write_text(native_csv(PLANTED.fly(1)))
    other = replace(PLANTED, elevator="3211", amplitude=0.045)
    (folder / "other.csv").write_text(native_csv(other.fly(2)))
    return folder


@pytest.fixture(scope="module")
def ran(folder: Path) -> subprocess.CompletedProcess[str]:
    return run(
        "close-loop",
        "doublet.csv",
        "--aircraft",
        "light_transport",
        "--validate",
        "other.csv",
        "--strict",
        folder=folder,
    )


@pytest.fixture(scope="module")
def result(folder: Path, ran: subprocess.CompletedProcess[str]) -> dict:
    assert ran.returncode == 0, ran.stderr
    text = (folder / "reports" / "doublet" / "result.json").read_text()

    def refuse(constant: str) -> float:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(text, parse_constant=refuse)


def test_all_files_stand_in_the_default_folder(folder: Path, ran: subprocess.CompletedProcess[str]) -> None:
    assert ran.returncode == 0, ran.stderr
    assert {path.name for path in (folder / "reports" / "doublet").iterdir()} == FILES
    # No terminal: one line per stage in place of a bar, and no warning.
    stages = [re.fullmatch(r"aerosid: (\d+) of (\d+), .*", line) for line in ran.stderr.splitlines()]
    places = [int(stage[1]) for stage in stages if stage]
    assert len(places) == len(stages)
    # A stage that this flight does not need is skipped: in calm air no coefficients are regressed.
    assert places == [n for n in range(1, len(BEGUN) + 1) if n != list(BEGUN).index("estimating by equation error") + 1]
    assert "alpha^2" in ran.stdout
    assert "\x1b" not in ran.stdout


def test_result_has_the_documented_keys(result: dict) -> None:
    assert result["schema"] == 1
    assert {"aerosid", "seed", "inputs", "verdict", "summary", "effects", "alternatives"} <= set(result)
    assert result["verdict"] == "explained"
    assert [entry["role"] for entry in result["inputs"]].count("identification") == 1
    assert [entry["role"] for entry in result["inputs"]].count("validation") == 1
    for entry in result["inputs"]:
        assert len(entry["sha256"]) == 64
    (effect,) = result["effects"]
    assert {"rank", "kind", "where", "term", "value", "std_error", "unit", "evidence"} <= set(effect)
    assert (effect["kind"], effect["where"], effect["term"]) == ("aero_term", "C_m", "alpha^2")
    assert effect["value"] == pytest.approx(-1.715, abs=4.0 * effect["std_error"])
    assert {"correlation", "p_value", "validation_gain"} <= set(effect["evidence"])
    assert {row["role"] for row in result["error"]} == {"identification", "validation"}
    for row in result["error"]:
        assert {"log", "role", "channel", "unit", "declared", "before", "after", "trimmed", "noise"} <= set(row)
    for row in result["coefficients"]:
        assert row["r2_after"] > 0.9
        assert {"coefficient", "log", "r2_before", "r2_after"} <= set(row)


def test_linear_models_are_told_apart_by_what_was_found(result: dict) -> None:
    """The found C_m alpha^2 makes the aircraft stiffer: 2 alpha at trim is 3 % of C_m alpha."""
    assert [entry["model"] for entry in result["linear"]] == ["declared", "completed"]
    stiffness = []
    for entry in result["linear"]:
        assert entry["states"] == ["u", "w", "q", "theta"]
        assert [len(entry["A"]), len(entry["A"][0]), len(entry["B"]), entry["inputs"]] == [4, 4, 4, ["delta_e"]]
        poles = np.linalg.eigvals(np.array(entry["A"]))
        short_period, phugoid = entry["modes"]
        assert short_period["numbers"]["frequency"]["value"] == pytest.approx(np.abs(poles).max(), rel=1e-9)
        assert phugoid["numbers"]["frequency"]["value"] == pytest.approx(np.abs(poles).min(), rel=1e-9)
        assert entry["qualities"]["cap"]["std_error"] > 0.0
        assert (entry["category"], entry["aircraft_class"]) == ("B", "II")
        stiffness.append(short_period["numbers"]["frequency"])
    declared, completed = stiffness
    assert completed["value"] > declared["value"]
    assert completed["std_error"] < 0.1 * declared["std_error"]


def test_derivative_table_is_that_of_the_result(folder: Path, result: dict) -> None:
    with (folder / "reports" / "doublet" / "derivatives.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0])[: len(DERIVATIVE_KEYS)] == DERIVATIVE_KEYS
    assert len(rows) == len(result["derivatives"]) == len(LIGHT.derivatives) + 1
    for row, entry in zip(rows, result["derivatives"], strict=True):
        assert set(DERIVATIVE_KEYS) <= set(entry)
        assert (row["coefficient"], row["term"]) == (entry["coefficient"], entry["term"])
        for key in ("declared", "refitted", "value", "std_error", "rls"):
            if entry[key] is None:
                assert row[key] == ""
            else:
                assert float(row[key]) == pytest.approx(entry[key], rel=1e-6)


def test_residuals_give_the_errors_again(folder: Path, result: dict) -> None:
    """The root-mean-square computed from residuals.csv equals the number in result.json."""
    with (folder / "reports" / "doublet" / "residuals.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [name.split(" [")[0] for name in list(rows[0])[:2]] == ["log", "time"]
    logs = {row["log"] for row in rows}
    assert len(logs) == 2
    for entry in result["error"]:
        part = [row for row in rows if row["log"] == entry["log"]]
        variants = ("measured", "declared", "before", "after")
        columns = {variant: f"{entry['channel']}_{variant} [{entry['unit']}]" for variant in variants}
        table = {variant: np.array([float(row[name]) for row in part]) for variant, name in columns.items()}
        for variant in ("declared", "before", "after"):
            error = math.sqrt(np.mean((table["measured"] - table[variant]) ** 2))
            assert entry[variant] == pytest.approx(error, rel=1e-3), (entry["channel"], variant)


def test_completed_aircraft_is_an_aircraft_file(folder: Path, result: dict) -> None:
    completed = load_aircraft(folder / "reports" / "doublet" / "completed_aircraft.toml")
    held = {(d.coefficient, str(d.term)): d.value for d in completed.derivatives}
    assert held["C_m", "alpha^2"] == pytest.approx(result["effects"][0]["value"], rel=1e-5)
    assert "# The reference aircraft of the examples" in completed.text


def test_the_same_input_gives_the_same_bytes(folder: Path, result: dict) -> None:
    again = run(
        *("close-loop", "doublet.csv", "--aircraft", "light_transport", "--validate", "other.csv", "--strict"),
        *("--out", "again"),  # the only argument that the title block omits
        folder=folder,
    )
    assert again.returncode == 0, again.stderr
    for name in FILES:
        assert (folder / "again" / name).read_bytes() == (folder / "reports" / "doublet" / name).read_bytes(), name


def test_from_and_to_are_in_the_logs_own_time(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "cut"
    words = ["close-loop", str(folder / "doublet.csv"), "--aircraft", "light_transport", "--out", str(out)]
    assert main([*words, "--from", "0.9", "--to", "4.5"]) == 0
    with (out / "residuals.csv").open(newline="") as file:
        times = [float(list(row.values())[1]) for row in csv.DictReader(file)]
    assert 0.9 <= min(times) < 0.95
    assert 4.45 < max(times) <= 4.5


@pytest.fixture
def call(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """One failing run in this process: its exit code and its one-sentence error; nothing is written."""

    def failing(*words: str | Path) -> tuple[int, str]:
        out = tmp_path / "out"
        code = main(["close-loop", *map(str, words), "--out", str(out)])
        captured = capsys.readouterr()
        assert not out.exists()
        assert captured.out == ""
        errors = [line for line in captured.err.splitlines() if not re.match(r"aerosid: \d+ of \d+, ", line)]
        assert len(errors) == 1
        assert errors[0].startswith("aerosid: ")
        return code, errors[0]

    return failing


@pytest.mark.parametrize("broken", BROKEN, ids=str)
def test_a_broken_log_leaves_nothing(broken: Broken, tmp_path: Path, call) -> None:
    path = tmp_path / broken.file
    if broken.content is not None:
        path.write_bytes(broken.content)
    if broken.channel_map is not None:
        (tmp_path / "channels.toml").write_text(broken.channel_map)
    code, sentence = call(path, "--aircraft", "light_transport")
    assert code == broken.code
    for name in broken.names:
        assert name in sentence


def test_a_broken_validation_log_leaves_nothing(folder: Path, tmp_path: Path, call) -> None:
    path = tmp_path / "cut.csv"
    path.write_text(GOOD[:-9])
    code, sentence = call(folder / "doublet.csv", "--aircraft", "light_transport", "--validate", path)
    assert code == 3
    assert "cut.csv" in sentence


AIRCRAFT = (Path(__file__).resolve().parents[2] / "aircraft_models" / "light_transport.toml").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass = 2280.0", "mass = -2280.0", ("mass",)),
        ("[mass]", "[mass]\nweight = 1.0", ("weight",)),
        ('"alpha" = { value = -0.729', "\"__import__('os')\" = { value = -0.729", ("C_m",)),
        ('"alpha" = { value = -0.729', f'"{"(" * 3000}" = {{ value = -0.729', ("C_m",)),
        ('"alpha" = { value = -0.729', '"q" = { value = -0.729', ("q_hat",)),
        ("I_yy = 6940.0", "", ("I_yy",)),
        ("wing_area = 23.23", "wing_area = nan", ("wing_area",)),
        ("schema = 1", "schema = = 1", ("TOML",)),
    ],
    ids=["negative mass", "unknown key", "code", "brackets", "an answer", "missing key", "nan", "no TOML"],
)
def test_a_broken_aircraft_leaves_nothing(
    old: str, new: str, words: tuple[str, ...], folder: Path, tmp_path: Path, call
) -> None:
    assert old in AIRCRAFT
    path = tmp_path / "broken.toml"
    path.write_text(AIRCRAFT.replace(old, new, 1))
    code, sentence = call(folder / "doublet.csv", "--aircraft", path)
    assert code == 2
    for word in ("broken.toml", *words):
        assert word in sentence


@pytest.mark.parametrize(
    ("words", "code", "names"),
    [
        (["none.csv", "--aircraft", "light_transport"], 3, "none.csv"),
        (["{log}", "--aircraft", "no_such_aircraft"], 2, "no_such_aircraft"),
        (["{log}"], 2, "--aircraft"),
        (["{log}", "--aircraft", "light_transport", "--prefilter", "magic"], 2, "magic"),
        (["{log}", "--aircraft", "light_transport", "--no-next-flight", "--limit", "V=90:110"], 2, "--limit limits"),
        (["{log}", "--aircraft", "light_transport", "--error-density", "1,2,3"], 2, "1,2,3"),
        (["{log}", "--aircraft", "light_transport", "--error-density", "1,1,-1,0"], 2, "-1"),
        (["{log}", "--aircraft", "light_transport", "--flight-phase", "D"], 2, "'D'"),
        (["{log}", "--aircraft", "light_transport", "--class", "VI"], 2, "'VI'"),
        (["{log}", "--aircraft", "light_transport", "--from", "500"], 3, "doublet.csv"),
        (["{log}", "--aircraft", "light_transport", "--to", "nan"], 2, "--to is nan"),
        (["{log}", "--aircraft", "light_transport", "--channels", "none.toml"], 2, "none.toml"),
    ],
)
def test_wrong_usage_leaves_nothing(words: list[str], code: int, names: str, folder: Path, call) -> None:
    found, sentence = call(*[word.format(log=folder / "doublet.csv") for word in words])
    assert (found, names in sentence) == (code, True), sentence


def test_a_log_without_pitch_rate_is_unusable(tmp_path: Path, call) -> None:
    path = tmp_path / "blind.csv"
    path.write_text(native_csv(with_channels(Problem(duration=3.0).fly(), q=None)))
    code, sentence = call(path, "--aircraft", "light_transport")
    assert code == 3
    assert "channel q" in sentence


def test_an_estimate_that_breaks_down_is_exit_4(folder: Path, tmp_path: Path, call) -> None:
    path = tmp_path / "mad.toml"
    path.write_text(AIRCRAFT.replace("I_yy = 6940.0", "I_yy = 1e-3"))
    code, sentence = call(folder / "doublet.csv", "--aircraft", path)
    assert code == 4
    assert "check" in sentence
