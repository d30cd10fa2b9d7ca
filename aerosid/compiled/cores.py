"""Independent pieces of work dealt out to copies of this process, one a core; the results are those of one core."""

from __future__ import annotations

import contextlib
import os
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from multiprocessing.connection import Connection, Pipe
from typing import Any, TypeVar

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

_allowed: ContextVar[int] = ContextVar("cores that may be used", default=1)

_TICKET = 2
"""Numerical: bytes of the number of an item on its way through a pipe, which takes as many at once or none."""

MOST = 10_000
"""Numerical: items that are dealt out; their numbers have to fit into a pipe that nobody empties yet."""


def available() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def allowed() -> int:
    """The cores that `mapped` may use here."""
    return _allowed.get()


@contextlib.contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Lets `mapped` use so many cores inside the block; without it there is one, as in the workers of a batch."""
    before = _allowed.set(count)
    try:
        yield
    finally:
        _allowed.reset(before)


def mapped(task: Callable[[_Item], _Result], items: Sequence[_Item], worth: float = 0.0) -> list[_Result]:
    """The task's result of each item, in their order.

    Parameters
    ----------
    task : callable
        Changes nothing but caches; its results can be sent between processes. What it raises is raised here.
    items : sequence
        Taken by the cores as each becomes free.
    worth : float
        Seconds of work below which no copy is made, by the time that the first item takes here.
    """
    count = min(_allowed.get(), len(items))
    if count > 1 and worth > 0.0:
        began = time.perf_counter()
        first = task(items[0])
        if (time.perf_counter() - began) * (len(items) - 1) < worth:
            return [first, *map(task, items[1:])]
        return [first, *mapped(task, items[1:])]
    if count < 2 or len(items) > MOST or sys.platform != "linux":
        return [task(item) for item in items]
    tickets, dealer = os.pipe()
    os.write(dealer, b"".join(n.to_bytes(_TICKET, "big") for n in range(len(items))))
    os.close(dealer)
    copies = [_copied(lambda: _worked(task, items, tickets)) for _ in range(count - 1)]
    try:
        done = _worked(task, items, tickets)
    finally:
        while os.read(tickets, _TICKET):  # where the task failed here, the copies are to end too
            pass
        os.close(tickets)
        received = [_received(*copy) for copy in copies]
    for part in received:
        done |= part
    # What a copy could not do is done here, so that its error is this process's own.
    return [done[n] if n in done else task(item) for n, item in enumerate(items)]


def begun(task: Callable[[], _Result]) -> Callable[[], _Result]:
    """Begins a task beside what follows, where there is a core for it; what is returned waits for its result.

    Parameters
    ----------
    task : callable
        Changes nothing but caches; its result can be sent between processes. Without a second core it is done when the
        result is asked for, and so is what a copy could not do, so that an error is this process's own. Where nobody
        asks, the copy ends when it is done.
    """
    if _allowed.get() < 2 or sys.platform != "linux":
        return task
    place, here = _copied(lambda: {0: task()})

    def result() -> _Result:
        done = _received(place, here)
        return done[0] if 0 in done else task()

    return result


@contextlib.contextmanager
def prepared(
    task: Callable[[_Item], _Result], ready: Callable[[], object]
) -> Iterator[Callable[[_Item], Callable[[], _Result]]]:
    """A task for a copy of this process that readies itself beside the block until it is given its item.

    Parameters
    ----------
    task : callable
        Of one item, which can be sent between processes as can its result; changes nothing but caches.
    ready : callable
        What the copy does at once, such as imports that this process does without.

    Returns
    -------
    context manager of callable
        Given the item, it hands it over; what that returns waits for the result. Without a second core, or where the
        copy fails, the task is done here when the result is asked for. A copy given nothing ends with the block.
    """
    if _allowed.get() < 2 or sys.platform != "linux":
        yield lambda item: lambda: task(item)
        return
    asked, asking = Pipe(duplex=False)

    def work() -> dict[int, Any]:
        asking.close()
        ready()
        return {0: task(asked.recv())}

    place, results = _copied(work)
    asked.close()

    def hand_over(item: _Item) -> Callable[[], _Result]:
        with contextlib.suppress(OSError):  # the copy has ended: its result will be missing
            asking.send(item)

        def result() -> _Result:
            done = {} if results.closed else _received(place, results)
            return done[0] if 0 in done else task(item)

        return result

    try:
        yield hand_over
    finally:
        asking.close()
        if not results.closed:
            _received(place, results)


def _worked(task: Callable[[_Item], _Result], items: Sequence[_Item], tickets: int) -> dict[int, _Result]:
    """The results of the items whose numbers this process draws."""
    done = {}
    while ticket := os.read(tickets, _TICKET):
        n = int.from_bytes(ticket, "big")
        done[n] = task(items[n])
    return done


def _copied(work: Callable[[], dict[int, Any]]) -> tuple[int, Connection]:
    """A copy of this process that does some work and ends: its number, and where the results come from."""
    here, there = Pipe(duplex=False)
    with warnings.catch_warnings():
        # Python from 3.12 warns of threads: those of numerical libraries wait for work, that of a progress bar draws.
        warnings.simplefilter("ignore", DeprecationWarning)
        copy = os.fork()
    if copy == 0:
        try:
            here.close()  # so that what nobody reads any more fails to be written, and does not wait for ever
            _allowed.set(1)
            there.send(work())
            there.close()
        finally:
            os._exit(0)
    there.close()
    return copy, here


def _received(copy: int, results: Connection) -> dict[int, Any]:
    """What a copy has done; nothing where it ended before it could tell."""
    with results:
        try:
            done: dict[int, Any] = results.recv()
        except (EOFError, OSError):
            done = {}
    os.waitpid(copy, 0)
    return done
