"""Compiled kernels are found again by content: another folder compiles nothing, another callee compiles again.

Each test runs interpreters of its own, since a compiled kernel never leaves the process that compiled it.
"""

from __future__ import annotations

import cProfile
import importlib
import json
import os
import pkgutil
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import aerosid
from aerosid.compiled import Kernel, njit
from aerosid.compiled.kernel_cache import KernelCache
from aerosid.compiled.kernel_digest import kernel_digest

ROOT = Path(__file__).resolve().parents[2]

SOURCES = {
    "sizes.py": "OFFSET = 0.25\n",
    "callee.py": (
        "from aerosid.compiled import njit_inline\n"
        "from sizes import OFFSET\n\n\n"
        "@njit_inline\n"
        "def amplified(x):\n"
        "    return 2.0 * x + OFFSET\n"
    ),
    "caller.py": (
        "from typing import NamedTuple\n\n"
        "from aerosid.compiled import njit\n"
        "from callee import amplified\n\n\n"
        "class Room(NamedTuple):\n"
        "    gain: float\n"
        "    shift: float\n\n\n"
        "@njit\n"
        "def total(values, room):\n"
        "    out = 0.0\n"
        "    for i in range(values.shape[0]):\n"
        "        out += amplified(values[i]) * room.gain + room.shift\n"
        "    return out\n"
    ),
}

PROGRAM = """
import json
import numpy as np
import numba.core.event as event
from caller import Room, total

with event.install_recorder("numba:compile") as compilations:
    room = Room(gain=3.0, shift=0.5)
    values = [total(np.linspace(0.1, 1.7, 40, dtype=kind), room) for kind in ("float64", "float32")]
names = [e.data["dispatcher"].py_func.__name__ for _, e in compilations.buffer if e.is_start]
print(json.dumps({"values": [value.hex() for value in values], "total": names.count("total"), "all": len(names)}))
"""


def write_sources(folder: Path, **replaced: tuple[str, str]) -> Path:
    folder.mkdir()
    for name, text in SOURCES.items():
        old, new = replaced.get(name.removesuffix(".py"), ("", ""))
        assert old in text
        (folder / name).write_text(text.replace(old, new) if old else text)
    return folder


def start(folder: Path, cache: Path, package: Path = ROOT) -> subprocess.Popen[str]:
    environment = os.environ | {"AEROSID_CACHE_DIR": str(cache), "PYTHONPATH": f"{package}{os.pathsep}{folder}"}
    command = [sys.executable, "-W", "error", "-c", PROGRAM]
    return subprocess.Popen(
        command, cwd=folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )


def finish(process: subprocess.Popen[str]) -> dict[str, object]:
    output, errors = process.communicate(timeout=300)
    assert errors == ""
    assert process.returncode == 0
    return json.loads(output)


def run(folder: Path, cache: Path, package: Path = ROOT) -> dict[str, object]:
    return finish(start(folder, cache, package))


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict[str, object]]:
    """A folder of modules, the cache that running them filled, and what they printed."""
    base = tmp_path_factory.mktemp("kernels")
    folder = write_sources(base / "clone")
    result = run(folder, base / "cache")
    assert result["total"] == 2
    return folder, base / "cache", result


def test_another_folder_with_the_same_content_compiles_nothing_and_gives_the_same_bits(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    _, cache, before = first
    again = run(write_sources(tmp_path / "elsewhere"), cache)
    assert again["all"] == 0
    assert again["values"] == before["values"]


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("callee", "2.0 * x", "2.5 * x"),  # only a constant, which is not in the bytecode
        pytest.param("callee", "2.0 * x + OFFSET", "OFFSET + 2.0 * x * x", marks=pytest.mark.slow),
        ("sizes", "0.25", "0.75"),  # a constant of a module without kernels
        ("caller", "    gain: float\n    shift: float", "    shift: float\n    gain: float"),
    ],
)
def test_a_change_in_what_a_kernel_calls_or_refers_to_compiles_it_again(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path, module: str, old: str, new: str
) -> None:
    _, cache, before = first
    changed = run(write_sources(tmp_path / "changed", **{module: (old, new)}), cache)
    assert changed["total"] == 2
    fresh = run(tmp_path / "changed", tmp_path / "empty")
    assert changed["values"] == fresh["values"]
    same = module == "caller"  # the order of named fields changes the layout of the arguments, not the sum
    assert (changed["values"] == before["values"]) is same


