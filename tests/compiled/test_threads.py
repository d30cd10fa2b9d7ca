"""Work dealt out to threads gives what one thread gives, in the same order, and the first error."""

from __future__ import annotations

import threading

import pytest

from aerosid.compiled.cores import allowed, on_cores
from aerosid.compiled.threads import mapped_in_threads


def test_results_stand_in_the_order_of_the_items_whichever_is_done_first() -> None:
    later = threading.Event()

    def waited(item: int) -> tuple[int, int]:
        """The first item ends when the second has: it takes two threads."""
        if item == 0:
            assert later.wait(60.0)
        else:
            later.set()
        return item, threading.get_ident()

    with on_cores(2):
        found = mapped_in_threads(waited, range(4))
    assert [item for item, _ in found] == [0, 1, 2, 3]
    assert len({thread for _, thread in found}) == 2


def test_one_core_makes_no_thread_and_inside_a_thread_there_is_one_core() -> None:
    assert set(mapped_in_threads(lambda _n: threading.get_ident(), range(3))) == {threading.get_ident()}
    with on_cores(3):
        assert mapped_in_threads(lambda _n: allowed(), range(5)) == [1] * 5
        assert allowed() == 3


def test_the_error_of_the_first_item_that_fails_is_raised_here() -> None:
    def refused(item: int) -> int:
        if item in (2, 3):
            raise ValueError(f"item {item}")
        return item

    for cores in (1, 2, 4):
        with on_cores(cores), pytest.raises(ValueError, match="item 2"):
            mapped_in_threads(refused, range(6))
