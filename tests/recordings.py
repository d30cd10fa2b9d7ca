"""Real recordings, which may not be copied into the project: tests that need one are skipped where it is absent."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

_BESIDE = Path(__file__).resolve().parents[2] / "shared" / "flight_data"
FOLDER = Path(os.environ.get("AEROSID_FLIGHT_DATA", _BESIDE))


def recording(name: str) -> Path:
    """The recording's path; skips the calling test where it is absent."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"the recording {name} is not at hand (set AEROSID_FLIGHT_DATA to its folder)")
    return path


_RECORDERS_BESIDE = Path(__file__).resolve().parents[2] / "shared" / "recorders"
RECORDERS = Path(os.environ.get("AEROSID_RECORDERS", _RECORDERS_BESIDE))


def recorder(name: str) -> Path:
    """A file of a real recorder; skips the calling test where it is absent."""
    path = RECORDERS / name
    if not path.is_file():
        pytest.skip(f"the recorder's file {name} is not at hand (set AEROSID_RECORDERS to its folder)")
    return path


def recorder_facts(name: str) -> Any:
    """What the format's reference library says of a file of a real recorder."""
    return json.loads(recorder("facts.json").read_text())["files"][name]
