"""Smoothing time of vanes and pitot tube beside the inertial path, chosen by likelihood.

Angle of attack and airspeed of the terms are the inertial path and the smoothed difference of what was measured from
it. What is smoothed away is gusts, which forces and moments answer as they answer any flow angle, and noise of the
vane, which nothing answers. In strong gusts before a good vane a short time leaves fewer gusts out of the terms; in
calm air, or before a noisy vane, a long one keeps its noise out of them.
"""

from __future__ import annotations

from dataclasses import replace

from aerosid.equation_error.regression.estimate import Estimate, estimate


def likelier_smoothing(found: Estimate) -> Estimate:
    """The estimate with the smoothing time, of those of the settings, that is likeliest; colours estimated anew.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    best = found
    for time in found.frame.settings.blends:
        frame = replace(found.frame, settings=replace(found.frame.settings, blend=time))
        tried = estimate(frame, found.point, found.solution.weights)
        if tried.log_likelihood > best.log_likelihood:
            best = tried
    return best
