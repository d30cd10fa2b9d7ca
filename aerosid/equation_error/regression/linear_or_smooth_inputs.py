"""Interpolation of recorded inputs between samples, linear or smooth, selected by likelihood.

A simulation interpolates its inputs linearly between samples; a control that passed the recorder's filter, as the
motion did, is smooth. The derivative of a sampled rate shows a few parts in a hundred less of the first at the band's
edge (`running_integral.linear_as_differentiated`), and derivatives estimated with the wrong one are biased by as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.related_problems import likeliest_estimate


def likelier_input_interpolation(found: Estimate) -> Estimate:
    """The estimate with its records' inputs linear or smooth between samples, whichever is likelier.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    problem = found.problem
    if all(recording.refinement > 1 for recording in problem.recordings):
        return found
    return likeliest_estimate(found, [replace(problem, recordings=_other(problem.recordings))])


def _other(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The records with the other interpolation; those refined by splines remain smooth."""
    return tuple(r if r.refinement > 1 else replace(r, linear_inputs=not r.linear_inputs) for r in recordings)
