"""Real recordings, which may not be copied into the project: tests that need one are skipped where it is absent."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_BESIDE = Path(__file__).resolve().parents[2] / "shared" / "flight_data"
FOLDER = Path(os.environ.get("AEROSID_FLIGHT_DATA", _BESIDE))


def recording(name: str) -> Path:
    """The recording's path; skips the calling test where it is absent."""
    path = FOLDER / name
    if not path.is_file():
        pytest.skip(f"the recording {name} is not at hand (set AEROSID_FLIGHT_DATA to its folder)")
    return path
