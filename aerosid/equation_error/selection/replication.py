"""Replication: effects that validation records show by themselves.

The estimate of an effect from a single event of the identification records is uncertain by whatever else happened in
that event; a validation record that gives the same estimate shows that it was no coincidence.
"""

from __future__ import annotations

from collections.abc import Sequence

from aerosid.equation_error.selection.cross_validation import largest_reduction, validation_residuals
from aerosid.equation_error.selection.level_shifts import shift_columns
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    deletions_from,
    estimate_without,
)


def replicated_effects(
    effects: Sequence[SelectedEffect], *, selected: SelectedStructure, fitted: SelectedStructure
) -> list[SelectedEffect]:
    """Those of some effects to whose gain the validation records add as much as the required significance has.

    All records share an effect's parameters, so that the gain beyond that of the identification records is the
    validation records' likelihood ratio for that estimate: half the square of its t-ratio where they agree, less or
    nothing where they do not.

    Parameters
    ----------
    effects : sequence of SelectedEffect
        Of the structure.
    selected : SelectedStructure
        The structure on all records.
    fitted : SelectedStructure
        The same structure on the identification records alone.
    """
    whole, own = selected.estimate, fitted.estimate
    if all(recording.fitted for recording in whole.problem.recordings):
        return []
    required = 0.5 * whole.problem.settings.deviations**2
    from_all, from_own = deletions_from([selected, fitted], effects)
    return [
        each
        for each, reduced_whole, reduced in zip(effects, from_all, from_own, strict=True)
        if whole.gain_over(reduced_whole) - own.gain_over(reduced) >= required
    ]


def is_needed(selected: SelectedStructure, fitted: SelectedStructure, each: SelectedEffect) -> bool:
    """Whether a validation record replicates an effect, or a much larger residual of a coefficient remains without it.

    Structures as of `replicated_effects`. A short validation record may gain little in ln L, its residual being
    coloured, and yet have most of its residual explained by the estimate from the identification records.
    """
    whole = selected.estimate.problem
    if all(recording.fitted for recording in whole.recordings):
        return False
    if replicated_effects([each], selected=selected, fitted=fitted):
        return True
    steps = shift_columns(selected.estimate)
    fall = largest_reduction(
        *(validation_residuals(whole, found, steps) for found in (estimate_without(fitted, each), fitted.estimate))
    )
    return fall >= whole.settings.needed_share
