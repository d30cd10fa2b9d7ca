"""What docs/ promises is what there is: blocks run, links lead somewhere, every verb and option is described."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.logs.formats.channel_map import load_channel_map
from aerosid.logs.spans import read_segment_file

ROOT = Path(__file__).resolve().parents[2]
PAGES = {path.name: path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs").glob("*.md"))}
FENCED = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = [(page, language, code) for page, text in PAGES.items() for language, code in FENCED.findall(text)]
LINKED = [(page, target) for page, text in PAGES.items() for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text)]


def named(language: str) -> list[object]:
    chosen = [(page, code) for page, found, code in BLOCKS if found == language]
    return [pytest.param(page, code, id=f"{page} {n}") for n, (page, code) in enumerate(chosen)]


def fill_options() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fill_options", ROOT / "docs" / "fill_options.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", sorted({page for page, language, _ in BLOCKS if language == "python"}))
def test_python_runs_as_printed(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A page's blocks run one after another, as a reader would type them."""
    monkeypatch.chdir(tmp_path)
    known: dict[str, object] = {"__name__": "docs"}
    for found, language, code in BLOCKS:
        if (found, language) == (page, "python"):
            exec(compile(code, page, "exec"), known)  # noqa: S102
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize(("page", "code"), named("toml"))
def test_toml_is_what_it_shows(page: str, code: str, tmp_path: Path) -> None:
    tomllib.loads(code)
    if "[channels]" in code:
        path = tmp_path / "channels.toml"
        path.write_text(code, encoding="utf-8")
        assert load_channel_map(path).channels
    elif "[[segment]]" in code:
        path = tmp_path / "segments.toml"
        path.write_text(code, encoding="utf-8")
        assert all(span.start < span.stop for span in read_segment_file(path) if span.start and span.stop)
    elif "[derivatives" not in code:
        base = load_aircraft("light_transport").text
        assert aircraft_from_text(f"{base}\n{code}", page, "0" * 64).derivatives
    else:
        assert aircraft_from_text(code, page, "0" * 64).derivatives


def test_there_are_blocks_of_each_kind_and_no_other() -> None:
    assert {language for _, language, _ in BLOCKS} == {"python", "toml"}


@pytest.mark.parametrize(("page", "target"), LINKED)
def test_links_lead_somewhere(page: str, target: str) -> None:
    assert "://" in target or (ROOT / "docs" / target).exists()


def test_tables_of_options_are_those_of_the_command_line() -> None:
    """`python docs/fill_options.py` makes them anew."""
    made = fill_options()
    page = PAGES["command_line.md"]
    assert made.filled(page) == page
    assert set(re.findall(r"<!-- options of ([\w -]+) -->", page)) == set(made.commands())


def test_every_package_has_its_line_in_the_layout() -> None:
    packages = {path.parent.name for path in (ROOT / "aerosid").glob("*/__init__.py")}
    assert set(re.findall(r"^\| `(\w+)/` \|", PAGES["layout.md"], re.MULTILINE)) == packages


@pytest.mark.parametrize("page", PAGES)
def test_files_and_folders_that_are_named_exist(page: str) -> None:
    quoted = re.findall(r"`((?:aerosid|aircraft_models|flight_data|tests|benchmarks|docs)/[\w./]*)`", PAGES[page])
    missing = [name for name in quoted if not (ROOT / name).exists()]
    assert missing == []
