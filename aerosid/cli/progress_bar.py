"""A progress bar with the remaining time, on a terminal; silent where stderr is none."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Announce = Callable[[int, int], None]
Tick = Callable[[int], None]


@contextmanager
def progress_bar(what: str) -> Iterator[tuple[Announce, Tick]]:
    """Two functions: one to be told how many items there are and how many are done, one how many more were finished."""
    if not sys.stderr.isatty():
        yield lambda _all, _done: None, lambda _items: None
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
