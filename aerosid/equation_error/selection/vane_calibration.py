"""Calibration uncertainty of the flow-angle vanes: a derivative with respect to an angle is known as well as its scale.

In moving air the kinematics determine the scale factor of a vane to one or several per cent, and an error below the
penalty for multiple testing is not identified; the coefficients cannot show it at all, since their derivatives scale
with it. Its posterior from the usual accuracy of a calibration and from the kinematics is a part of the standard errors
of the derivatives (a nuisance parameter with a prior; Klein & Morelli, Aircraft System Identification, eq. 5.31).

The prior is a mixture: most vanes are calibrated, some are not. A normal prior alone would outvote kinematics that
contradict it, and a vane that shows 17 % too much would leave derivatives six standard errors off (contaminated normal
distribution; Huber, Annals of Mathematical Statistics 35 (1), 1964).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import VANE_OF
from aerosid.equation_error.regression.estimate import maximise_likelihood
from aerosid.equation_error.selection.alternatives import last_parameter
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.structure import SelectedStructure

SCALE = "sensor_scale"

STEPS = 4
"""Numerical: Gauss-Newton steps at most; the kinematic equations are nearly linear in a scale factor."""


def uncertain_scales(
    identified: SelectedStructure, hypotheses: Sequence[Hypothesis], acting: Sequence[ActiveEffect]
) -> tuple[ActiveEffect, ...]:
    """The scale factor errors of the vanes that were not identified, each at its posterior root-mean-square size.

    Parameters
    ----------
    identified : SelectedStructure
        The instrument errors, selected from the kinematic equations.
    hypotheses : sequence of Hypothesis
        All hypotheses.
    acting : sequence of ActiveEffect
        The effects of the completed structure, among which a scale factor may be identified.
    """
    base = identified.estimate
    known = {active.name for active in acting}
    compared = {channel for _, channel in base.design.segments}
    scales = [
        hypothesis
        for hypothesis in hypotheses
        if hypothesis.kind == SCALE
        and hypothesis.where in compared & set(VANE_OF.values())
        and (SCALE, hypothesis.where) not in known
    ]
    return tuple(mapped(lambda each: _at_posterior_size(identified, each), scales, common=[base.problem]))


def _at_posterior_size(identified: SelectedStructure, hypothesis: Hypothesis) -> ActiveEffect:
    """A scale factor error, frozen at the root mean square of its posterior about one, on the side of its mean."""
    base = identified.estimate
    found = maximise_likelihood(base.problem, with_hypothesis(base.point, hypothesis), base.solution.weights, STEPS)
    active, value, error = last_parameter(found.estimate, hypothesis)
    assert active is not None
    null, settings = active.effect.parameters[0].null, base.problem.settings
    size = posterior_size(value - null, error, settings.vane_scale, *settings.uncalibrated_vane)
    return frozen(replace(active, values=(null + (size if value >= null else -size), *active.values[1:])))


def posterior_size(found: float, error: float, calibrated: float, probability: float, uncalibrated: float) -> float:
    """Root mean square of a scale factor error of which kinematics found a value with a standard error.

    `calibrated` and `uncalibrated`: its standard deviation with a calibrated vane and with one that is not, which it is
    with this `probability`. Without kinematic evidence the prior is left.
    """
    priors = ((calibrated**2, 1.0 - probability), (uncalibrated**2, probability))
    if not math.isfinite(error):
        return math.sqrt(sum(share * prior for prior, share in priors))
    squares, odds = [], []
    for prior, share in priors:
        if share == 0.0:
            continue
        spread = prior + error**2
        taken = prior / spread  # of the kinematic estimate; none where they do not determine it
        squares.append((taken * found) ** 2 + (1.0 - taken) * prior)
        odds.append(math.log(share) - 0.5 * (found**2 / spread + math.log(spread)))
    weights = [math.exp(each - max(odds)) for each in odds]
    return math.sqrt(sum(w * square for w, square in zip(weights, squares, strict=True)) / sum(weights))
