"""Smoothing time of vanes and pitot tube beside the inertial path, chosen by likelihood.

Angle of attack and airspeed of the terms are the inertial path and the smoothed difference of what was measured from
it. What is smoothed away is gusts, which forces and moments answer as they answer any flow angle, and noise of the
vane, which nothing answers. In strong gusts before a good vane a short time leaves fewer gusts out of the terms; in
calm air, or before a noisy vane, a long one keeps its noise out of them.
"""

from __future__ import annotations

from dataclasses import replace

from aerosid.equation_error.regression.estimate import Estimate, likeliest_estimate


def likelier_vane_smoothing(found: Estimate) -> Estimate:
    """The estimate with the smoothing time, of those of the settings, that is likeliest; colours estimated anew.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    settings = found.problem.settings
    return likeliest_estimate(
        found, (replace(found.problem, settings=replace(settings, blend=time)) for time in settings.blends)
    )
