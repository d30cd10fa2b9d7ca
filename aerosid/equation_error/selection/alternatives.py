"""Hypotheses that these recordings cannot tell from a chosen one: in its place they are nearly as likely."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from aerosid.compiled.cores import allowed, mapped, on_cores
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.design import Solution, compares_all
from aerosid.equation_error.regression.estimate import Estimate, likeliest_numbers
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.candidates import (
    Candidate,
    candidates_kept,
    identity,
    implausibility,
    joined,
    likeliest,
    limits_of,
    scores,
    to_first_order,
    within_limits,
)
from aerosid.equation_error.selection.penalties import Rules, own_effects
from aerosid.equation_error.selection.redundancy import is_told, open_beside
from aerosid.equation_error.selection.stepwise import Admitted
from aerosid.equation_error.selection.structure import Chosen, Selected, each_struck_out, struck_out
from aerosid.equation_error.selection.wald_tests import null_of
from aerosid.equation_error.settings import TRIALS

_Told = TypeVar("_Told")

Farthest = Callable[[Hypothesis], float]
"""How far behind a chosen one, in ln L, a hypothesis is of interest in its place."""


@dataclass(frozen=True)
class Alternative:
    """What could stand in place of a chosen hypothesis.

    `active` with its numbers, None for a term; `gain` in ln L in its place; `behind` what the chosen one has more,
    which decides nothing up to `margin`; `own` the share of its columns that no other explains; `unlikelier` by how
    much its size is more unusual beforehand than the chosen one's, in ln L.
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
    unlikelier: float = 0.0

    @property
    def ratio(self) -> float:
        """Distance of its number from its null value in its own deviations; infinite without any."""
        return abs(self.value - null_of(self.active)) / self.std_error if self.std_error > 0.0 else np.inf


def worth_of(selected: Selected) -> dict[tuple[str, str, str], float]:
    """What each chosen hypothesis is worth in ln L, by its label: the fall when it is struck out of the structure."""
    bare = each_struck_out(selected, selected.chosen, with_columns=not compares_all(selected.estimate.design))
    return {
        each.hypothesis.label: selected.estimate.gain_over(lone)
        for each, lone in zip(selected.chosen, bare, strict=True)
    }


def alternatives_of(selected: Selected, asked: Sequence[Hypothesis]) -> tuple[Alternative, ...]:
    """Everything that does for a chosen hypothesis' share of the likelihood what it does, most of all first.

    At a size that is not too unusual: an aircraft whose centre of gravity lay half a chord from where it was weighed
    would not have flown.
    """
    rows = _of_each(
        selected,
        lambda each: in_place_of(selected, each, asked),
        lambda each: _known(selected, each, asked) is not None,
    )
    return tuple(row for of_one in rows for row in of_one if row.behind + row.unlikelier < row.margin)


def replaced(
    selected: Selected,
    asked: Sequence[Hypothesis],
    rules: Rules,
    admitted: Admitted = lambda _found, _hypothesis: True,
    rounds: int = 2,
) -> Selected:
    """The structure with each hypothesis changed for the one that is likelier in its place, prices counted."""
    for _ in range(rounds):
        better = functools.partial(_better, selected, asked=asked, rules=rules, admitted=admitted)
        is_known = functools.partial(_is_known_to_win, selected, asked=asked, rules=rules)
        found = _of_each(selected, better, is_known, until=lambda row: row is not None)
        row = found[-1] if found else None
        if row is None:
            return selected
        left = selected.chosen[len(found) - 1]
        others = tuple(other for other in selected.chosen if other is not left)
        entered = Chosen(row.hypothesis, left.kinematic, row.gain)
        selected = Selected(row.estimate, (*others, entered))
    return selected


