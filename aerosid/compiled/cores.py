"""Independent pieces of work dealt out to copies of this process, one a core; the results are those of one core."""

from __future__ import annotations

import contextlib
import mmap
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from multiprocessing.connection import Connection, Pipe
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from aerosid.compiled.sent_results import NOT_SENT, packed, unpacked

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")
_Other = TypeVar("_Other")

_allowed: ContextVar[int] = ContextVar("cores that may be used", default=1)

_lent: ContextVar[tuple[Connection, ...]] = ContextVar(
    "where it is told that another process's core is free", default=()
)

TICKET = 2
"""Numerical: bytes of the number of an item on its way through a pipe, which takes as many at once or none."""

NUMBER = 8
"""Layout: bytes of a whole number that copies see."""

MOST = 10_000
"""Numerical: items that are dealt out; their numbers have to fit into a pipe that nobody empties yet."""


YIELDS = 5
"""Numerical: niceness of a copy that yields, a third of another one's share of a core that both want: on a machine that
others keep busy too it is to be done in time."""


Shared = tuple[mmap.mmap, int]
"""Memory that several processes see, and where a number stands in it."""


class Work(NamedTuple):
    """Items to be dealt out, with their task and what `mapped` is told of them."""

    task: Callable[[Any], Any]
    items: Sequence[Any]
    until: Callable[[Any], bool]
    common: Sequence[object]
    names: Sequence[object]


class Replicas(Protocol):
    """Other processes that are in the same place of the same task (`compiled.replicas`)."""

    @property
    def is_alone(self) -> bool:
        """Whether none is left."""

    def number(self) -> Shared | None:
        """The place of a number that all of them see; None where there is no more room."""

    def done(self, work: Work) -> dict[int, Any]:
        """The results of some items, found by all together; none where the others have items of other names."""


_replicas: ContextVar[Replicas | None] = ContextVar("processes in the same place of the same task", default=None)


class NumberSeenByCopies:
    """A whole number that this process, its replicas and the copies that it makes later all see and change.

    When one learns of it depends on chance: it may save work, and must not change a result.

    Parameters
    ----------
    value : int
        To begin with; of replicas some may begin when others have changed it.
    """

    def __init__(self, value: int) -> None:
        replicas = _replicas.get()
        shared = replicas.number() if replicas is not None else None
        self._room, self._at = shared if shared is not None else (mmap.mmap(-1, NUMBER), 0)
        self._first = value

    @property
    def value(self) -> int:
        """The number."""
        known = int.from_bytes(self._room[self._at : self._at + NUMBER], "big")
        return known - 1 if known else self._first  # zero as long as nobody has changed it

    @value.setter
    def value(self, value: int) -> None:
        self._room[self._at : self._at + NUMBER] = (value + 1).to_bytes(NUMBER, "big")


def available() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def allowed() -> int:
    """The cores that `mapped` may use here, those among them of copies that are done and of a process that waits."""
    return _allowed.get() + sum(results.poll() for results in _lent.get())


@contextlib.contextmanager
def on_cores(count: int) -> Iterator[None]:
    """Lets `mapped` use so many cores inside the block; without it there is one, as in the workers of a batch."""
    with _sharing(count, ()):
        yield


@contextlib.contextmanager
def _sharing(count: int, lent: tuple[Connection, ...]) -> Iterator[None]:
    """Lets `mapped` use so many cores inside the block, and one more with each result that has come."""
    before, lent_before = _allowed.set(count), _lent.set(lent)
    try:
        yield
    finally:
        _allowed.reset(before)
        _lent.reset(lent_before)


def are_replicated() -> bool:
    """Whether other processes are in the same place of the same task."""
    return _replicas.get() is not None


@contextlib.contextmanager
def replicated_by(replicas: Replicas) -> Iterator[None]:
    """Inside the block `mapped` deals out to replicas of this process, which are in the same block."""
    before = _replicas.set(replicas)
    try:
        yield
    finally:
        _replicas.reset(before)


