"""A progress bar with the remaining time on a terminal; occasional lines where stderr is a file or a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from aerosid.cli.output import mode

Announce = Callable[[int, int], None]
Tick = Callable[[int], None]


@contextmanager
def progress_bar(what: str) -> Iterator[tuple[Announce, Tick]]:
    """Two functions: `announce(items, done)` sets the total and the items done, `tick(n)` adds n finished items."""
    if mode().quiet:
        yield lambda _all, _done: None, lambda _items: None
        return
    if not sys.stderr.isatty():
        yield _lines(what)
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("remaining"),
        TimeRemainingColumn(),
    )
    # Chunks of runs end all at once: the speed is averaged over minutes, not over the last chunk.
    with Progress(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=300.0) as bar:
        task = bar.add_task(what, total=None)

        def announce(items: int, done: int) -> None:
            bar.reset(task, total=items, completed=done)

        yield announce, lambda items: bar.advance(task, items)


LINES = 20
"""Display: maximum number of lines of a whole run."""


def _lines(what: str) -> tuple[Announce, Tick]:
    """A line at the beginning and at each twentieth of the items, with the remaining time at the present speed."""
    state = {"items": 0, "done": 0, "first": 0, "printed": 0}
    begun = time.monotonic()

    def announce(items: int, done: int) -> None:
        state.update(items=items, done=done, first=done, printed=done)
        sys.stderr.write(f"aerosid: {what}, {done} of {items}\n")
        sys.stderr.flush()

    def tick(more: int) -> None:
        state["done"] += more
        if state["done"] - state["printed"] < max(1, state["items"] // LINES) and state["done"] < state["items"]:
            return
        state["printed"] = state["done"]
        elapsed = time.monotonic() - begun
        left = elapsed * (state["items"] - state["done"]) / max(state["done"] - state["first"], 1)
        sys.stderr.write(
            f"aerosid: {what}, {state['done']} of {state['items']}; {elapsed:.0f} s elapsed, "
            f"about {left:.0f} s remaining\n"
        )
        sys.stderr.flush()

    return announce, tick
