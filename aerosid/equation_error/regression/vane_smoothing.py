"""Smoothing time of vanes and pitot tube relative to the inertial path, selected by likelihood.

Angle of attack and airspeed of the terms are the inertial path plus the smoothed difference of the measurement from it.
The part removed by smoothing is gusts, to which forces and moments respond as to any flow angle, and vane noise, to
which nothing responds. In strong gusts with a good vane a short time leaves fewer gusts out of the terms; in calm air,
or with a noisy vane, a long one keeps its noise out of them.
"""

from __future__ import annotations

from dataclasses import replace

from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.regression.related_problems import likeliest_estimate


def likelier_vane_smoothing(found: Estimate) -> Estimate:
    """The estimate with the likeliest smoothing time of those of the settings; colours re-estimated.

    Parameters
    ----------
    found : Estimate
        Of the coefficient equations.
    """
    settings = found.problem.settings
    return likeliest_estimate(
        found, (replace(found.problem, settings=replace(settings, blend=time)) for time in settings.blends)
    )
