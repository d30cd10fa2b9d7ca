"""What calibration leaves of an airspeed that was not identified as wrong: a part of it, or the same at any speed.

Every coefficient is divided by the square of the airspeed: an error of it is an error of all derivatives. Kinematics
show one that is proportional to the airspeed by every change of speed, to a few parts in a thousand, and one that is
constant only by the rate at which a given force bends the path, to some per cent. An airspeed that is off by a constant
therefore agrees with a scale factor of one, closely: the derivatives are not known as well as that scale factor, but as
the likelier of both shapes leaves them (mixture over the shapes of a nuisance parameter; Gelman et al., Bayesian Data
Analysis, section 7.4). On a bias the coefficients speak too, which all change by it with the airspeed alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import AIRSPEED
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.calibration import (
    BIAS,
    PITOT_TUBE,
    SCALE,
    at_size,
    kinematic_scale,
    posterior_sizes,
)
from aerosid.equation_error.selection.candidates import effect_candidates
from aerosid.equation_error.selection.coefficient_information import information_on
from aerosid.equation_error.selection.structure import SelectedStructure


def uncertain_airspeed(
    identified: SelectedStructure,
    hypotheses: Sequence[Hypothesis],
    acting: Sequence[ActiveEffect],
    coefficients: Estimate,
) -> tuple[ActiveEffect, ...]:
    """Scale factor error and bias of the airspeed, each at the root mean square of its part of the posterior.

    None where either is identified or declared, or where kinematics do not contain the airspeed.

    Parameters
    ----------
    identified : SelectedStructure
        The instrument errors, selected from the kinematic equations.
    hypotheses : sequence of Hypothesis
        All hypotheses.
    acting : sequence of ActiveEffect
        The effects of the completed structure.
    coefficients : Estimate
        Of the completed structure from all records.
    """
    known = {active.name for active in acting}
    compared = {channel for _, channel in identified.estimate.design.segments}
    by_kind = {h.kind: h for h in hypotheses if h.where == AIRSPEED and h.kind in (SCALE, BIAS)}
    if AIRSPEED not in compared or known & {(SCALE, AIRSPEED), (BIAS, AIRSPEED)} or SCALE not in by_kind:
        return ()
    found, error = kinematic_scale(identified, by_kind[SCALE])
    if abs(found) > PITOT_TUBE.plausible:
        error = math.inf
    if BIAS not in by_kind:
        (size,) = posterior_sizes([(found, error)], PITOT_TUBE)
        return (at_size(by_kind[SCALE], size, found),)
    airspeed = mean_airspeed(coefficients)
    bias, of_bias = shown_bias((identified.estimate, coefficients), by_kind[BIAS])
    scale, constant = posterior_sizes([(found, error), (bias / airspeed, of_bias / airspeed)], PITOT_TUBE)
    return at_size(by_kind[SCALE], scale, found), at_size(by_kind[BIAS], constant * airspeed, bias)


def mean_airspeed(found: Estimate) -> float:
    """Mean airspeed, m/s, of the records to which the derivatives are fitted."""
    return float(np.mean([np.mean(record.channels[AIRSPEED]) for record in found.problem.recordings if record.fitted]))


def shown_bias(found: Sequence[Estimate], hypothesis: Hypothesis) -> tuple[float, float]:
    """An instrument's bias and its standard error by some independent equations together, to first order."""
    information = score = 0.0
    for each in found:
        for candidate in effect_candidates(each.problem, each, [hypothesis]):
            own, slope = information_on(each, candidate.columns)
            information, score = information + float(own[0, 0]), score + float(slope[0])
    return (score / information, 1.0 / math.sqrt(information)) if information > 0.0 else (0.0, math.inf)
