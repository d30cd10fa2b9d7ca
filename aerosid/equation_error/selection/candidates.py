"""Hypotheses as columns of the regression: what each would add to every equation, to first order in its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect, InputEffect, OutputEffect
from aerosid.effects.family import at_null
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import EffectParameter, PositionEffect
from aerosid.effects.limits import OFFERED
from aerosid.effects.sensor_position import SHOWN_BY_PITCHING, farthest_place, sensor_position
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import (
    Solution,
    Weights,
    compared,
    design_of,
    regress,
    whiten,
    whitened_instruments,
)
from aerosid.equation_error.regression.estimate import Estimate, Frame, Peak, linear_values, residual_of
from aerosid.flight_model.aerodynamics import Entry
from aerosid.nomenclature import CHANNELS

Array = NDArray[np.float64]


BESIDE = ("beside",)
"""The name of a structure's own estimate among what is kept of it; others are named for what they lack."""


@dataclass(frozen=True)
class Candidate:
    """A hypothesis with its columns at an estimate.

    Attributes
    ----------
    hypothesis : Hypothesis
    columns : ndarray, shape (R, k)
        What one unit of each number adds.
    trial : int
        Which of its trial values the columns lead to.
    """

    hypothesis: Hypothesis
    columns: Array
    trial: int = 0


