"""Aircraft and sample flights travel with the package."""

from __future__ import annotations

import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from aerosid.aircraft.bundled import bundled_folder

ROOT = Path(__file__).resolve().parents[2]


def test_bundled_folders_are_found() -> None:
    assert (bundled_folder("aircraft_models") / "_template.toml").is_file()
    assert (bundled_folder("flight_data") / "channel_maps" / "hfb320.toml").is_file()


def test_the_wheel_is_told_to_take_the_data() -> None:
    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    for folder in ("aircraft_models", "flight_data"):
        assert folder in wheel["only-include"]
        assert wheel["sources"][folder] == f"aerosid/{folder}"


@pytest.mark.slow
def test_a_wheel_finds_its_data_away_from_the_checkout(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("aerosid-*.whl")
    unpacked = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(unpacked)
    code = (
        f"import sys; sys.path.insert(0, {str(unpacked)!r}); from aerosid.aircraft.bundled import bundled_folder as f; "
        "print(f('aircraft_models')); print(f('flight_data'))"
    )
    run = subprocess.run([sys.executable, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    folders = [Path(line) for line in run.stdout.split()]
    for folder in folders:
        assert folder.is_relative_to(unpacked)
        assert {path.relative_to(folder) for path in folder.rglob("*.toml")} == {
            path.relative_to(ROOT / folder.name) for path in (ROOT / folder.name).rglob("*.toml")
        }
