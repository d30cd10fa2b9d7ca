"""What calibration leaves of instrument errors: too little to be named, or too much for a derivative to be known.

An error within the accuracy of a calibration is no missing effect, however well a record shows it: what a recorder's
filter or a gyro's slow noise does to a channel may look like a scale factor of .998 with a standard error of .0003.

A derivative is known as well as the scale of what it is formed with. In moving air the kinematics determine the scale
factor of a vane to one or several per cent, and an error below the penalty for multiple testing is not identified; the
coefficients cannot show it at all, since their derivatives scale with it. Its posterior from the usual accuracy of a
calibration and from the kinematics is a part of the standard errors of the derivatives (a nuisance parameter with a
prior; Klein & Morelli, Aircraft System Identification, eq. 5.31). The same holds for the airspeed, by whose square
every coefficient is divided (`airspeed_calibration`).

The prior is a mixture: most instruments are calibrated, some are not. A normal prior alone would outvote kinematics
that contradict it, and a vane that shows 17 % too much would leave derivatives six standard errors off (contaminated
normal distribution; Huber, Annals of Mathematical Statistics 35 (1), 1964).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from aerosid.compiled.cores import mapped
from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import VANE_OF
from aerosid.equation_error.regression.estimate import Estimate, maximise_likelihood
from aerosid.equation_error.selection.alternatives import last_parameter
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.structure import SelectedStructure
from aerosid.flight_model.axes import ACCELEROMETERS

SCALE, BIAS = "sensor_scale", "sensor_bias"


@dataclass(frozen=True)
class Calibration:
    """A-priori accuracy of an instrument's calibration.

    Attributes
    ----------
    accuracy : float
        Standard deviation, 1, of the scale factor error that a calibrated one retains.
    probability : float
        That it is not calibrated, 1.
    uncalibrated : float
        Standard deviation, 1, of its scale factor error then.
    plausible : float
        Largest error, 1, that kinematics may find and that is evidence: of the airspeed a larger one is a wind that
        changes, and moves the path as a scale factor does.
    """

    accuracy: float
    probability: float
    uncalibrated: float
    plausible: float = math.inf


VANE = Calibration(0.02, 0.1, 0.1)
"""Chosen: two parts in a hundred, by upwash that changes with configuration (found on no data); one vane in ten is not
calibrated, and then off by the usual error of `limit_over_usual` (asked for by `benchmarks/field_detection.py`, seeds
191 and 192, whose vanes of 0.87 and 1.17 left derivatives four to seven standard errors off)."""

PITOT_TUBE = Calibration(0.005, 0.1, 0.03, 0.06)
"""Chosen: half a per cent with a calibrated static pressure, three without one, which is what 14 CFR 23.1323 and
25.1323 allow, and twice that as the largest plausible one (HFB-320, whose a_x, attitude and airspeed contradict each
other, shows 7 %); asked for by `benchmarks/field_detection.py`, seed 217 flight 34, whose airspeed 3 % off left
derivatives six and fourteen standard errors off."""

ATTITUDE, RATE = ("phi", "theta", "psi"), ("p", "q", "r")


@dataclass(frozen=True)
class RetainedErrors:
    """Errors that calibrated instruments retain: smaller ones are not named. All chosen.

    Attributes
    ----------
    scale : float
        Of a scale factor, 1: four parts in a thousand, of any instrument.
    attitude : float
        Bias of an attitude, rad: a seventeenth of a degree.
    rate : float
        Bias of a gyro, rad/s: a hundredth of a degree per second.
    acceleration : float
        Bias of an accelerometer, m/s^2: half a thousandth of the Earth's.
    """

    scale: float = 0.004
    attitude: float = 0.001
    rate: float = 0.0002
    acceleration: float = 0.005

    def of(self, kind: str, channel: str) -> float:
        """That of a kind of instrument error in a channel, in its unit; 0 where any is named."""
        if kind == SCALE:
            return self.scale
        sizes = ((ATTITUDE, self.attitude), (RATE, self.rate), (ACCELEROMETERS, self.acceleration))
        return next((size for channels, size in sizes if kind == BIAS and channel in channels), 0.0)


RETAINED = RetainedErrors()
"""Of every record."""

STEPS = 4
"""Numerical: Gauss-Newton steps at most; the kinematic equations are nearly linear in a scale factor."""


def exceeds_calibration(found: Estimate, hypothesis: Hypothesis) -> bool:
    """Whether the last instrument error of an estimate is larger than a calibrated instrument retains."""
    active = found.point.effects[-1]
    least = RETAINED.of(hypothesis.kind, hypothesis.where)
    return abs(active.values[0] - active.effect.parameters[0].null) > least


def uncertain_scales(
    identified: SelectedStructure, hypotheses: Sequence[Hypothesis], acting: Sequence[ActiveEffect]
) -> tuple[ActiveEffect, ...]:
    """The scale factor errors of vanes that were not identified, each at its posterior root-mean-square size.

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
        and hypothesis.where in compared.intersection(VANE_OF.values())
        and (SCALE, hypothesis.where) not in known
    ]
    return tuple(mapped(lambda each: _at_posterior_size(identified, each), scales, common=[base.problem]))


