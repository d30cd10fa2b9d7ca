"""aerosid itself, as far as it is comparable: the whole loop, aerodynamic terms alone, and the structure told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import prepare
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.paper_chain.chain import run_chain
from aerosid.studies.monte_carlo.search import estimate_known
from benchmarks.rivals.task import COEFFICIENTS, LIBRARY, Answer, Record, Task

TERMS = LoopSettings(
    catalogue="terms", paper_chain=False, linear_analysis=False, kinematics=False, next_flight=False
)  # fmt: skip


@dataclass(frozen=True)
class WholeLoop:
    """`close_loop` with the second sample flight as validation."""

    settings: LoopSettings = field(default_factory=LoopSettings)

    def __call__(self, task: Task, record: Record) -> Answer:
        """Estimate."""
        found = close_loop([record.log], task.aircraft, [task.validation.log], settings=self.settings)
        rows = [(row.coefficient, row.term, row.value, row.std_error) for row in found.derivatives]
        named = {(e.where, e.term) if e.kind == "aero_term" else (e.kind, e.where) for e in found.effects}
        return _answer(rows, frozenset(named))


def structure_told(task: Task, record: Record) -> Answer:
    """The maximum-likelihood estimate of the true derivatives, noise of the elevator counted."""
    found = estimate_known(record.log, task.aircraft, task.entries)
    free, values = found.completed.free, found.completed.model
    rows = [
        (coefficient, str(term), values.value((coefficient, term)), float(deviation))
        for (coefficient, term), deviation in zip(free, found.uncertainty.corrected, strict=True)
    ]
    return _answer(rows, None)


def paper_chain(task: Task, record: Record) -> Answer:
    """The paper's own chain: prefilter, IEBMEE, recursive least squares on d(t)."""
    model = declared_model(task.aircraft, float(np.mean(record.log["V"]))).extended(task.entries)
    found = run_chain(model, [prepare(record.log, task.aircraft, model.columns)], task.entries)
    rows = [
        (coefficient, str(term), found.model.value((coefficient, term)), float(deviation))
        for (coefficient, term), deviation in zip(found.entries, found.std_errors, strict=True)
    ]
    return _answer(rows, None)


def _answer(rows: Sequence[tuple[str, str, float, float | None]], named: frozenset[tuple[str, str]] | None) -> Answer:
    values = np.zeros((len(COEFFICIENTS), len(LIBRARY)))
    errors = np.full(values.shape, np.nan)
    for coefficient, term, value, deviation in rows:
        if term in LIBRARY:  # another term has no place in the table; it stands in `named`
            place = COEFFICIENTS.index(coefficient), LIBRARY.index(term)
            values[place] = value
            errors[place] = np.nan if deviation is None else deviation
    return Answer(values, errors, named)
