"""Bias against scale factor of a channel, nearly collinear where its mean is large: searches that begin with either."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.calibration import BIAS, SCALE
from aerosid.equation_error.selection.candidates import effect_candidates, linearised, with_hypothesis
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, penalised_likelihood
from aerosid.equation_error.settings import TRIALS

OTHER_KIND = {BIAS: SCALE, SCALE: BIAS}
"""Published: the two errors of a calibration line, its zero and its slope (Klein & Morelli 2006, section 10.3)."""


def with_either_begun(
    found: SelectedStructure,
    path: Sequence[SelectedStructure],
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
    search: Callable[[SelectedStructure], SelectedStructure],
) -> SelectedStructure:
    """The structure, or a clearly likelier one of a search that entered a scale factor for a bias or vice versa.

    Parameters
    ----------
    found : SelectedStructure
        The result of a search.
    path : sequence of SelectedStructure
        The structures on its way, the first without any added effect.
    hypotheses : sequence of Hypothesis
        Candidates.
    search : callable
        Continues the search from a structure.

    Notes
    -----
    Near 1 g a scale factor of a_z is nearly its bias, and which of the two explains more by itself is chance. If the
    wrong one enters, a further error, such as a scale factor of h, makes up for the difference, and is then needed:
    replaced alone neither is worse. What entered last is replaced by a gain to first order, which is a fraction of that
    at the colour of what it leaves: behind instrumental variables a bias of a_x of .23 m/s^2 gained 9 in place of 88.
    """
    for each in found.chosen:
        entered = next((n for n, passed in enumerate(path) if each.hypothesis.label in passed.labels), 0)
        if not entered:
            continue
        begun = _with_other_kind(path[entered - 1], each.hypothesis, found, hypotheses)
        if begun is None or not _is_higher(begun, path[entered], criterion, -TRIALS.behind):
            continue
        other = search(begun)
        if _is_higher(other, found, criterion, found.estimate.problem.settings.clearly):
            return other
    return found


def _is_higher(one: SelectedStructure, other: SelectedStructure, criterion: SelectionCriterion, margin: float) -> bool:
    """Whether the penalised likelihood of one structure exceeds that of another by more than a margin."""
    return penalised_likelihood(one, criterion) - penalised_likelihood(other, criterion) > margin


def _with_other_kind(
    before: SelectedStructure, entered: Hypothesis, found: SelectedStructure, hypotheses: Sequence[Hypothesis]
) -> SelectedStructure | None:
    """A structure with the other kind of error than the one that entered it; None where there is none to enter."""
    label = (OTHER_KIND.get(entered.kind, ""), *entered.label[1:])
    others = [] if label in found.labels else [h for h in hypotheses if h.label == label]
    candidates = effect_candidates(before.estimate.problem, before.estimate, others)
    if not candidates:
        return None
    _, hypothesis = linearised(before.estimate, candidates[0])
    point = with_hypothesis(before.estimate.point, hypothesis)
    begun = estimate(before.estimate.problem, point, before.estimate.solution.weights)
    entering = SelectedEffect(hypothesis, kinematic=True, gain=begun.gain_over(before.estimate))
    return SelectedStructure(begun, (*before.chosen, entering))