def test_a_comment_and_a_line_further_down_compile_nothing(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    _, cache, before = first
    lines = ("@njit_inline", "# What amplification means.\n\n\n@njit_inline")
    again = run(write_sources(tmp_path / "commented", callee=lines), cache)
    assert again["all"] == 0
    assert again["values"] == before["values"]


def test_processes_that_compile_at_once_leave_a_cache_that_all_can_use(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    folder, _, before = first
    together = [finish(process) for process in [start(folder, tmp_path / "cache") for _ in range(3)]]
    assert [each["values"] for each in together] == [before["values"]] * 3
    assert sum(each["total"] for each in together) == 2, "what one compiles the others wait for"
    after = run(folder, tmp_path / "cache")
    assert after["all"] == 0
    assert after["values"] == before["values"]
    assert {path.suffix for path in (tmp_path / "cache").iterdir()} == {".nbc"}


def test_what_a_killed_process_was_compiling_is_compiled_by_the_next(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    folder, cache, before = first
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    (tmp_path / "cache").mkdir()
    for path in cache.iterdir():
        (tmp_path / "cache" / path.name).with_suffix(".compiling").write_text(f"{ended.pid} {platform.node()}")
    again = run(folder, tmp_path / "cache")
    assert again["total"] == 2
    assert again["values"] == before["values"]


@pytest.mark.parametrize("kept", [*(pytest.param(kept, marks=pytest.mark.slow) for kept in (0, 10)), 5000])
def test_a_cut_off_file_is_compiled_again_and_replaced(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path, kept: int
) -> None:
    folder, cache, before = first
    damaged = shutil.copytree(cache, tmp_path / "cache")
    for path in damaged.iterdir():
        path.write_bytes(path.read_bytes()[:kept])
    again = run(folder, damaged)
    assert again["total"] == 2
    assert again["values"] == before["values"]
    assert run(folder, damaged)["all"] == 0


def test_a_folder_that_cannot_be_written_is_no_error(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    folder, _, before = first
    (tmp_path / "file").write_text("not a folder")
    assert run(folder, tmp_path / "file" / "cache")["values"] == before["values"]


def test_kernels_inside_the_package_are_used_where_nothing_can_be_written(
    first: tuple[Path, Path, dict[str, object]], tmp_path: Path
) -> None:
    folder, cache, before = first
    package = tmp_path / "site" / "aerosid"
    shutil.copytree(ROOT / "aerosid" / "compiled", package / "compiled", ignore=shutil.ignore_patterns("kernels"))
    shutil.copy(ROOT / "aerosid" / "__init__.py", package)
    shutil.copytree(cache, package / "compiled" / "kernels")
    (tmp_path / "file").write_text("not a folder")
    installed = run(folder, tmp_path / "file" / "cache", package.parent)
    assert installed["all"] == 0
    assert installed["values"] == before["values"]


def test_a_profiler_leaves_the_content_of_a_kernel_as_it_was() -> None:
    # A call under one makes numba overwrite the flags of the function's code: kernels called by it were compiled again.
    @njit
    def halved(number: float) -> float:
        return 0.5 * number

    before = kernel_digest(halved)
    with cProfile.Profile():
        assert halved(3.0) == 1.5

    assert kernel_digest(halved) == before


def test_every_kernel_of_the_package_has_a_known_content() -> None:
    kernels = []
    for module in pkgutil.walk_packages(aerosid.__path__, "aerosid."):
        if not module.name.endswith("__main__"):
            kernels += [
                value for value in vars(importlib.import_module(module.name)).values() if isinstance(value, Kernel)
            ]
    ours = {id(kernel): kernel for kernel in kernels if kernel.py_func.__module__.startswith("aerosid.")}.values()
    assert all(isinstance(kernel._cache, KernelCache) for kernel in ours)
    assert len({kernel_digest(kernel) for kernel in ours}) == len(ours) > 100
