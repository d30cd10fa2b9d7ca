"""Distribution of work items to worker processes, on one or many machines, with their results as they are completed.

Workers are an executor of `concurrent.futures`: processes of this machine, or a Dask cluster. Items are independent and
have their own seeds, so that neither the number of workers nor their order changes a result. A worker that dies ends
its executor: a new one continues, and an item that kills its worker twice while alone is given up with a sentence.
"""

from __future__ import annotations

import importlib
import os
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass

from aerosid.compiled.cores import available
from aerosid.errors import AerosidError, EstimationError, UsageError
from aerosid.file_set import end_process
from aerosid.loop.blas_threads import one_blas_thread
from aerosid.studies.journal import Journal, Row
from aerosid.studies.settings import WORKERS

Task = Callable[[str], Row]
"""From an item's key to its result; pickled for workers, so that it is a module's function or a `partial` of one."""

FAILURE = "failure"
"""The key of a result that contains the sentence of an error."""

_AHEAD = 2
"""Numerical: chunks per worker: one in progress, one waiting."""

_Chunk = tuple[str, ...]
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Workers:
    """Executor of the work.

    Attributes
    ----------
    count : int or None
        Processes on this machine; None: one for each core that this process may use.
    scheduler : str or None
        Address of a Dask scheduler, as tcp://host:8786; its workers replace processes of this machine.

    Raises
    ------
    UsageError
        Where the count is below 1.
    """

    count: int | None = None
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.count is not None and self.count < 1:
            raise UsageError(f"--workers is {self.count}; at least 1 is needed.")


EVERY_CORE = Workers()
"""One process for each core of this machine."""


def work_off(
    task: Task,
    keys: Sequence[str],
    journal: Journal,
    workers: Workers = EVERY_CORE,
    *,
    chunk: int = 1,
    tick: Callable[[int], None] = lambda _items: None,
) -> Mapping[str, str]:
    """Process the items not in the journal; returns items whose worker died, with a sentence each.

    Parameters
    ----------
    task : callable
        Function of an item. An exception becomes a result of the single key `FAILURE`, so that one bad item stops no
        other.
    keys : sequence of str
        The items.
    journal : Journal
        Receives each result when it is completed.
    chunk : int
        Items per chunk of a worker: enough for a second of work keeps the overhead small.
    tick : callable
        Called with the number of items completed since the last call.

    Raises
    ------
    UsageError
        Where no worker is available.
    EstimationError
        Where worker processes die before any of them has completed an item.
    """
    pending = [key for key in keys if key not in journal]
    work = _Work(task, journal, tick)
    work.waiting.extend(tuple(pending[start : start + chunk]) for start in range(0, len(pending), chunk))
    while work.waiting:
        try:
            with opened(workers) as (executor, count):
                work.feed(executor, _AHEAD * count)
        except BrokenExecutor:
            work.take_back()
    return work.lost


class _Work:
    """Items waiting and in progress, and the history of items whose worker died."""

    def __init__(self, task: Task, journal: Journal, tick: Callable[[int], None]) -> None:
        self.task = task
        self.journal = journal
        self.tick = tick
        self.waiting: deque[_Chunk] = deque()
        self.flying: dict[Future[list[tuple[str, Row]]], _Chunk] = {}
        self.deaths: Counter[str] = Counter()
        self.lost: dict[str, str] = {}
        self.breakdowns = 0

    def feed(self, executor: Executor, most: int) -> None:
        """Keep the workers busy until nothing waits; after BrokenExecutor `flying` contains the items in progress."""
        while self.waiting or self.flying:
            while self._may_start(most):
                # Submitted before it leaves the queue: a broken executor raises.
                future = executor.submit(run_items, self.task, self.waiting[0])
                self.flying[future] = self.waiting.popleft()
            done, _ = wait(self.flying, return_when=FIRST_COMPLETED)
            broken: BaseException | None = None
            for future in done:
                error = CancelledError() if future.cancelled() else future.exception()
                if error is None:
                    rows = future.result()
                    self.journal.write(rows)
                    del self.flying[future]
                    self.breakdowns = 0
                    self.tick(len(rows))
                else:
                    broken = error
            if broken is not None:
                # Dask's own name for a task whose workers died; it must not be imported where it is not used.
                if isinstance(broken, BrokenExecutor | CancelledError) or type(broken).__name__ == "KilledWorker":
                    raise BrokenExecutor(str(broken)) from broken
                raise broken

    def _may_start(self, most: int) -> bool:
        """Whether another chunk may be submitted; one suspected of killing workers is processed alone."""
        if not self.waiting or len(self.flying) >= most:
            return False
        return not self.flying or not any(self._suspect(items) for items in (self.waiting[0], *self.flying.values()))

    def _suspect(self, items: _Chunk) -> bool:
        return any(self.deaths[key] >= WORKERS.suspect for key in items)

    def take_back(self) -> None:
        """Queue the items in progress again: suspects singly and last, without items that died alone too often."""
        self.breakdowns += 1
        if self.breakdowns > WORKERS.breakdowns:
            raise EstimationError(
                f"worker processes died {self.breakdowns} times in a row without finishing anything; look for a "
                "lack of memory, and start again with fewer --workers to go on."
            )
        chunks, self.flying = list(self.flying.values()), {}
        alone = len(chunks) == 1 and self._suspect(chunks[0])
        for items in chunks:
            self.deaths.update(items)
            for key in items:
                if alone and self.deaths[key] >= WORKERS.suspect + WORKERS.alone:
                    self.lost[key] = "its worker process died each time it was tried, at last as the only process"
                    self.breakdowns = 0
                elif self.deaths[key] >= WORKERS.suspect:
                    self.waiting.append((key,))
            early = tuple(key for key in items if self.deaths[key] < WORKERS.suspect)
            if early:
                self.waiting.appendleft(early)


