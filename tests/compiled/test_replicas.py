"""Replicas of this process find together what one process finds, whatever becomes of them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from aerosid.compiled.cores import NumberSeenByCopies, allowed, both, mapped, on_cores
from aerosid.compiled.replicas import replicated

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="copies of a process are made on Linux alone")


def walk(seed: int) -> np.ndarray:
    """Numbers enough that they do not fit into a pipe at once."""
    return np.random.default_rng(seed).standard_normal(20_000).cumsum()


def chained() -> list[float]:
    """Rounds of independent work, each of which depends on all results of the one before."""
    found = [1.0]
    for n in range(40):
        rows = mapped(lambda k, n=n, found=tuple(found): walk(100 * n + k) * found[-1], range(n % 4 + 1))
        found.append(float(np.mean([row[-1] for row in rows])) / 100.0)
    return found


@pytest.mark.parametrize("cores", [2, 3, 5])
def test_a_task_of_many_rounds_gives_the_bits_of_one_core(cores: int) -> None:
    alone = chained()
    with on_cores(cores):
        assert replicated(chained) == alone


def test_the_same_replicas_take_part_in_every_round() -> None:
    """Each process holds an item until the other holds one too: two copies a round would be four processes."""
    gates = [os.pipe() for _ in range(2)]

    def met(item: int) -> int:
        os.write(gates[1 - item][1], b".")
        os.read(gates[item][0], 1)
        return os.getpid()

    with on_cores(2):
        rounds = replicated(lambda: [set(mapped(met, range(2))) for _ in range(3)])
    assert len(set.union(*rounds)) == 2
    assert all(len(each) == 2 for each in rounds)
    for gate in gates:
        for end in gate:
            os.close(end)


def test_inside_an_item_there_is_the_share_of_the_cores_and_outside_all() -> None:
    with on_cores(4):
        inside, outside = replicated(lambda: (mapped(lambda _n: allowed(), range(8)), allowed()))
        assert allowed() == 4
    assert set(inside) == {1}
    assert outside == 4


def test_two_tasks_are_found_together_and_work_inside_them_is_found_too() -> None:
    def squares(first: int) -> list[int]:
        return mapped(lambda n: n * n, range(first, first + 5))

    with on_cores(2):
        found = replicated(lambda: (both(lambda: squares(0), lambda: squares(5)), squares(2)))
    assert found == (([0, 1, 4, 9, 16], [25, 36, 49, 64, 81]), [4, 9, 16, 25, 36])


def test_work_ends_at_the_first_result_that_ends_it() -> None:
    def up_to(last: int) -> list[int]:
        return mapped(lambda n: n, range(50), until=lambda n: n >= last)

    with on_cores(2):
        found = replicated(lambda: [up_to(last) for last in (3, 0, 49)])
    assert found == [list(range(4)), [0], list(range(50))]


def test_an_error_is_that_of_the_first_item_that_fails_and_may_be_caught_on_the_way() -> None:
    def failing(n: int) -> int:
        if n in (5, 9):
            raise ValueError(f"item {n}")
        return n

    def task() -> tuple[str, list[int]]:
        try:
            mapped(failing, range(12))
        except ValueError as error:
            return str(error), mapped(failing, range(5))
        return "", []

    with on_cores(2):
        assert replicated(task) == ("item 5", list(range(5)))
        with pytest.raises(ValueError, match="item 9"):
            replicated(lambda: mapped(failing, range(6, 12)))


@pytest.mark.parametrize("ended", [signal.SIGKILL, signal.SIGTERM])
def test_a_replica_that_ends_early_changes_no_result(ended: signal.Signals) -> None:
    here = os.getpid()

    def task() -> list[list[int]]:
        rounds = []
        for n in range(6):
            if n == 3 and os.getpid() != here:
                os.kill(os.getpid(), ended)
            rounds.append(mapped(lambda k, n=n: k * n, range(4)))
        return rounds

    with on_cores(3):
        assert replicated(task) == [[k * n for k in range(4)] for n in range(6)]


def test_a_replica_that_goes_another_way_is_given_up() -> None:
    here = os.getpid()

    def task() -> list[int]:
        if os.getpid() != here:
            mapped(lambda n: -n, range(7))
        return mapped(lambda n: n, range(5)) + mapped(lambda n: n, range(7))

    with on_cores(2):
        assert replicated(task) == [*range(5), *range(7)]


def test_a_replica_elsewhere_that_refers_to_what_only_it_has_in_common_is_given_up() -> None:
    """Its results name their parts by their places among those, of which there are fewer here."""
    here, shared = os.getpid(), [3]

    def task() -> list[object]:
        if os.getpid() != here:
            mapped(lambda _n: shared, range(4), common=[shared])
        return [*mapped(slowly, range(4)), *mapped(slowly, range(7))]

    def slowly(n: int) -> int:
        time.sleep(0.02)
        return n

    with on_cores(2):
        assert replicated(task) == [*range(4), *range(7)]


def test_replicas_that_have_cached_something_else_do_not_mix_their_results() -> None:
    """An item may fill a cache of the process that does it: what is missing there differs, and may be as much."""
    known: dict[int, int] = {}

    def looked_up(n: int) -> int:
        missing = [k for k in (n,) if k not in known]
        known.update(zip(missing, mapped(lambda k: k * k, missing, names=missing), strict=True))
        return known[n]

    def task() -> list[int]:
        mapped(looked_up, range(4))
        missing = [k for k in range(4) if k not in known]
        known.update(zip(missing, mapped(lambda k: k * k, missing, names=missing), strict=True))
        return [known[k] for k in range(4)]

    for cores in (1, 2, 4):
        known.clear()
        with on_cores(cores):
            assert replicated(task) == [0, 1, 4, 9]


def test_where_no_process_can_be_made_this_one_does_all(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> int:
        raise BlockingIOError

    monkeypatch.setattr(os, "fork", refused)
    with on_cores(3):
        assert replicated(lambda: [n + 1 for n in range(3)]) == [1, 2, 3]


def test_what_cannot_be_sent_is_found_here() -> None:
    with on_cores(2):
        found = replicated(lambda: mapped(lambda n: (n for _ in range(n)), range(3)))
    assert [sum(1 for _ in each) for each in found] == [0, 1, 2]


@pytest.mark.parametrize("waiting", ["for work", "for results"])
def test_a_replica_ends_with_the_first_process(waiting: str) -> None:
    """It would wait for ever, for what nobody deals out or sends any more."""
    script = f"""
