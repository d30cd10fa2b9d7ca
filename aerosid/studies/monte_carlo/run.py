"""Run of a study: truth simulated, runs distributed to workers, results combined."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from aerosid.errors import EstimationError
from aerosid.studies.journal import Journal, Row
from aerosid.studies.monte_carlo.plan import StudyPlan
from aerosid.studies.monte_carlo.statistics import LevelStatistics, bounds, level_statistics
from aerosid.studies.monte_carlo.trial import Trials, run_trial
from aerosid.studies.monte_carlo.truth import make_truth
from aerosid.studies.workers import EVERY_CORE, FAILURE, Workers, work_off

JOURNAL = "study.journal"
"""Name of the journal of runs; where it exists an interrupted study continues."""

_CHUNK = 4
"""Numerical: runs per work item of a worker: about a second."""


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes
    ----------
    plan : StudyPlan
    trials : Trials
        The true aircraft and its flights.
    levels : tuple of LevelStatistics
        In the order of the plan.
    failures : mapping of str to int
        The error sentences of runs without numbers, and the count of each.
    directory : Path
        Where the runs are.
    lost : mapping of str to str
        Runs whose worker process died, with a sentence; the journal does not contain them.
    """

    plan: StudyPlan
    trials: Trials
    levels: tuple[LevelStatistics, ...]
    failures: Mapping[str, int]
    directory: Path
    lost: Mapping[str, str]

    def rows(self, level: int) -> list[Row]:
        """The results of one level's runs, in their order."""
        with Journal(self.directory / JOURNAL, self.plan.identity) as journal:
            return _rows(self.plan, journal, level, self.lost)


Announce = Callable[[int, int], None]
"""Called with the number of runs, and of those already done."""


def run_study(
    plan: StudyPlan,
    directory: Path,
    workers: Workers = EVERY_CORE,
    announce: Announce = lambda _all, _done: None,
    tick: Callable[[int], None] = lambda _runs: None,
) -> Study:
    """The completed study; runs present in `directory` are not repeated.

    Parameters
    ----------
    plan : StudyPlan
    directory : Path
        Folder of the journal of runs.
    workers : Workers
    announce, tick : callable
        Called with the number of runs and of those done, then with the number completed since the last call.

    Raises
    ------
    UsageError
        Where the plan is inconsistent, or the folder contains another study.
    EstimationError
        Where the true flight cannot be simulated, or no run gives numbers.
    """
    trials = Trials(make_truth(plan), plan.levels, plan.seed, plan.catalogue).begun()
    levels = []
    failures: Counter[str] = Counter()
    with Journal(directory / JOURNAL, plan.identity) as journal:
        keys = plan.keys
        announce(len(keys), sum(key in journal for key in keys))
        lost = work_off(partial(run_trial, trials), keys, journal, workers, chunk=_CHUNK, tick=tick)
        for level, bound in enumerate(bounds(trials)):
            rows = _rows(plan, journal, level, lost)
            failures.update(row[FAILURE] for row in rows if FAILURE in row)
            levels.append(level_statistics(trials, level, rows, bound))
    if not any(level.runs for level in levels):
        raise EstimationError(
            f"no run of the study gave a result; the most frequent reason: {failures.most_common(1)[0][0]}"
        )
    return Study(plan, trials, tuple(levels), dict(failures), directory, lost)


def _rows(plan: StudyPlan, journal: Journal, level: int, lost: Mapping[str, str]) -> list[Row]:
    """One level at a time is in memory. The journal may contain more runs, from a call with a larger number."""
    prefix = f"{level}/"
    wanted = {f"{prefix}{run}": run for run in range(plan.runs_at(level))}
    rows: list[Row] = [{FAILURE: lost.get(key, "not run")} for key in wanted]
    for key, row in journal.rows():
        if key in wanted:
            rows[wanted[key]] = row
    return rows
