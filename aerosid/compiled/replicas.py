"""Copies of this process that run one long task as it does, and share what the task deals out.

A copy made for every piece of work costs more than most pieces take: the pages that either process then writes are
copied, those of reference counts among them. A replica is made once. It runs the same task from the same state; where
the task deals out independent work (`cores.mapped`), each process does a part and sends its results to the others, so
that all are again in the same state. What is not dealt out, all do alike.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import sys
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection, Pipe
from typing import Any, TypeVar

from aerosid.compiled.cores import (
    NUMBER,
    TICKET,
    Shared,
    Work,
    allowed,
    apart,
    are_replicated,
    end_at_once,
    forked,
    on_cores,
    replicated_by,
    tickets_of,
)
from aerosid.compiled.sent_results import NOT_SENT, packed, unpacked

_Result = TypeVar("_Result")

_NO_MORE = (1 << 8 * TICKET) - 1
"""Layout: ticket after the last item; there is one for each process."""

_NUMBERS = 512
"""Numerical: whole numbers that all processes of one task see."""

_MOST = 4
"""Numerical: processes of one task, since each runs all of what is not dealt out."""


def replicated(task: Callable[[], _Result]) -> _Result:
    """The task's result, found by this process with as many replicas as there are further cores.

    Parameters
    ----------
    task : callable
        Changes nothing but caches, and goes the same way wherever it runs: not by the time, the number of its process
        or what others write meanwhile. What it prints or reports in a replica is lost. Where a replica ends early, or
        turns out to have gone another way, this process goes on alone.
    """
    count = min(allowed(), _MOST)
    if count < 2 or sys.platform != "linux" or are_replicated():
        return task()
    group = _Group(count)
    try:
        with on_cores(allowed()):
            for _ in range(count - 1):
                if not group.add_replica(task):
                    break
            with replicated_by(group):
                return task()
    finally:
        group.end()


class _Group:
    """The processes of one task, as one of them sees the others: the first sees all, each of those the first alone."""

    def __init__(self, size: int) -> None:
        self._tickets, self._dealer = os.pipe()
        self._room = mmap.mmap(-1, _NUMBERS * NUMBER)
        self._numbers, self._calls, self._is_first = 0, 0, True
        self._others: list[tuple[int, Connection]] = []
        self._size = size

    def add_replica(self, task: Callable[[], object]) -> bool:
        """Makes a replica, which runs the task and ends; false, and none is left, where there is no room for it."""
        here, there = Pipe()
        try:
            copy = forked()
        except OSError:
            there.close()
            here.close()
            self.end()
            return False
        if copy == 0:
            try:
                # So that it learns of the first process's end: no replica may hold the first one's end of a pipe.
                for _, connection in (*self._others, (0, here)):
                    connection.close()
                os.close(self._dealer)
                self._others, self._is_first = [(0, there)], False
                nowhere = os.open(os.devnull, os.O_WRONLY)
                os.dup2(nowhere, 1)
                os.dup2(nowhere, 2)
                with replicated_by(self):
                    task()
            finally:
                os._exit(0)
        there.close()
        self._others.append((copy, here))
        return True

    @property
    def is_alone(self) -> bool:
        """Whether no replica is left."""
        return not self._others

    def number(self) -> Shared | None:
        """The place of a number that all processes see; None where there is no more room."""
        if self._numbers >= _NUMBERS:
            return None
        self._numbers += 1
        return self._room, (self._numbers - 1) * NUMBER

    def done(self, work: Work) -> dict[int, Any]:
        """The results that the processes have found: in front of an item that ends it, all but what failed."""
        self._calls += 1
        code, count = getattr(work.task, "__code__", None), len(work.items)
        place = None if code is None else (code.co_filename, code.co_firstlineno)
        here = self._calls, place, count, tuple(work.names)
        if self._is_first:
            os.write(self._dealer, tickets_of((*range(count), *(_NO_MORE for _ in range(self._size)))))
        with apart(min(self._size, count)):
            own = self._worked(work)
        exchanged = self._as_first if self._is_first else self._as_replica
        return exchanged(own, here, work.common)

    def _worked(self, work: Work) -> dict[int, Any]:
        """The results of the items whose numbers this process draws, up to one that ends it for all or fails."""
        done: dict[int, Any] = {}
        while (n := self._drawn()) != _NO_MORE:
            # Whatever an item fails by: every process finds it missing, does it again and fails alike.
            with contextlib.suppress(Exception):
                done[n] = work.task(work.items[n])
            if n not in done or work.until(done[n]):
                while self._drawn() != _NO_MORE:
                    pass
                break
        return done

    def _drawn(self) -> int:
        """The number of an item, or `_NO_MORE`; waits until the first process has dealt."""
        ticket = os.read(self._tickets, TICKET)
        if not ticket:
            raise EOFError("the first process has ended")
        return int.from_bytes(ticket, "big")

    def _as_first(self, own: dict[int, Any], here: object, common: Sequence[object]) -> dict[int, Any]:
        """The results of all; each replica is sent those of the others."""
        done = dict(own)
        found: list[dict[int, Any]] = []
        try:
            for _, connection in self._others:
                there, results = unpacked(connection.recv_bytes(), common)
                if there != here:
                    raise EOFError("a replica is elsewhere in the task, or has cached something else")
                found.append(results)
            for results in found:
                done |= results
            for (_, connection), known in zip(self._others, found, strict=True):
                connection.send_bytes(packed({n: done[n] for n in done.keys() - known.keys()}, common))
        except (EOFError, OSError, *NOT_SENT):
            self.end()
        return done

    def _as_replica(self, own: dict[int, Any], here: object, common: Sequence[object]) -> dict[int, Any]:
        """The results of all, by way of the first process; where that has ended, so does this one."""
        ((_, connection),) = self._others
        connection.send_bytes(packed((here, own), common))
        others: dict[int, Any] = unpacked(connection.recv_bytes(), common)
        return own | others

    def end(self) -> None:
        """Ends the replicas: what they still do is done here as well."""
        for copy, connection in self._others:
            end_at_once(copy)
            connection.close()
        self._others = []
        if self._tickets >= 0:
            os.close(self._tickets)
            os.close(self._dealer)
            self._tickets = -1