@one_blas_thread()
def run_items(task: Task, items: Sequence[str]) -> list[tuple[str, Row]]:
    """The results of some items, in their order; runs in a worker."""
    _Stopped.can_be_raised = True
    try:
        return [(key, _guarded(task, key)) for key in items]
    except _Stopped:
        os._exit(1)  # what the item had begun to write is removed by now
    finally:
        _Stopped.can_be_raised = False


class _Stopped(BaseException):
    """Raised in a worker that is told to end while it works on an item."""

    can_be_raised = False


def _guarded(task: Task, key: str) -> Row:
    try:
        return task(key)
    except AerosidError as error:
        return {FAILURE: str(error)}
    except Exception as error:  # noqa: BLE001  a defect in one item stops no other; the sentence names it
        return {FAILURE: f"an unexpected {type(error).__name__} ({' '.join(str(error).split())[:200]})"}


@contextmanager
def opened(workers: Workers) -> Iterator[tuple[Executor, int]]:
    """The executor and the number of its workers, shut down at the end of the block.

    Raises
    ------
    UsageError
        Where the scheduler cannot be reached, or Dask is not installed.
    """
    if workers.scheduler is not None:
        with _dask(workers.scheduler) as pair:
            yield pair
        return
    import multiprocessing

    count = workers.count or available()
    # Spawned, not forked: the same on every system, and no lock of one of our threads is copied in locked state.
    context = multiprocessing.get_context("spawn")
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    executor = ProcessPoolExecutor(count, context, initializer=end_with_parent)
    try:
        yield executor, count
    except BaseException:
        # Items in progress are not awaited, only what their workers have to tidy up.
        processes = list((executor._processes or {}).values())
        for process in processes:
            process.terminate()
        executor.shutdown(cancel_futures=True)
        raise
    else:
        executor.shutdown()
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def end_with_parent() -> None:
    """Make this worker process end when its parent ends in any way: a killed parent sends no message."""
    import multiprocessing
    import signal
    from multiprocessing.connection import wait as wait_for

    def stop(number: int, _frame: object) -> None:
        signal.signal(number, signal.SIG_IGN)
        if _Stopped.can_be_raised:
            raise _Stopped
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent receives it and ends the workers
    signal.signal(signal.SIGTERM, stop)
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        wait_for([parent.sentinel])
        end_process(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _dask(address: str) -> Iterator[tuple[Executor, int]]:
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise UsageError(
            "--scheduler needs Dask, which is not installed; install it with pip install 'aerosid[cluster]'."
        ) from None
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"--scheduler {address}: no Dask scheduler answers there ({' '.join(str(error).split())[:120]}); start one "
            "with `dask scheduler` and workers with `dask worker`."
        ) from None
    try:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise UsageError(f"--scheduler {address}: the cluster has no workers; start some with `dask worker`.")
        yield client.get_executor(), threads
    finally:
        client.close()
