"""Candidate hypotheses as columns of the regression: change of every equation to first order in their parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from aerosid.equation_error.equations.channels import AIRSPEED
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import Weights, design_of
from aerosid.equation_error.regression.estimate import Estimate, Optimum, linear_values, residual_of
from aerosid.equation_error.regression.least_squares import Solution, regress
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.flight_model.aerodynamics import Entry
from aerosid.nomenclature import CHANNELS

Array = NDArray[np.float64]


CURRENT_MODEL = ("current",)
"""Cache key of the current structure's own estimate; others are named for the effects that they lack."""


@dataclass(frozen=True)
class Candidate:
    """A hypothesis with its columns at an estimate.

    Attributes
    ----------
    hypothesis : Hypothesis
    columns : ndarray, shape (R, k)
        Change of the equations by one unit of each parameter.
    trial : int
        Index of the trial value that the columns are secants to.
    """

    hypothesis: Hypothesis
    columns: Array
    trial: int = 0


def is_instrument_error(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis concerns instruments alone, so that kinematics can test it."""
    return bool(hypothesis.effects) and all(
        isinstance(active.effect, OutputEffect | PositionEffect) for active in hypothesis.effects
    )


def distinct_name(hypothesis: Hypothesis) -> tuple[str, ...]:
    """Name that distinguishes hypotheses of one list: the label, of a position error with its axes."""
    axes = (active.effect.axes for active in hypothesis.effects if isinstance(active.effect, PositionEffect))
    return (*hypothesis.label, *axes)


def unit_of(channel: str) -> str:
    """The unit of a channel."""
    return CHANNELS[channel].unit if channel in CHANNELS else ""


def with_plausible_limits(hypothesis: Hypothesis, mean_chord: float, airspeed: float) -> Hypothesis:
    """The hypothesis with the limits of usable instruments and flyable aircraft; most have those of their kind.

    `mean_chord`: m; `airspeed`: m/s, of the slowest record.
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
    if hypothesis.where == AIRSPEED and hypothesis.kind == "sensor_bias":
        limit = min(limit, OFFERED.largest_airspeed_bias * airspeed)
    parameters = (_within(first, limit), *active.effect.parameters[1:])
    return replace(hypothesis, effects=(replace(active, effect=replace(active.effect, parameters=parameters)),))


def with_aircraft_limits(
    hypothesis: Hypothesis, declared: Mapping[str, Array], mean_chord: float, length: float | None
) -> Hypothesis:
    """The hypothesis of a sensor position limited to the aircraft's size; any other unchanged.

    Parameters
    ----------
    declared : mapping of str to ndarray, shape (3,)
        Declared position of each sensor from the centre of gravity, m, from which its error counts; zero by default.
    mean_chord, length : float
        Of the aircraft, m, as of `farthest_place`.
    """
    effect = hypothesis.effects[0].effect if hypothesis.effects else None
    if not isinstance(effect, PositionEffect):
        return hypothesis
    limit = farthest_place(hypothesis.where, mean_chord, length)
    place = declared.get(hypothesis.where, np.zeros(3))
    places = [float(place["xyz".index(axis)]) for axis in effect.axes]
    parameters = tuple(
        _within(parameter, limit, along) for parameter, along in zip(effect.parameters, places, strict=True)
    )
    (active,) = hypothesis.effects
    return replace(hypothesis, effects=(replace(active, effect=replace(effect, parameters=parameters)),))


def _within(parameter: EffectParameter, limit: float, declared: float = 0.0) -> EffectParameter:
    """The parameter with a limit of its `declared` place and it together; the null value is always within."""
    lowest = parameter.null + min(-limit - declared, 0.0)
    highest = parameter.null + max(limit - declared, 0.0)
    trials = tuple(trial for trial in parameter.trials if lowest <= trial <= highest)
    return replace(parameter, lowest=lowest, highest=highest, trials=trials or (parameter.null,))


def size_penalty(effects: Sequence[ActiveEffect]) -> float:
    """Reduction of ln L by the prior of the size of an instrument error or of a wrong loading.

    `effects`: those of a hypothesis with their parameter values; none of a term.
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


def within_limits(found: Estimate | Optimum, hypothesis: Hypothesis) -> bool:
    """Whether the parameters of the last hypothesis of an estimate lie inside their limits, as they must."""
    if not hypothesis.effects:
        return True
    active = found.point.effects[-1]
    return all(p.lowest < value < p.highest for p, value in zip(active.effect.parameters, active.values, strict=True))


def position_hypotheses(channels: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Position errors of the sensors of the channels that there are."""
    return tuple(
        Hypothesis("sensor_position", channel, effects=(at_null(sensor_position(channel, axis)),))
        for channel, axis in SHOWN_BY_PITCHING
        if channel in channels
    )


def in_either_order(hypotheses: Sequence[Hypothesis], effects: Sequence[ActiveEffect]) -> list[Hypothesis]:
    """The hypotheses, those of a control that already has an effect in either order.

    A lag and a rate limit, or a dead band, do not commute; the data decide on the order.
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


def with_hypothesis(point: Point, hypothesis: Hypothesis) -> Point:
    """The point with a hypothesis' terms and effects, at the values that it gives them."""
    model = point.model.extended(hypothesis.entries)
    wider = replace(point, model=model, free=(*point.free, *hypothesis.entries))
    return wider.with_effects((*point.effects, *hypothesis.effects))


def term_candidates(problem: RegressionProblem, base: Estimate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """All hypotheses that are one plain term, their columns computed in one pass."""
    tested = {
        h.entries[0]: h
        for h in hypotheses
        if len(h.entries) == 1 and not h.effects and h.entries[0] not in base.point.free
    }
    if not tested:
        return []
    model = base.point.model.extended(tested)
    wide = design_of(problem.segments(replace(base.point, model=model, free=tuple(tested))), problem.settings)
    return [
        Candidate(hypothesis, wide.columns[:, [p for p, u in enumerate(wide.unknowns) if _is_of(u, entry)]])
        for entry, hypothesis in tested.items()
    ]


def _is_of(unknown: tuple[object, ...], entry: Entry) -> bool:
    return unknown[0] in ("term", "one") and unknown[1] == entry


def effect_candidates(problem: RegressionProblem, base: Estimate, hypotheses: Sequence[Hypothesis]) -> list[Candidate]:
    """Hypotheses that are one effect each, with a column for every trial value: a delay is nonlinear in its parameter.

    A position is linear in its parameters, and has a column for each.
    """
    known = linear_values(base.design, base.solution)
    at_base = residual_of(problem, known, base.point)
    tested = [hypothesis for hypothesis in hypotheses if len(hypothesis.effects) == 1 and not hypothesis.entries]

    def columns_of(hypothesis: Hypothesis) -> list[Array]:
        wide = with_hypothesis(base.point, hypothesis)
        (active,) = hypothesis.effects
        columns_by_trial = []
        for displacement in _displacements(active):
            columns = []
            for number, ends in enumerate(displacement):
                moved = replace(wide, effects=(*wide.effects[:-1], replace(active, values=ends)))
                distance = ends[number] - active.values[number]
                columns.append(-(residual_of(problem, known, moved, active, at_base) - at_base) / distance)
            columns_by_trial.append(np.column_stack(columns))
        return columns_by_trial

    names = [(full_identity(hypothesis), hypothesis.time) for hypothesis in tested]
    return [
        Candidate(hypothesis, columns, trial)
        for hypothesis, columns_by_trial in zip(tested, mapped(columns_of, tested, names=names), strict=True)
        for trial, columns in enumerate(columns_by_trial)
        if np.isfinite(columns).all()
    ]


def cached_candidates(
    cache: dict[object, list[Any]], name: tuple[object, ...], base: Estimate, hypotheses: Sequence[Hypothesis]
) -> list[Candidate]:
    """Candidates at an estimate, terms first; those computed before are reused.

    Parameters
    ----------
    cache : dict
        Columns computed before; new ones are added.
    name : tuple
        Key of the estimate among others of the same cache.
    """
    either = in_either_order(hypotheses, base.point.effects)
    keys = {full_identity(h): ("columns", *name, *full_identity(h)) for h in either}
    missing = [h for h in either if keys[full_identity(h)] not in cache]
    for hypothesis in missing:
        cache[keys[full_identity(hypothesis)]] = []
    for candidate in (*term_candidates(base.problem, base, missing), *effect_candidates(base.problem, base, missing)):
        cache[keys[full_identity(candidate.hypothesis)]].append(candidate)
    found = [candidate for h in either for candidate in cache[keys[full_identity(h)]]]
    return sorted(found, key=lambda candidate: bool(candidate.hypothesis.effects))


def drop_cached_columns(cache: dict[object, list[Any]], name: tuple[object, ...]) -> None:
    """Delete the columns at an estimate that is not used again: they are as long as records."""
    for key in [key for key in cache if isinstance(key, tuple) and key[: 1 + len(name)] == ("columns", *name)]:
        del cache[key]


def full_identity(hypothesis: Hypothesis) -> tuple[object, ...]:
    """Key that also distinguishes a hypothesis' limits and its order relative to other effects of the same control."""
    orders = tuple(getattr(active.effect, "comes_first", False) for active in hypothesis.effects)
    return distinct_name(hypothesis), limits_of(hypothesis), orders


def limits_of(hypothesis: Hypothesis) -> tuple[tuple[float, float], ...]:
    """Lower and upper limit of every parameter of a hypothesis."""
    return tuple((p.lowest, p.highest) for active in hypothesis.effects for p in active.effect.parameters)


def _displacements(active: ActiveEffect) -> list[list[tuple[float, ...]]]:
    """For every trial the parameter values to which the effect is moved, one set for each column."""
    if isinstance(active.effect, PositionEffect):
        return [[active.perturbed(n, active.effect.parameters[n].step).values for n in range(len(active.values))]]
    return [[ends] for ends in _trials(active)]


def _trials(active: ActiveEffect) -> list[tuple[float, ...]]:
    """Values to which the effect is moved: its trials, or one small step where it is linear."""
    first = active.effect.parameters[0]
    away = [value for value in first.trials if value != first.null] or [first.null + first.step]
    return [(value, *active.values[1:]) for value in away]


def at_regressed_values(candidate: Candidate, step: Sequence[float]) -> Hypothesis:
    """The hypothesis at the parameter values given by the columns' regression, within their limits."""
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


def regressed_with(base: Estimate, columns: Array, weights: Weights) -> Solution:
    """The regression with further columns (R, K), the colour re-estimated from given weights."""
    names = [("trial", i) for i in range(columns.shape[1])]
    return regress(base.design.extended(columns, names), base.problem.settings, weights, rounds=2)


def linearised(base: Estimate, candidate: Candidate) -> tuple[Solution, Hypothesis]:
    """The regression with a candidate's columns, the colour re-estimated, and the hypothesis at its values."""
    solution = regressed_with(base, candidate.columns, base.solution.weights)
    return solution, at_regressed_values(candidate, solution.values[-candidate.columns.shape[1] :].tolist())