import os, signal, time
from aerosid.compiled.cores import mapped, on_cores
from aerosid.compiled.replicas import replicated
here = os.getpid()
begun, tell = os.pipe()
def item(n):
    if os.getpid() == here:
        os.write(tell, b"1")
        time.sleep(0.5)  # the replica waits for the results by then
        os.kill(here, signal.SIGKILL)
    os.read(begun, 1)  # so that the replica does not take all items where the first process is slow
    return n
def task():
    if os.getpid() != here:
        os.close(tell)
        os.write(told, str(os.getpid()).encode())
    elif {waiting == "for work"}:
        item(0)
    return mapped(item, range(2))
told = os.dup(1)
with on_cores(2):
    replicated(task)
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=60)
    assert ran.returncode == -signal.SIGKILL
    replica, deadline = int(ran.stdout), time.monotonic() + 20.0
    while Path(f"/proc/{replica}").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not Path(f"/proc/{replica}").exists()


def test_a_replica_prints_nothing_and_none_is_left(capfd: pytest.CaptureFixture[str]) -> None:
    here, (known, told) = os.getpid(), os.pipe()

    def task() -> list[int]:
        os.write(1, b"said\n")
        os.write(2, b"said\n")
        if os.getpid() != here:
            os.write(told, str(os.getpid()).encode())
        return mapped(lambda n: n, range(4))

    with on_cores(2):
        replicated(task)
    assert capfd.readouterr() == ("said\n", "said\n")
    with pytest.raises(ChildProcessError):
        os.waitpid(int(os.read(known, 20)), os.WNOHANG)
    os.close(known)
    os.close(told)


def test_a_number_that_one_changes_is_seen_by_all_and_has_its_first_value_before() -> None:
    gates = [os.pipe() for _ in range(2)]

    def task() -> tuple[int, int]:
        first, number = NumberSeenByCopies(5), NumberSeenByCopies(7)

        def told() -> int:
            number.value = 0
            os.write(gates[0][1], b".")
            return first.value

        def learned() -> int:
            os.read(gates[0][0], 1)
            return number.value

        return both(told, learned)

    with on_cores(2):
        assert replicated(task) == (5, 0)
    for gate in gates:
        for end in gate:
            os.close(end)


def test_one_core_makes_no_replica_and_a_task_inside_another_none_either() -> None:
    here = os.getpid()
    assert replicated(lambda: mapped(lambda _n: os.getpid(), range(4))) == [here] * 4
    with on_cores(2):
        assert replicated(lambda: replicated(chained)) == chained()
