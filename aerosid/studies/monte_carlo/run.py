"""Run of a study: the truth flown, the runs given to workers, the results put together."""

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
"""Name of the file that holds the runs; with it in place a study goes on where it stopped."""

_CHUNK = 4
"""Numerical: runs that a worker takes at once: about a second."""


@dataclass(frozen=True)
class Study:
    """A finished study.

    Attributes
    ----------
    plan : StudyPlan
    trials : Trials
        What was flown.
    levels : tuple of LevelStatistics
        In the order of the plan.
    failures : mapping of str to int
        The sentences of runs that gave no numbers, and how often each.
    directory : Path
        Where the runs are.
    lost : mapping of str to str
        Runs that cost their worker its life, with a sentence; the journal does not hold them.
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
"""Told how many runs there are and how many of them are done already."""


def run_study(
    plan: StudyPlan,
    directory: Path,
    workers: Workers = EVERY_CORE,
    announce: Announce = lambda _all, _done: None,
    tick: Callable[[int], None] = lambda _runs: None,
) -> Study:
    """The study, finished; runs that `directory` holds already are not done again.

    Parameters
    ----------
    plan : StudyPlan
    directory : Path
        Where the journal of runs is kept.
    workers : Workers
    announce, tick : callable
        Told how many runs there are and are done, then how many were finished since the last call.

    Raises
    ------
    UsageError
        Where the plan does not fit, or the folder holds another study.
    EstimationError
        Where the true flight cannot be flown, or no run at all gives numbers.
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
    """One level at a time is held in memory. The journal may hold more runs, of a time when more were asked for."""
    prefix = f"{level}/"
    wanted = {f"{prefix}{run}": run for run in range(plan.runs_at(level))}
    rows: list[Row] = [{FAILURE: lost.get(key, "not run")} for key in wanted]
    for key, row in journal.rows():
        if key in wanted:
            rows[wanted[key]] = row
    return rows
