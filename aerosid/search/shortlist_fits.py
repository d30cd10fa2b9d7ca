"""Trial fits of a shortlist, the leading term first: of the others those that could take its place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.search.linearised_exchange import possible_replacements
from aerosid.search.structure_search import StructureSearch
from aerosid.search.trial_fits import start_with_hypothesis, trial_fits


class ShortlistFit(NamedTuple):
    """A hypothesis of the shortlist with its trial fit."""

    score: Score
    fit: Refinement


def fits_of(search: StructureSearch, current: Refinement, scores: Sequence[Score]) -> list[ShortlistFit]:
    """The trial fits of some hypotheses in competition."""
    return list(map(ShortlistFit, scores, trial_fits(search, current, scores)))


def leading_fits(
    search: StructureSearch, current: Refinement, shortlist: Sequence[Score]
) -> tuple[list[ShortlistFit], list[Score]]:
    """The trial fits of a shortlist without the terms that cannot take the leading one's place, and those terms.

    Notes
    -----
    Shortlisted terms mostly compete for one part of the residual, each at the cost of several simulations. The term of
    largest score is fitted first, together with all effects. The second-order expansion at its maximum, which the next
    round uses too, predicts the likelihood with each other term in its place, accurately for one that can take it,
    however large their effect. A term of another part of the residual enters in a later round, and what is chosen here
    is compared once more with all that could take its place when the search ends.
    """
    terms = [score for score in shortlist if not score.hypothesis.effects]
    leading = max(terms, key=lambda score: score.gain, default=None)
    if leading is None or len(terms) < 2 or current.held_to_data > 0.0:
        return fits_of(search, current, shortlist), []
    others = [score for score in terms if score is not leading]
    # Before the leading fit, since only the last estimate's expansion is stored.
    starts = {score.hypothesis.key: start_with_hypothesis(search, current, score) for score in others}
    fits = fits_of(search, current, [score for score in shortlist if score is leading or score.hypothesis.effects])
    level = min(search.penalised_cost(fit) for _, fit in fits)
    (leader,) = (fit for score, fit in fits if score is leading)
    competing = others
    if leader.converged and leader.held_to_data == 0.0 and search.penalised_cost(leader) == level:
        possible = possible_replacements(search, leader, leading.hypothesis.entries, search.settings.reach)
        keys = {score.hypothesis.key for score in possible}
        competing = [score for score in others if score.hypothesis.key in keys]
    further = trial_fits(search, current, [], level, further=[starts[score.hypothesis.key] for score in competing])
    return [*fits, *map(ShortlistFit, competing, further)], [score for score in others if score not in competing]
