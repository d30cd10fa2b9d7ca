"""Delays and lags of instruments from kinematic and coefficient equations together.

Kinematics prove that an instrument is late; in moving air they say by how much only roughly, since the gusts at a vane
are no motion of the aircraft. The coefficients hold the same timing against forces and moments, which answer the same
gusts. Both are joined as independent measurements: Gauss-Newton on the coefficients' likelihood with the kinematic
estimate as prior (Bayes; Klein & Morelli, Aircraft System Identification, eq. 5.31).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.design import whiten
from aerosid.equation_error.regression.estimate import Estimate, effect_columns, estimate, linear_values, numbers_of
from aerosid.equation_error.regression.standard_errors import corrected_covariance, covariance_of_scores
from aerosid.equation_error.selection.alternatives import Alternative, in_place_of
from aerosid.equation_error.selection.structure import Chosen, Selected, left_out, struck_out
from aerosid.equation_error.selection.wald_tests import weakest

Array = NDArray[np.float64]

LATE = frozenset({"sensor_delay", "sensor_lag"})
"""Kinds whose number is a time by which a channel comes late."""

STEPS = 6
"""Numerical: Gauss-Newton steps at most."""

HALVINGS = 4
"""Numerical: times that a step is halved before the search ends where it is."""

SETTLED = 0.1
"""Numerical: standard deviations, 1, of a step that decides nothing any more."""


@dataclass(frozen=True)
class JointTiming:
    """The instruments' faults with their timings from both kinds of equations.

    Attributes
    ----------
    effects : tuple of ActiveEffect
        All proven faults, the timings at their joint estimate.
    covariance : ndarray, shape (n, n)
        Of all their numbers, in order.
    penalty : float
        What their distance from the kinematic estimate takes off ln L.
    """

    effects: tuple[ActiveEffect, ...]
    covariance: Array
    penalty: float


def kinematic_timing(proved: Estimate) -> JointTiming:
    """The faults as kinematics alone measure them."""
    places = [proved.design.unknowns.index(("effect", i, k)) for i, k in numbers_of(proved.point.effects)]
    covariance = corrected_covariance(proved.design, proved.solution)[np.ix_(places, places)]
    return JointTiming(proved.point.effects, covariance, 0.0)


def joint_timing(
    proved: Estimate, begun: JointTiming, found: Estimate, told: Callable[[str], None] = lambda _text: None
) -> JointTiming:
    """The timings at the highest likelihood of both kinds of equations; other faults follow by their correlation.

    Parameters
    ----------
    proved : Estimate
        Of the kinematic equations.
    begun : JointTiming
        Where to begin.
    found : Estimate
        Of the coefficient equations, its first effects the proven faults, held at `begun`.
    """
    numbers = numbers_of(proved.point.effects)
    late = [n for n, (i, _) in enumerate(numbers) if proved.point.effects[i].effect.kind in LATE]
    if not late:
        return begun
    kinematic = kinematic_timing(proved).covariance
    known = kinematic[np.ix_(late, late)]
    if not np.all(np.isfinite(known)) or np.linalg.matrix_rank(known) < len(late):
        return begun  # kinematics hold one timing by another: there is no prior to join
    prior = np.linalg.inv(known)
    follow = kinematic[:, late] @ prior
    mean = values_of(proved.point.effects)
    away = (values_of(begun.effects) - mean)[late]
    effects = begun.effects
    covariance = known

    def objective(found: Estimate, away: Array) -> float:
        return found.log_likelihood - 0.5 * float(away @ prior @ away)

    for _ in range(STEPS):
        information, pull = _information(found, effects, numbers, follow)
        covariance = np.linalg.inv(information + prior)
        step = covariance @ (pull - prior @ away)
        if np.all(np.abs(step) < SETTLED * np.sqrt(np.diag(covariance))):
            break
        best = objective(found, away)
        for halving in range(HALVINGS):
            aim = away + 0.5**halving * step
            trial = _placed(proved.point.effects, mean + follow @ aim)
            aim = (values_of(trial) - mean)[late]
            moved = estimate(found.frame, held_at(found.point, trial), found.solution.weights, steps=2)
            if objective(moved, aim) > best:
                effects, away, found = trial, aim, moved
                break
        else:
            break
    told("  timed " + ", ".join(f"{active.effect.kind} {active.effect.where} {active.values}" for active in effects))
    joint = kinematic - follow @ (known - covariance) @ follow.T
    return JointTiming(effects, joint, 0.5 * float(away @ prior @ away))


def joint_gain(proved: Selected, each: Chosen, timing: JointTiming, kept: Estimate) -> float | None:
    """What both kinds of equations gain in ln L by a proven lateness at their joint estimate; None of another fault.

    Kinematics prove it at their own number. Where forces and moments move it far from there, what it gained there is
    gone, and a fit of both may be left with a number that neither needs.

    Parameters
    ----------
    proved : Selected
        The faults, from kinematics.
    each : Chosen
        One of them.
    timing : JointTiming
        Their numbers from both.
    kept : Estimate
        Of the coefficient equations, its first effects the faults, held at `timing`.
    """
    if each.hypothesis.kind not in LATE:
        return None
    name = each.hypothesis.effects[0].name
    place = next(n for n, active in enumerate(timing.effects) if active.values and active.name == name)
    number = sum(len(active.values) for active in timing.effects[:place])
    alone = kinematic_timing(proved.estimate)
    apart = timing.effects[place].values[0] - alone.effects[place].values[0]
    away = 0.5 * apart**2 / float(alone.covariance[number, number])
    effects = tuple(active for n, active in enumerate(kept.point.effects) if n != place)
    without = estimate(kept.frame, replace(kept.point, effects=effects), kept.solution.weights)
    shown = proved.estimate.gain_over(struck_out(proved, each)) - away
    return shown + kept.log_likelihood - without.log_likelihood


@dataclass(frozen=True)
class _Lateness:
    """One way in which an instrument may be late, with its number by both kinds of equations.

    `hypothesis` as kinematics took it with its `gain` there; `behind`: what the one that they chose has more;
    `likelihood`: ln L of both kinds of equations.
    """

    hypothesis: Hypothesis
    gain: float
    behind: float
    selected: Selected
    timing: JointTiming
    likelihood: float

    @property
    def place(self) -> int:
        """Of the lateness among the faults."""
        name = self.hypothesis.effects[0].name
        return next(n for n, active in enumerate(self.timing.effects) if active.values and active.name == name)

    def in_place_of(self, best: _Lateness, margin: float) -> Alternative:
        """As the alternative of a likelier way, by how much worse it does for the kinematics that proved both."""
        active = self.timing.effects[self.place]
        number = sum(len(each.values) for each in self.timing.effects[: self.place])
        error = float(np.sqrt(self.timing.covariance[number, number]))
        behind = max(self.behind - best.behind, 0.0)
        return Alternative(
            self.hypothesis,
            active,
            active.values[0],
            error,
            self.gain,
            behind,
            margin,
            best.hypothesis,
            self.selected.estimate,
        )


def likeliest_kinds(
    proved: Selected,
    declared: Estimate,
    sensors: Sequence[Hypothesis],
    told: Callable[[str], None] = lambda _text: None,
) -> tuple[Selected, tuple[Alternative, ...]]:
    """The faults, each lateness of the kind that both kinds of equations together find likelier, and the other kinds.

    Kinematics hardly tell a delay from a lag; forces and moments do, where their structure is right.

    Parameters
    ----------
    declared : Estimate
        Of the coefficient equations of the declared structure, its first effects the faults, held.
    sensors : sequence of Hypothesis
        Instruments' faults that may stand in place of one another.
    """
    timed: dict[tuple[tuple[str, tuple[float, ...]], ...], tuple[JointTiming, float]] = {}

    def judged(selected: Selected, hypothesis: Hypothesis, gain: float, behind: float = 0.0) -> _Lateness:
        begun = kinematic_timing(selected.estimate)
        # The same faults are asked for each channel that is late.
        name = tuple((f"{active.effect.kind} {active.effect.where}", active.values) for active in begun.effects)
        if name not in timed:
            timing = joint_timing(selected.estimate, begun, _at(declared, begun), told)
            timed[name] = timing, _at(declared, timing).log_likelihood - timing.penalty
        timing, likelihood = timed[name]
        return _Lateness(hypothesis, gain, behind, selected, timing, likelihood - behind)

    others: list[Alternative] = []
    margin = declared.frame.settings.alike_instruments
    for each in proved.chosen:
        if each.hypothesis.kind not in LATE:
            continue
        rest = tuple(other for other in proved.chosen if other is not each)
        here = judged(proved, each.hypothesis, each.gain)
        ways = [here]
        for row in in_place_of(proved, each, sensors):
            if row.hypothesis.kind in LATE and row.hypothesis.where == each.hypothesis.where:
                instead = Selected(row.estimate, (*rest, Chosen(row.hypothesis, each.kinematic, row.gain)))
                ways.append(judged(instead, row.hypothesis, row.gain, row.behind))
        best = max(ways, key=lambda way: way.likelihood - (0.0 if way is here else declared.frame.settings.clearly))
        others.extend(way.in_place_of(best, margin) for way in ways if way is not best)
        proved = best.selected
    # What stood beside a lateness of the other kind may have been what that one left over.
    while (weak := weakest(proved.estimate, proved.chosen)) is not None:
        told(f"  does not stand beside the other kind: {weak.hypothesis.label}")
        proved = left_out(proved, weak)
    names = set(proved.labels)
    return proved, tuple(row for row in others if row.instead_of.label in names)


def _at(declared: Estimate, timing: JointTiming) -> Estimate:
    """The declared structure's coefficients with the faults held at some numbers."""
    return estimate(declared.frame, held_at(declared.point, timing.effects), declared.solution.weights)


