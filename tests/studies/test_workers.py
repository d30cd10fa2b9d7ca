"""Work items reach workers and their results the disk: whatever is killed, each result is stored once."""

import itertools
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aerosid.errors import UsageError
from aerosid.studies.journal import Journal
from aerosid.studies.workers import FAILURE, Workers, work_off

KEYS = [str(n) for n in range(12)]
HERE = Path(__file__).parent


def squared(key: str) -> dict[str, float]:
    return {"value": float(key) ** 2 / 3.0}


def slow(folder: str, key: str) -> dict[str, float]:
    """Report the worker, so that a test can kill it and observe its end."""
    Path(folder, f"pid{os.getpid()}").touch()
    time.sleep(0.1)
    return squared(key)


def dying(folder: str, always: bool, key: str) -> dict[str, float]:
    marker = Path(folder, f"died{key}")
    if key == "5" and (always or not marker.exists()):
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return squared(key)


def failing(key: str) -> dict[str, float]:
    if key == "3":
        raise UsageError("three is not liked.")
    if key == "4":
        raise ZeroDivisionError("four")
    return squared(key)


def results(path: Path) -> dict[str, dict[str, float]]:
    with Journal(path, "squares") as journal:
        rows = list(journal.rows())
    assert len({key for key, _ in rows}) == len(rows)
    return dict(rows)


def expected() -> dict[str, dict[str, float]]:
    return {key: squared(key) for key in KEYS}


@pytest.mark.parametrize("count", [1, 3])
def test_the_number_of_workers_and_the_chunk_change_no_result(tmp_path: Path, count: int) -> None:
    with Journal(tmp_path / "journal", "squares") as journal:
        assert work_off(squared, KEYS, journal, Workers(count), chunk=count) == {}
    assert results(tmp_path / "journal") == expected()


def test_an_item_that_raises_stops_no_other(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal", "squares") as journal:
        work_off(failing, KEYS, journal, Workers(1), chunk=5)
    rows = results(tmp_path / "journal")
    assert rows["3"] == {FAILURE: "three is not liked."}
    assert rows["4"] == {FAILURE: "an unexpected ZeroDivisionError (four)"}
    assert {key: rows[key] for key in KEYS if key not in "34"} == {k: squared(k) for k in KEYS if k not in "34"}


def test_a_worker_killed_in_mid_run_loses_nothing(tmp_path: Path) -> None:
    ticks: list[int] = []
    with Journal(tmp_path / "journal", "squares") as journal:
        lost = work_off(partial(dying, str(tmp_path), False), KEYS, journal, Workers(2), chunk=2, tick=ticks.append)
    assert lost == {}
    assert (tmp_path / "died5").exists()
    assert results(tmp_path / "journal") == expected()
    assert sum(ticks) == len(KEYS)


@pytest.mark.slow
def test_an_item_that_always_kills_its_worker_is_given_up_alone(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal", "squares") as journal:
        lost = work_off(partial(dying, str(tmp_path), True), KEYS, journal, Workers(2), chunk=3)
    assert list(lost) == ["5"]
    assert "died" in lost["5"]
    assert results(tmp_path / "journal") == {key: row for key, row in expected().items() if key != "5"}


SCRIPT = """
import sys
from functools import partial
from pathlib import Path
from aerosid.studies.journal import Journal
from aerosid.studies.workers import Workers, work_off
from test_workers import KEYS, slow
if __name__ == "__main__":
    folder = sys.argv[1]
    with Journal(Path(folder, "journal"), "squares") as journal:
        work_off(partial(slow, folder), KEYS, journal, Workers(2), chunk=2)
"""


def start(folder: Path) -> "subprocess.Popen[bytes]":
    script = folder / "work.py"
    script.write_text(SCRIPT, encoding="utf-8")
    paths = os.pathsep.join([str(HERE), str(HERE.parent), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen([sys.executable, str(script), str(folder)], env={**os.environ, "PYTHONPATH": paths})


def finished(path: Path) -> int:
    return max(path.read_bytes().count(b"\n") - 1, 0) if path.exists() else 0


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").split()[2] != "Z" if Path("/proc").exists() else True


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is a signal of POSIX systems")
def test_killed_and_started_again_it_goes_on_and_leaves_no_worker_behind(tmp_path: Path) -> None:
    for least in (0, 2, 6):
        process = start(tmp_path)
        deadline = time.monotonic() + 60.0
        while finished(tmp_path / "journal") < least or not list(tmp_path.glob("pid*")):
            assert time.monotonic() < deadline, "no result came"
            time.sleep(0.01)
        process.kill()
        process.wait()
    assert start(tmp_path).wait() == 0
    assert results(tmp_path / "journal") == expected()
    left = [int(path.name[3:]) for path in tmp_path.glob("pid*")]
    deadline = time.monotonic() + 30.0
    while any(map(alive, left)):
        assert time.monotonic() < deadline, "a worker outlived its parent"
        time.sleep(0.05)


@given(cut=st.integers(min_value=0), garbage=st.binary(max_size=40))
@settings(max_examples=60, deadline=None)
def test_a_torn_journal_keeps_every_whole_line(
    tmp_path_factory: pytest.TempPathFactory, cut: int, garbage: bytes
) -> None:
    path = tmp_path_factory.mktemp("torn") / "journal"
    with Journal(path, "squares") as journal:
        for key in KEYS:
            journal.write([(key, squared(key))])
    whole = path.read_bytes()
    ends = [0, *itertools.accumulate(len(line) + 1 for line in whole.splitlines())]
    cut %= len(whole) + 1
    path.write_bytes(whole[:cut] + garbage.replace(b"\n", b""))
    kept = max(sum(end <= cut for end in ends) - 2, 0)
    with Journal(path, "squares") as journal:
        assert len(journal) == kept
        for key in KEYS:
            journal.write([(key, squared(key))])
    assert path.read_bytes() == whole


def test_a_journal_of_other_work_or_in_other_hands_is_refused(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal", "squares"), pytest.raises(UsageError, match="another process"):
        Journal(tmp_path / "journal", "squares")
    with pytest.raises(UsageError, match="other settings"):
        Journal(tmp_path / "journal", "cubes")


@pytest.mark.parametrize("count", [0, -2])
def test_no_workers_are_refused(count: int) -> None:
    with pytest.raises(UsageError, match="--workers"):
        Workers(count)


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the optional extra 'cluster' is not installed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        Journal(tmp_path / "journal", "squares") as journal,
    ):
        assert work_off(squared, KEYS, journal, Workers(scheduler=cluster.scheduler_address), chunk=2) == {}
    assert results(tmp_path / "journal") == expected()
