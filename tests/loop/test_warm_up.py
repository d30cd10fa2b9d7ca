"""After warm-up nothing is left to compile, in a first process of its own and on flights that are no sample."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks import field_detection, sideways_detection, six_axis_flights
from benchmarks.planted_flights import csv_text

ROOT = Path(__file__).resolve().parents[2]

PROGRAM = """
import sys
import numba.core.event as event
from aerosid.cli.main import main

with event.install_recorder("numba:compile") as compilations:
    code = main(sys.argv[1:])
assert code == 0
print("compiled:", *(e.data["dispatcher"].py_func.__name__ for _, e in compilations.buffer if e.is_start))
"""


def aerosid(cache: Path, *words: str) -> str:
    environment = os.environ | {"AEROSID_CACHE_DIR": str(cache), "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], cwd=ROOT, env=environment, text=True, capture_output=True, check=True
    )
    return run.stdout.splitlines()[-1]


def turbulent(folder: Path) -> tuple[str, ...]:
    """A pair of recorded flights in turbulence, in which two or more things are wrong."""
    field_detection.written(folder, (27401, 1), 1)
    return case(folder)


def sideways(folder: Path, axes: str) -> tuple[str, ...]:
    """A pair of flights in side gusts whose aircraft file declares the coefficients of a case."""
    at, plant, first = sideways_detection.planted(3, 27402, 0.01)
    folder.mkdir()
    aircraft = six_axis_flights.aircraft_of(at, plant, axes, np.random.default_rng(27403))
    (folder / "aircraft.toml").write_text(aircraft.text)
    for n, role in enumerate(("identification", "validation")):
        log = six_axis_flights.flown(role, at, plant, first + n)
        (folder / f"{role}.csv").write_text(csv_text(log))
    return case(folder)


def case(folder: Path) -> tuple[str, ...]:
    fitted, unseen, aircraft = (str(folder / n) for n in ("identification.csv", "validation.csv", "aircraft.toml"))
    return (fitted, "--aircraft", aircraft, "--validate", unseen)


@pytest.mark.slow
def test_what_the_sample_flights_need_is_compiled_by_a_part_of_warm_up(tmp_path: Path) -> None:
    aerosid(tmp_path / "cache", "warm-up", "--sample", "--quiet")
    flights = ROOT / "flight_data"
    loop = ("close-loop", "--aircraft", "light_transport", "--out", str(tmp_path / "out"))
    both = (str(flights / "light_transport_doublet.csv"), "--validate", str(flights / "light_transport_3211.csv"))
    assert aerosid(tmp_path / "cache", *loop, *both) == "compiled:"
    assert aerosid(tmp_path / "cache", *loop, str(flights / "light_transport_3211.csv")) == "compiled:"


@pytest.mark.slow
def test_nothing_is_compiled_after_warm_up(tmp_path: Path) -> None:
    aerosid(tmp_path / "cache", "warm-up", "--quiet")
    flights = (turbulent(tmp_path / "turbulent"), *(sideways(tmp_path / axes, axes) for axes in ("lateral", "six")))
    for flight in flights:
        assert aerosid(tmp_path / "cache", "close-loop", *flight, "--out", str(tmp_path / "out")) == "compiled:"
