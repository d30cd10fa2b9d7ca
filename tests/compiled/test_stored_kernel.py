"""Kernels loaded from stored machine code do what freshly compiled ones do, and start no compiler.

Each test runs interpreters of its own: the first fills the cache, the second loads from it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

KERNELS = """
import numpy as np
from aerosid.compiled import njit

@njit
def solved(matrix, right):
    return np.linalg.solve(matrix, right)

@njit
def checked(values):
    if values[0] < 0.0:
        raise ValueError("negative")
    return np.sqrt(values).cumsum()
"""

CALLER = """
import numpy as np
from aerosid.compiled import njit
from kernels import checked

@njit
def last(values):
    return checked(values)[-1] + 1.0
"""

PROGRAM = """
import json, sys
import numpy as np
import numba.core.event as event
from kernels import checked, solved

def said(call):
    try:
        return [number.hex() for number in call().ravel().tolist()]
    except Exception as error:
        return f"{type(error).__name__}: {error}"

matrix, right = np.array([[3.0, 1.0], [1.0, 2.0]]), np.array([1.0, 2.0])
with event.install_recorder("numba:compile") as compilations:
    told = [
        said(lambda: solved(matrix, right)),
        said(lambda: solved(np.ones((2, 2)), right)),
        said(lambda: checked(np.array([2.0, 3.0]))),
        said(lambda: checked(np.array([-2.0, 3.0]))),
    ]
started = "numba.np.arraymath" in sys.modules
if "caller" in sys.argv:
    from caller import last
    told.append(said(lambda: np.array(last(np.array([2.0, 3.0])))))
print(json.dumps({"told": told, "compiled": len(compilations.buffer), "started": started}))
"""


def run(folder: Path, *words: str, cache: Path) -> dict[str, object]:
    environment = os.environ | {"AEROSID_CACHE_DIR": str(cache), "PYTHONPATH": f"{ROOT}{os.pathsep}{folder}"}
    command = [sys.executable, "-W", "error", "-c", PROGRAM, *words]
    done = subprocess.run(command, env=environment, text=True, capture_output=True, timeout=300, check=False)
    assert done.stderr == ""
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sources")
    (folder / "kernels.py").write_text(KERNELS)
    (folder / "caller.py").write_text(CALLER)
    return folder


@pytest.fixture(scope="module")
def compiled(sources: Path) -> dict[str, object]:
    """What freshly compiled kernels say, their compiled caller last; the cache holds all of them then."""
    told = run(sources, "caller", cache=sources / "cache")
    assert told["compiled"] != 0
    return told


def test_loaded_kernels_say_what_compiled_ones_say_and_start_no_compiler(
    sources: Path, compiled: dict[str, object]
) -> None:
    loaded = run(sources, cache=sources / "cache")
    assert loaded["told"] == compiled["told"][:4]
    assert loaded["told"][1].startswith("LinAlgError")
    assert loaded["told"][3] == "ValueError: negative"
    assert loaded["compiled"] == 0
    assert loaded["started"] is False


def test_a_caller_compiled_later_takes_a_loaded_kernel_in(sources: Path, compiled: dict[str, object]) -> None:
    (caller,) = (sources / "cache").glob("caller.last-*.nbc")
    caller.unlink()
    linked = run(sources, "caller", cache=sources / "cache")
    assert caller.exists()
    assert linked["started"] is False  # the kernels of the first four answers were loaded
    assert linked["told"] == compiled["told"]
    assert linked["told"][4] == [(float.fromhex(linked["told"][2][-1]) + 1.0).hex()]
