"""Batch run: close-loop on many logs, each independent of the failures of others."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from aerosid import __version__
from aerosid.aircraft import Aircraft
from aerosid.errors import LogError
from aerosid.loop.settings import LoopSettings
from aerosid.studies.batch.logs import LogFile, require_separate_logs
from aerosid.studies.batch.one_log import BatchTask, close_one
from aerosid.studies.batch.table import (
    Measured,
    Structure,
    TableRow,
    conditions,
    derivative_table,
    measured,
    structures,
)
from aerosid.studies.journal import Journal, Row
from aerosid.studies.source_digest import source_state
from aerosid.studies.workers import EVERY_CORE, FAILURE, Workers, work_off

JOURNAL = "batch.journal"
"""Name of the journal; where it exists an interrupted batch continues."""

REPORTS = "manoeuvres"
"""Name of the folder of the logs' own reports."""


USUAL = LoopSettings()


@dataclass(frozen=True)
class Batch:
    """A finished batch.

    Attributes
    ----------
    aircraft : Aircraft
    logs : tuple of LogFile
        All of them, in order.
    rows : mapping of str to dict
        `one_log.summary_row` of each usable log, by its name.
    failures : mapping of str to str
        Reason why a log could not be used, by its name.
    reports : bool
        Whether each log has a report of its own.
    """

    aircraft: Aircraft
    logs: tuple[LogFile, ...]
    rows: Mapping[str, Row]
    failures: Mapping[str, str]
    reports: bool

    @property
    def measured(self) -> tuple[Measured, ...]:
        """Every derivative of every manoeuvre."""
        return measured(self.rows)

    @property
    def conditions(self) -> dict[str, int]:
        """The number of each log's flight condition."""
        return conditions(self.rows)

    @property
    def structures(self) -> dict[Structure, int]:
        """The number of each structure: what the declared model lacked."""
        return structures(self.rows)

    @property
    def table(self) -> tuple[TableRow, ...]:
        """Derivatives over manoeuvres."""
        return derivative_table(self.rows)


def run_batch(
    logs: Sequence[LogFile],
    aircraft: Aircraft,
    directory: Path,
    *,
    channels: Path | None = None,
    settings: LoopSettings = USUAL,
    reports: bool = True,
    workers: Workers = EVERY_CORE,
    announce: Callable[[int, int], None] = lambda _all, _done: None,
    tick: Callable[[int], None] = lambda _logs: None,
) -> Batch:
    """The loops of all logs, completed; logs with results in `directory` are not repeated.

    Parameters
    ----------
    logs : sequence of LogFile
    aircraft : Aircraft
        The declared model of all of them.
    directory : Path
        Folder of the journal and of the logs' reports.
    channels : Path, optional
        The channel map for all logs.
    settings : LoopSettings
    reports : bool
        Whether each log gets a report of its own.
    workers : Workers
    announce, tick : callable
        Called with the number of logs and of those done, then with the number completed since the last call.

    Raises
    ------
    UsageError
        Where the folder contains the results of another batch, or two logs hold the same samples.
    LogError
        Where no log could be used.
    """
    require_separate_logs(logs)
    paths = {log.key: (log.path, log.name) for log in logs}
    task = BatchTask(paths, aircraft, channels, directory / REPORTS if reports else None, settings)
    with Journal(directory / JOURNAL, _identity(aircraft, settings, reports)) as journal:
        announce(len(paths), sum(key in journal for key in paths))
        lost = work_off(partial(close_one, task), list(paths), journal, workers, tick=tick)
        found = dict(lost_rows(lost)) | {key: row for key, row in journal.rows() if key in paths}
    rows = {log.name: found[log.key] for log in logs if FAILURE not in found[log.key]}
    failures = {log.name: found[log.key][FAILURE] for log in logs if FAILURE in found[log.key]}
    if not rows:
        name, reason = next(iter(failures.items()))
        raise LogError(f"none of the {len(logs)} logs could be used; {name}: {reason}")
    return Batch(aircraft, tuple(logs), rows, failures, reports)


def lost_rows(lost: Mapping[str, str]) -> dict[str, Row]:
    """Failures that are not results: a log whose worker process died is tried again in the next run."""
    return {key: {FAILURE: reason} for key, reason in lost.items()}


def _identity(aircraft: Aircraft, settings: LoopSettings, reports: bool) -> str:
    """Identification of the results of this batch; each log's own content is part of its key."""
    state = {"aerosid": __version__, "sources": source_state()}
    what = {**state, "aircraft": aircraft.sha256, "settings": repr(settings), "reports": reports}
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()
