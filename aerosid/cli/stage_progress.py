"""Progress of a loop by its stages: a bar on a terminal, one line a stage where standard error is a file or a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TextIO

BEGUN: Mapping[str, tuple[float, float]] = {
    "reading the logs into the flight model": (0.0, 0.0),
    "comparing the instruments with each other": (0.0, 0.01),
    "re-estimating the declared model": (0.04, 0.18),
    "tracing the residual": (0.04, 0.22),
    "asking the model error d(t)": (0.50, 0.95),
    "re-estimating beside what is not shown": (0.61, 0.97),
    "simulating every log": (0.61, 0.98),
    "leaving each effect out": (0.65, 0.98),
    "estimating the model error d(t)": (0.70, 0.98),
    "designing the next flight": (0.98, 0.99),
}
"""Least and greatest share of the whole time that has passed where a stage begins: on the sample flight, where 14 s are
taken, and on 20 s of the Citation, where 519 s are. The search takes by far the most of it where much is missing, so
that only a range is honest."""

LEAST_SHARE = 0.03
"""Share below which what has passed says nothing of what remains."""


def remaining(stage: str, elapsed: float) -> tuple[float, float] | None:
    """Least and greatest time that remains, s, where a stage begins after so many s; None where nobody can know."""
    low, high = BEGUN.get(stage, (0.0, 0.0))
    if low < LEAST_SHARE:
        return None
    return elapsed * (1.0 - high) / high, elapsed * (1.0 - low) / low


def in_words(remains: tuple[float, float] | None) -> str:
    """A range of times as a person says it."""
    if remains is None:
        return "how long it takes shows later"
    low, high = (_duration(seconds) for seconds in remains)
    return f"about {low} left" if low == high else f"{low} to {high} left"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 99.5 else f"{seconds / 60.0:.0f} min"


@contextmanager
def stages(stream: TextIO | None = None) -> Iterator[Callable[[str], None]]:
    """A function to be told each stage as it begins.

    Parameters
    ----------
    stream : TextIO, optional
        Where to; by default standard error.
    """
    stream = stream or sys.stderr
    begun = time.monotonic()
    count = iter(range(1, 1000))
    if not stream.isatty():

        def line(stage: str) -> None:
            elapsed = time.monotonic() - begun
            left = in_words(remaining(stage, elapsed))
            stream.write(f"aerosid: {next(count)} of {len(BEGUN)}, {stage}; {_duration(elapsed)} passed, {left}\n")
            stream.flush()

        yield line
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=Console(file=stream), transient=True) as bar:
        task = bar.add_task("starting", total=len(BEGUN), left="")

        def shown(stage: str) -> None:
            left = in_words(remaining(stage, time.monotonic() - begun))
            bar.update(task, description=stage, advance=1, left=left)

        yield shown