@contextlib.contextmanager
def apart(processes: int) -> Iterator[None]:
    """Inside the block this process does what its replicas do not, with its share of the cores."""
    before = _replicas.set(None)
    try:
        with on_cores(max(allowed() // processes, 1)):
            yield
    finally:
        _replicas.reset(before)


def mapped(
    task: Callable[[_Item], _Result],
    items: Sequence[_Item],
    worth: float = 0.0,
    *,
    common: Sequence[object] = (),
    until: Callable[[_Result], bool] = lambda _result: False,
    names: Sequence[object] = (),
) -> list[_Result]:
    """The task's result of each item, in their order, up to the first that ends it.

    Parameters
    ----------
    task : callable
        Changes nothing but caches; its results can be sent between processes. What it raises is raised here. What it
        deals out itself is dealt out where there are more cores than items, or copies that are done.
    items : sequence
        Taken by the cores in turn, as each becomes free.
    worth : float
        Seconds of work below which no copy is made, by the time that the first item takes here.
    common : sequence of object
        What results hold and this process has: it is not sent.
    until : callable
        Whether a result ends it. What was begun behind that one is lost.
    names : sequence
        What tells the items from others where they depend on what is cached: replicas that have cached something else
        do not work together.

    Notes
    -----
    A core that becomes free while the items are done here takes part in those that are left.
    """
    cores = allowed()
    count = min(cores, len(items))
    if count < 2 or len(items) > MOST or sys.platform != "linux":
        lent = _lent.get() if len(items) <= MOST else ()
        own = _up_to(lambda result: until(result) or any(place.poll() for place in lent), map(task, items))
        left = items[len(own) :] if own and not until(own[-1]) else ()
        return [*own, *mapped(task, left, worth, common=common, until=until)] if left else own
    replicas = _replicas.get()
    if replicas is not None and not replicas.is_alone:
        done = replicas.done(Work(task, items, until, common, names))
        return _completed(done, task, items, until)
    if worth > 0.0:
        began = time.perf_counter()
        first = task(items[0])
        if until(first):
            return [first]
        enough = (time.perf_counter() - began) * (len(items) - 1) >= worth
        with on_cores(cores if enough else 1):
            return [first, *mapped(task, items[1:], common=common, until=until)]
    tickets, dealer = os.pipe()
    os.write(dealer, tickets_of(range(len(items))))
    os.close(dealer)
    each = cores // count
    copies = [copied(lambda: _worked(task, items, tickets, until), common, each) for _ in range(count - 1)]
    try:
        with _sharing(each, tuple(results for _, results in copies)):
            done = _worked(task, items, tickets, until)
    finally:
        _draw_all(tickets)  # where the task failed here, the copies are to end too
        os.close(tickets)
        others = [received(*copy, common) for copy in copies]
    for part in others:
        done |= part
    return _completed(done, task, items, until)


def both(
    one: Callable[[], _Result], other: Callable[[], _Other], common: Sequence[object] = ()
) -> tuple[_Result, _Other]:
    """The results of two tasks that need nothing of each other, as `mapped` does its items."""
    tasks: tuple[Callable[[], Any], ...] = (one, other)
    first, second = mapped(lambda task: task(), tasks, common=common)
    return first, second


class Begun(Generic[_Result]):
    """A task that may be under way in a copy of this process; called, it waits for the result.

    Parameters
    ----------
    task : callable
        Done here where there is no copy, or where that could not do it, so that an error is this process's own.
    copy : (int, Connection), optional
        Of this process, at work on the task.
    common : sequence of object
        As of `begun`.
    lent : Connection, optional
        Tells the copy that it may use this process's core.
    """

    def __init__(
        self,
        task: Callable[[], _Result],
        copy: tuple[int, Connection] | None = None,
        common: Sequence[object] = (),
        lent: Connection | None = None,
    ) -> None:
        self._task, self._copy, self._common, self._lent = task, copy, common, lent

    def __call__(self) -> _Result:
        """The result; the copy has this process's core while it is waited for."""
        if self._copy is None or self._copy[1].closed:
            return self._task()
        if self._lent is not None:
            with self._lent, contextlib.suppress(OSError):  # a copy that is done has closed its end
                self._lent.send_bytes(b"free")
        done = received(*self._copy, self._common)
        return done[0] if 0 in done else self._task()

    def abandon(self) -> None:
        """Ends the copy, whose result is not needed."""
        if self._copy is None or self._copy[1].closed:
            return
        number, results = self._copy
        results.close()
        end_at_once(number)


def begun(task: Callable[[], _Result], common: Sequence[object] = (), *, yielding: bool = False) -> Begun[_Result]:
    """Begins a task beside what follows, where there is a core for it; what is returned waits for its result.

    Parameters
    ----------
    task : callable
        Changes nothing but caches; its result can be sent between processes. Without a second core it is done when the
        result is asked for. Where nobody asks, the copy ends when it is done.
    common : sequence of object
        What its result holds and this process has: it is not sent.
    yielding : bool
        Whether it leaves the cores to what was begun before and is waited for longer, as far as that needs them.
    """
    if _allowed.get() < 2 or sys.platform != "linux":
        return Begun(task)

    told, lent = Pipe(duplex=False)

    def work() -> dict[int, _Result]:
        if yielding:
            os.nice(YIELDS)
        with _sharing(1, (told,)):
            return {0: task()}

    with told:
        return Begun(task, copied(work, common), common, lent)


def _up_to(until: Callable[[_Result], bool], results: Iterable[_Result]) -> list[_Result]:
    """Results up to the first that ends it, and that one."""
    kept = []
    for result in results:
        kept.append(result)
        if until(result):
            break
    return kept


def _completed(
    done: dict[int, _Result],
    task: Callable[[_Item], _Result],
    items: Sequence[_Item],
    until: Callable[[_Result], bool],
) -> list[_Result]:
    """All results; what another process could not do is done here, so that its error is this process's own."""
    return _up_to(until, (done[n] if n in done else task(item) for n, item in enumerate(items)))


def tickets_of(numbers: Iterable[int]) -> bytes:
    """The numbers of items as they go through a pipe."""
    return b"".join(n.to_bytes(TICKET, "big") for n in numbers)


def _worked(
    task: Callable[[_Item], _Result], items: Sequence[_Item], tickets: int, until: Callable[[_Result], bool]
) -> dict[int, _Result]:
    """The results of the items whose numbers this process draws, until one of its own ends it for all."""
    done = {}
    while ticket := os.read(tickets, TICKET):
        n = int.from_bytes(ticket, "big")
        done[n] = task(items[n])
        if until(done[n]):
            _draw_all(tickets)
    return done


def _draw_all(tickets: int) -> None:
    """Leaves no item to be drawn."""
    while os.read(tickets, TICKET):
        pass


def copied(work: Callable[[], dict[int, Any]], common: Sequence[object] = (), cores: int = 1) -> tuple[int, Connection]:
    """A copy of this process that does some work and ends: its number, and where the results come from."""
    here, there = Pipe(duplex=False)
    copy = forked()
    if copy == 0:
        try:
            here.close()  # so that what nobody reads any more fails to be written, and does not wait for ever
            _allowed.set(cores)
            _lent.set(())
            _replicas.set(None)
            there.send_bytes(packed(work(), common))
            there.close()
        finally:
            os._exit(0)
    there.close()
    return copy, here


def received(copy: int, results: Connection, common: Sequence[object] = ()) -> dict[int, Any]:
    """What a copy has done; nothing where it ended before it could tell."""
    with results:
        try:
            done: dict[int, Any] = unpacked(results.recv_bytes(), common)
        except (EOFError, OSError, *NOT_SENT):
            done = {}
    await_end(copy)
    return done


def forked() -> int:
    """The number of a copy of this process; zero in that one."""
    with warnings.catch_warnings():
        # Python from 3.12 warns of threads: those of numerical libraries wait for work, that of a progress bar draws.
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def end_at_once(copy: int) -> None:
    """Ends a copy of this process, whatever it is doing."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(copy, signal.SIGKILL)
    await_end(copy)


def await_end(copy: int) -> None:
    """Waits until a copy of this process has ended."""
    with contextlib.suppress(ChildProcessError):  # where this process was told to forget those that end
        os.waitpid(copy, 0)
