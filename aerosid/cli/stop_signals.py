"""A request to end from outside, taken as the interrupt of a keyboard: unfinished files are removed on the way out."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator

INTERRUPTED, TERMINATED = 130, 143
"""Standard: exit codes of a process that SIGINT and SIGTERM end, 128 and the number of the signal."""


class Termination:
    """Whether this process was asked to end."""

    requested = False


def unless_ended(run: Callable[[], int]) -> tuple[int, str]:
    """The exit code of a run, and how it was ended from outside, in a word; empty where it was not."""
    with termination_as_interrupt() as termination:
        code = run()
    if code != INTERRUPTED:
        return code, ""
    return (TERMINATED, "terminated.") if termination.requested else (INTERRUPTED, "interrupted.")


@contextlib.contextmanager
def termination_as_interrupt() -> Iterator[Termination]:
    """SIGTERM raises KeyboardInterrupt within; copies of the process still end by it at once.

    Outside the main thread, or where someone else handles the signal, nothing changes.
    """
    told, owner = Termination(), os.getpid()
    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield told
        return

    def interrupt(number: int, _frame: object) -> None:
        if os.getpid() != owner:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
            return
        told.requested = True
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
    try:
        yield told
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
