"""Hypotheses that these recordings cannot tell from a chosen one: in its place they are nearly as likely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import Design, Solution, gain_over
from aerosid.equation_error.regression.deviations import corrected_covariance
from aerosid.equation_error.regression.estimate import Estimate, Frame, estimate
from aerosid.equation_error.selection.candidates import (
    effect_candidates,
    joined,
    likeliest,
    scores,
    term_candidates,
    to_first_order,
    within_limits,
)
from aerosid.equation_error.selection.prices import Rules, own_effects
from aerosid.equation_error.selection.stepwise import Admitted, Chosen, Selected, is_told, without
from aerosid.equation_error.settings import TRIALS


@dataclass(frozen=True)
class Alternative:
    """What could stand in place of a chosen hypothesis.

    `active` with its numbers, None for a term; `gain` in ln L in its place; `behind` what the chosen one has more,
    which decides nothing up to `margin`; `own` the share of its columns that no other explains.
    """

    hypothesis: Hypothesis
    active: ActiveEffect | None
    value: float
    std_error: float
    gain: float
    behind: float
    margin: float
    instead_of: Hypothesis
    estimate: Estimate = field(repr=False, compare=False)
    own: float = 1.0

    @property
    def ratio(self) -> float:
        """Distance of its number from its null value in its own deviations; infinite without any."""
        null = self.active.effect.parameters[0].null if self.active is not None else 0.0
        return abs(self.value - null) / self.std_error if self.std_error > 0.0 else np.inf


def worth_of(selected: Selected) -> dict[tuple[str, str, str], float]:
    """What each chosen hypothesis is worth in ln L, by its label: the fall when it is struck out of the structure."""
    return {each.hypothesis.label: selected.estimate.gain_over(bare_of(selected, each)) for each in selected.chosen}


def bare_of(selected: Selected, each: Chosen) -> Estimate:
    """The structure without one, estimated anew; asked again of the same structure, it is not made anew."""
    key = ("without", each.hypothesis.label)
    if key not in selected.instead:
        weights = selected.estimate.solution.weights
        found = estimate(selected.estimate.frame, without(selected.estimate.point, each), weights, steps=4)
        selected.instead[key] = [found]
    bare: Estimate = selected.instead[key][0]
    return bare


def alternatives_of(selected: Selected, asked: Sequence[Hypothesis]) -> tuple[Alternative, ...]:
    """Everything that does for a chosen hypothesis' share of the likelihood what it does, most of all first."""
    return tuple(row for each in selected.chosen for row in in_place_of(selected, each, asked))


def replaced(
    selected: Selected,
    asked: Sequence[Hypothesis],
    rules: Rules,
    admitted: Admitted = lambda _found, _hypothesis: True,
    rounds: int = 2,
) -> Selected:
    """The structure with each hypothesis changed for the one that is likelier in its place, prices counted."""
    for _ in range(rounds):
        for each in selected.chosen:
            row = _better(selected, each, asked, rules, admitted)
            if row is not None:
                others = tuple(other for other in selected.chosen if other is not each)
                entered = Chosen(row.hypothesis, each.kinematic, row.gain)
                selected = Selected(row.estimate, (*others, entered))
                break
        else:
            return selected
    return selected


def _better(
    selected: Selected, each: Chosen, asked: Sequence[Hypothesis], rules: Rules, admitted: Admitted
) -> Alternative | None:
    """The likeliest in place of one that is clearly better and admitted."""
    cost = rules.cost(each.hypothesis, own_effects(selected.estimate.point, each.hypothesis))
    rows = [
        (cost - rules.cost(row.hypothesis, [row.active] if row.active else []) - row.behind, row)
        for row in in_place_of(selected, each, asked)
    ]
    for better, row in sorted(rows, key=lambda pair: -pair[0]):
        distinct = not row.hypothesis.entries or row.own >= row.estimate.frame.settings.distinct
        if better > selected.estimate.frame.settings.clearly and distinct and admitted(row.estimate, row.hypothesis):
            return row
    return None


def in_place_of(selected: Selected, each: Chosen, asked: Sequence[Hypothesis]) -> list[Alternative]:
    """What could stand in place of one, the likeliest first; asked again of the same structure, it is not made anew."""
    # The same hypotheses may be asked again within narrower limits.
    key = (each.hypothesis.label, tuple((h.label, _limits(h)) for h in asked))
    if key not in selected.instead:
        selected.instead[key] = _in_place_of(selected, each, asked)
    return selected.instead[key]


