"""After warm-up nothing is left to compile, in a first process of its own and on flights that are no sample."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.slow
def test_nothing_is_compiled_after_warm_up(tmp_path: Path) -> None:
    aerosid(tmp_path / "cache", "warm-up", "--quiet")
    flights = ROOT / "flight_data"
    loop = ("close-loop", "--aircraft", "light_transport", "--out", str(tmp_path / "out"))
    both = (str(flights / "light_transport_doublet.csv"), "--validate", str(flights / "light_transport_3211.csv"))
    assert aerosid(tmp_path / "cache", *loop, *both) == "compiled:"
    assert aerosid(tmp_path / "cache", *loop, str(flights / "light_transport_3211.csv")) == "compiled:"
