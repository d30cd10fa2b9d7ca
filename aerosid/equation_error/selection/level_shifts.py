"""Intervention analysis: level shifts of recordings outside the fit, estimated beside a structure as nuisance.

What happens suddenly on a recording that only confirms is no noise of it: taken for noise, it sets the size and the
colour of that coefficient's residual, and the recording shows nothing of what else is missing (Box & Tiao, Journal of
the American Statistical Association 70, 1975). A shift pays the price of any sudden change, belongs to its recording
and is no finding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.candidates import joined
from aerosid.equation_error.selection.deletion import Selected
from aerosid.equation_error.selection.prices import Rules
from aerosid.equation_error.selection.starts import sudden_hypotheses
from aerosid.equation_error.selection.stepwise import forward_steps

Array = NDArray[np.float64]


def shifts_of(found: Estimate) -> tuple[ActiveEffect, ...]:
    """The level shifts of unseen recordings in a structure."""
    unseen = {recording.name for recording in found.frame.recordings if not recording.fitted}
    return tuple(active for active in found.point.effects if active.values and active.log in unseen)


def with_shifts(point: Point, shifts: Sequence[ActiveEffect]) -> Point:
    """The point with some level shifts beside what it has."""
    return point.with_effects((*point.effects, *shifts)) if shifts else point


def without_shifts(found: Estimate) -> Point:
    """The point of a structure without the level shifts of unseen recordings."""
    own = shifts_of(found)
    effects = tuple(active for active in found.point.effects if not any(active is one for one in own))
    return replace(found.point, effects=effects)


def as_hypothesis(shift: ActiveEffect) -> Hypothesis:
    """A sudden change as a hypothesis."""
    return Hypothesis(shift.effect.kind, shift.effect.where, effects=(shift,))


def level_shifts(
    found: Estimate,
    coefficients: Sequence[str],
    rules: Rules,
    most: int,
    told: Callable[[str], None] = lambda _text: None,
) -> Estimate:
    """A structure with what happens suddenly on unseen recordings beside the level shifts that it has.

    Parameters
    ----------
    coefficients : sequence of str
        In which it is looked for.
    most : int
        Shifts of one recording.
    """
    for recording in found.frame.recordings:
        if not recording.fitted:
            begun = Selected(found, ())
            *_, last = forward_steps(
                begun,
                rules,
                (),
                kinematic=False,
                most=most,
                coefficients=coefficients,
                recording=recording.name,
                told=lambda text, name=recording.name: told(f"{name}: {text}"),  # type: ignore[misc]
            )
            found = last.estimate
    return found


def sudden_elsewhere(base: Estimate, coefficients: Sequence[str], rules: Rules) -> list[Estimate]:
    """Estimates with each further sudden change that an unseen recording has at its price, the change its last."""
    rows = []
    for recording in base.frame.recordings:
        for again in sudden_hypotheses(base.frame, base, coefficients, recording.name) if not recording.fitted else ():
            found = estimate(base.frame, joined(base.point, again), base.solution.weights, steps=4)
            if found.gain_over(base) > rules.price(again):
                rows.append(found)
    return rows


def comes_again(shifts: Sequence[ActiveEffect], hypothesis: Hypothesis) -> bool:
    """Whether a sudden change happens on an unseen recording too: that cannot refute it by being there."""
    return any(is_step_change(active) for active in hypothesis.effects) and any(
        (active.effect.kind, active.effect.where) == (hypothesis.kind, hypothesis.where) for active in shifts
    )


def shift_columns(found: Estimate, further: Sequence[Estimate] = ()) -> dict[tuple[int, str], Array]:
    """What a unit of each level shift adds to the equations of its recording, (n, k), by recording and coefficient.

    `further`: estimates with another one each, their last effect.
    """
    columns: dict[tuple[int, str], list[Array]] = {}
    known = shifts_of(found)
    own = [(found, place) for place, active in enumerate(found.point.effects) if any(active is one for one in known)]
    for each, place in (*own, *((each, len(each.point.effects) - 1) for each in further)):
        column = each.design.columns[:, each.design.unknowns.index(("effect", place, 0))]
        for s, key in enumerate(each.design.segments):
            part = column[each.design.rows(s)]
            if np.any(part != 0.0):
                columns.setdefault(key, []).append(part)
    return {key: np.column_stack(rows) for key, rows in columns.items()}
