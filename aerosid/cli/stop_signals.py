"""A request to end from outside, taken as the interrupt of a keyboard: unfinished files are removed on the way out."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import NoReturn

from aerosid.file_set import end_process

INTERRUPTED, TERMINATED = 130, 143
"""Standard: exit codes of a process that SIGINT and SIGTERM end, 128 and the number of the signal."""

_ONE_KEY = 0.2
"""Numerical: s within which signals are one request: that of a key reaches all of a terminal's processes, and a process
that started this one may pass it on."""


class Termination:
    """Since when this process has been asked to end, in s of the monotonic clock, and whether by SIGTERM."""

    since: float | None = None
    requested = False

    def explains(self, error: Exception) -> bool:
        """Whether an error is due to a signal: one has come, or it is what a compiled call makes of an interrupt."""
        cause: BaseException | None = error
        while isinstance(cause, SystemError):
            cause = cause.__cause__ or cause.__context__
        return self.since is not None or isinstance(cause, KeyboardInterrupt)


def unless_ended(run: Callable[[Termination], int], *, is_last: bool = False) -> tuple[int, str]:
    """The exit code of a run, and how it was ended from outside, in a word; empty where it was not.

    Parameters
    ----------
    run : callable
        Returns `INTERRUPTED` where it was. It is given whether a signal has come, which libraries turn into errors of
        their own.
    is_last : bool
        Whether the process ends after it: then a signal that comes while Python cleans up ends it quietly too.
    """
    with termination_as_interrupt(is_last=is_last) as termination:
        code = run(termination)
    if code != INTERRUPTED:
        return code, ""
    return (TERMINATED, "terminated.") if termination.requested else (INTERRUPTED, "interrupted.")


@contextlib.contextmanager
def termination_as_interrupt(*, is_last: bool = False) -> Iterator[Termination]:
    """SIGTERM raises KeyboardInterrupt within, as SIGINT does; a second signal of either ends the process at once.

    Copies of the process end by a signal at once. Outside the main thread, or where someone else handles a signal or
    it is ignored, nothing changes.

    Parameters
    ----------
    is_last : bool
        Whether, once a signal has come, the next one ends the process after the block too.
    """
    told, owner = Termination(), os.getpid()
    in_main_thread = threading.current_thread() is threading.main_thread()
    usual = {signal.SIGTERM: signal.SIG_DFL, signal.SIGINT: signal.default_int_handler}
    own = {number: handler for number, handler in usual.items() if signal.getsignal(number) is handler}
    if not in_main_thread or not own:
        yield told
        return

    def interrupt(number: int, _frame: object) -> None:
        if os.getpid() != owner:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
            return
        if told.since is not None:
            if time.monotonic() - told.since > _ONE_KEY:
                # Whatever still waits for workers is not interrupted in its wait but ended: they end with this process.
                _end(told)
            return
        told.since = time.monotonic()
        told.requested = number == signal.SIGTERM
        raise KeyboardInterrupt

    for number in own:
        signal.signal(number, interrupt)
    try:
        yield told
    finally:
        if not is_last or told.since is None:
            for number, handler in own.items():
                signal.signal(number, handler)


def _end(told: Termination) -> NoReturn:
    code, word = (TERMINATED, b"terminated") if told.requested else (INTERRUPTED, b"interrupted")
    with contextlib.suppress(OSError):
        os.write(sys.stderr.fileno(), b"aerosid: " + word + b" before everything was tidied up.\n")
    end_process(code)
