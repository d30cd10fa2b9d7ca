"""Seven recordings walked from log to paper: no two numbers for one quantity, nothing named beside 'not significant'.

What is checked here is what a reader would find contradicting itself in the files of one run, whatever was found.
"""

from __future__ import annotations

import io
import json
import re
import statistics
from pathlib import Path
from typing import Any

import pytest
from pypdf import PdfReader
from recordings import recording

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.cli.close_loop import read_roles
from aerosid.cli.main import main
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.derivative_table import CONTRADICTED
from aerosid.reporting import write_report

pytestmark = pytest.mark.slow

CITATION = "citation/seg_ref_20180312_shortperiod.csv"
WHOLE = "citation/phlab_ref_20180312_full_10Hz.csv.gz"
TWIN = "twin_otter/totter_demo_018.csv"
WALKS = {
    "HFB-320": ("hfb320", "hfb320.toml", "hfb320/hfb320_1_10.asc@0:36", "hfb320/hfb320_1_10.asc@36:60"),
    "ATTAS": ("attas", "attas_mat.toml", "attas/fAttasElv1.mat@0:16", "attas/fAttasElv1.mat@16:25"),
    "ATTAS stall": ("attas", "attas_stall.toml", "attas/fAttas_qst01_withHeader.asc", ""),
    "Twin Otter": ("twin_otter", "twin_otter.toml", TWIN, "twin_otter/totter_lon_020213f1_017.csv"),
    "Twin Otter alone": ("twin_otter", "twin_otter.toml", TWIN, ""),
    "Citation": ("citation", "citation.toml", f"{CITATION}@3625:3645", f"{CITATION}@3645:3665"),
    "Citation, whole": ("citation", "citation.toml", f"{WHOLE}@3625:3665", f"{WHOLE}@3225:3300"),
    "JSBSim": ("", "", "", ""),
}
NAMED = 3.0
"""Deviations from the null value of whatever is named."""


def spans(names: tuple[str, str]) -> tuple[list[str], list[str]]:
    whole = [f"{recording(name.partition('@')[0])}{''.join(name.partition('@')[1:])}" for name in names if name]
    return whole[:1], whole[1:]


@pytest.fixture(scope="module", params=list(WALKS))
def walked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of one run."""
    folder = tmp_path_factory.mktemp("walk")
    aircraft, channels, *names = WALKS[request.param]
    if not aircraft:
        pytest.importorskip("jsbsim", reason="JSBSim flies here")
        for name, shape, seed in (("one", "3211", "1"), ("two", "doublet", "2")):
            assert main(["fly", "c310", "--input", shape, "--seed", seed, "--out", str(folder / f"{name}.csv")]) == 0
        roles = read_roles([str(folder / "one.csv")], [str(folder / "two.csv")], None)
        declared = load_aircraft(folder / "one.aircraft.toml")
    else:
        fitted, predicted = spans((names[0], names[1]))
        roles = read_roles(fitted, predicted, bundled_folder("flight_data") / "channel_maps" / channels)
        declared = load_aircraft(aircraft)
    result = close_loop(roles.identification, declared, roles.validation)
    write_report(result, folder / "report", interactive=False)
    return folder / "report"


@pytest.fixture(scope="module")
def told(walked: Path) -> Any:
    return json.loads((walked / "result.json").read_text())


@pytest.fixture(scope="module")
def sheets(walked: Path) -> list[str]:
    reader = PdfReader(io.BytesIO((walked / "report.pdf").read_bytes()))
    return [" ".join(page.extract_text().split()) for page in reader.pages]


def certainty(effect: Any) -> float:
    null = 1.0 if effect["kind"].endswith("_scale") else 0.0
    return abs(effect["value"] - null) / effect["std_error"]


def test_what_is_named_is_shown_by_its_own_number(told: Any, sheets: list[str]) -> None:
    rows = {(row["coefficient"], row["term"]): row for row in told["derivatives"]}
    terms = [effect for effect in told["effects"] if effect["kind"] == "aero_term"]
    for effect in terms:
        row = rows[effect["where"], effect["term"]]
        assert row["shown"]
        assert (row["value"], row["std_error"]) == (effect["value"], effect["std_error"])
    certain = [effect for effect in told["effects"] if "parameters" not in effect]
    assert all(certainty(effect) >= NAMED for effect in certain)
    chance = [effect for effect in told["effects"] if effect["evidence"]["p_value"] > 0.05]
    assert sum("by chance in" in sheet for sheet in sheets) >= bool(chance)


def test_an_alternative_is_one(told: Any) -> None:
    assert told["alternatives"], "each of these recordings leaves some: nothing is compared"
    named = {(effect["kind"], effect["where"], effect["term"]) for effect in told["effects"]}
    refuted = {text.removeprefix("refuted ") for text in told["decided_by_validation"]}
    for other in told["alternatives"]:
        assert (other["kind"], other["where"], other["term"]) not in named
        assert f"{other['kind']} of {other['where']}" not in refuted
        assert f"{other['where']} {other['term']}" not in refuted
        assert other["worse_by"] <= other["margin"]
        assert other["kind"] != "sensor_position" or abs(other["value"]) < 14.0


def test_the_headline_is_the_table(told: Any) -> None:
    roles = [row["role"] for row in told["error"]]
    role = "validation" if "validation" in roles else "identification"
    ratios = [row["before"] / row["after"] for row in told["error"] if row["role"] == role]
    said = re.search(
        r"is (\S+) in the median channel .*decreases in (\d+) of (\d+) channels and increases in (\d+)",
        str(told["summary"]),
    )
    assert said is not None
    assert float(said[1]) == pytest.approx(statistics.median(ratios), abs=0.006)
    falls, grows = sum(r > 1.005 for r in ratios), sum(r < 0.995 for r in ratios)
    assert [int(said[2]), int(said[3]), int(said[4])] == [falls, len(ratios), grows]


def test_what_is_not_shown_keeps_its_declared_value_unless_the_records_contradict_it(walked: Path, told: Any) -> None:
    hidden = [row for row in told["derivatives"] if not row["shown"]]
    assert (walked / "completed_aircraft.toml").read_text().count("shown = false") == len(hidden)
    assert all(row["value"] == row["declared"] for row in hidden if row["estimate"] is not None)
    freed = [row for row in hidden if row["estimate"] is None]
    assert sum(CONTRADICTED in note for note in told["notes"]) == len(freed)
    assert all(row["value"] != row["declared"] for row in freed)


def test_the_paper_is_short_full_and_written_by_a_person(sheets: list[str], told: Any) -> None:
    alone = len({entry["path"] for entry in told["inputs"]}) == 2 and "twin" in str(told["inputs"])
    assert len(sheets) <= (9 if alone else 13)
    first = sheets[0]
    for words in ("SHA-256", "Decision summary", "Action:", "Effects missing from the declared model"):
        assert words in first
    short = len(told["effects"]) <= 9
    assert ("Derivatives, declared and completed" in first) is short
    assert all(len(sheet) > 400 for sheet in sheets[:-1])
    whole = " ".join(sheets)
    words = [word for word in whole.split() if not re.fullmatch(r"[0-9a-f]{20,}", word)]
    assert not [word for word in words if re.fullmatch(r"[(−-]?\d+(\.\d+)?e[+-]?\d+[).,]?", word)]
    assert not {"nan", "inf", "None"} & set(words)
    multiples = [int(number) for number in re.findall(r"(\d+) times the noise", whole)]
    assert all(number <= 100 for number in multiples)
    assert ("multiples of the measurement noise" in whole) is (told["decided_by"] == "likelihood")
