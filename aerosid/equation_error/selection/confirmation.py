"""Replication: effects that recordings outside the fit show by themselves.

A number that one event of the fitted recordings shows is uncertain by whatever happened in that event; another
recording that shows the same number tells that it was no chance.
"""

from __future__ import annotations

from aerosid.equation_error.regression.estimate import Estimate, estimate, likeliest_numbers
from aerosid.equation_error.selection.deletion import STEPS, Chosen, Selected, each_struck_out, without
from aerosid.equation_error.selection.level_shifts import shift_columns
from aerosid.equation_error.selection.votes import beside_gusts, largest_fall


def is_replicated(selected: Selected, completed: Estimate, each: Chosen) -> bool:
    """Whether the unseen recordings add to a chosen effect's gain what a value at the asked deviations has.

    All recordings share its number, so that their gain beyond that of the fitted ones is what the unseen ones say for
    that number: half the square of its deviations where they agree, less or nothing where they do not.

    Parameters
    ----------
    selected : Selected
        The structure on all recordings.
    completed : Estimate
        The same structure on the fitted recordings alone.
    each : Chosen
        One of its effects.
    """
    whole = selected.estimate
    if all(recording.fitted for recording in whole.frame.recordings):
        return False
    (rest,) = each_struck_out(selected, [each])
    alone = likeliest_numbers(completed.frame, without(completed.point, each), completed.solution.weights, STEPS)
    beyond = whole.gain_over(rest) - completed.gain_over(alone)
    return beyond >= 0.5 * whole.frame.settings.deviations**2


def is_needed(selected: Selected, completed: Estimate, each: Chosen) -> bool:
    """Whether an unseen recording shows a chosen effect by itself, or leaves much more of a coefficient without it.

    Arguments as of `is_replicated`. A short unseen recording may gain little in ln L, its residual being coloured, and
    yet have most of what its coefficients leave explained by the fitted recordings' number.
    """
    whole = selected.estimate.frame
    if all(recording.fitted for recording in whole.recordings):
        return False
    if is_replicated(selected, completed, each):
        return True
    bare = estimate(completed.frame, without(completed.point, each), completed.solution.weights, STEPS)
    jumps = shift_columns(selected.estimate)
    fall = largest_fall(beside_gusts(whole, bare, jumps), beside_gusts(whole, completed, jumps))
    return fall >= whole.settings.needed_share
