"""Suggested terms: near-significant, below the critical t-ratio."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import Entry
from aerosid.notation import with_deviation
from aerosid.search.finding_evidence import finding_from_part
from aerosid.search.findings import Finding
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import trial_fits


@dataclass(frozen=True)
class SuggestedTerm:
    """A near-significant term, its t-ratio, and the critical ratio for the number of candidates tested."""

    finding: Finding
    ratio: float
    critical_ratio: float

    @property
    def entry(self) -> Entry:
        """Coefficient and term."""
        assert self.finding.entry is not None
        return self.finding.entry


def suggested_terms(
    search: StructureSearch, completed: Refinement, refuted: Collection[tuple[str, str, str]] = ()
) -> tuple[SuggestedTerm, ...]:
    """The most significant further term of each coefficient, where the model is inadequate.

    Each is fitted in addition to the estimate; its standard deviation is corrected for coloured residuals. `refuted`
    labels are not tested again.
    """
    if not search.is_inadequate(completed):
        return ()
    settings = search.settings.suggestion
    by_coefficient: dict[str, list[Score]] = {}
    for score in search.scores(completed):
        if score.hypothesis.is_plain_term and score.hypothesis.label not in refuted:
            by_coefficient.setdefault(score.hypothesis.where, []).append(score)
    best = [score for ranked in by_coefficient.values() for score in ranked[: settings.tried]]
    found: dict[str, SuggestedTerm] = {}
    level = search.penalised_cost(completed)
    for trial in trial_fits(search, completed, best, level, margin=np.inf):
        if not np.isfinite(trial.cost):
            continue
        part = next(p for p in search.parts(trial, search.quick_deviations(trial)) if p.entry not in completed.free)
        if part.ratio > settings.suggested:
            row = finding_from_part(search, part, completed.cost - trial.cost)
            if row.where not in found or part.ratio > found[row.where].ratio:
                found[row.where] = SuggestedTerm(row, part.ratio, search.critical)
    return tuple(sorted(found.values(), key=lambda suggestion: -suggestion.ratio))


def note_on_suggested(suggested: Sequence[SuggestedTerm]) -> list[str]:
    """One sentence per suggested term, for the notes."""
    return [
        f"Not significant: {suggestion.finding.where} {suggestion.finding.term} = "
        f"{with_deviation(suggestion.finding.value, suggestion.finding.std_error)}: {reason(suggestion)}. "
        "Another flight, or declaring the term, would decide."
        for suggestion in suggested
    ]


def reason(suggestion: SuggestedTerm, finding: Finding | None = None) -> str:
    """Why the term is not significant; `finding`: a later estimate of it, whose t-ratio is then reported."""
    ratio = suggestion.ratio if finding is None or finding.std_error <= 0.0 else abs(finding.value) / finding.std_error
    if ratio < suggestion.critical_ratio:
        return (
            f"{ratio:.1f} standard errors from zero, where {suggestion.critical_ratio:.1f} are required for the number "
            "of candidates tested"
        )
    return (
        f"{ratio:.1f} standard errors from zero, but unmodelled forces would leave as much, and the model is inadequate"
    )
