"""Progress of a loop by its stages: a bar on a terminal, one line per stage where stderr is a file or a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TextIO

BEGUN: Mapping[str, tuple[float, float]] = {
    "preparing the logs": (0.0, 0.0),
    "checking data compatibility": (0.0, 0.01),
    "re-estimating the declared model": (0.04, 0.18),
    "determining the structure from the residual": (0.04, 0.22),
    "estimating by equation error": (0.25, 0.65),
    "cross-checking with the model error d(t)": (0.32, 0.95),
    "re-estimating with insignificant derivatives fixed": (0.53, 0.97),
    "simulating all logs": (0.53, 0.98),
    "computing the error without each effect": (0.56, 0.98),
    "estimating the model error d(t)": (0.57, 0.98),
    "designing the next flight": (0.66, 0.99),
}
"""Display: least and greatest fraction of the total time elapsed at the beginning of a stage: on the sample flight, a
flight of JSBSim, HFB-320, ATTAS, Twin Otter and three spans of the Citation by the default method, 10 to 120 s each,
and on 20 s of the Citation by the likelihood, 519 s. The search takes most of the time where much is missing, so that
only a range can be given. No method passes all stages; the last one is the same for all."""

LEAST_SHARE = 0.03
"""Display: fraction of the total time, 1, below which the elapsed time gives no estimate of the remaining time."""


def remaining(stage: str, elapsed: float) -> tuple[float, float] | None:
    """Least and greatest remaining time, s, at the beginning of a stage after so many s; None where unknown."""
    low, high = BEGUN.get(stage, (0.0, 0.0))
    if low < LEAST_SHARE:
        return None
    return elapsed * (1.0 - high) / high, elapsed * (1.0 - low) / low


def in_words(remains: tuple[float, float] | None) -> str:
    """The remaining time in words."""
    if remains is None:
        return "estimating remaining time"
    low, high = (_duration(seconds) for seconds in remains)
    return f"about {low} remaining" if low == high else f"{low} to {high} remaining"


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 99.5 else f"{seconds / 60.0:.0f} min"


@contextmanager
def stages(stream: TextIO | None = None) -> Iterator[Callable[[str], None]]:
    """A function that reports each stage as it begins.

    Parameters
    ----------
    stream : TextIO, optional
        Output stream; standard error by default.
    """
    stream = stream or sys.stderr
    begun = time.monotonic()
    place = {stage: number for number, stage in enumerate(BEGUN, start=1)}
    if not stream.isatty():

        def line(stage: str) -> None:
            elapsed = time.monotonic() - begun
            left = in_words(remaining(stage, elapsed))
            number = f"{place[stage]} of {len(BEGUN)}, " if stage in place else ""
            stream.write(f"aerosid: {number}{stage}; {_duration(elapsed)} elapsed, {left}\n")
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
            bar.update(task, description=stage, completed=place.get(stage, 1) - 1, left=left)

        yield shown
