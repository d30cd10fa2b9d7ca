"""Price of a hypothesis: Schwarz's criterion at prior odds that share a stated probability of a false alarm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.selection.candidates import distinct_name, size_penalty
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.flight_model.aerodynamics import Entry

Array = NDArray[np.float64]

Label = tuple[str, str, str]
"""Kind, channel or coefficient, and term of a hypothesis."""

Name = tuple[str, ...]
"""What tells a hypothesis apart: its label, of a place its axes too."""

RARE = (("thrust_change", "thrust", ""), ("cg_shift", "x", ""))
"""What a step of one coefficient, or the moment of a surface, says more simply; they take the share of a product of two
factors."""


@dataclass(frozen=True)
class KinematicEvidence:
    """What other, independent equations show of a hypothesis; infinite variances where they say nothing.

    Attributes
    ----------
    values : tuple of float
        Its numbers, in their units.
    covariance : ndarray, shape (k, k)
        Theirs.
    gain : float
        In ln L of those equations at these values.
    credit : float
        What of that gain counts towards the price.
    """

    values: tuple[float, ...]
    covariance: Array
    gain: float
    credit: float

    def gain_at(self, values: Sequence[float]) -> float:
        """Gain in ln L at other values, to second order."""
        return self.gain - 0.5 * self._distance(values)

    def agrees(self, values: Sequence[float], deviations: float) -> bool:
        """Whether other values lie within so many deviations."""
        return self._distance(values) <= deviations**2

    def _distance(self, values: Sequence[float]) -> float:
        if self.is_uninformative:
            return 0.0
        apart = np.array(values) - np.array(self.values)
        return float(apart @ np.linalg.solve(self.covariance, apart))

    @property
    def is_uninformative(self) -> bool:
        """Whether those equations say nothing of it."""
        return not np.isfinite(self.covariance).all()


@dataclass(frozen=True)
class SelectionCriterion:
    """By which hypotheses enter: all that are asked share the stated odds of a false alarm.

    Attributes
    ----------
    odds_shares : mapping of label to float
        Of the odds, their sum one: simple terms take more of it than products of many factors.
    samples : int
    false_alarm : float
        Probability of any false alarm among all that are asked.
    evidence : mapping of name to KinematicEvidence
        What other equations show; both likelihoods are one product, and have to pay the price together.
    prior_sizes : mapping of entry to float
        Standard deviation of a term's value about none, for terms whose size physics tell.
    odds_factors : mapping of label to float
        By how much other evidence raises the odds of a hypothesis over its share, 1.
    """

    odds_shares: Mapping[Label, float]
    samples: int
    false_alarm: float
    evidence: Mapping[Name, KinematicEvidence] = field(default_factory=dict)
    prior_sizes: Mapping[Entry, float] = field(default_factory=dict)
    odds_factors: Mapping[Label, float] = field(default_factory=dict)

    def allowed_false_alarm(self, hypothesis: Hypothesis) -> float:
        """Probability of a false alarm that a hypothesis is allowed, its share of the whole."""
        share = self.odds_shares.get(hypothesis.label, max(self.odds_shares.values()))
        return share * self.false_alarm * self.odds_factors.get(hypothesis.label, 1.0)

    def penalty(self, hypothesis: Hypothesis) -> float:
        """Gain in ln L that it must exceed: Schwarz's criterion at its prior odds."""
        odds = -float(np.log(self.allowed_false_alarm(hypothesis)))
        return odds + schwarz_penalty(hypothesis, self.samples)

    def is_distinct(self, hypothesis: Hypothesis, own: float, gain: float, settings: EquationErrorSettings) -> bool:
        """Whether a term tells more than what others' errors could, by its column's own share or by a gain in ln L."""
        if not hypothesis.entries or own >= settings.distinct:
            return True
        return gain >= settings.overwhelming * self.penalty(hypothesis)

    def least_penalty(self, hypothesis: Hypothesis) -> float:
        """The price less the most that other equations gain by it: no number costs less."""
        evidence = self.evidence.get(distinct_name(hypothesis))
        return self.penalty(hypothesis) - (evidence.credit if evidence is not None else 0.0)

    def penalty_at(self, hypothesis: Hypothesis, point: Point) -> float:
        """The price, with what its numbers at a point are unusual by, less what other equations gain by them."""
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
    """Schwarz's criterion in ln L for a hypothesis that is the only question, at even odds."""
    return 0.5 * max(hypothesis.parameters, 1) * float(np.log(samples))


def criterion_for(
    hypotheses: Sequence[Hypothesis], samples: int, false_alarm: float, factor_odds: float
) -> SelectionCriterion:
    """The rules by which some hypotheses are judged on so many samples."""
    weights = {}
    for hypothesis in hypotheses:
        factors = sum(factor.power for _, term in hypothesis.entries for factor in term.factors)
        weights[hypothesis.label] = factor_odds ** max(factors - 1, 0)
    for label in RARE:
        weights[label] = factor_odds
    total = sum(weights.values())
    return SelectionCriterion({label: weight / total for label, weight in weights.items()}, samples, false_alarm)


def effects_of(point: Point, hypothesis: Hypothesis) -> tuple[ActiveEffect, ...]:
    """The effects of a hypothesis with their numbers at a point."""
    names = {(active.name, active.log) for active in hypothesis.effects}
    return tuple(active for active in point.effects if active.values and (active.name, active.log) in names)


def joint_penalty(criterion: SelectionCriterion, point: Point, hypotheses: Sequence[Hypothesis]) -> float:
    """What some hypotheses have to bring together with their numbers at a point."""
    return sum(criterion.penalty_at(hypothesis, point) for hypothesis in hypotheses)