def _of_each(
    selected: Selected,
    told: Callable[[Chosen], _Told],
    is_known: Callable[[Chosen], bool],
    until: Callable[[_Told], bool] = lambda _told: False,
) -> list[_Told]:
    """What is told of each chosen one in turn, up to the first that ends it, by what could stand in its place.

    What was found on the way is kept. `is_known`: whether that was asked of one before.
    """

    def with_found(each: Chosen) -> tuple[_Told, dict[object, list[Any]]]:
        before = dict(selected.instead)
        said = told(each)
        return said, {key: made for key, made in selected.instead.items() if made is not before.get(key)}

    with on_cores(1 if all(map(is_known, selected.chosen)) else allowed()):
        answers = mapped(
            with_found, selected.chosen, common=[selected.estimate.frame], until=lambda answer: until(answer[0])
        )
    for _, made in answers:
        selected.instead.update(made)
    return [said for said, _ in answers]


def _better(
    selected: Selected, each: Chosen, asked: Sequence[Hypothesis], rules: Rules, admitted: Admitted
) -> Alternative | None:
    """The likeliest in place of one that is clearly better and admitted."""
    cost, clearly = rules.cost(each.hypothesis, selected.estimate.point), selected.estimate.frame.settings.clearly
    rows = [
        (cost - rules.cost(row.hypothesis, row.estimate.point) - row.behind, row)
        for row in in_place_of(selected, each, asked, _farthest_to_win(selected, each, rules))
    ]
    for better, row in sorted(rows, key=lambda pair: -pair[0]):
        distinct = rules.is_distinct(row.hypothesis, row.own, row.gain, row.estimate.frame.settings)
        if better > clearly and distinct and admitted(row.estimate, row.hypothesis):
            return row
    return None


def _farthest_to_win(selected: Selected, each: Chosen, rules: Rules) -> Farthest:
    """How far behind a chosen one others may be and yet clearly better, prices counted."""
    cost = rules.cost(each.hypothesis, selected.estimate.point) - selected.estimate.frame.settings.clearly
    return lambda hypothesis: cost - rules.least_cost(hypothesis)


def _is_known_to_win(selected: Selected, each: Chosen, asked: Sequence[Hypothesis], rules: Rules) -> bool:
    return _known(selected, each, asked, _farthest_to_win(selected, each, rules)) is not None


def in_place_of(
    selected: Selected, each: Chosen, asked: Sequence[Hypothesis], farthest: Farthest | None = None
) -> list[Alternative]:
    """What could stand in place of one, the likeliest first; asked again of the same structure, it is not made anew.

    `farthest`: by default the alternatives' margin. What promises to stay further behind is not estimated.
    """
    known = _known(selected, each, asked, farthest)
    if known is None:
        known = _in_place_of(selected, each, asked, farthest)
        selected.instead[_key(each, asked, farthest)] = known
    return known


def _known(
    selected: Selected, each: Chosen, asked: Sequence[Hypothesis], farthest: Farthest | None = None
) -> list[Alternative] | None:
    """The answer that was given before; that without a limit holds all others."""
    every = selected.instead.get(_key(each, asked))
    return every if every is not None else selected.instead.get(_key(each, asked, farthest))


def _key(each: Chosen, asked: Sequence[Hypothesis], farthest: Farthest | None = None) -> tuple[object, ...]:
    """Under what the answer is kept: the same hypotheses may be asked again within narrower limits."""
    limits = ((h.label, limits_of(h), None if farthest is None else farthest(h)) for h in asked)
    return each.hypothesis.label, tuple(limits)


