"""Batch processing of one log: its loop, its report, and the numbers for the tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.spans import parse_span, read_span, require_samples
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.manoeuvres import require_manoeuvre
from aerosid.notation import finite
from aerosid.reporting import write_report
from aerosid.studies.journal import Row
from aerosid.studies.settings import BATCH

CONDITION = ("V", "h", "mach", "alpha", "mass")
"""Channels that define the flight condition at the start of a manoeuvre, SI; the mass is that of the evaluation."""


@dataclass(frozen=True)
class BatchTask:
    """Data shared by all logs of a batch; sent to workers.

    Attributes
    ----------
    paths : mapping of str to (path, name)
        The log of each item.
    aircraft : Aircraft
    channels : Path or None
        The channel map for all logs.
    reports : Path or None
        Parent folder of the logs' reports; None: no reports are written.
    settings : LoopSettings
    """

    paths: Mapping[str, tuple[str, str]]
    aircraft: Aircraft
    channels: Path | None
    reports: Path | None
    settings: LoopSettings


def close_one(task: BatchTask, key: str) -> Row:
    """The result of one log: verdict, effects, derivatives, condition and errors, as a JSON object.

    Raises
    ------
    AerosidError
        As `read_log` and `close_loop`.
    """
    path, name = task.paths[key]
    span = parse_span(path)
    log = require_samples(read_span(span, task.channels))
    if not span.whole:
        log = replace(log, name=name)
    require_manoeuvre(log)
    result = close_loop([log], task.aircraft, settings=task.settings)
    if task.reports is not None:
        write_report(result, task.reports / name, interactive=False)  # saves 5 MB per log
    return summary_row(result)


def summary_row(result: ClosedLoop) -> Row:
    """The numbers of one loop for tables over manoeuvres."""
    (log,) = result.identification
    return {
        "sha256": log.sha256,
        "verdict": result.verdict.name.lower(),
        "summary": result.summary,
        "condition": {name: _at_first(log, name) for name in CONDITION},
        "effects": [
            {
                "kind": e.kind,
                "where": e.where,
                "term": e.term,
                "value": finite(e.value),
                "std_error": finite(e.std_error),
            }
            for e in result.effects
        ],
        "derivatives": [
            {
                "coefficient": row.coefficient,
                "term": row.term,
                "declared": row.declared,
                "value": finite(row.value),
                "std_error": row.std_error,
                "std_error_white": row.std_error_white,
                "shown": row.shown,
            }
            for row in result.derivatives
        ],
        "error": [
            {
                "channel": row.channel,
                "unit": row.unit,
                "before": row.before,
                "after": row.after,
                "noise": finite(row.noise),
            }
            for row in result.errors
        ],
    }


def _at_first(log: FlightLog, name: str) -> float | None:
    """Mean over the first second, of at least five samples; None where the channel was not recorded."""
    if name not in log:
        return None
    present = np.isfinite(log[name])
    first = np.flatnonzero(present & (log.time <= log.time[0] + BATCH.trim_time))
    if first.size < BATCH.fewest:
        first = np.flatnonzero(present)[: BATCH.fewest]
    return float(np.mean(log[name][first])) if first.size else None
