"""Find what the declared model lacks, keep what survives the noise, and say what else fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.effects import StateEffect
from aerosid.evidence import Deviations, Score
from aerosid.findings import Finding, labels, named
from aerosid.hypotheses import Hypothesis
from aerosid.manoeuvre import Manoeuvre
from aerosid.refinement import Refinement, refine_on
from aerosid.refutation import cannot_follow, without_refuted
from aerosid.structure_search import AttributionSettings, StructureSearch

USUAL = AttributionSettings()
"""The settings of a loop unless told otherwise."""


@dataclass(frozen=True)
class Attribution:
    """What is missing from the declared model.

    Attributes
    ----------
    before : Refinement
        The declared structure, re-estimated.
    completed : Refinement
        With every finding.
    completed_deviations : Deviations
        Its standard deviations.
    findings : tuple of Finding
        Most certain first.
    alternatives : tuple of Finding
        What could stand in place of a finding.
    rounds : tuple of tuple of Score
        The score of every hypothesis in each round, before one of that round entered.
    refuted : tuple of (kind, where, term)
        What the flights that were fitted showed and others refuted.
    """

    before: Refinement
    completed: Refinement
    completed_deviations: Deviations
    findings: tuple[Finding, ...]
    alternatives: tuple[Finding, ...]
    rounds: tuple[tuple[Score, ...], ...]
    refuted: tuple[tuple[str, str, str], ...] = ()

    @property
    def terms(self) -> tuple[Entry, ...]:
        """The found terms."""
        return tuple(finding.entry for finding in self.findings if finding.entry is not None)


def attribute(
    before: Refinement,
    manoeuvres: Sequence[Manoeuvre],
    hypotheses: Sequence[Hypothesis],
    coefficients: Sequence[str] = (),
    settings: AttributionSettings = USUAL,
    given: AerodynamicModel | None = None,
    validation: Sequence[Manoeuvre] = (),
) -> Attribution:
    """What the declared model lacks, among `hypotheses`, flow separation and disturbances.

    Parameters
    ----------
    before : Refinement
        The declared structure, re-estimated on the manoeuvres.
    manoeuvres : sequence of Manoeuvre
        The identification flights, one joint estimate.
    hypotheses : sequence of Hypothesis
        What may enter.
    coefficients : sequence of str
        Coefficients that may change without a term; none: no sudden change and no flow separation is tried.
    given : AerodynamicModel, optional
        The declared structure with its declared values: where a search begins again if what is missing is gross.
    validation : sequence of Manoeuvre
        Flights that are not fitted; what predicts them worse is not named.
    """
    search = StructureSearch(tuple(manoeuvres), tuple(hypotheses), tuple(coefficients), before, settings, given)
    current, rounds = search.forward(before)
    current, others = search.exchange(current)
    # What separates in another flight may look like a term here: the verdict will say that it does not explain it.
    wrong_elsewhere = current is not before and any(cannot_follow(current, other) for other in validation)
    if coefficients and (search.is_doubtful(current) or wrong_elsewhere):
        separated = search.separated(current)
        if search.price(separated) < search.price(current):
            current, others = separated, ()
    found, beside = current, others
    if settings.disturbances and search.is_doubtful(found):
        # What was found so far may be the disturbance's work, or be real beside it.
        held_still = found is before or any(isinstance(active.effect, StateEffect) for active in found.effects)
        for base in (before,) if held_still else (before, found):
            disturbed, around = search.disturbed(base)
            if search.price(disturbed) < search.price(current):
                current, others = disturbed, around
    completed, spread = search.certain(refine_on(_unforced(current, before), manoeuvres))
    if _is_forced(current):
        samples = sum(int(np.isfinite(manoeuvre.flight.measured).sum()) for manoeuvre in manoeuvres)
        if search.price(completed) - search.price(found) > NO_IMITATION * samples:
            current, others = found, beside
            completed, spread = search.certain(refine_on(found, manoeuvres))
    held, refuted = without_refuted(completed, search, validation)
    if refuted:
        completed, spread = search.certain(refine_on(held, manoeuvres))
    findings = search.findings(completed, spread)
    if _is_forced(current):
        # Those forces follow what a rival leaves in open loop, and may so tell apart what the motion alone cannot.
        others = _once((*others, *search.alternatives(completed)))
    others = tuple(other for other in others if other.instead_of in {named(label) for label in labels(findings)})
    return Attribution(before, completed, spread, findings, others, tuple(rounds), tuple(p.label for p in refuted))


NO_IMITATION = 1.8
"""Rise of -2 ln L a sample, residuals 2.5 times as large, that no wrong name makes good.

Forces of any shape can follow a stall, a trim change and thrust too, and leave none of them standing. What brings the
whole residual in open loop down so far is kept, although something is left.
"""


def _is_forced(current: Refinement) -> bool:
    return any(active.effect.kind == "unmodelled_forces" for active in current.effects)


def _unforced(current: Refinement, before: Refinement) -> Refinement:
    """Without forces of any shape, which judged what is real: the numbers come from the estimator of those before."""
    effects = tuple(active for active in current.effects if active.effect.kind != "unmodelled_forces")
    return replace(current, effects=effects, variance=np.maximum(current.variance, before.variance))


def _once(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Each alternative once, the first time that it is named."""
    return tuple({(f.kind, f.where, f.term, f.instead_of): f for f in reversed(findings)}.values())[::-1]
