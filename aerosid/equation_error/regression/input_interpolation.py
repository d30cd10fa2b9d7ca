"""Interpolation of recorded inputs between samples, straight or smooth, chosen by likelihood.

A simulation holds its inputs linear between samples; a control that went through the recorder's filter, as the motion
did, bends smoothly. The derivative of a sampled rate shows of the first a few parts in a hundred less at the band's end
(`running_integral.linear_as_differentiated`), and derivatives estimated with the wrong one are off by as much.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.estimate import Estimate, likeliest_estimate


def likelier_input_interpolation(found: Estimate) -> Estimate:
    """The estimate with its recordings' inputs straight or smooth between samples, whichever is likelier.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    problem = found.problem
    if all(recording.refined for recording in problem.recordings):
        return found
    return likeliest_estimate(found, [replace(problem, recordings=_other(problem.recordings))])


def _other(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings with their inputs the other way; those that splines made finer stay smooth."""
    return tuple(r if r.refined else replace(r, linear_inputs=not r.linear_inputs) for r in recordings)
