"""Replication: effects that recordings outside the fit show by themselves.

A number that one event of the fitted recordings shows is uncertain by whatever happened in that event; another
recording that shows the same number tells that it was no chance.
"""

from __future__ import annotations

from aerosid.equation_error.selection.cross_validation import largest_reduction, validation_residuals
from aerosid.equation_error.selection.level_shifts import shift_columns
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, deletions, estimate_without


def is_replicated(selected: SelectedStructure, fitted: SelectedStructure, each: SelectedEffect) -> bool:
    """Whether the unseen recordings add to a chosen effect's gain what a value at the asked deviations has.

    All recordings share its number, so that their gain beyond that of the fitted ones is what the unseen ones say for
    that number: half the square of its deviations where they agree, less or nothing where they do not.

    Parameters
    ----------
    selected : SelectedStructure
        The structure on all recordings.
    fitted : SelectedStructure
        The same structure on the fitted recordings alone.
    each : SelectedEffect
        One of its effects.
    """
    whole = selected.estimate
    if all(recording.fitted for recording in whole.problem.recordings):
        return False
    (reduced_whole,) = deletions(selected, [each])
    (reduced,) = deletions(fitted, [each])
    validation_gain = whole.gain_over(reduced_whole) - fitted.estimate.gain_over(reduced)
    return validation_gain >= 0.5 * whole.problem.settings.deviations**2


def is_needed(selected: SelectedStructure, fitted: SelectedStructure, each: SelectedEffect) -> bool:
    """Whether an unseen recording shows a chosen effect by itself, or leaves much more of a coefficient without it.

    Arguments as of `is_replicated`. A short unseen recording may gain little in ln L, its residual being coloured, and
    yet have most of what its coefficients leave explained by the fitted recordings' number.
    """
    whole = selected.estimate.problem
    if all(recording.fitted for recording in whole.recordings):
        return False
    if is_replicated(selected, fitted, each):
        return True
    steps = shift_columns(selected.estimate)
    fall = largest_reduction(
        *(validation_residuals(whole, found, steps) for found in (estimate_without(fitted, each), fitted.estimate))
    )
    return fall >= whole.settings.needed_share
