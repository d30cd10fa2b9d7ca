"""Structure selection in the coefficient equations: rounds of forward selection and backward elimination."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from aerosid.effects.refutation import Refutation
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.selection.backward_elimination import (
    eliminate_insignificant,
    improves_prediction,
    on_identification_records,
)
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch, select_with_level_shifts
from aerosid.equation_error.selection.declared_start import likelier_from_declared_values
from aerosid.equation_error.selection.penalties import Label
from aerosid.equation_error.selection.prior_odds import likelihood_losses, with_raised_odds
from aerosid.equation_error.selection.structure import SelectedStructure, structure_without


def select_structure(
    search: CoefficientSearch, initial: SelectedStructure
) -> tuple[SelectedStructure, dict[Label, Refutation]]:
    """The structure selected by forward selection, replacement and backward elimination, and the refuted labels.

    Each elimination may unmask other effects, so the search is continued; an eliminated effect cannot re-enter, neither
    in addition nor as a replacement. Among the structures retained in the rounds that of highest penalised likelihood
    is returned.
    """
    refuted: dict[Label, Refutation] = {}
    eliminated: tuple[Label, ...] = ()
    most = initial.estimate.problem.settings.most
    found = likelier_from_declared_values(search, initial, select_with_level_shifts(search, initial))
    best: SelectedStructure | None = None
    visited: set[frozenset[Label]] = set()
    last = initial.estimate.problem.settings.rounds
    for round_ in range(last + 1):
        visited.add(frozenset(found.labels))
        retained, refuted_now = eliminate_insignificant(search, found)
        removed = found.labels_not_in(retained)
        refuted, eliminated = refuted | refuted_now, (*eliminated, *_barred(found, removed, refuted_now))
        # A structure with an effect that was refuted in this round is not comparable.
        is_comparable = best is not None and not set(best.labels) & refuted_now.keys()
        best = max(best, retained, key=search.penalised_likelihood) if best is not None and is_comparable else retained
        if round_ == last:
            break
        eligible = search.hypotheses_except(refuted)
        found = search.with_replacements(retained, eligible, excluded=eliminated)
        if removed:
            found = search.forward(found, eligible, most, excluded=eliminated)
        names = frozenset(found.labels)
        if names == frozenset(retained.labels) or names in visited:  # the next elimination would repeat an earlier one
            break
    assert best is not None
    return best, refuted


def _barred(found: SelectedStructure, removed: Collection[Label], refuted: Collection[Label]) -> list[Label]:
    """The removed labels that may not re-enter: a step change may, at another instant, unless prediction refuted it."""
    steps = {each.hypothesis.label for each in found.chosen if any(map(is_step_change, each.hypothesis.effects))}
    return [label for label in removed if label not in steps or label in refuted]


def add_terms_at_raised_odds(
    search: CoefficientSearch, found: SelectedStructure, refuted: dict[Label, Refutation], errors: slice
) -> tuple[CoefficientSearch, SelectedStructure, dict[Label, Refutation]]:
    """The structure with terms that are significant at raised prior odds of their coefficients, and refuted labels.

    Applied to the selected structure: what it explains no longer contradicts the identified instrument errors. At
    raised odds a term must in addition improve the prediction of records or blocks to which it is not fitted. `errors`:
    slice of the point's effects that are identified instrument errors.
    """
    losses = likelihood_losses(found.estimate, errors)
    if not losses:
        return search, found, refuted
    settings = found.estimate.problem.settings
    search = replace(
        search, criterion=with_raised_odds(search.criterion, search.hypotheses, losses, settings.contradicted)
    )
    eligible = [
        hypothesis
        for hypothesis in search.hypotheses_except(refuted)
        if hypothesis.label in search.criterion.odds_factors
    ]
    grown = search.forward(found, eligible, settings.most, step_changes=False)
    if grown is found:
        return search, found, refuted
    retained, refuted_now = eliminate_insignificant(search, grown)
    new = retained.labels_not_in(found)
    better = improves_prediction(retained, on_identification_records(search, retained))
    for each in retained.chosen:
        label = each.hypothesis.label
        if label in new and not better.get(label, False):
            retained = structure_without(retained, each)
    if not retained.labels_not_in(found):
        return search, found, refuted
    return search, retained, refuted | refuted_now
