"""A progress bar with the remaining time on a terminal; a line now and then where stderr is a file or a pipe."""

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
    """Two functions: one to be told how many items there are and how many are done, one how many more were finished."""
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
    # A chunk of runs ends at once: the speed is that of the last minutes, not of the last chunk.
    with Progress(*columns, console=Console(stderr=True), transient=True, speed_estimate_period=300.0) as bar:
        task = bar.add_task(what, total=None)

        def announce(items: int, done: int) -> None:
            bar.reset(task, total=items, completed=done)

        yield announce, lambda items: bar.advance(task, items)


LINES = 20
"""Display: lines of a whole run at most."""


def _lines(what: str) -> tuple[Announce, Tick]:
    """A line at the beginning and at each twentieth of the items, with the time that the rest takes at this speed."""
    state = {"items": 0, "done": 0, "first": 0, "told": 0}
    begun = time.monotonic()

    def announce(items: int, done: int) -> None:
        state.update(items=items, done=done, first=done, told=done)
        sys.stderr.write(f"aerosid: {what}, {done} of {items}\n")
        sys.stderr.flush()

    def tick(more: int) -> None:
        state["done"] += more
        if state["done"] - state["told"] < max(1, state["items"] // LINES) and state["done"] < state["items"]:
            return
        state["told"] = state["done"]
        elapsed = time.monotonic() - begun
        left = elapsed * (state["items"] - state["done"]) / max(state["done"] - state["first"], 1)
        sys.stderr.write(
            f"aerosid: {what}, {state['done']} of {state['items']}; {elapsed:.0f} s elapsed, "
            f"about {left:.0f} s remaining\n"
        )
        sys.stderr.flush()

    return announce, tick
