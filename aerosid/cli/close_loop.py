"""What the verb close-loop does around the loop itself: settings from words, logs from paths, a progress bar."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from aerosid.aircraft import Aircraft
from aerosid.errors import LogError, UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.identification import LoopSettings, close_loop
from aerosid.loop.next_flight.flight_limits import read_limit
from aerosid.loop.result import ClosedLoop
from aerosid.model_error.paper_chain import ChainSettings

_FILTERS = ("zero-phase", "causal", "off")
_STAGES = 7


def loop_settings(
    prefilter: str,
    error_density: str | None,
    priors: bool,
    seed: int,
    flight_phase: str | None = None,
    aircraft_class: str | None = None,
    next_flight: bool = True,
    limits: Sequence[str] = (),
) -> LoopSettings:
    """The settings that the words of the command line ask for.

    Raises
    ------
    UsageError
        Where a word is not one of the choices, not a number or no range.
    """
    if prefilter not in _FILTERS:
        raise UsageError(f"--prefilter is {prefilter!r}; give one of {', '.join(_FILTERS)}.")
    return LoopSettings(
        chain=ChainSettings(filtering=prefilter, error_density=_density(error_density)),
        priors=priors,
        seed=seed,
        flight_phase=flight_phase,
        aircraft_class=aircraft_class,
        next_flight=next_flight,
        limits=dict(read_limit(text) for text in limits),
    )


def _density(text: str | None) -> tuple[float, float, float, float] | None:
    if text is None:
        return None
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 4 or not all(0.0 <= number < float("inf") for number in numbers):
        raise UsageError(f"--error-density is {text!r}; give four numbers, none negative, as in 1,1,0.01,0.")
    return numbers[0], numbers[1], numbers[2], numbers[3]


def read_logs(
    paths: Sequence[Path], channels: Path | None, start: float | None = None, stop: float | None = None
) -> list[FlightLog]:
    """The logs, cut to start..stop s of their own time where given.

    Raises
    ------
    LogError
        Where a log cannot be used, or the cut leaves fewer than ten samples.
    """
    logs = []
    for path in paths:
        log = read_log(path, channels)
        if start is not None or stop is not None:
            log = log.between(log.time[0] if start is None else start, log.time[-1] if stop is None else stop)
        if log.time.size < 10:
            raise LogError(f"{path}: {log.time.size} samples are too few to estimate anything; give at least 10.")
        logs.append(log)
    return logs


def with_progress(
    identification: Sequence[FlightLog], aircraft: Aircraft, validation: Sequence[FlightLog], settings: LoopSettings
) -> ClosedLoop:
    """The loop, with a progress bar on the terminal; silent where stderr is none."""
    if not sys.stderr.isatty():
        return close_loop(identification, aircraft, validation, settings)
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting", total=_STAGES)
        return close_loop(
            identification,
            aircraft,
            validation,
            settings,
            progress=lambda stage: bar.update(task, description=stage, advance=1),
        )
