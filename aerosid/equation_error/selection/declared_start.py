"""Search from the declared values, where the derivatives of the selected structure contradict them.

Free derivatives can hide what is missing: with a surface that hardly moves and a stabiliser that does, neither is
significant while the derivatives, fitted without both, are nearly zero, and nothing is in proportion to them. With the
declared values as a-priori information the model keeps its motion, and what it lacks is in the residuals. The structure
that is found so is then estimated without that information, and continued where its penalised likelihood is higher at
odds of the stated false-alarm rate.
"""

from __future__ import annotations

import math
from dataclasses import replace

from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch, continued
from aerosid.equation_error.selection.level_shifts import shifts_of, with_shifts
from aerosid.equation_error.selection.structure import SelectedStructure


def likelier_from_declared_values(
    search: CoefficientSearch, initial: SelectedStructure, found: SelectedStructure
) -> SelectedStructure:
    """The structure found from `initial` or, where significantly likelier, the one found from the declared values.

    Parameters
    ----------
    initial : SelectedStructure
        That from which the search started.
    found : SelectedStructure
        That in which it ended; it is returned where its derivatives do not contradict declared ones.
    """
    problem, declared = found.estimate.problem, found.estimate.design.declared
    if declared is None or problem.declared is None or initial.chosen:
        return found
    solution = found.estimate.solution
    if declared.disagreement(solution.values, solution.covariance) < problem.settings.contradiction:
        return found
    informed = replace(problem, declared=replace(problem.declared, inform=True))
    point = with_shifts(initial.estimate.point, shifts_of(found.estimate))
    start = SelectedStructure(estimate(informed, point, initial.estimate.solution.weights), ())
    grown = search.forward(start, search.hypotheses, problem.settings.most)
    if not grown.chosen:
        return found
    free = SelectedStructure(estimate(problem, grown.estimate.point, grown.estimate.solution.weights), grown.chosen)
    before, after = search.penalised_likelihood(found), search.penalised_likelihood(free)
    # Between two that are alike the shorter way decides.
    return continued(search, free) if after > before - math.log(search.criterion.false_alarm) else found