def of_sensors(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis says something of instruments alone, so that kinematics judge it."""
    return bool(hypothesis.effects) and all(
        isinstance(active.effect, OutputEffect | PositionEffect) for active in hypothesis.effects
    )


def told_apart(hypothesis: Hypothesis) -> tuple[str, ...]:
    """What tells a hypothesis from others of its own list: its label, of a place the axes too."""
    axes = (active.effect.axes for active in hypothesis.effects if isinstance(active.effect, PositionEffect))
    return (*hypothesis.label, *axes)


def unit_of(channel: str) -> str:
    """The unit of a channel."""
    return CHANNELS[channel].unit if channel in CHANNELS else ""


def bounded(hypothesis: Hypothesis, mean_chord: float) -> Hypothesis:
    """The hypothesis with the limits of an instrument in use and of a flyable aircraft; most have those of their kind.

    `mean_chord`: m.
    """
    if not hypothesis.effects:
        return hypothesis
    (active, *_) = hypothesis.effects
    first = active.effect.parameters[0]
    limits = {
        "sensor_bias": OFFERED.largest_bias.get(first.unit),
        "sensor_scale": OFFERED.largest_scale.get(unit_of(hypothesis.where), OFFERED.largest_inertial_scale),
        "cg_shift": OFFERED.furthest_centre * mean_chord,
    }
    limit = limits.get(hypothesis.kind)
    if limit is None:
        return hypothesis
    parameters = (_within(first, limit), *active.effect.parameters[1:])
    return replace(hypothesis, effects=(replace(active, effect=replace(active.effect, parameters=parameters)),))


def within_reach(hypothesis: Hypothesis, mean_chord: float, length: float | None) -> Hypothesis:
    """The hypothesis of a sensor's place with the aircraft's size, m, as its limit; any other as it is."""
    if not hypothesis.effects or not isinstance(hypothesis.effects[0].effect, PositionEffect):
        return hypothesis
    (active,) = hypothesis.effects
    limit = farthest_place(hypothesis.where, mean_chord, length)
    parameters = tuple(_within(parameter, limit) for parameter in active.effect.parameters)
    return replace(hypothesis, effects=(replace(active, effect=replace(active.effect, parameters=parameters)),))


def _within(parameter: EffectParameter, limit: float) -> EffectParameter:
    """The number with a limit about its null."""
    lowest, highest = parameter.null - limit, parameter.null + limit
    trials = tuple(trial for trial in parameter.trials if lowest <= trial <= highest)
    return replace(parameter, lowest=lowest, highest=highest, trials=trials or (parameter.null,))


def implausibility(effects: Sequence[ActiveEffect]) -> float:
    """What the size of an instrument's fault or of a wrong loading takes off ln L.

    `effects`: a hypothesis' own with their numbers; none of a term.
    """
    if not effects:
        return 0.0
    (active, *_), over = effects, OFFERED.limit_over_usual
    ratio = over.get(active.name, over.get(active.effect.kind))
    if ratio is None:
        return 0.0
    (parameter, *_), (value, *_) = active.effect.parameters, active.values
    half = 0.5 * (parameter.highest - parameter.lowest)
    return 0.5 * (ratio * (value - parameter.null) / half) ** 2


def within_limits(found: Estimate | Peak, hypothesis: Hypothesis) -> bool:
    """Whether the numbers of the last hypothesis of an estimate lie inside their limits: at one they prove nothing."""
    if not hypothesis.effects:
        return True
    active = found.point.effects[-1]
    return all(p.lowest < value < p.highest for p, value in zip(active.effect.parameters, active.values, strict=True))


def position_hypotheses(channels: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Sensors that sit elsewhere, of the channels that are there."""
    return tuple(
        Hypothesis("sensor_position", channel, effects=(at_null(sensor_position(channel, axis)),))
        for channel, axis in SHOWN_BY_PITCHING
        if channel in channels
    )


def in_either_order(hypotheses: Sequence[Hypothesis], effects: Sequence[ActiveEffect]) -> list[Hypothesis]:
    """The hypotheses, those of a control beside what acts on the same one in either order.

    A lag and a rate limit, or a dead band, are another thing in the other order; which it is the flight tells.
    """
    known = {
        active.effect.where for active in effects if isinstance(active.effect, InputEffect) and not active.effect.column
    }
    both = []
    for hypothesis in hypotheses:
        both.append(hypothesis)
        for active in hypothesis.effects:
            effect = active.effect
            if isinstance(effect, InputEffect) and not effect.column and effect.where in known:
                first = replace(active, effect=replace(effect, comes_first=True))
                both.append(replace(hypothesis, effects=(first,)))
    return both


def joined(point: Point, hypothesis: Hypothesis) -> Point:
    """The point with a hypothesis' terms and effects, at the values that it gives them."""
    model = point.model.extended(hypothesis.entries)
    wider = replace(point, model=model, free=(*point.free, *hypothesis.entries))
    return wider.with_effects((*point.effects, *hypothesis.effects))


def term_candidates(frame: Frame, base: Estimate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """All hypotheses that are one plain term, their columns made in one pass."""
    asked = {
        h.entries[0]: h
        for h in hypotheses
        if len(h.entries) == 1 and not h.effects and h.entries[0] not in base.point.free
    }
    if not asked:
        return []
    model = base.point.model.extended(asked)
    wide = design_of(frame.segments(replace(base.point, model=model, free=tuple(asked))), frame.settings)
    return [
        Candidate(hypothesis, wide.columns[:, [p for p, u in enumerate(wide.unknowns) if _is_of(u, entry)]])
        for entry, hypothesis in asked.items()
    ]


def _is_of(unknown: tuple[object, ...], entry: Entry) -> bool:
    return unknown[0] in ("term", "one") and unknown[1] == entry


def effect_candidates(frame: Frame, base: Estimate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """Hypotheses that are one effect each, with a column for every trial value: a delay is not linear in its number.

    A place is linear in its numbers, and has a column for each.
    """
    known = linear_values(base.design, base.solution)
    at_base = residual_of(frame, known, base.point)
    asked = [hypothesis for hypothesis in hypotheses if len(hypothesis.effects) == 1 and not hypothesis.entries]

    def columns_of(hypothesis: Hypothesis) -> list[Array]:
        wide = joined(base.point, hypothesis)
        (active,) = hypothesis.effects
        made = []
        for way in _ways(active):
            columns = []
            for number, ends in enumerate(way):
                moved = replace(wide, effects=(*wide.effects[:-1], replace(active, values=ends)))
                distance = ends[number] - active.values[number]
                columns.append(-(residual_of(frame, known, moved) - at_base) / distance)
            made.append(np.column_stack(columns))
        return made

    return [
        Candidate(hypothesis, columns, trial)
        for hypothesis, made in zip(asked, mapped(columns_of, asked), strict=True)
        for trial, columns in enumerate(made)
        if np.isfinite(columns).all()
    ]


def candidates_kept(
    kept: dict[object, list[Any]], name: tuple[object, ...], base: Estimate, hypotheses: Sequence[Hypothesis]
) -> list[Candidate]:
    """Candidates beside an estimate, terms first; those that were asked of it before are not made anew.

    Parameters
    ----------
    kept : dict
        What was made before, and what is made now.
    name : tuple
        What tells the estimate from others of the same store.
    """
    either = in_either_order(hypotheses, base.point.effects)
    keys = {identity(h): ("columns", *name, *identity(h)) for h in either}
    missing = [h for h in either if keys[identity(h)] not in kept]
    for hypothesis in missing:
        kept[keys[identity(hypothesis)]] = []
    for candidate in (*term_candidates(base.frame, base, missing), *effect_candidates(base.frame, base, missing)):
        kept[keys[identity(candidate.hypothesis)]].append(candidate)
    found = [candidate for h in either for candidate in kept[keys[identity(h)]]]
    return sorted(found, key=lambda candidate: bool(candidate.hypothesis.effects))


def drop_columns(kept: dict[object, list[Any]], name: tuple[object, ...]) -> None:
    """Lets go of the candidates beside an estimate that nothing will be asked of again: they are as long as records."""
    for key in [key for key in kept if isinstance(key, tuple) and key[: 1 + len(name)] == ("columns", *name)]:
        del kept[key]


def identity(hypothesis: Hypothesis) -> tuple[object, ...]:
    """What tells a hypothesis from the same within other limits, or in the other order beside what acts already."""
    orders = tuple(getattr(active.effect, "comes_first", False) for active in hypothesis.effects)
    return told_apart(hypothesis), limits_of(hypothesis), orders


def limits_of(hypothesis: Hypothesis) -> tuple[tuple[float, float], ...]:
    """Least and greatest of every number of a hypothesis."""
    return tuple((p.lowest, p.highest) for active in hypothesis.effects for p in active.effect.parameters)


def _ways(active: ActiveEffect) -> list[list[tuple[float, ...]]]:
    """For every trial the numbers to which the effect is moved, one set for each column."""
    if isinstance(active.effect, PositionEffect):
        return [[active.perturbed(n, active.effect.parameters[n].step).values for n in range(len(active.values))]]
    return [[ends] for ends in _trials(active)]


def _trials(active: ActiveEffect) -> list[tuple[float, ...]]:
    """Values to which the effect is moved: its trials, or one small step where it is linear."""
    first = active.effect.parameters[0]
    away = [value for value in first.trials if value != first.null] or [first.null + first.step]
    return [(value, *active.values[1:]) for value in away]


def started(candidate: Candidate, step: Sequence[float]) -> Hypothesis:
    """The hypothesis with its numbers where the columns' regression puts them, within their limits."""
    if not candidate.hypothesis.effects:
        return candidate.hypothesis
    (active,) = candidate.hypothesis.effects
    first = active.effect.parameters[0]
    aim = active.values[0] + float(step[0])
    if not first.lowest < aim < first.highest:
        away = _trials(active)[candidate.trial][0]
        aim = away if (away - first.null) * float(step[0]) > 0.0 else first.null + first.step * np.sign(step[0])
        aim = float(np.clip(aim, first.lowest, first.highest))
    values = (aim, *(value + float(change) for value, change in zip(active.values[1:], step[1:], strict=False)))
    rest = active.values[len(values) :]
    return replace(candidate.hypothesis, effects=(replace(active, values=(*values, *rest)),))


def regressed_beside(base: Estimate, columns: Array, weights: Weights) -> Solution:
    """The regression with further columns (R, K), the colour estimated anew from some weights on."""
    names = [("trial", i) for i in range(columns.shape[1])]
    return regress(base.design.beside(columns, names), base.frame.settings, weights, rounds=2)


def to_first_order(base: Estimate, candidate: Candidate) -> tuple[Solution, Hypothesis]:
    """The regression with a candidate's columns, the colour estimated anew, and the hypothesis where it puts it."""
    solution = regressed_beside(base, candidate.columns, base.solution.weights)
    return solution, started(candidate, solution.values[-candidate.columns.shape[1] :].tolist())


@dataclass(frozen=True)
class Scored:
    """What candidates would bring, to first order in their numbers.

    Attributes
    ----------
    gains : ndarray, shape (C,)
        In ln L at the base's colour.
    own : ndarray, shape (C,)
        Share of each candidate's whitened columns that no other column explains, the least of its numbers.
    """

    gains: Array
    own: Array


def scores(base: Estimate, candidates: Sequence[Candidate]) -> Scored:
    """The gain of each candidate from its columns alone, and how far they are its own."""
    gains, own = np.zeros(len(candidates)), np.zeros(len(candidates))
    if not candidates:
        return Scored(gains, own)
    stacked = np.column_stack([each.columns for each in candidates])
    weights = base.solution.weights
    bases = whitened_instruments(base.design, weights)
    white = compared(base.design, whiten(base.design, stacked, weights), bases)
    slopes, covariance = base.solution.slopes, base.solution.covariance
    along = slopes.T @ white
    innovations = base.solution.whitened
    place = 0
    for n, each in enumerate(candidates):
        k = each.columns.shape[1]
        part, toward = white[:, place : place + k], along[:, place : place + k]
        place += k
        total = part.T @ part
        left = total - toward.T @ covariance @ toward
        own[n] = float(np.linalg.eigvalsh(left)[0]) / max(float(np.trace(total)), 1e-300)
        if own[n] <= COLLINEAR:
            continue
        pull = part.T @ innovations
        if _leads_back(each, pull):
            continue
        gains[n] = 0.5 * float(pull @ np.linalg.solve(left, pull))
    return Scored(gains, own)


def likeliest(
    scored: Scored, candidates: Sequence[Candidate], most: int, worth_asking: Callable[[int], bool] = lambda _n: True
) -> list[int]:
    """Places of the candidates of highest gain, one of each name, at most so many."""
    order: list[int] = []
    seen: set[tuple[str, ...]] = set()
    for n in np.argsort(-scored.gains):
        name = told_apart(candidates[n].hypothesis)
        if name not in seen and worth_asking(int(n)):
            seen.add(name)
            order.append(int(n))
            if len(order) >= most:
                break
    return order


def _leads_back(candidate: Candidate, pull: Array) -> bool:
    """Whether a chord to a trial value leads to the other side of none: to no possible value, or to one that another
    trial value is nearer to.
    """
    if not candidate.hypothesis.effects or pull.size > 1:
        return False
    first = candidate.hypothesis.effects[0].effect.parameters[0]
    away = np.array([trial - first.null for trial in first.trials])
    here = away[candidate.trial]
    other_side = first.lowest < first.null if here > 0.0 else first.highest > first.null
    if other_side and not (away.min() < 0.0 < away.max()):
        return False
    return bool(pull[0] * here < 0.0)


COLLINEAR = 1e-6
"""Numerical: share of its own, 1, below which a column says nothing that others do not say: rounding of its
square."""
