"""Terms suggested but not proven: below the critical t-ratio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import Entry
from aerosid.notation import with_deviation
from aerosid.search.finding_rows import finding_of
from aerosid.search.findings import Finding
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import tried


@dataclass(frozen=True)
class Unproven:
    """A term that stands out, and by how many deviations it would have to: among so many candidates chance does too."""

    finding: Finding
    ratio: float
    asked: float

    @property
    def entry(self) -> Entry:
        """Coefficient and term."""
        assert self.finding.entry is not None
        return self.finding.entry


def unproven_terms(
    search: StructureSearch, completed: Refinement, refuted: Sequence[tuple[str, str, str]] = ()
) -> tuple[Unproven, ...]:
    """The term that stands out most in each coefficient beside what was found, where something is left to explain.

    Each is fitted beside the estimate; its deviation counts the residuals' colour. `refuted` are not asked for again.
    """
    if not search.is_doubtful(completed):
        return ()
    settings = search.settings.suggestion
    by_coefficient: dict[str, list[Score]] = {}
    for score in search.scores(completed):
        if score.hypothesis.is_plain_term and score.hypothesis.label not in refuted:
            by_coefficient.setdefault(score.hypothesis.where, []).append(score)
    best = [score for ranked in by_coefficient.values() for score in ranked[: settings.tried]]
    found: dict[str, Unproven] = {}
    level = search.price(completed)
    for trial in tried(search, completed, best, level, margin=np.inf):
        if not np.isfinite(trial.cost):
            continue
        part = next(p for p in search.parts(trial, search.rough_deviations(trial)) if p.entry not in completed.free)
        if part.ratio > settings.suggested:
            row = finding_of(search, part, completed.cost - trial.cost)
            if row.where not in found or part.ratio > found[row.where].ratio:
                found[row.where] = Unproven(row, part.ratio, search.critical)
    return tuple(sorted(found.values(), key=lambda each: -each.ratio))


def told_of_unproven(unproven: Sequence[Unproven]) -> list[str]:
    """A sentence for each, for the notes."""
    return [
        f"Not proven: {each.finding.where} {each.finding.term} = "
        f"{with_deviation(each.finding.value, each.finding.std_error)}: {reason(each)}. "
        "Another flight, or declaring it, would decide."
        for each in unproven
    ]


def reason(each: Unproven, told: Finding | None = None) -> str:
    """Why it is not proven; beside the number that is `told` where that is a later estimate."""
    ratio = each.ratio if told is None or told.std_error <= 0.0 else abs(told.value) / told.std_error
    if ratio < each.asked:
        return f"{ratio:.1f} standard errors from zero, where {each.asked:.1f} are asked for among so many candidates"
    return f"{ratio:.1f} standard errors from zero, but unknown forces would leave as much, and more is missing"
