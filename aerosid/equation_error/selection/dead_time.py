"""A dead time beside a lag of one instrument: a damped vane whose readings a bus delivers late.

To first order both move the signal by the same time, and differ in the second, by half the square of the lag. Taken for
one of them, the rest of a vane's lateness was told as a scale factor error, a displaced centre of gravity or a term in
the elevator, and derivatives were 3 to 10 standard errors off. Kinematics find both one by one in calm air; in gusts
at the vane forces and moments are needed, from a vane that is late by both about alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import estimate
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.joint_errors import DELAY, DELAY_KINDS, LAG, JointErrors, is_timing_of
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.profiled_error import ProfiledError, likeliest_value
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, point_without
from aerosid.equation_error.selection.vane_position import MOVED_BY
from aerosid.equation_error.settings import TRIALS


def is_causal(point: Point) -> bool:
    """Whether no instrument that lags has a negative dead time: as large a lag with a lead stands for other errors.

    On flights of the Twin Otter alpha would lag by .072 s and be early by .049 s.
    """
    lagging = {active.effect.where for active in point.effects if active.effect.kind == LAG}
    return all(
        active.values[0] > 0.0
        for active in point.effects
        if active.effect.kind == DELAY and active.values and active.effect.where in lagging
    )


def likelier_dead_times(
    identified: SelectedStructure,
    errors: JointErrors,
    structure: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    criterion: SelectionCriterion,
) -> Iterator[ProfiledError]:
    """Late vanes with a lag and a dead time that are likelier than either by more than the penalty of a second.

    Kinematics have to support the pair: the coefficients are formed from the channel with its lag undone, whose noise
    grows with the lag, and by themselves prefer a dead time in place of a part of it.

    Parameters
    ----------
    identified, errors : SelectedStructure, JointErrors
        Instrument errors, from kinematics and jointly.
    structure : SelectedStructure
        Of the coefficient equations of all records, its first effects these errors.
    hypotheses : sequence of Hypothesis
        All candidates.
    """
    for each in identified.chosen:
        pair = _lag_and_delay(each, identified, hypotheses)
        if pair is None:
            continue
        lag, delay = pair
        penalty, support = criterion.penalty(delay), 0.5 * identified.estimate.problem.settings.support**2
        selected = ProfiledError(delay, each.hypothesis, 0.0, identified, errors, structure.estimate)
        begun = _divided(selected, each, lag)
        if begun.log_likelihood + begun.line.gain < selected.log_likelihood + TRIALS.asked * penalty:
            continue
        found = likeliest_value(begun)
        if found.identified.estimate.gain_over(identified.estimate) < support:
            continue
        if found.log_likelihood > max(selected.log_likelihood, begun.moved_to(0.0).log_likelihood) + penalty:
            yield found


def _lag_and_delay(
    timing: SelectedEffect, identified: SelectedStructure, hypotheses: Sequence[Hypothesis]
) -> tuple[Hypothesis, Hypothesis] | None:
    """Hypotheses of a lag and of a delay of a vane of which one was selected; None where it has both or neither."""
    channel = timing.hypothesis.where
    if channel not in MOVED_BY or not is_timing_of(timing.hypothesis, channel):
        return None
    timings = [
        active
        for active in identified.estimate.point.effects
        if active.effect.kind in DELAY_KINDS and active.effect.where == channel
    ]
    found = {h.kind: h for h in hypotheses if is_timing_of(h, channel) and h.effects}
    if len(timings) > 1 or len(found) < 2 or not timings[0].values or timings[0].values[0] <= 0.0:
        return None
    return found[LAG], found[DELAY]


def _divided(selected: ProfiledError, timing: SelectedEffect, lag: Hypothesis) -> ProfiledError:
    """The structure with a vane's lateness divided into a lag and a dead time, the errors re-estimated.

    From a delay alone no step leads there: about it the likelihood is even in the lag, whose square is what counts
    beyond the sum. The start is the middle of that between the one selected and where the other would be as likely.
    """
    kinematic = selected.identified.estimate
    late = next(a.values[0] for a in kinematic.point.effects if a.name == timing.hypothesis.effects[0].name)
    of_lag = np.sqrt(0.75 if timing.hypothesis.kind == LAG else 0.25)
    (active,) = lag.effects
    lagging = replace(lag, effects=(replace(active, values=(float(of_lag * late),)),))
    point = with_hypothesis(point_without(kinematic.point, timing.hypothesis), lagging)
    others = tuple(other for other in selected.identified.chosen if other is not timing)
    entered = SelectedEffect(lagging, timing.kinematic, timing.gain)
    at = estimate(kinematic.problem, point, kinematic.solution.weights, steps=0)
    begun = replace(selected, timing=lagging, identified=SelectedStructure(at, (*others, entered)))
    return begun.moved_to(float((1.0 - of_lag) * late))