def is_within(kinematic: JointTiming, other: JointTiming, deviations: float) -> bool:
    """Whether no fault's number lies further than so many of its kinematic deviations from the kinematic one."""
    distance = np.abs(values_of(other.effects) - values_of(kinematic.effects))
    return bool(np.all(distance <= deviations * np.sqrt(np.diag(kinematic.covariance))))


@dataclass(frozen=True)
class TwoWitnesses:
    """How late a channel is by kinematics alone and by both kinds of equations, where these differ, s."""

    channel: str
    alone: ActiveEffect
    alone_std_error: float
    joint: ActiveEffect
    joint_std_error: float


def where_witnesses_differ(proved: Estimate, timing: JointTiming, deviations: float) -> tuple[TwoWitnesses, ...]:
    """The channels whose lateness is of another kind, or further off than so many kinematic deviations, with forces.

    Parameters
    ----------
    proved : Estimate
        Of the kinematic equations, with the kinds that they chose.
    timing : JointTiming
        Of both kinds of equations.
    """
    alone = kinematic_timing(proved)
    rows = []
    before, after = (
        {a.effect.where: (a, error) for a, error in _leading(each) if a.effect.kind in LATE} for each in (alone, timing)
    )
    for channel in before.keys() & after.keys():
        (one, one_error), (other, other_error) = before[channel], after[channel]
        further = abs(one.values[0] - other.values[0]) > deviations * one_error
        if further or one.effect.kind != other.effect.kind:
            rows.append(TwoWitnesses(channel, one, one_error, other, other_error))
    return tuple(sorted(rows, key=lambda row: row.channel))


