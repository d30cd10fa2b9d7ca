"""The names of the glossary, by which channels are recognised."""

from __future__ import annotations

from pathlib import Path

from aerosid.nomenclature import CHANNELS, is_surface

PACKAGE = Path(__file__).parents[2] / "aerosid"


def test_surfaces_are_recognised_by_their_names() -> None:
    deflections = {name for name, channel in CHANNELS.items() if "trailing" in channel.positive}
    assert {name for name in CHANNELS if is_surface(name)} == deflections
    assert is_surface("delta_flaperon")
    assert not is_surface("thrust")


def test_no_other_module_recognises_surfaces_by_its_own() -> None:
    found = [path for path in sorted(PACKAGE.rglob("*.py")) if '"delta_"' in path.read_text(encoding="utf-8")]
    assert found == [PACKAGE / "nomenclature.py"]
