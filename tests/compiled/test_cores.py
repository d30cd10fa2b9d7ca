"""Work dealt out to copies of this process gives what one process gives, in the same order, whatever becomes of it."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from aerosid.compiled.cores import YIELDS, NumberSeenByCopies, allowed, begun, both, mapped, on_cores
from aerosid.compiled.prepared_copy import prepared

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="copies of a process are made on Linux alone")


def walk(seed: int) -> np.ndarray:
    """Numbers enough that they do not fit into a pipe at once."""
    return np.random.default_rng(seed).standard_normal(20_000).cumsum()


def test_results_are_those_of_one_core_in_the_order_of_the_items() -> None:
    alone = mapped(walk, range(7))
    with on_cores(3):
        shared = mapped(walk, range(7))
    assert [a.tobytes() for a in alone] == [b.tobytes() for b in shared]


def test_other_processes_take_part_and_make_no_copies_of_their_own() -> None:
    here, (gate, opener) = os.getpid(), os.pipe()

    def met(_item: int) -> tuple[int, set[int]]:
        """The process that drew an item, and those that work for it; this one waits until another has drawn one."""
        if os.getpid() == here:
            os.read(gate, 1)
        os.write(opener, b".")
        return os.getpid(), set(mapped(lambda _n: os.getpid(), range(8)))

    with on_cores(2):
        drawn = dict(mapped(met, range(2)))
    others = {process: inner for process, inner in drawn.items() if process != here}
    assert others == {process: {process} for process in others}
    assert len(others) == 1
    assert set(mapped(lambda _n: os.getpid(), range(8))) == {here}
    os.close(gate)
    os.close(opener)


def test_what_is_dealt_out_inside_has_the_cores_that_are_left() -> None:
    """Of four cores two each; of two one, in this process as in its copies, while both are busy."""
    gates = [os.pipe() for _ in range(2)]

    def met(item: int) -> int:
        """The cores while both items are under way: neither goes on before the other has come, twice."""
        found = []
        for _ in range(2):
            os.write(gates[1 - item][1], b".")
            os.read(gates[item][0], 1)
            found.append(allowed())
        return found[0]

    for cores, inside in ((4, 2), (2, 1)):
        with on_cores(cores):
            assert mapped(met, range(2)) == [inside, inside]
            assert both(lambda: met(0), lambda: met(1)) == (inside, inside)
            assert allowed() == cores
    for ends in (end for gate in gates for end in gate):
        os.close(ends)


def test_the_core_of_a_copy_that_is_done_is_used_inside() -> None:
    here, gate = os.getpid(), os.pipe()

    def first_here(item: int) -> tuple[int, set[int]]:
        """The processes that work for this one's item, which is under way until the copy has done the other."""
        if os.getpid() != here:
            os.read(gate[0], 1)
            return os.getpid(), set()
        os.write(gate[1], b".")
        while allowed() < 2:
            time.sleep(0.001)
        return os.getpid(), set(mapped(lambda _n: time.sleep(0.02) or os.getpid(), range(4)))

    with on_cores(2):
        inside = dict(mapped(first_here, range(2)))[here]
    for ends in gate:
        os.close(ends)
    assert len(inside) == 2


def test_a_task_has_the_core_of_the_process_that_waits_for_it() -> None:
    """For what is left of the items that were begun while that process was still busy."""
    gate = os.pipe()

    def worker(item: int) -> int:
        if item == 0:
            os.write(gate[1], b".")
            while allowed() < 2:
                time.sleep(0.001)
        time.sleep(0.02)
        return os.getpid()

    with on_cores(2):
        waited_for = begun(lambda: (os.getpid(), mapped(worker, range(6))))
        os.read(gate[0], 1)
        copy, (first, *others) = waited_for()
    for end in gate:
        os.close(end)
    assert first == copy
    assert len(set(others)) == 2


