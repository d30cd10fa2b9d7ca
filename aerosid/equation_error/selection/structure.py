"""Selected structures, and re-estimates with one effect deleted at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

from aerosid.compiled.cores import mapped
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.regression.estimate import Estimate, Optimum, maximise_likelihood
from aerosid.equation_error.regression.least_squares import regress
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion, effects_of, joint_penalty

STEPS = 4
"""Numerical: Gauss-Newton steps at most of a structure with one effect less."""


@dataclass(frozen=True)
class SelectedEffect:
    """A hypothesis that was selected, with its parameters at the estimate's point.

    `kinematic`: whether it was identified by kinematics alone. `gain` in ln L when it entered.
    """

    hypothesis: Hypothesis
    kinematic: bool
    gain: float


@dataclass(frozen=True)
class SelectedStructure:
    """A structure and its estimate; `chosen` in the order of the point's added effects and terms.

    `cache`: re-estimates without and with replacements of each effect, kept as long as the structure.
    """

    estimate: Estimate
    chosen: tuple[SelectedEffect, ...]
    cache: dict[object, list[Any]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def labels(self) -> tuple[Label, ...]:
        """Labels of the selected effects, in their order."""
        return tuple(each.hypothesis.label for each in self.chosen)

    def labels_not_in(self, other: SelectedStructure) -> tuple[Label, ...]:
        """Labels of its effects that another structure lacks."""
        others = set(other.labels)
        return tuple(label for label in self.labels if label not in others)


def penalised_likelihood(selected: SelectedStructure, criterion: SelectionCriterion) -> float:
    """Ln L of a structure less the penalties of its effects."""
    chosen = [each.hypothesis for each in selected.chosen]
    return selected.estimate.log_likelihood - joint_penalty(criterion, selected.estimate.point, chosen)


def point_without(point: Point, hypothesis: Hypothesis) -> Point:
    """The point without a hypothesis: its terms and effects removed."""
    own = effects_of(point, hypothesis)
    effects = tuple(active for active in point.effects if not any(active is one for one in own))
    dropped = set(hypothesis.entries)
    free = tuple(entry for entry in point.free if entry not in dropped)
    return replace(point, model=point.model.without(dropped), free=free, effects=effects)


def deletions(
    selected: SelectedStructure, effects: Sequence[SelectedEffect], *, with_columns: bool = False
) -> list[Optimum]:
    """The structure without each of some effects, re-estimated; cached with the structure.

    `with_columns`: with the columns of the effects' parameters, where more than the likelihood is needed.
    """
    return deletions_from([selected], effects, with_columns=with_columns)[0]


def deletions_from(
    structures: Sequence[SelectedStructure], effects: Sequence[SelectedEffect], *, with_columns: bool = False
) -> list[list[Optimum]]:
    """As `deletions`, each of several estimates of one structure without each of some effects, all of them at once."""

    def cached(selected: SelectedStructure, each: SelectedEffect) -> Optimum | None:
        peaks = selected.cache.get(("without", each.hypothesis.label), (None,))
        return peaks[0]

    def reestimated(deleted: tuple[SelectedStructure, SelectedEffect]) -> Optimum:
        (selected, each), found = deleted, deleted[0].estimate
        peak = cached(selected, each) or maximise_likelihood(
            found.problem,
            point_without(found.point, each.hypothesis),
            found.solution.weights,
            STEPS,
            near=found,
            keep_near=True,
        )
        return peak.with_columns() if with_columns else peak

    def is_cached(selected: SelectedStructure, each: SelectedEffect) -> bool:
        peak = cached(selected, each)
        return peak is not None and (not with_columns or peak.has_columns)

    missing = [(n, each) for n, one in enumerate(structures) for each in effects if not is_cached(one, each)]
    names = [(n, each.hypothesis.label) for n, each in missing]
    problems = [one.estimate.problem for one in structures]
    peaks = mapped(reestimated, [(structures[n], each) for n, each in missing], common=problems, names=names)
    for (n, each), peak in zip(missing, peaks, strict=True):
        structures[n].cache["without", each.hypothesis.label] = [peak]
    return [[one.cache["without", each.hypothesis.label][0] for each in effects] for one in structures]


def first_order_loss(selected: SelectedStructure, each: SelectedEffect) -> float:
    """Loss in ln L by the deletion of one effect, the others re-estimated to first order and the colours anew.

    Its leading parameter times its column is what it explains; any other parameter is no size.
    """
    found = selected.estimate
    own = effects_of(found.point, each.hypothesis)
    indices = [i for i, active in enumerate(found.point.effects) if any(active is one for one in own)]
    target = found.design.target.copy()
    deleted: list[Unknown] = [("term", entry) for entry in each.hypothesis.entries]
    for i in indices:
        active = found.point.effects[i]
        deleted.extend(("effect", i, k) for k in range(len(active.values)))
        size = active.values[0] - active.effect.parameters[0].null
        target += size * found.design.columns[:, found.design.unknowns.index(("effect", i, 0))]
    reduced = found.problem.with_prior_knowledge(replace(found.design.without(deleted), target=target))
    return found.log_likelihood - regress(reduced, found.problem.settings, found.solution.weights).log_likelihood


def estimate_without(selected: SelectedStructure, each: SelectedEffect) -> Estimate:
    """The estimate of the structure without one effect."""
    (peak,) = deletions(selected, [each], with_columns=True)
    return peak.estimate


def optimum_without_all(selected: SelectedStructure, effects: Iterable[SelectedEffect]) -> Optimum:
    """The regression of the structure without several effects, the parameters of the others as starting values."""
    found = selected.estimate
    point = reduce(point_without, (each.hypothesis for each in effects), found.point)
    return maximise_likelihood(found.problem, point, found.solution.weights)


def estimate_without_all(selected: SelectedStructure, effects: Iterable[SelectedEffect]) -> Estimate:
    """The same with the columns of its effects' parameters."""
    return optimum_without_all(selected, effects).estimate


def structure_without(selected: SelectedStructure, effect: SelectedEffect) -> SelectedStructure:
    """The structure without one effect, re-estimated."""
    return SelectedStructure(
        estimate_without(selected, effect), tuple(each for each in selected.chosen if each is not effect)
    )