def _leading(timing: JointTiming) -> list[tuple[ActiveEffect, float]]:
    """Each fault with the deviation of its first number."""
    errors, place, rows = np.sqrt(np.diag(timing.covariance)), 0, []
    for active in timing.effects:
        if active.values:
            rows.append((active, float(errors[place])))
        place += len(active.values)
    return rows


def held_at(point: Point, effects: Sequence[ActiveEffect]) -> Point:
    """A point whose first effects are some faults, held at their numbers."""
    held = tuple(frozen(active) for active in effects)
    return replace(point, effects=(*held, *point.effects[len(held) :]))


def values_of(effects: Sequence[ActiveEffect]) -> Array:
    """All numbers of some effects that are free, in order."""
    return np.array([value for active in effects for value in active.values])


def _placed(effects: Sequence[ActiveEffect], values: Array) -> tuple[ActiveEffect, ...]:
    """Effects moved to some values, within their limits."""
    placed, rest = [], list(values)
    for active in effects:
        aim = np.array([rest.pop(0) for _ in active.values])
        placed.append(active.moved(aim - np.array(active.values)))
    return tuple(placed)


def _information(
    found: Estimate, effects: tuple[ActiveEffect, ...], numbers: Sequence[tuple[int, int]], follow: Array
) -> tuple[Array, Array]:
    """Information (n, n) of the coefficients on the timings, and its pull (n,), all linear unknowns estimated.

    `follow`: what each number of the faults moves by with each timing. The information is less where the residuals'
    whitening leaves correlation, as for every other number.
    """
    open_ = replace(found.point, effects=(*effects, *found.point.effects[len(effects) :]))
    columns = effect_columns(found.frame, linear_values(found.design, found.solution), open_, numbers) @ follow
    white = whiten(found.design, columns, found.solution.weights)
    own = white - found.solution.slopes @ (found.solution.covariance @ (found.solution.slopes.T @ white))
    information, pull = own.T @ own, own.T @ found.solution.whitened
    meat = covariance_of_scores(found.design, own * found.solution.whitened[:, None])
    less = 1.0 / np.sqrt(np.maximum(np.diag(meat) / np.maximum(np.diag(information), 1e-300), 1.0))
    return information * np.outer(less, less), pull * less**2