def test_no_item_is_begun_behind_one_that_ends_it() -> None:
    begun_at = NumberSeenByCopies(0)

    def counted(item: int) -> int:
        begun_at.value = max(begun_at.value, item)
        if item > 3:
            time.sleep(0.02)  # so that others do not get far while the fourth is being done
        return item * item

    for cores in (1, 3):
        begun_at.value = 0
        with on_cores(cores):
            assert mapped(counted, range(400), until=lambda square: square >= 9) == [0, 1, 4, 9]
            assert mapped(counted, range(3), 1e9, until=lambda square: square >= 1) == [0, 1]
        assert begun_at.value < 200


def test_the_first_that_ends_it_counts_and_not_the_first_in_time() -> None:
    here, (gate, opener) = os.getpid(), os.pipe()

    def waits_for_the_other(item: int) -> int:
        if os.getpid() == here:
            os.read(gate, 1)
        else:
            os.write(opener, b".")
        return item

    with on_cores(2):
        assert mapped(waits_for_the_other, range(2), until=lambda _item: True) == [0]
    os.close(gate)
    os.close(opener)


def test_results_hold_what_both_have_itself_and_functions_with_what_they_enclose() -> None:
    here, heavy = os.getpid(), [walk(1)]

    def made(item: int) -> tuple[int, list[np.ndarray], list[object]]:
        def beside(x: float, y: float = 2.0, *, z: float = 0.5) -> float:
            return item * x + y + z + float(heavy[0][7])

        return os.getpid(), heavy, [beside, lambda x: beside(x, z=0.0)]

    with on_cores(2):
        process, same, (sent, again) = begun(lambda: both(lambda: made(3), lambda: made(4), [heavy]))()[1]
        others = [row for row in mapped(made, range(40), common=[heavy]) if row[0] != here]
    assert process != here
    assert same[0].tobytes() == heavy[0].tobytes()
    _, _, (sent_here, again_here) = made(4)
    assert (sent(5.0), again(5.0)) == (sent_here(5.0), again_here(5.0))
    assert all(row[1] is heavy for row in others)


LEFT_ALONE = """
try:
    os.waitpid(-1, os.WNOHANG)
except ChildProcessError:
    print("alone")
"""
"""End of a program: said where no copy is left, neither running nor unreaped."""

PROGRAM = """
import os
from aerosid.compiled.cores import begun, mapped, on_cores

def refuses(item):
    if item == 5:
        raise ValueError("the sixth")
    return item

try:
    with on_cores(2):
        mapped(refuses, range(12))
except ValueError as error:
    print(error)
"""


def test_an_error_is_the_callers_own_and_leaves_no_process_behind() -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM + LEFT_ALONE], text=True, capture_output=True, check=False, timeout=60
    )
    assert done.stdout.splitlines() == ["the sixth", "alone"]


def test_what_a_killed_copy_had_is_done_again() -> None:
    here = os.getpid()

    def dies_elsewhere(item: int) -> int:
        if os.getpid() != here:
            os._exit(1)
        return item * item

    with on_cores(3):
        assert mapped(dies_elsewhere, range(20)) == [item * item for item in range(20)]


@pytest.mark.skipif(sys.platform != "linux", reason="copies of a process are made on Linux")
def test_a_task_that_yields_leaves_the_cores_to_others() -> None:
    here = os.nice(0)
    with on_cores(2):
        usual, yields = begun(lambda: os.nice(0)), begun(lambda: os.nice(0), yielding=True)
        assert usual() == here
        assert here < yields() <= here + YIELDS
    assert begun(lambda: os.nice(0), yielding=True)() == here == os.nice(0)


def test_a_task_begun_beside_others_gives_its_result_and_is_done_here_where_its_copy_dies() -> None:
    here = os.getpid()
    with on_cores(2):
        asked, lost = begun(lambda: (os.getpid(), walk(3))), begun(lambda: os._exit(1) if os.getpid() != here else 7)
        process, numbers = asked()
        assert lost() == 7
    assert process != here
    assert numbers.tobytes() == walk(3).tobytes()
    assert begun(os.getpid)() == here


