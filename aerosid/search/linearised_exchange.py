"""Exchange of a part for another hypothesis, predicted by the second-order expansion of the likelihood with the part.

With the noise variances of that estimate the loss by an exchange is overestimated where it is large.
"""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import Entry
from aerosid.search.backward_elimination import variance_inflation
from aerosid.search.structure_search import StructureSearch


def possible_replacements(
    search: StructureSearch, current: Refinement, entries: Sequence[Entry], negligible_loss: float
) -> list[Score]:
    """The hypotheses that could recover nearly all of the loss by removing some free entries.

    `negligible_loss`: of -2 ln L, that they may leave of however small a loss.
    """
    loss, scores = search.linearised_with_candidates(current).in_place_of(entries)
    # A spline approximates any curve closely: it counts only where it recovers the loss completely.
    limits = search.settings.replacement
    tolerated_loss = negligible_loss, limits.nearly_all * loss + negligible_loss
    return [score for score in scores if loss - score.gain < tolerated_loss[score.hypothesis.searched_parameters == 0]]


def indifference_margin(search: StructureSearch, current: Refinement, labels: set[tuple[str, str, str]]) -> float:
    """Insignificant difference in penalised cost, multiplied by the parts' variance inflation by coloured residuals."""
    return search.settings.reach * inflation_of_labels(search, current, labels)


def inflation_of_labels(search: StructureSearch, current: Refinement, labels: set[tuple[str, str, str]]) -> float:
    """Variance inflation of the parts of some labels by coloured residuals, at least 1."""
    return variance_inflation(search, current, search.quick_deviations(current), labels)
