"""Attribution of the residual to effects: structure search, acceptance tests, alternatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.filter_error import FilterError, filter_error, widened
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.model_error.coefficient_match import CoefficientRow
from aerosid.search.acceptance import accept
from aerosid.search.backward_elimination import eliminate_on_final_estimate
from aerosid.search.confirmation import Confirmed, confirmed_terms, with_confirmed
from aerosid.search.finding_evidence import findings_with_p_values
from aerosid.search.findings import Finding, labels, named, unique_alternatives
from aerosid.search.multi_start import multi_start_search
from aerosid.search.replacement import alternatives_to_parts, replace_parts
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import SuggestedTerm, suggested_terms

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
    filter_error : FilterError or None
        The completed structure's terms among forces of any shape, where those say better what is left; then
        `completed_deviations` are no smaller than theirs.
    unproven : tuple of Unproven
        Terms that stand out where something is left, and not far enough.
    confirmed : tuple of Confirmed
        Those of them that flights which were not fitted show by themselves: they are among the findings.
    fallen : tuple of Finding
        What entered and whose final number does not stand: `final_significance`.
    regressed : bool
        Whether the estimate is a regression's and no simulated flight's: what is held in it moves the other numbers by
        their covariance, and no fit to a simulation comes after it.
    again : callable or None
        Of an estimate that keeps some numbers as they were measured: the same of a structure with fewer parts.
    shares : tuple of CoefficientRow
        Of a regression: R^2 of each coefficient and log in the band of the motion, constants free on each log.
    """

    before: Refinement
    completed: Refinement
    completed_deviations: Deviations
    findings: tuple[Finding, ...]
    alternatives: tuple[Finding, ...]
    rounds: tuple[tuple[Score, ...], ...]
    refuted: tuple[tuple[str, str, str], ...] = ()
    filter_error: FilterError | None = None
    suggested: tuple[SuggestedTerm, ...] = ()
    confirmed: tuple[Confirmed, ...] = ()
    eliminated: tuple[Finding, ...] = ()
    regressed: bool = False
    shares: tuple[CoefficientRow, ...] = ()
    re_estimator: Callable[[Refinement], Refinement] | None = None

    def re_estimated(self, start: Refinement, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
        """A structure with fewer free parts, by the estimator that the numbers are from."""
        return refine_on(start, manoeuvres) if self.re_estimator is None else self.re_estimator(start)

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
    *,
    moving_air: bool = False,
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
    moving_air : bool
        Whether the instruments show gusts by kinematics alone: what is missing is then looked for beside them at first.
    """
    search = StructureSearch(tuple(manoeuvres), tuple(hypotheses), tuple(coefficients), before, settings, given)
    results = multi_start_search(search, before, validation, moving_air=moving_air)
    accepted = accept(search, before, results, validation)
    completed, uncertainty, forces = accepted.completed, accepted.uncertainty, accepted.forces
    refuted = tuple(part.label for part in accepted.refuted)
    suggested = suggested_terms(search, completed, refuted)
    confirmed = confirmed_terms(search, completed, suggested, validation)
    if confirmed:
        completed = with_confirmed(search, completed, [each.entry for each in confirmed])
        uncertainty = deviations(completed, manoeuvres)
        suggested = tuple(each for each in suggested if each not in [stands.suggested for stands in confirmed])
    with_forces = filter_error(completed, forces, accepted.searched.estimate.variance, manoeuvres) if forces else None
    uncertainty = widened(uncertainty, with_forces)
    findings = findings_with_p_values(search, completed, uncertainty)
    alternatives = accepted.searched.alternatives
    if forces is not None and settings.instruments_compared:
        # Those forces follow what a rival leaves in open loop, and may so tell apart what the motion alone cannot.
        alternatives = (*alternatives, *alternatives_to_parts(search, completed))
    elif forces is not None:
        completed, alternatives = replace_parts(search, completed, alike=True)
        completed, uncertainty = eliminate_on_final_estimate(search, refine_on(completed, manoeuvres))
        uncertainty = widened(uncertainty, with_forces)
        findings = findings_with_p_values(search, completed, uncertainty)
    alternatives = unique_alternatives(
        other for other in alternatives if other.instead_of in {named(label) for label in labels(findings)}
    )
    return Attribution(
        before,
        completed,
        uncertainty,
        findings,
        alternatives,
        results.plain.rounds,
        refuted,
        with_forces,
        suggested,
        confirmed,
    )