UNASKED = """
from aerosid.compiled.cores import begun, on_cores
with on_cores(2):
    unasked = begun(lambda: b"0" * 1_000_000)
print("done")
"""


def test_a_copy_whose_result_nobody_asks_for_ends() -> None:
    """It holds the ends of the caller's pipes: whoever reads its output would wait for ever."""
    done = subprocess.run([sys.executable, "-c", UNASKED], text=True, capture_output=True, check=False, timeout=60)
    assert (done.stdout, done.stderr) == ("done\n", "")


GIVEN_UP = """
import os
import time
from aerosid.compiled.cores import begun, on_cores

with on_cores(2):
    endless = begun(lambda: time.sleep(600) or "copied")
endless.abandon()
endless.abandon()
here = begun(lambda: "here")
here.abandon()
print(here())
"""


def test_a_copy_that_is_not_needed_is_ended_at_once() -> None:
    done = subprocess.run(
        [sys.executable, "-c", GIVEN_UP + LEFT_ALONE], text=True, capture_output=True, check=False, timeout=60
    )
    assert (done.stdout.splitlines(), done.stderr) == (["here", "alone"], "")


def test_an_abandoned_task_is_done_here_where_its_result_is_asked_for_after_all() -> None:
    with on_cores(2):
        given_up = begun(os.getpid)
    given_up.abandon()
    assert given_up() == os.getpid()


def test_a_prepared_copy_is_ready_before_it_is_given_its_item() -> None:
    here, made_ready = os.getpid(), []

    def task(seed: int) -> tuple[int, list[int], bytes]:
        return os.getpid(), made_ready, walk(seed).tobytes()

    with on_cores(2), prepared(task, lambda: made_ready.append(os.getpid())) as hand_over:
        waiting = hand_over(3)
        process, ready, numbers = waiting()
    assert process != here
    assert ready == [process]
    assert numbers == walk(3).tobytes()
    assert made_ready == []


def test_what_a_prepared_copy_cannot_do_is_done_here() -> None:
    here = os.getpid()

    def dies_elsewhere() -> None:
        assert os.getpid() != here
        os._exit(1)

    with on_cores(2), prepared(lambda item: item * item, dies_elsewhere) as hand_over:
        waiting = hand_over(9)
        assert waiting() == 81
        assert waiting() == 81
    with prepared(lambda _item: os.getpid(), dies_elsewhere) as hand_over:
        assert hand_over(0)() == here


ABANDONED = """
import os
from aerosid.compiled.cores import on_cores
from aerosid.compiled.prepared_copy import prepared

try:
    with on_cores(2), prepared(print, lambda: None):
        raise ValueError("stopped")
except ValueError as error:
    print(error)
"""


def test_a_prepared_copy_that_is_given_nothing_ends_with_the_block() -> None:
    done = subprocess.run(
        [sys.executable, "-c", ABANDONED + LEFT_ALONE], text=True, capture_output=True, check=False, timeout=60
    )
    assert done.stdout.splitlines() == ["stopped", "alone"]
    assert done.stderr == ""


BESIDE_ANOTHER = """
from aerosid.compiled.cores import begun, on_cores
from aerosid.compiled.prepared_copy import prepared

try:
    with on_cores(2), prepared(print, lambda: None):
        unread = begun(lambda: bytes(10_000_000))
        raise BrokenPipeError("nobody reads what is printed")
except BrokenPipeError as error:
    print(error)
"""


def test_a_prepared_copy_ends_though_another_that_waits_for_this_process_was_made_since() -> None:
    """Cut off by a pager, close-loop stood still: the later copy held the end whose closing the first waited for."""
    done = subprocess.run(
        [sys.executable, "-c", BESIDE_ANOTHER], text=True, capture_output=True, check=False, timeout=60
    )
    assert done.stdout.splitlines() == ["nobody reads what is printed"]
    assert done.stderr == ""
