"""Penalty of a hypothesis: Schwarz's criterion with prior odds that share a stated false-alarm probability."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import UNIT
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.selection.candidates import distinct_name, size_penalty
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.flight_model.aerodynamics import Entry

Array = NDArray[np.float64]

Label = tuple[str, str, str]
"""Kind, channel or coefficient, and term of a hypothesis."""

Name = tuple[str, ...]
"""Name that distinguishes a hypothesis: its label, of a position error with its axes."""

RARE = (("thrust_change", "thrust", ""), ("cg_shift", "x", ""), ("sensor_position", UNIT, ""))
"""Effects that a step of one coefficient, the moment of a surface, or one channel's sensor explains more simply; their
prior odds are those of a product of two factors."""


@dataclass(frozen=True)
class KinematicEvidence:
    """Estimate of a hypothesis by other, independent equations; infinite variances where they contain no information.

    Attributes
    ----------
    values : tuple of float
        Parameter values, in their units.
    covariance : ndarray, shape (k, k)
        Of the values.
    gain : float
        In ln L of those equations at these values.
    credit : float
        Part of that gain that counts towards the penalty.
    least : float
        Least value of the first parameter that is told from the errors of the equations that are to show it.
    """

    values: tuple[float, ...]
    covariance: Array
    gain: float
    credit: float
    least: float = -math.inf

    def gain_at(self, values: Sequence[float]) -> float:
        """Gain in ln L at other values, to second order."""
        return self.gain - 0.5 * self._distance(values)

    def agrees(self, values: Sequence[float], deviations: float) -> bool:
        """Whether other values lie within a number of standard deviations, and are not too small to be told."""
        return values[0] >= self.least and self._distance(values) <= deviations**2

    def _distance(self, values: Sequence[float]) -> float:
        if self.is_uninformative:
            return 0.0
        difference = np.array(values) - np.array(self.values)
        return float(difference @ np.linalg.solve(self.covariance, difference))

    @property
    def is_uninformative(self) -> bool:
        """Whether those equations contain no information on the hypothesis."""
        return not np.isfinite(self.covariance).all()


@dataclass(frozen=True)
class SelectionCriterion:
    """Criterion of selection: all hypotheses tested share the stated odds of a false alarm.

    Attributes
    ----------
    odds_shares : mapping of label to float
        Shares of the odds, their sum one: larger for simple terms than for products of many factors.
    samples : int
    false_alarm : float
        Probability of any false alarm among all hypotheses tested.
    evidence : mapping of name to KinematicEvidence
        Estimates by other equations; the product of both likelihoods is tested against the penalty.
    prior_sizes : mapping of entry to float
        Prior standard deviation of a term's value about zero, for terms of known physical size.
    odds_factors : mapping of label to float
        Factor by which other evidence raises the prior odds of a hypothesis, 1.
    """

    odds_shares: Mapping[Label, float]
    samples: int
    false_alarm: float
    evidence: Mapping[Name, KinematicEvidence] = field(default_factory=dict)
    prior_sizes: Mapping[Entry, float] = field(default_factory=dict)
    odds_factors: Mapping[Label, float] = field(default_factory=dict)

    def allowed_false_alarm(self, hypothesis: Hypothesis) -> float:
        """Probability of a false alarm allotted to a hypothesis, its share of the whole."""
        share = self.odds_shares.get(hypothesis.label, max(self.odds_shares.values()))
        return share * self.false_alarm * self.odds_factors.get(hypothesis.label, 1.0)

    def penalty(self, hypothesis: Hypothesis) -> float:
        """Gain in ln L that it must exceed: Schwarz's criterion at its prior odds.

        Of a further step change of one coefficient it is that of all of them: steps, given enough of them, follow any
        slow residual.
        """
        odds = -float(np.log(self.allowed_false_alarm(hypothesis)))
        return (1 + hypothesis.repetition) * (odds + schwarz_penalty(hypothesis, self.samples))

    def is_distinct(self, hypothesis: Hypothesis, own: float, gain: float, settings: EquationErrorSettings) -> bool:
        """Whether a term is identifiable, by its column's independent fraction or by an overwhelming gain in ln L."""
        if not hypothesis.entries or own >= settings.distinct:
            return True
        return gain >= settings.overwhelming * self.penalty(hypothesis)

    def least_penalty(self, hypothesis: Hypothesis) -> float:
        """The penalty less the largest credited gain of other equations: the lower bound over all parameter values."""
        evidence = self.evidence.get(distinct_name(hypothesis))
        return self.penalty(hypothesis) - (evidence.credit if evidence is not None else 0.0)

    def penalty_at(self, hypothesis: Hypothesis, point: Point) -> float:
        """The penalty at a point, with the prior of the parameter values, less the credited gain of other equations."""
        effects = effects_of(point, hypothesis)
        evidence = self.evidence.get(distinct_name(hypothesis))
        evidence_gain = 0.0
        if evidence is not None and evidence.credit > 0.0 and effects:
            evidence_gain = evidence.gain_at(effects[0].values)
        size = sum(
            0.5 * (point.model.value(e) / self.prior_sizes[e]) ** 2 for e in hypothesis.entries if e in self.prior_sizes
        )
        return self.penalty(hypothesis) + size_penalty(effects) + size - evidence_gain


def schwarz_penalty(hypothesis: Hypothesis, samples: int) -> float:
    """Schwarz's criterion in ln L for a hypothesis that is the only one tested, at even odds."""
    return 0.5 * max(hypothesis.parameters, 1) * float(np.log(samples))


def criterion_for(
    hypotheses: Sequence[Hypothesis], samples: int, false_alarm: float, factor_odds: float
) -> SelectionCriterion:
    """The selection criterion for some hypotheses and a number of samples."""
    weights = {}
    for hypothesis in hypotheses:
        factors = sum(factor.power for _, term in hypothesis.entries for factor in term.factors)
        weights[hypothesis.label] = factor_odds ** max(factors - 1, 0)
    for label in RARE:
        weights[label] = factor_odds
    total = sum(weights.values())
    return SelectionCriterion({label: weight / total for label, weight in weights.items()}, samples, false_alarm)


def effects_of(point: Point, hypothesis: Hypothesis) -> tuple[ActiveEffect, ...]:
    """The effects of a hypothesis with their parameter values at a point."""
    keys = {active.key for active in hypothesis.effects}
    return tuple(active for active in point.effects if active.values and active.key in keys)


def joint_penalty(criterion: SelectionCriterion, point: Point, hypotheses: Sequence[Hypothesis]) -> float:
    """Sum of the penalties of some hypotheses with their parameter values at a point."""
    return sum(criterion.penalty_at(hypothesis, point) for hypothesis in hypotheses)
