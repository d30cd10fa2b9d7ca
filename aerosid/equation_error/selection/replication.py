"""Replication: effects that validation records show by themselves.

The estimate of an effect from a single event of the identification records is uncertain by whatever else happened in
that event; a validation record that gives the same estimate shows that it was no coincidence.
"""

from __future__ import annotations

from aerosid.equation_error.selection.cross_validation import largest_reduction, validation_residuals
from aerosid.equation_error.selection.level_shifts import shift_columns
from aerosid.equation_error.selection.structure import SelectedEffect, SelectedStructure, deletions, estimate_without


def is_replicated(selected: SelectedStructure, fitted: SelectedStructure, each: SelectedEffect) -> bool:
    """Whether the validation records add to an effect's gain as much as an estimate of the required significance has.

    All records share its parameters, so that the gain beyond that of the identification records is the validation
    records' likelihood ratio for that estimate: half the square of its t-ratio where they agree, less or nothing where
    they do not.

    Parameters
    ----------
    selected : SelectedStructure
        The structure on all records.
    fitted : SelectedStructure
        The same structure on the identification records alone.
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
    """Whether a validation record replicates an effect, or a much larger residual of a coefficient remains without it.

    Arguments as of `is_replicated`. A short validation record may gain little in ln L, its residual being coloured, and
    yet have most of its residual explained by the estimate from the identification records.
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
