"""The files of a closed loop: read back by parsers independent of the writers."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems_report import closed_loop, simulated
from rich.console import Console

from aerosid.errors import UsageError
from aerosid.loop.effect_rows import Effect, Evidence
from aerosid.loop.quantity import Parameter
from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict
from aerosid.notation import number, with_deviation
from aerosid.reporting import ResultFile, print_summary, result_file, write_report
from aerosid.reporting.result_json import result_text
from aerosid.reporting.tables import derivatives_csv, residuals_csv
from aerosid.reporting.thinning import BINS, DRAWN_WHOLE, envelope
from aerosid.reporting.words import symbol

FILES = {"result.json", "derivatives.csv", "residuals.csv", "report.html", "report.pdf"}
FILES |= {"completed_aircraft.toml"}


def refuse(word: str) -> float:
    raise AssertionError(f"{word} in the file")


def strict_json(text: str) -> dict:
    """Parsed as in the standard: NaN and Infinity are not JSON."""
    return json.loads(text, parse_constant=refuse)


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    return closed_loop()


def test_result_json_has_the_keys_of_the_contract(result: ClosedLoop) -> None:
    document = strict_json(result_text(result))
    contract = ["schema", "aerosid", "seed", "inputs", "verdict", "summary", "effects", "alternatives"]
    contract += ["derivatives", "coefficients", "error"]
    assert list(document)[: len(contract)] == contract
    assert document["schema"] == 1
    assert document["verdict"] == "explained"
    assert [entry["role"] for entry in document["inputs"]] == ["identification", "validation", "aircraft"]
    effect = document["effects"][0]
    assert list(effect) == ["rank", "kind", "where", "term", "value", "std_error", "unit", "evidence"]
    assert {"correlation", "p_value", "validation_gain"} <= set(effect["evidence"])
    assert list(document["derivatives"][0]) == [field.name for field in dataclasses.fields(result.derivatives[0])]
    assert list(document["error"][0]) == [field.name for field in dataclasses.fields(result.errors[0])]
    assert document["alternatives"][0]["instead_of"] == "C_m alpha^2"


def test_result_json_survives_the_way_back(result: ClosedLoop) -> None:
    text = result_text(result)
    assert ResultFile.model_validate_json(text) == result_file(result)
    assert strict_json(text)["derivatives"][0]["value"] == result.derivatives[0].value


@given(st.floats(), st.floats(), st.none() | st.floats())
def test_numbers_that_are_none_become_null(value: float, deviation: float, gain: float | None) -> None:
    evidence = Evidence(gain, value, gain, deviation)
    parameters = {"depth": Parameter(value, deviation, "1")}
    effect = Effect(1, "flow_separation", "C_L", "", value, deviation, "1", evidence, time=gain, parameters=parameters)
    made = dataclasses.replace(closed_loop(samples=60), effects=(effect,))
    written = strict_json(result_text(made))["effects"][0]
    expected = [x if x is not None and math.isfinite(x) else None for x in (value, deviation, gain, value, deviation)]
    depth, held = written["parameters"]["depth"], written["evidence"]
    assert [
        written["value"],
        written["std_error"],
        held["correlation"],
        held["p_value"],
        depth["std_error"],
    ] == expected
    assert written.get("time") == expected[2]


def test_derivatives_csv_has_the_numbers_of_result_json(result: ClosedLoop) -> None:
    rows = list(csv.DictReader(io.StringIO(derivatives_csv(result))))
    document = strict_json(result_text(result))["derivatives"]
    assert list(rows[0]) == list(document[0])
    for row, entry in zip(rows, document, strict=True):
        for key, value in entry.items():
            text = "" if value is None else str(value).lower() if isinstance(value, bool) else value
            assert (float(row[key]) if isinstance(value, float) else row[key]) == text


def test_residuals_csv_gives_back_every_history(result: ClosedLoop) -> None:
    table = pd.read_csv(io.StringIO(residuals_csv(result)))
    columns = [f"q_{response} [rad/s]" for response in ("measured", "declared", "before", "after")]
    place = list(table).index(columns[0])
    assert list(table)[:3] == ["log", "time [s]", "V_measured [m/s]"]
    assert list(table)[place : place + 4] == columns
    for response in result.simulated:
        rows = table[table["log"] == response.log.name]
        np.testing.assert_allclose(rows["time [s]"], response.log.time, rtol=1e-14)
        np.testing.assert_allclose(rows["q_before [rad/s]"], response.before["q"], rtol=1e-8, atol=1e-300)
        np.testing.assert_allclose(rows["alpha_measured [rad]"], response.measured["alpha"], rtol=1e-8)  # NaN included


def test_residuals_csv_leaves_empty_what_a_log_does_not_have() -> None:
    result = closed_loop(samples=60)
    first, second = result.simulated
    log = dataclasses.replace(first.log, name='a, "nan" log')
    diverged = {**first.after, "q": np.where(first.log.time < 1.0, first.after["q"], np.inf)}
    first = dataclasses.replace(first, log=log, after=diverged)
    second = dataclasses.replace(second, measured={name: v for name, v in second.measured.items() if name != "h"})
    text = residuals_csv(dataclasses.replace(result, simulated=(first, second)))
    table = pd.read_csv(io.StringIO(text))
    assert list(table["log"].unique()) == ['a, "nan" log', second.log.name]
    rows = table[table["log"] == log.name]
    assert rows["q_after [rad/s]"].isna().tolist() == (log.time >= 1.0).tolist()
    assert table[table["log"] == second.log.name]["h_measured [m]"].isna().all()
    assert "inf" not in text


def test_write_report_writes_exactly_its_files(result: ClosedLoop, tmp_path: Path) -> None:
    folder = tmp_path / "a" / "new folder"
    paths = write_report(result, folder)
    assert {path.name for path in folder.iterdir()} == FILES == {path.name for path in paths}
    completed = tomllib.loads((folder / "completed_aircraft.toml").read_text())
    assert completed["derivatives"]["C_m"]["alpha^2"]["value"] == pytest.approx(-1.7106)


def test_the_same_result_gives_the_same_bytes(tmp_path: Path) -> None:
    first = write_report(closed_loop(), tmp_path / "first")
    second = write_report(closed_loop(), tmp_path / "second")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name


def test_a_failure_midway_leaves_nothing_new_and_nothing_lost(result: ClosedLoop, tmp_path: Path) -> None:
    broken = dataclasses.replace(result, completed_aircraft=None)  # the last file cannot be written
    folder = tmp_path / "new" / "folder"
    with pytest.raises(AttributeError):
        write_report(broken, folder)
    assert list(tmp_path.iterdir()) == []
    old = tmp_path / "report.html"
    old.write_text("of an earlier run")
    with pytest.raises(AttributeError):
        write_report(broken, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert old.read_text() == "of an earlier run"


@pytest.mark.parametrize("taken", ["itself a file", "below a file", "a folder has a file's name"])
def test_a_folder_that_cannot_be_written_is_one_sentence(result: ClosedLoop, tmp_path: Path, taken: str) -> None:
    file = tmp_path / "file"
    file.write_text("kept")
    folder = {"itself a file": file, "below a file": file / "out"}.get(taken, tmp_path)
    if folder == tmp_path:
        (tmp_path / "report.html").mkdir()
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(UsageError) as caught:
        write_report(result, folder)
    message = str(caught.value)
    assert message.startswith(f"{folder}: ")
    assert "\n" not in message
    assert message.endswith("--out.")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_path_of_any_bytes_can_be_reported(result: ClosedLoop, tmp_path: Path) -> None:
    odd = simulated("flight_\udcff", "identification", (1, 1), 60)
    log = dataclasses.replace(odd.log, path="fl\udcff.csv")
    changed = dataclasses.replace(
        result, identification=(log,), validation=(), simulated=(dataclasses.replace(odd, log=log),)
    )
    write_report(changed, tmp_path)
    assert strict_json((tmp_path / "result.json").read_text("utf-8"))["inputs"][0]["path"] == "fl\\udcff.csv"


@pytest.mark.parametrize("verdict", list(Verdict))
def test_the_summary_says_verdict_effects_and_errors(verdict: Verdict) -> None:
    stream = io.StringIO()
    made = closed_loop(samples=60, verdict=verdict)
    made = dataclasses.replace(made, summary="[red]not markup[/red]")
    print_summary(made, Console(file=stream, width=140))
    text = stream.getvalue()
    for words in (
        verdict.name.lower().replace("_", " "),
        "[red]not markup[/red]",
        "C_m has a term in alpha^2",
        "−1.711 ± 0.019",
    ):
        assert words in text
    for row in made.errors:
        assert row.log in text
        assert number(row.after, 2) in text


@given(st.integers(2, 9000), st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_the_envelope_loses_no_extreme(samples: int, seed: int, missing: float) -> None:
    generator = np.random.default_rng(seed)
    values = generator.standard_normal(samples)
    values[generator.random(samples) < missing] = np.nan
    time = np.arange(samples, dtype=float)
    instants, levels = envelope(time, values)
    assert instants.size == samples if samples <= DRAWN_WHOLE else instants.size <= 2 * BINS
    assert np.all(np.diff(instants) >= 0.0)
    np.testing.assert_array_equal(levels, values[instants.astype(int)])
    kept, given_ = (part[np.isfinite(part)] for part in (levels, values))
    assert kept.size == 0 or (kept.min(), kept.max()) == (given_.min(), given_.max())
    assert (kept.size == 0) == (given_.size == 0)


@given(st.floats(-1e9, 1e9), st.floats(1e-9, 1e6))
def test_a_value_is_written_as_exactly_as_its_deviation_is_known(value: float, deviation: float) -> None:
    text = with_deviation(value, deviation).replace("−", "-").replace("·10", "e")
    text = text.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-"))
    shown, spread = (float(part) for part in text.split(" ± "))
    assert spread == pytest.approx(deviation, rel=0.051)
    assert abs(shown - value) <= max(0.051 * deviation, 1e-7 * abs(value))


def test_numbers_and_symbols_as_engineers_write_them() -> None:
    assert number(-0.000123456) == "−0.000123"
    assert number(9.996) == "10.0"
    assert number(1.5e-7) == "1.50·10⁻⁷"
    assert number(math.nan) == number(None) == "–"
    assert with_deviation(-1.7106, 0.019) == "−1.711 ± 0.019"
    assert with_deviation(3.0, math.inf) == "3.000"
    assert symbol("delta_e") == ("δ", "e")
    assert symbol("C_m") == ("C", "m")
    assert symbol("a_quick_note") == ("a_quick_note", "")