def _limits(hypothesis: Hypothesis) -> tuple[tuple[float, float], ...]:
    """Least and greatest of every number of a hypothesis."""
    return tuple((p.lowest, p.highest) for active in hypothesis.effects for p in active.effect.parameters)


def _in_place_of(selected: Selected, each: Chosen, asked: Sequence[Hypothesis]) -> list[Alternative]:
    frame, settings = selected.estimate.frame, selected.estimate.frame.settings
    bare = bare_of(selected, each)
    taken = {other.hypothesis.label for other in selected.chosen}
    rest = [other for other in selected.chosen if other is not each]
    open_ = [h for h in asked if h.label not in taken and not is_told(h, rest)]
    candidates = [*term_candidates(frame, bare, open_), *effect_candidates(frame, bare, open_)]
    scored = scores(bare, candidates)
    worth = selected.estimate.gain_over(bare)
    alike = settings.alike_instruments if each.kinematic else settings.alike
    margin = alike + 0.03 * worth
    order = likeliest(scored, candidates, settings.shortlist)

    def tried(n: int) -> _Tried | None:
        trial, hypothesis = to_first_order(bare, candidates[n])
        if (
            worth - gain_over(bare.design, bare.log_likelihood, trial, settings)
            > TRIALS.hopeless * alike + TRIALS.hopeless_share * worth
        ):
            return None
        found = estimate(frame, joined(bare.point, hypothesis), trial.weights, steps=5)
        behind = worth - found.gain_over(bare)
        if not (behind < margin and within_limits(found, hypothesis)):
            return None
        begun = tuple(active.values for active in hypothesis.effects)
        ended = tuple(active.values for active in found.point.effects)
        return _Tried(begun, found.point.model.values, ended, found.design, found.solution, behind)

    rows = []
    for n, found in zip(order, mapped(tried, order), strict=True):
        if found is not None:
            hypothesis = candidates[n].hypothesis
            if hypothesis.effects:
                effects = [replace(a, values=v) for a, v in zip(hypothesis.effects, found.begun, strict=True)]
                hypothesis = replace(hypothesis, effects=tuple(effects))
            estimated = found.estimate(frame, joined(bare.point, hypothesis))
            row = _row(estimated, hypothesis, each.hypothesis, worth - found.behind, found.behind)
            # Where the chosen one is worth little more than the margin, nothing at all would be an alternative as well.
            if row.ratio >= settings.deviations:
                rows.append(replace(row, margin=margin, own=float(scored.own[n])))
    return sorted(rows, key=lambda row: row.behind)


class _Tried(NamedTuple):
    """An estimate in place of a chosen one, without what the process that asked for it has already.

    `begun`: numbers of the hypothesis' effects to first order; `values` of all terms and `ended` numbers of all effects
    where they are likeliest.
    """

    begun: tuple[tuple[float, ...], ...]
    values: NDArray[np.float64]
    ended: tuple[tuple[float, ...], ...]
    design: Design
    solution: Solution
    behind: float

    def estimate(self, frame: Frame, start: Point) -> Estimate:
        """The estimate, `start` being where it began."""
        effects = tuple(replace(active, values=v) for active, v in zip(start.effects, self.ended, strict=True))
        point = replace(start, model=start.model.with_values(self.values), effects=effects)
        return Estimate(frame, point, self.design, self.solution)


def _row(found: Estimate, hypothesis: Hypothesis, chosen: Hypothesis, gain: float, behind: float) -> Alternative:
    deviations = np.sqrt(np.diag(corrected_covariance(found.design, found.solution)))
    if hypothesis.entries:
        entry = hypothesis.entries[0]
        unknown: tuple[object, ...] = ("term", entry)
        active, value = None, found.point.model.value(entry)
    else:
        place = len(found.point.effects) - 1
        active = found.point.effects[place]
        unknown, value = ("effect", place, 0), active.values[0]
    known = unknown in found.design.unknowns
    error = float(deviations[found.design.unknowns.index(unknown)]) if known else float("inf")
    return Alternative(hypothesis, active, value, error, gain, behind, behind, chosen, found)
