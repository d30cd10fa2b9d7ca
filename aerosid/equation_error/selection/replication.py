"""Replication: effects that recordings outside the fit show by themselves.

A number that one event of the fitted recordings shows is uncertain by whatever happened in that event; another
recording that shows the same number tells that it was no chance.
"""

from __future__ import annotations

from aerosid.equation_error.selection.cross_validation import beside_gusts, largest_fall
from aerosid.equation_error.selection.level_shifts import shift_columns
from aerosid.equation_error.selection.structure import Chosen, Selected, each_struck_out, struck_out


def is_replicated(selected: Selected, fitted: Selected, each: Chosen) -> bool:
    """Whether the unseen recordings add to a chosen effect's gain what a value at the asked deviations has.

    All recordings share its number, so that their gain beyond that of the fitted ones is what the unseen ones say for
    that number: half the square of its deviations where they agree, less or nothing where they do not.

    Parameters
    ----------
    selected : Selected
        The structure on all recordings.
    fitted : Selected
        The same structure on the fitted recordings alone.
    each : Chosen
        One of its effects.
    """
    whole = selected.estimate
    if all(recording.fitted for recording in whole.frame.recordings):
        return False
    (rest,) = each_struck_out(selected, [each])
    (bare,) = each_struck_out(fitted, [each])
    beyond = whole.gain_over(rest) - fitted.estimate.gain_over(bare)
    return beyond >= 0.5 * whole.frame.settings.deviations**2


def is_needed(selected: Selected, fitted: Selected, each: Chosen) -> bool:
    """Whether an unseen recording shows a chosen effect by itself, or leaves much more of a coefficient without it.

    Arguments as of `is_replicated`. A short unseen recording may gain little in ln L, its residual being coloured, and
    yet have most of what its coefficients leave explained by the fitted recordings' number.
    """
    whole = selected.estimate.frame
    if all(recording.fitted for recording in whole.recordings):
        return False
    if is_replicated(selected, fitted, each):
        return True
    jumps = shift_columns(selected.estimate)
    fall = largest_fall(*(beside_gusts(whole, found, jumps) for found in (struck_out(fitted, each), fitted.estimate)))
    return fall >= whole.settings.needed_share