def _in_place_of(
    selected: Selected, each: Chosen, asked: Sequence[Hypothesis], farthest: Farthest | None
) -> list[Alternative]:
    frame, settings = selected.estimate.frame, selected.estimate.frame.settings
    bare = struck_out(selected, each)
    rest = [other for other in selected.chosen if other is not each]
    open_ = open_beside(asked, rest, [each.hypothesis.label])
    candidates = candidates_kept(selected.instead, (each.hypothesis.label,), bare, open_)
    scored = scores(bare, candidates)
    alike = settings.alike_instruments if each.kinematic else settings.alike
    vacancy = _Vacancy(each, bare, selected.estimate.gain_over(bare), alike)
    unusual = implausibility(own_effects(selected.estimate.point, each.hypothesis))
    order = likeliest(scored, candidates, settings.shortlist)

    def asked_before(n: int) -> tuple[object, ...]:
        return ("tried", each.hypothesis.label, *identity(candidates[n].hypothesis), candidates[n].trial)

    def tried(n: int) -> _Tried | _Unasked | None:
        return vacancy.tried(candidates[n], farthest)

    fresh = [n for n in order if asked_before(n) not in selected.instead]
    for n, fit in zip(fresh, mapped(tried, fresh, common=[frame]), strict=True):
        if not isinstance(fit, _Unasked):
            selected.instead[asked_before(n)] = [fit]
    rows = []
    for n in order:
        (found,) = selected.instead.get(asked_before(n), (None,))
        if found is not None:
            hypothesis, estimated = found.hypothesis, found.estimate
            row = _row(estimated, hypothesis, each.hypothesis, vacancy.worth - found.behind, found.behind)
            # Where the chosen one is worth little more than the margin, nothing at all would be an alternative as well;
            # another way in which the same channel is late says that it is late.
            if row.ratio >= settings.deviations or is_told(hypothesis, [each]):
                unlikelier = implausibility(own_effects(estimated.point, hypothesis)) - unusual
                rows.append(replace(row, margin=vacancy.margin, own=float(scored.own[n]), unlikelier=unlikelier))
    return sorted(rows, key=lambda row: row.behind)


class _Unasked(NamedTuple):
    """What promises to stay behind: where another question is asked it may be of interest."""


class _Tried(NamedTuple):
    """A hypothesis in place of a chosen one, its numbers where it began; where it is likeliest, and how far behind."""

    hypothesis: Hypothesis
    estimate: Estimate
    behind: float


@dataclass(frozen=True)
class _Vacancy:
    """A structure without one of its hypotheses, for others to stand in its place.

    `left` the one; `bare` the structure without it, and `worth` what that loses in ln L; `alike` the least margin.
    """

    left: Chosen
    bare: Estimate
    worth: float
    alike: float

    @property
    def margin(self) -> float:
        """How far behind in ln L nothing is decided."""
        return self.alike + 0.03 * self.worth

    def tried(self, candidate: Candidate, farthest: Farthest | None) -> _Tried | _Unasked | None:
        """A hypothesis with its numbers estimated; None where it is no alternative, unasked where it may not win."""
        trial, hypothesis = to_first_order(self.bare, candidate)
        if self._is_hopeless(trial, hypothesis, TRIALS.hopeless * self.alike):
            return None
        if farthest is not None and self._loses(trial, hypothesis, farthest(hypothesis)):
            return _Unasked()
        begun = joined(self.bare.point, hypothesis)

        def may_win(promised: Solution) -> bool:
            return not self._is_hopeless(promised, hypothesis, self.margin)

        found = likeliest_numbers(self.bare.frame, begun, trial.weights, steps=5, may_win=may_win)
        behind = self.worth - found.gain_over(self.bare)
        if not (behind < self.margin and within_limits(found, hypothesis)):
            return None
        return _Tried(hypothesis, found.estimate, behind)

    def _behind(self, promised: Solution) -> float:
        return self.worth - self.bare.gain_by(promised)

    def _is_hopeless(self, promised: Solution, hypothesis: Hypothesis, most: float) -> bool:
        # Other ways of being late are as far from their first order as the chosen one is.
        far = self._behind(promised) > most + TRIALS.hopeless_share * self.worth
        return far and not is_told(hypothesis, [self.left])

    def _loses(self, promised: Solution, hypothesis: Hypothesis, most: float) -> bool:
        # What a lag, a limit or a moment brings is far from its first order: some that promised to lose won.
        is_linear = not hypothesis.effects and not self.left.hypothesis.effects
        return is_linear and self._behind(promised) > most + TRIALS.losing_share * self.worth


def _row(found: Estimate, hypothesis: Hypothesis, chosen: Hypothesis, gain: float, behind: float) -> Alternative:
    active, value, error = last_number(found, hypothesis)
    return Alternative(hypothesis, active, value, error, gain, behind, behind, chosen, found)


def last_number(found: Estimate, hypothesis: Hypothesis) -> tuple[ActiveEffect | None, float, float]:
    """The last hypothesis of an estimate: its effect, None for a term, its leading number and that one's deviation."""
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
    return active, value, float(deviations[found.design.unknowns.index(unknown)]) if known else float("inf")