def _at_posterior_size(identified: SelectedStructure, hypothesis: Hypothesis) -> ActiveEffect:
    """A scale factor error, frozen at the root mean square of its posterior about one, on the side of its mean."""
    found, error = kinematic_scale(identified, hypothesis)
    return at_size(hypothesis, posterior_size(found, error, VANE), found)


def kinematic_scale(identified: SelectedStructure, hypothesis: Hypothesis) -> tuple[float, float]:
    """A scale factor error and its standard error, 1, by kinematics."""
    base = identified.estimate
    found = maximise_likelihood(base.problem, with_hypothesis(base.point, hypothesis), base.solution.weights, STEPS)
    active, value, error = last_parameter(found.estimate, hypothesis)
    assert active is not None
    return value - active.effect.parameters[0].null, error


def at_size(hypothesis: Hypothesis, size: float, found: float) -> ActiveEffect:
    """An instrument error, frozen at some size from its null, on the side of an estimate of its distance from there."""
    (active,) = hypothesis.effects
    null = active.effect.parameters[0].null
    return frozen(replace(active, values=(null + (size if found >= 0.0 else -size), *active.values[1:])))


def posterior_size(found: float, error: float, usual: Calibration) -> float:
    """Root mean square of a scale factor error of which kinematics found a value with a standard error."""
    return posterior_sizes([(found, error)], usual)[0]


def posterior_sizes(evidence: Sequence[tuple[float, float]], usual: Calibration) -> list[float]:
    """Root mean squares of the parts of an error that is of one of several shapes, a priori as probable.

    Parameters
    ----------
    evidence : sequence of (float, float)
        For each shape the size that the records show if it is the error's, and its standard error: infinite where they
        show nothing, and the prior is left.
    usual : Calibration
        Of the instrument.
    """
    priors = ((usual.accuracy**2, 1.0 - usual.probability), (usual.uncalibrated**2, usual.probability))
    rows = [
        (n, *_posterior(found, error, prior), math.log(share))
        for n, (found, error) in enumerate(evidence)
        for prior, share in priors
        if share > 0.0
    ]
    most = max(gain + prior_odds for _, _, gain, prior_odds in rows)
    weights = [math.exp(gain + prior_odds - most) for _, _, gain, prior_odds in rows]
    squares = [0.0] * len(evidence)
    for weight, (n, square, _, _) in zip(weights, rows, strict=True):
        squares[n] += weight * square / sum(weights)
    return [math.sqrt(square) for square in squares]


def _posterior(found: float, error: float, prior: float) -> tuple[float, float]:
    """Mean square of an error of some prior variance, and its gain in ln L over none, the error integrated out."""
    if not math.isfinite(error):
        return prior, 0.0
    spread = prior + error**2
    taken = prior / spread  # of the estimate; none where the records do not determine it
    gain = 0.5 * (taken * (found / error) ** 2 - math.log(spread / error**2)) if error > 0.0 else 0.0
    return (taken * found) ** 2 + (1.0 - taken) * prior, gain
