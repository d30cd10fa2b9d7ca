"""Intervention analysis: level shifts of validation records, estimated with a structure as nuisance parameters.

A step change in a record that serves validation only is not noise: counted as noise, it determines the size and colour
of that coefficient's residual, and the record loses its power to test anything else (Box & Tiao, Journal of the
American Statistical Association 70, 1975). A shift has the penalty of any step change, belongs to its record and is no
finding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.penalties import SelectionCriterion
from aerosid.equation_error.selection.starting_values import as_hypothesis, step_change_hypotheses
from aerosid.equation_error.selection.stepwise import forward_selection
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.estimation.manoeuvre import Manoeuvre

Array = NDArray[np.float64]


def shifts_of(found: Estimate) -> tuple[ActiveEffect, ...]:
    """The level shifts of validation records in a structure."""
    validation_names = {recording.name for recording in found.problem.recordings if not recording.fitted}
    return tuple(active for active in found.point.effects if active.values and active.log in validation_names)


def shifts_by_record(found: Estimate) -> dict[str, tuple[ActiveEffect, ...]]:
    """The level shifts by the name of each record; none of identification records, whose steps are effects."""
    shifts = shifts_of(found)
    return {
        recording.name: tuple(active for active in shifts if active.log == recording.name)
        for recording in found.problem.recordings
    }


def shifts_of_further(
    found: Estimate, further: Sequence[Manoeuvre], coefficients: Sequence[str], criterion: SelectionCriterion
) -> dict[str, tuple[ActiveEffect, ...]]:
    """The level shifts of flights that took no part in the selection, by name; none where a structure has no step.

    Only where they are matters: the values of the structure are not changed by those flights. A flight that is too
    short for the equations has none.
    """
    if not further or not any(is_step_change(active) for active in found.point.effects):
        return {}
    problem = found.problem
    own = tuple(
        recording
        for recording in read_recordings((), further, problem.settings)
        if recording.time_in_band.size >= problem.settings.fewest
    )
    fitted = tuple(recording for recording in problem.recordings if recording.fitted)
    whole = replace(problem, recordings=(*fitted, *own), all_fitted=True)
    shifted = level_shifts(estimate(whole, found.point), coefficients, criterion, problem.settings.most)
    by_record = shifts_by_record(shifted)
    return {recording.name: by_record[recording.name] for recording in own}


def with_shifts(point: Point, shifts: Sequence[ActiveEffect]) -> Point:
    """The point with additional level shifts."""
    return point.with_effects((*point.effects, *shifts)) if shifts else point


def without_shifts(found: Estimate) -> Point:
    """The point of a structure without the level shifts of validation records."""
    own = shifts_of(found)
    effects = tuple(active for active in found.point.effects if not any(active is one for one in own))
    return replace(found.point, effects=effects)


def as_hypotheses(found: Estimate) -> list[Hypothesis]:
    """The level shifts of a structure as the hypotheses that entered, each after those of its record before it."""
    hypotheses: list[Hypothesis] = []
    intervals = {recording.name: recording.interval for recording in found.problem.recordings}
    shifts = shifts_of(found)
    for n, shift in enumerate(shifts):
        repetition = sum((each.name, each.log) == (shift.name, shift.log) for each in shifts[:n])
        hypotheses.append(as_hypothesis(shift, intervals[shift.log], repetition))
    return hypotheses


def level_shifts(
    found: Estimate,
    coefficients: Sequence[str],
    criterion: SelectionCriterion,
    most: int,
) -> Estimate:
    """A structure with the step changes of validation records added to its level shifts.

    Parameters
    ----------
    coefficients : sequence of str
        In which they are searched for.
    most : int
        Largest number of shifts of one record.
    """
    for recording in found.problem.recordings:
        if not recording.fitted:
            initial = SelectedStructure(found, ())
            *_, last = forward_selection(
                initial,
                criterion,
                (),
                kinematic=False,
                most=most,
                coefficients=coefficients,
                recording=recording.name,
            )
            found = last.estimate
    return found


def further_level_shifts(base: Estimate, coefficients: Sequence[str], criterion: SelectionCriterion) -> list[Estimate]:
    """Estimates with each further significant step change of a validation record, as their last effect."""
    rows = []
    for recording in base.problem.recordings:
        for step_change in (
            step_change_hypotheses(base.problem, base, coefficients, recording.name) if not recording.fitted else ()
        ):
            found = estimate(base.problem, with_hypothesis(base.point, step_change), base.solution.weights, steps=4)
            if found.gain_over(base) > criterion.penalty(step_change):
                rows.append(found)
    return rows


def shift_columns(found: Estimate, further: Sequence[Estimate] = ()) -> dict[tuple[int, str], Array]:
    """Change of the equations of its record by one unit of each level shift, (n, k), by record and coefficient.

    `further`: estimates with another shift each, as their last effect.
    """
    columns: dict[tuple[int, str], list[Array]] = {}
    known = shifts_of(found)
    own = [(found, index) for index, active in enumerate(found.point.effects) if any(active is one for one in known)]
    for each, index in (*own, *((each, len(each.point.effects) - 1) for each in further)):
        column = each.design.columns[:, each.design.unknowns.index(("effect", index, 0))]
        for s, key in enumerate(each.design.segments):
            part = column[each.design.rows(s)]
            if np.any(part != 0.0):
                columns.setdefault(key, []).append(part)
    return {key: np.column_stack(rows) for key, rows in columns.items()}
