"""Alternatives that explain what a selected effect explains, and not something else that would enter beside it."""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.selection.alternatives import Alternative, alternatives_of
from aerosid.equation_error.selection.candidate_scores import score_candidates
from aerosid.equation_error.selection.candidates import CURRENT_MODEL, cached_candidates, full_identity
from aerosid.equation_error.selection.structure import SelectedStructure


def competing_alternatives(selected: SelectedStructure, hypotheses: Sequence[Hypothesis]) -> tuple[Alternative, ...]:
    """The alternatives of every selected hypothesis that gain little beside it, the likeliest first.

    What gains as much beside a weak effect as in its place is another weak effect: the records tell the two apart. Step
    changes, which replace others at their instants, are not compared.
    """
    rows = alternatives_of(selected, hypotheses)
    named = {full_identity(row.hypothesis) for row in rows}
    tested = [hypothesis for hypothesis in hypotheses if full_identity(hypothesis) in named]
    candidates = cached_candidates(selected.cache, CURRENT_MODEL, selected.estimate, tested)
    beside: dict[tuple[object, ...], float] = {}
    for candidate, gain in zip(candidates, score_candidates(selected.estimate, candidates).gains, strict=True):
        key = full_identity(candidate.hypothesis)
        beside[key] = max(beside.get(key, 0.0), float(gain))
    most = selected.estimate.problem.settings.gained_beside
    return tuple(row for row in rows if beside.get(full_identity(row.hypothesis), 0.0) <= most * max(row.gain, 0.0))
