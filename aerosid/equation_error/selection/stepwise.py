"""Stepwise regression by Schwarz's criterion: forward selection and elimination at a stated false-alarm rate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import allowed, mapped
from aerosid.effects.flow_separation import is_breakdown
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import Weights, design_of, uses_no_instruments
from aerosid.equation_error.regression.estimate import Estimate, Optimum, estimate, maximise_likelihood
from aerosid.equation_error.regression.least_squares import solve, uncoloured
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.candidate_scores import best_candidates, score_candidates
from aerosid.equation_error.selection.candidates import (
    CURRENT_MODEL,
    Candidate,
    cached_candidates,
    drop_cached_columns,
    effect_candidates,
    full_identity,
    linearised,
    with_hypothesis,
    within_limits,
)
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.redundancy import CONTROL_DELAY_KINDS, non_redundant
from aerosid.equation_error.selection.starting_values import (
    is_within_signed_limits,
    separation_hypotheses,
    step_change_hypotheses,
)
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    deletions,
    first_order_loss,
    penalised_likelihood,
)
from aerosid.equation_error.settings import TRIALS

Array = NDArray[np.float64]

Admitted = Callable[[Estimate, Hypothesis], bool]
"""Whether an estimate, its last hypothesis among the effects, is admissible by criteria other than its likelihood."""


@dataclass
class SelectionHistory:
    """What a forward selection knows of its past, with which it can be continued.

    `inadmissible`: labels that were not admitted; `visited`: structures by key; `recurred`: whether it ended in one.
    """

    inadmissible: set[tuple[str, str, str]] = field(default_factory=set)
    visited: dict[frozenset[tuple[object, ...]], SelectedStructure] = field(default_factory=dict)
    recurred: bool = False

    def before(self, last: SelectedStructure) -> SelectionHistory:
        """The history when a structure was reached, without what its structures store."""
        key = structure_key(last)
        visited = {each: replace(found, cache={}) for each, found in self.visited.items() if each != key}
        return SelectionHistory(set(self.inadmissible), visited)


def forward_selection(
    selected: SelectedStructure,
    criterion: SelectionCriterion,
    hypotheses: Sequence[Hypothesis],
    *,
    kinematic: bool,
    most: int,
    coefficients: Sequence[str] = (),
    recording: str | None = None,
    admitted: Admitted = lambda _found, _hypothesis: True,
    history: SelectionHistory | None = None,
) -> Iterator[SelectedStructure]:
    """A structure, and its extensions by the best significant hypothesis at a time, with elimination after each step.

    `most`: number of effects at which it ends; `coefficients`: those in which step changes are searched for, on the
    identification records or on that record alone whose name is given; `history`: of a selection that this continues.

    An entering effect changes the parameters of the others, and a parameter with kinematic evidence has a penalty that
    grows with its distance from that: effects may enter and be eliminated in a cycle. The selection ends when a
    structure recurs, and yields last the structure of the cycle with the highest penalised likelihood.
    """
    history = SelectionHistory() if history is None else history
    inadmissible, visited = history.inadmissible, history.visited
    while True:
        names = structure_key(selected)
        if names in visited:
            history.recurred = True
            cycle = [*[*visited.values()][[*visited].index(names) :], selected]
            yield max(cycle, key=lambda each: penalised_likelihood(each, criterion))
            return
        visited[names] = selected
        yield selected
        if len(selected.chosen) >= most:
            return
        best = _best(selected, criterion, hypotheses, inadmissible, admitted, coefficients, recording)
        if best is None:
            # What entered last too: without it another optimum may be reached, likelier than the structure it entered.
            last, selected = selected, eliminate_by_penalty(selected, criterion)
            if selected is last:
                return
            continue
        found, hypothesis, gain = best
        drop_cached_columns(selected.cache, CURRENT_MODEL)
        chosen = (*selected.chosen, SelectedEffect(hypothesis, kinematic, gain))
        selected = eliminate_by_penalty(SelectedStructure(found, chosen), criterion, protected=[hypothesis])


def structure_key(selected: SelectedStructure) -> frozenset[tuple[object, ...]]:
    """Key of a structure: its hypotheses, and when they act."""
    return frozenset((*full_identity(each.hypothesis), each.hypothesis.time) for each in selected.chosen)


def _best(
    selected: SelectedStructure,
    criterion: SelectionCriterion,
    hypotheses: Sequence[Hypothesis],
    inadmissible: set[tuple[str, str, str]],
    admitted: Admitted,
    coefficients: Sequence[str],
    recording: str | None,
) -> tuple[Estimate, Hypothesis, float] | None:
    base, problem = selected.estimate, selected.estimate.problem
    eligible = non_redundant(hypotheses, selected.chosen, inadmissible)
    uncoloured_base = replace(base, solution=uncoloured(base.design, base.solution.residuals))
    candidates = cached_candidates(selected.cache, CURRENT_MODEL, base, eligible)
    if any(kind in COEFFICIENT for kind in problem.kinds):
        step_changes = [
            h
            for each in (base, uncoloured_base)
            for h in step_change_hypotheses(problem, each, coefficients, recording)
        ]
        taken = inadmissible | set(selected.labels)
        step_changes = [hypothesis for hypothesis in step_changes if hypothesis.label not in taken]
        candidates += effect_candidates(problem, base, step_changes)
    if not candidates:
        return None
    order = list(
        dict.fromkeys(
            [
                *_shortlist(base, candidates, problem, criterion),
                *_shortlist(uncoloured_base, candidates, problem, criterion),
            ]
        )
    )
    tried: list[_Trial] = []
    ranked = _ranked(base, [candidates[n] for n in order], criterion)
    while len(tried) < problem.settings.fitted:
        # As many in parallel as there are cores; the set of those tested does not depend on that.
        next_ranked = ranked[len(tried) : min(len(tried) + allowed(), problem.settings.fitted)]
        tested = [linear for linear in next_ranked if not tried or linear.net >= tried[0].net - TRIALS.behind]
        for linear, trial in zip(tested, _estimated(base, tested, criterion), strict=True):
            if tried and linear.net < tried[0].net - TRIALS.behind:
                break
            tried = sorted([*tried, trial], key=lambda each: -each.net)
        else:
            if tested:
                continue
        break
    tried += _estimated(base, _other_delay_kinds(base, tried, candidates, criterion), criterion)
    tried.sort(key=lambda trial: -trial.net)
    for trial in tried:
        if trial.net <= 0.0:
            continue
        found = trial.peak.estimate
        if is_acceptable(found, trial.hypothesis, admitted):
            return found, trial.hypothesis, found.gain_over(base)
        inadmissible.add(trial.hypothesis.label)
    return None


def is_acceptable(found: Estimate, hypothesis: Hypothesis, admitted: Admitted) -> bool:
    """Whether the last hypothesis of an estimate lies within its limits and is admitted by other criteria."""
    return within_limits(found, hypothesis) and admitted(found, hypothesis)


def _estimated(base: Estimate, tested: Sequence[_Linear], criterion: SelectionCriterion) -> list[_Trial]:
    """Hypotheses with all parameters re-estimated."""

    def fitted(linear: _Linear) -> _Trial:
        initial = _initial_point(base.problem, base, linear)
        found = maximise_likelihood(base.problem, initial, linear.weights, steps=6, near=base)
        return _Trial(
            found.gain_over(base) - criterion.penalty_at(linear.hypothesis, found.point), found, linear.hypothesis
        )

    return mapped(fitted, tested, common=[base.problem])


def _other_delay_kinds(
    base: Estimate, tried: Sequence[_Trial], candidates: Sequence[Candidate], criterion: SelectionCriterion
) -> list[_Linear]:
    """The other kinds of delay of a control, where the likeliest of those tried is one.

    In low noise the secant to a trial value predicts little of a delay between two trial values: a lag, which is less
    nonlinear, would be tested alone.
    """
    if not tried or tried[0].hypothesis.kind not in CONTROL_DELAY_KINDS:
        return []
    tested, where = {trial.hypothesis.kind for trial in tried}, tried[0].hypothesis.where
    others = {
        candidate.hypothesis.kind: candidate
        for candidate in candidates
        if candidate.hypothesis.where == where and candidate.hypothesis.kind in CONTROL_DELAY_KINDS - tested
    }
    return _ranked(base, tuple(others.values()), criterion, least=-np.inf)


def _initial_point(problem: RegressionProblem, base: Estimate, linear: _Linear) -> Point:
    """The starting point of an estimate: the regressed value, or a trial value that is likelier.

    The linear prediction of a delay comparable to a control's steps is far off, and Gauss-Newton diverges from there.
    """
    aimed = with_hypothesis(base.point, linear.hypothesis)
    if not linear.hypothesis.effects:
        return aimed
    (active,) = linear.hypothesis.effects
    trials = [trial for trial in active.effect.parameters[0].trials if trial != active.effect.parameters[0].null]
    if len(trials) < 2:
        return aimed
    points = [aimed]
    for trial in trials:
        moved = replace(active, values=(trial, *active.values[1:]))
        points.append(replace(aimed, effects=(*aimed.effects[:-1], moved)))
    designs = [design_of(problem.segments(point), problem.settings) for point in points]
    likelihoods = [solve(design, linear.weights).log_likelihood for design in designs]
    return points[int(np.argmax(likelihoods))]


@dataclass(frozen=True)
class _Trial:
    """A hypothesis with all parameters re-estimated; `net`: its gain in ln L less its penalty."""

    net: float
    peak: Optimum
    hypothesis: Hypothesis


@dataclass(frozen=True)
class _Linear:
    """A hypothesis to first order at its regressed parameter values; `net` as above."""

    net: float
    hypothesis: Hypothesis
    weights: Weights


def _ranked(
    base: Estimate, candidates: Sequence[Candidate], criterion: SelectionCriterion, least: float | None = None
) -> list[_Linear]:
    """Candidates that may exceed their penalty, by first-order gain with the colour re-estimated.

    `least`: least net gain; by default that of the settings.
    """
    least = base.problem.settings.nearly if least is None else least
    rows = []
    for candidate in candidates:
        solution, hypothesis = linearised(base, candidate)
        penalty = criterion.least_penalty(candidate.hypothesis)
        net = base.gain_by(solution) - penalty
        if net >= least:
            rows.append(_Linear(net, hypothesis, solution.weights))
    return sorted(rows, key=lambda row: -row.net)


def _shortlist(
    base: Estimate, candidates: Sequence[Candidate], problem: RegressionProblem, criterion: SelectionCriterion
) -> list[int]:
    """The candidates of highest score, one of each name, that may exceed their penalty with the colour re-estimated."""
    scored = score_candidates(base, candidates)
    gains = scored.gains

    def may_exceed_penalty(n: int) -> bool:
        hypothesis = candidates[n].hypothesis
        exceeds = bool(gains[n] >= TRIALS.asked * criterion.least_penalty(hypothesis))
        return exceeds and criterion.is_distinct(hypothesis, scored.independent[n], gains[n], problem.settings)

    return best_candidates(scored, candidates, problem.settings.shortlist, may_exceed_penalty)


def with_flow_separation(
    selected: SelectedStructure,
    problem: RegressionProblem,
    criterion: SelectionCriterion,
    coefficients: Sequence[str],
) -> SelectedStructure | None:
    """The structure with flow separation, where that exceeds its penalty; else None."""
    best: tuple[float, Estimate, Hypothesis] | None = None
    for hypothesis in separation_hypotheses(problem, selected.estimate, coefficients):
        found = estimate(
            problem, with_hypothesis(selected.estimate.point, hypothesis), selected.estimate.solution.weights, steps=12
        )
        net = found.gain_over(selected.estimate) - criterion.penalty(hypothesis)
        active = found.point.effects[-1]
        is_valid = is_within_signed_limits(active) and is_breakdown(active)
        if net > 0.0 and is_valid and (best is None or net > best[0]):
            best = net, found, hypothesis
    if best is None:
        return None
    net, found, hypothesis = best
    entered = SelectedEffect(hypothesis, kinematic=False, gain=net + criterion.penalty(hypothesis))
    return SelectedStructure(found, (*selected.chosen, entered))


def eliminate_by_penalty(
    selected: SelectedStructure,
    criterion: SelectionCriterion,
    protected: Sequence[Hypothesis] = (),
) -> SelectedStructure:
    """Backward elimination of effects whose gain is below their penalty; `protected` ones are retained."""
    while True:
        worst: tuple[float, Optimum, SelectedEffect] | None = None
        others = [
            each
            for each in selected.chosen
            if not any(each.hypothesis is one for one in protected) and not _is_necessary(selected, each, criterion)
        ]
        reduced_fits = deletions(selected, others, with_columns=not uses_no_instruments(selected.estimate.design))
        for each, reduced in zip(others, reduced_fits, strict=True):
            net = selected.estimate.gain_over(reduced) - criterion.penalty_at(each.hypothesis, selected.estimate.point)
            if net < 0.0 and (worst is None or net < worst[0]):
                worst = net, reduced, each
        if worst is None:
            return selected
        selected = SelectedStructure(worst[1].estimate, tuple(each for each in selected.chosen if each is not worst[2]))


def _is_necessary(selected: SelectedStructure, each: SelectedEffect, criterion: SelectionCriterion) -> bool:
    """Whether the loss without an effect, to first order, is too far above its penalty for a re-estimate to matter."""
    if not uses_no_instruments(selected.estimate.design):
        return False
    is_linear = all(is_step_change(active) for active in each.hypothesis.effects)
    least = TRIALS.necessary if is_linear else TRIALS.necessary_nonlinear
    penalty = criterion.penalty_at(each.hypothesis, selected.estimate.point)
    return first_order_loss(selected, each) > least * penalty


def recordings_agree(found: Estimate, hypothesis: Hypothesis) -> bool:
    """Whether estimates of an instrument error from each record alone agree within a few standard deviations."""
    indices = [
        p
        for p, unknown in enumerate(found.design.unknowns)
        if unknown[0] == "effect" and found.point.effects[int(str(unknown[1]))].name == hypothesis.effects[0].name
    ]
    recordings = sorted({recording for recording, _ in found.design.segments})
    if len(recordings) < 2 or len(indices) != 1:
        return True
    settings = found.problem.settings
    column = found.design.columns[:, indices[0]]
    _, effect, number = found.design.unknowns[indices[0]]
    active = found.point.effects[int(str(effect))]
    distance = abs(active.values[int(str(number))] - active.effect.parameters[int(str(number))].null)
    split = np.zeros((column.size, len(recordings)))
    for s, (recording, _) in enumerate(found.design.segments):
        rows = found.design.rows(s)
        split[rows, recordings.index(recording)] = column[rows]
    reduced = found.design.without({found.design.unknowns[indices[0]]})
    wide = reduced.extended(split, [("alone", recording) for recording in recordings])
    solved = solve(wide, found.solution.weights)
    covariance = corrected_covariance(wide, solved)[-len(recordings) :, -len(recordings) :]
    values = solved.values[-len(recordings) :]
    for i in range(len(recordings)):
        for j in range(i):
            variance = covariance[i, i] + covariance[j, j] - 2.0 * covariance[i, j]
            further = abs(values[i] - values[j]) - settings.agreement_share * distance
            if further > settings.agreement * float(np.sqrt(max(variance, 1e-300))):
                return False
    return True
