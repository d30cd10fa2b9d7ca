"""Find which terms the declared model lacks: score, try, keep what survives the noise, and say what else fits.

A term enters where three things hold: among all candidates its fit is the most likely, its deviation corrected for
coloured residuals leaves no doubt after counting how many candidates were looked at, and it stays so beside every
other term that entered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from aerosid.aerodynamics import Entry
from aerosid.evidence import Deviations, Score, deviations, score_candidates
from aerosid.manoeuvre import Manoeuvre
from aerosid.refinement import Refinement, RefinementSettings, refine


@dataclass(frozen=True)
class AttributionSettings:
    """Settings of the structure search, each with the reason for its value.

    Attributes
    ----------
    false_alarm : float
        Share of flights with nothing missing in which some term may be named, by design.
    shortlist : int
        Candidates that are fitted in each round; the score's ranking is exact only for small effects.
    rounds : int
        Terms that may enter; beyond, a flight misses something that is no sum of terms.
    reach : float
        Difference of -2 ln L, for white residuals, within which another term counts as not told apart (20:1 odds).
    """

    false_alarm: float = 0.01
    shortlist: int = 5
    rounds: int = 6
    reach: float = 6.0


TRIAL = RefinementSettings(steps=12, rounds=4, step_tolerance=0.03, variance_tolerance=0.01)
"""A trial decides between terms that differ by many units of -2 ln L: a few steps are enough."""


@dataclass(frozen=True)
class Finding:
    """One term that the data show to be missing.

    `p_value` counts how many candidates were looked at; `gain` is the rise of -2 ln L when it is struck out again.
    """

    entry: Entry
    value: float
    std_error: float
    p_value: float
    gain: float


@dataclass(frozen=True)
class Alternative:
    """A term that these manoeuvres hardly tell from the chosen `instead_of`; `loss` is its -2 ln L above the chosen."""

    entry: Entry
    instead_of: Entry
    value: float
    std_error: float
    loss: float


@dataclass(frozen=True)
class Attribution:
    """What is missing from the declared model.

    Attributes
    ----------
    before : Refinement
        The declared structure, re-estimated.
    completed : Refinement
        With every finding.
    findings : tuple of Finding
        Most certain first.
    alternatives : tuple of Alternative
        What could stand in place of a finding.
    rounds : tuple of tuple of Score
        The score of every candidate in each round, before a term of that round entered.
    """

    before: Refinement
    completed: Refinement
    completed_deviations: Deviations
    findings: tuple[Finding, ...]
    alternatives: tuple[Alternative, ...]
    rounds: tuple[tuple[Score, ...], ...]


def attribute(
    before: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    candidates: Sequence[Entry],
    settings: AttributionSettings = AttributionSettings(),
) -> Attribution:
    """The terms among `candidates` that the declared model lacks.

    Parameters
    ----------
    before : Refinement
        The declared structure, re-estimated on the manoeuvres.
    manoeuvres : sequence of Manoeuvre
        The identification flights, one joint estimate.
    candidates : sequence of Entry
        Terms that may enter.
    """
    search = _Search(tuple(manoeuvres), tuple(candidates), before.free, settings)
    current, rounds = search.forward(before)
    found = [entry for entry in current.free if entry not in before.free]
    current, alternatives = search.exchange(current, found)
    found = [entry for entry in current.free if entry not in before.free]
    completed = refine(current.model, manoeuvres, current.free, states=current.states, variance=current.variance)
    spread = deviations(completed, manoeuvres)
    findings = search.findings(completed, spread, found)
    return Attribution(before, completed, spread, findings, alternatives, tuple(rounds))


class _Search:
    """The stepwise search over one set of candidates on one set of manoeuvres."""

    def __init__(
        self,
        manoeuvres: tuple[Manoeuvre, ...],
        candidates: tuple[Entry, ...],
        declared: tuple[Entry, ...],
        settings: AttributionSettings,
    ) -> None:
        self.manoeuvres = manoeuvres
        self.candidates = candidates
        self.declared = declared
        self.settings = settings
        self.critical = float(norm.isf(0.5 * settings.false_alarm / max(len(candidates), 1)))

    def forward(self, start: Refinement) -> tuple[Refinement, list[tuple[Score, ...]]]:
        """Let terms enter one at a time, and leave again when a later one explains them."""
        current = start
        rounds = []
        rejected: set[frozenset[Entry]] = set()
        for _ in range(self.settings.rounds):
            left = [entry for entry in self.candidates if entry not in current.free]
            scores = score_candidates(current, self.manoeuvres, left)
            rounds.append(scores)
            trials = [self.with_term(current, score) for score in self.shortlist(scores)]
            trials = [trial for trial in trials if frozenset(trial.free) not in rejected]
            if not trials:
                break
            best = min(trials, key=lambda trial: trial.cost)
            rejected.add(frozenset(best.free))
            pruned = self.pruned(best)
            if best.free[-1] not in pruned.free:
                break
            current = pruned
        return current, rounds

    def shortlist(self, scores: Sequence[Score]) -> list[Score]:
        """The candidates worth a fit: those whose score alone could pass, the best few of them."""
        worth = [score for score in scores if score.gain > self.critical**2]
        return worth[: self.settings.shortlist]

    def with_term(self, current: Refinement, score: Score) -> Refinement:
        """The estimate with one more term."""
        model = current.model.extended([score.entry])
        return refine(
            model,
            self.manoeuvres,
            (*current.free, score.entry),
            states=current.states,
            variance=current.variance,
            settings=TRIAL,
        )

    def without_term(self, current: Refinement, entry: Entry) -> Refinement:
        """The estimate with one term struck out."""
        return refine(
            current.model.without([entry]),
            self.manoeuvres,
            tuple(other for other in current.free if other != entry),
            states=current.states,
            variance=current.variance,
            settings=TRIAL,
        )

    def pruned(self, current: Refinement) -> Refinement:
        """The estimate without those added terms that corrected deviations cannot tell from zero."""
        while True:
            added = [entry for entry in current.free if entry not in self.declared]
            ratios = self.ratios(current, deviations(current, self.manoeuvres), added)
            if not added or min(ratios) >= self.critical:
                return current
            current = self.without_term(current, added[int(np.argmin(ratios))])

    def ratios(self, current: Refinement, spread: Deviations, entries: Sequence[Entry]) -> list[float]:
        """|value| over corrected deviation of `entries`."""
        places = [current.free.index(entry) for entry in entries]
        return [
            abs(current.model.value(entry)) / float(spread.corrected[place])
            for entry, place in zip(entries, places, strict=True)
        ]

    def exchange(self, current: Refinement, found: Sequence[Entry]) -> tuple[Refinement, tuple[Alternative, ...]]:
        """Try other terms in the place of each found one: take a better one, list those within reach."""
        alternatives: list[Alternative] = []
        for entry in found:
            reduced = self.without_term(current, entry)
            others = [other for other in self.candidates if other not in current.free]
            scores = score_candidates(reduced, self.manoeuvres, others)
            trials = [self.with_term(reduced, score) for score in self.shortlist(scores)]
            chosen = entry
            if trials:
                best = min(trials, key=lambda trial: trial.cost)
                if best.cost < current.cost and best.free == self.pruned(best).free:
                    chosen = best.free[-1]
                    rest = [trial for trial in trials if trial is not best]
                    trials = [*rest, current]
                    current = best
            reach = self.settings.reach * self.inflation(current, chosen)
            for trial in trials:
                other = entry if trial.free[-1] == chosen or entry in trial.free else trial.free[-1]
                if trial.cost - current.cost < reach and other != chosen:
                    place = trial.free.index(other)
                    error = float(deviations(trial, self.manoeuvres).corrected[place])
                    alternatives.append(
                        Alternative(other, chosen, trial.model.value(other), error, trial.cost - current.cost)
                    )
        return current, tuple(alternatives)

    def inflation(self, current: Refinement, entry: Entry) -> float:
        """By how much coloured residuals widen the variance of a term, at least 1."""
        spread = deviations(current, self.manoeuvres)
        place = current.free.index(entry)
        return max(1.0, float(spread.corrected[place] / spread.white[place]) ** 2)

    def findings(self, completed: Refinement, spread: Deviations, found: Sequence[Entry]) -> tuple[Finding, ...]:
        """The found terms with their evidence, most certain first."""
        rows = []
        for entry in found:
            place = completed.free.index(entry)
            value, error = completed.model.value(entry), float(spread.corrected[place])
            p_value = float(min(1.0, 2.0 * norm.sf(abs(value) / error) * len(self.candidates)))
            gain = self.without_term(completed, entry).cost - completed.cost
            rows.append(Finding(entry, value, error, p_value, gain))
        return tuple(sorted(rows, key=lambda row: -row.gain))
