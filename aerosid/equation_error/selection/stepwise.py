"""Stepwise regression by Schwarz's criterion: selection, elimination and exchange at a stated false-alarm rate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import allowed, mapped
from aerosid.effects.flow_separation import is_breakdown
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import Weights, compares_all, design_of, solve, uncoloured
from aerosid.equation_error.regression.estimate import (
    Estimate,
    Frame,
    Peak,
    estimate,
    likeliest_numbers,
)
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.candidates import (
    BESIDE,
    Candidate,
    candidates_kept,
    drop_columns,
    effect_candidates,
    identity,
    in_either_order,
    joined,
    likeliest,
    scores,
    to_first_order,
    within_limits,
)
from aerosid.equation_error.selection.penalties import Rules
from aerosid.equation_error.selection.redundancy import LATE_CONTROL, open_beside
from aerosid.equation_error.selection.starting_values import separation_hypotheses, sudden_hypotheses, within_strengths
from aerosid.equation_error.selection.structure import Chosen, Selected, each_struck_out, paid
from aerosid.equation_error.settings import TRIALS

Array = NDArray[np.float64]

Admitted = Callable[[Estimate, Hypothesis], bool]
"""Whether an estimate, its last hypothesis among the effects, may stand on other grounds than its likelihood."""


def forward_steps(
    selected: Selected,
    rules: Rules,
    hypotheses: Sequence[Hypothesis],
    *,
    kinematic: bool,
    most: int,
    coefficients: Sequence[str] = (),
    recording: str | None = None,
    admitted: Admitted = lambda _found, _hypothesis: True,
    told: Callable[[str], None] = lambda _text: None,
) -> Iterator[Selected]:
    """A structure, and that with everything that pays its price, the best at a time; what no longer pays leaves again.

    `most`: effects at which it ends; `coefficients`: those in which sudden changes are looked for, on the fitted
    recordings or on that one alone whose name is given.

    What enters moves the numbers of the others, and a number that other equations know too costs more the further it is
    moved from theirs: effects can chase one another out and in again. The structure that would come a second time is
    the end, and last comes the likeliest of those between, prices paid.
    """
    refused: set[tuple[str, str, str]] = set()
    met: dict[frozenset[tuple[object, ...]], Selected] = {}
    while True:
        names = names_of(selected)
        if names in met:
            yield max([*met.values()][[*met].index(names) :], key=lambda each: paid(each, rules))
            return
        met[names] = selected
        yield selected
        if len(selected.chosen) >= most:
            return
        best = _best(selected, rules, hypotheses, refused, admitted, told, coefficients, recording)
        if best is None:
            return
        found, hypothesis, gain = best
        drop_columns(selected.instead, BESIDE)
        chosen = (*selected.chosen, Chosen(hypothesis, kinematic, gain))
        selected = backward(Selected(found, chosen), rules, keep=[hypothesis], told=told)


def names_of(selected: Selected) -> frozenset[tuple[object, ...]]:
    """What tells a structure from others: its hypotheses, and when they act."""
    return frozenset((*identity(each.hypothesis), each.hypothesis.time) for each in selected.chosen)


def _best(
    selected: Selected,
    rules: Rules,
    hypotheses: Sequence[Hypothesis],
    refused: set[tuple[str, str, str]],
    admitted: Admitted,
    told: Callable[[str], None],
    coefficients: Sequence[str],
    recording: str | None,
) -> tuple[Estimate, Hypothesis, float] | None:
    base, frame = selected.estimate, selected.estimate.frame
    open_ = open_beside(hypotheses, selected.chosen, refused)
    uncoloured_ = replace(base, solution=uncoloured(base.design, base.solution.residuals))
    candidates = candidates_kept(selected.instead, BESIDE, base, open_)
    if any(kind in COEFFICIENT for kind in frame.kinds):
        sudden = [h for each in (base, uncoloured_) for h in sudden_hypotheses(frame, each, coefficients, recording)]
        taken = refused | set(selected.labels)
        sudden = [hypothesis for hypothesis in sudden if hypothesis.label not in taken]
        candidates += effect_candidates(frame, base, in_either_order(sudden, base.point.effects))
    if not candidates:
        return None
    order = list(
        dict.fromkeys([*_shortlist(base, candidates, frame, rules), *_shortlist(uncoloured_, candidates, frame, rules)])
    )
    tried: list[_Trial] = []
    ranked = _ranked(base, [candidates[n] for n in order], rules)
    while len(tried) < frame.settings.fitted:
        # As many at once as there are cores; which of them are asked at all is as on one.
        open_now = ranked[len(tried) : min(len(tried) + allowed(), frame.settings.fitted)]
        asked = [linear for linear in open_now if not tried or linear.net >= tried[0].net - TRIALS.behind]
        for linear, trial in zip(asked, _fitted(base, asked, rules), strict=True):
            if tried and linear.net < tried[0].net - TRIALS.behind:
                break
            tried = sorted([*tried, trial], key=lambda each: -each.net)
        else:
            if asked:
                continue
        break
    tried += _fitted(base, _as_late(base, tried, candidates, rules), rules)
    tried.sort(key=lambda trial: -trial.net)
    told("   tried " + ", ".join(f"{t.hypothesis.label} {t.net:.1f}" for t in tried))
    for trial in tried:
        if trial.net <= 0.0:
            continue
        found = trial.peak.estimate
        if may_stand(found, trial.hypothesis, admitted):
            told(f"  enters {trial.hypothesis.label}")
            return found, trial.hypothesis, found.gain_over(base)
        told(f"  not admitted {trial.hypothesis.label}")
        refused.add(trial.hypothesis.label)
    return None


def may_stand(found: Estimate, hypothesis: Hypothesis, admitted: Admitted) -> bool:
    """Whether the last hypothesis of an estimate lies within its limits and is admitted on other grounds."""
    return within_limits(found, hypothesis) and admitted(found, hypothesis)


def _fitted(base: Estimate, asked: Sequence[_Linear], rules: Rules) -> list[_Trial]:
    """Hypotheses with all numbers estimated anew."""

    def fitted(linear: _Linear) -> _Trial:
        found = likeliest_numbers(base.frame, _begun(base.frame, base, linear), linear.weights, steps=6)
        return _Trial(found.gain_over(base) - rules.cost(linear.hypothesis, found.point), found, linear.hypothesis)

    return mapped(fitted, asked, common=[base.frame])


def _as_late(base: Estimate, tried: Sequence[_Trial], candidates: Sequence[Candidate], rules: Rules) -> list[_Linear]:
    """The other ways in which a control is late, where the likeliest of those tried says that it is.

    What a column to a trial value says of a delay between two trial values is little where the noise is small: a lag,
    which bends less, would be asked alone.
    """
    if not tried or tried[0].hypothesis.kind not in LATE_CONTROL:
        return []
    asked, where = {trial.hypothesis.kind for trial in tried}, tried[0].hypothesis.where
    others = {
        candidate.hypothesis.kind: candidate
        for candidate in candidates
        if candidate.hypothesis.where == where and candidate.hypothesis.kind in LATE_CONTROL - asked
    }
    return _ranked(base, tuple(others.values()), rules, least=-np.inf)


def _begun(frame: Frame, base: Estimate, linear: _Linear) -> Point:
    """The point to begin an estimate from: where the regression puts it, or at a trial value that is likelier.

    What one column says of a delay of the length of a control's steps is far off; from there Gauss-Newton goes astray.
    """
    aimed = joined(base.point, linear.hypothesis)
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
    designs = [design_of(frame.segments(point), frame.settings) for point in points]
    likelihoods = [solve(design, linear.weights).log_likelihood for design in designs]
    return points[int(np.argmax(likelihoods))]


@dataclass(frozen=True)
class _Trial:
    """A hypothesis with all numbers estimated anew; `net`: its gain in ln L beyond its price."""

    net: float
    peak: Peak
    hypothesis: Hypothesis


@dataclass(frozen=True)
class _Linear:
    """A hypothesis to first order in its numbers, which are set where the regression puts them; `net` as above."""

    net: float
    hypothesis: Hypothesis
    weights: Weights


def _ranked(base: Estimate, candidates: Sequence[Candidate], rules: Rules, least: float | None = None) -> list[_Linear]:
    """Candidates that may pay their price, by their gain to first order with the colour estimated anew.

    `least`: net gain from which on; by default that of the settings.
    """
    least = base.frame.settings.nearly if least is None else least
    rows = []
    for candidate in candidates:
        solution, hypothesis = to_first_order(base, candidate)
        cost = rules.least_cost(candidate.hypothesis)
        net = base.gain_by(solution) - cost
        if net >= least:
            rows.append(_Linear(net, hypothesis, solution.weights))
    return sorted(rows, key=lambda row: -row.net)


def _shortlist(base: Estimate, candidates: Sequence[Candidate], frame: Frame, rules: Rules) -> list[int]:
    """The candidates of highest score, one of each name, that may pay their price with the colour estimated anew."""
    scored = scores(base, candidates)
    gains = scored.gains

    def worth_asking(n: int) -> bool:
        hypothesis = candidates[n].hypothesis
        paid = bool(gains[n] >= TRIALS.asked * rules.least_cost(hypothesis))
        return paid and rules.is_distinct(hypothesis, scored.own[n], gains[n], frame.settings)

    return likeliest(scored, candidates, frame.settings.shortlist, worth_asking)


def with_separation(
    selected: Selected, frame: Frame, rules: Rules, coefficients: Sequence[str], told: Callable[[str], None]
) -> Selected | None:
    """The structure with flow separation beside what it has, where that pays its price; else None."""
    best: tuple[float, Estimate, Hypothesis] | None = None
    for hypothesis in separation_hypotheses(frame, selected.estimate, coefficients):
        found = estimate(
            frame, joined(selected.estimate.point, hypothesis), selected.estimate.solution.weights, steps=12
        )
        net = found.gain_over(selected.estimate) - rules.price(hypothesis)
        told(f"  separation {net:.1f} at {found.point.effects[-1].values}")
        active = found.point.effects[-1]
        stands = within_strengths(active) and is_breakdown(active)
        if net > 0.0 and stands and (best is None or net > best[0]):
            best = net, found, hypothesis
    if best is None:
        return None
    net, found, hypothesis = best
    entered = Chosen(hypothesis, kinematic=False, gain=net + rules.price(hypothesis))
    return Selected(found, (*selected.chosen, entered))


def backward(
    selected: Selected,
    rules: Rules,
    keep: Sequence[Hypothesis] = (),
    told: Callable[[str], None] = lambda _text: None,
) -> Selected:
    """The structure without what no longer pays its price; `keep` stays."""
    while True:
        worst: tuple[float, Peak, Chosen] | None = None
        others = [each for each in selected.chosen if not any(each.hypothesis is one for one in keep)]
        lone_ones = each_struck_out(selected, others, with_columns=not compares_all(selected.estimate.design))
        for each, lone in zip(others, lone_ones, strict=True):
            loss = selected.estimate.gain_over(lone) - rules.cost(each.hypothesis, selected.estimate.point)
            if loss < 0.0 and (worst is None or loss < worst[0]):
                worst = loss, lone, each
        if worst is None:
            return selected
        told(f"  leaves {worst[2].hypothesis.label} {worst[0]:.1f}")
        selected = Selected(worst[1].estimate, tuple(each for each in selected.chosen if each is not worst[2]))


def recordings_agree(found: Estimate, hypothesis: Hypothesis) -> bool:
    """Whether each recording by itself gives an instrument's number within a few deviations of every other's."""
    places = [
        p
        for p, unknown in enumerate(found.design.unknowns)
        if unknown[0] == "effect" and found.point.effects[int(str(unknown[1]))].name == hypothesis.effects[0].name
    ]
    recordings = sorted({recording for recording, _ in found.design.segments})
    if len(recordings) < 2 or len(places) != 1:
        return True
    settings = found.frame.settings
    column = found.design.columns[:, places[0]]
    _, effect, number = found.design.unknowns[places[0]]
    active = found.point.effects[int(str(effect))]
    distance = abs(active.values[int(str(number))] - active.effect.parameters[int(str(number))].null)
    split = np.zeros((column.size, len(recordings)))
    for s, (recording, _) in enumerate(found.design.segments):
        rows = found.design.rows(s)
        split[rows, recordings.index(recording)] = column[rows]
    keep = [p for p in range(len(found.design.unknowns)) if p != places[0]]
    bare = replace(
        found.design,
        columns=found.design.columns[:, keep],
        unknowns=tuple(found.design.unknowns[p] for p in keep),
        precisions=found.design.precisions[keep],
    )
    wide = bare.beside(split, [("alone", recording) for recording in recordings])
    solved = solve(wide, found.solution.weights)
    covariance = corrected_covariance(wide, solved)[-len(recordings) :, -len(recordings) :]
    values = solved.values[-len(recordings) :]
    for i in range(len(recordings)):
        for j in range(i):
            apart = covariance[i, i] + covariance[j, j] - 2.0 * covariance[i, j]
            further = abs(values[i] - values[j]) - settings.agreement_share * distance
            if further > settings.agreement * float(np.sqrt(max(apart, 1e-300))):
                return False
    return True
