"""Attribution of the residual to effects: structure search, acceptance tests, alternatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from aerosid.effects.refutation import Refutation, Refuted
from aerosid.equation_error.selection.control_dependence import ControlDependence
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.filter_error import FilterError, filter_error, widened
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import Entry
from aerosid.model_error.paper_chain.coefficient_match import CoefficientRow
from aerosid.search.acceptance import accept
from aerosid.search.backward_elimination import eliminate_on_final_estimate
from aerosid.search.coefficient_predictions import CoefficientPredictions
from aerosid.search.confirmation import Confirmed, confirmed_terms, with_confirmed
from aerosid.search.finding_evidence import findings_with_p_values
from aerosid.search.findings import Finding, labels, named, unique_alternatives
from aerosid.search.lowered_coefficients import LoweredCoefficient
from aerosid.search.multi_start import MultiStartResult, multi_start_search, search_without_disturbances
from aerosid.search.other_derivatives import OtherDerivative
from aerosid.search.replacement import alternatives_to_parts, replace_parts
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import SuggestedTerm, suggested_terms


@dataclass(frozen=True)
class Attribution:
    """Result of a structure search: the effects missing from the declared model.

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
        Indistinguishable from a finding in its place.
    rounds : tuple of tuple of Score
        The scores of all candidates at the start of each round.
    refuted : mapping of (kind, where, term) to Refutation
        Found on the fitted flights and refuted, with the grounds.
    filter_error : FilterError or None
        The filter-error estimate of the completed structure's terms with unmodelled forces, where those lower the
        penalised cost; then `completed_deviations` are no smaller than its own.
    suggested : tuple of SuggestedTerm
        Near-significant terms, where the model is inadequate.
    confirmed : tuple of Confirmed
        Those of them that an independent estimate on the validation flights confirms: they are among the findings.
    eliminated : tuple of Finding
        Findings that fail the Wald test of their final estimate: `final_significance`.
    regressed : bool
        Whether the estimate is from a regression (equation error) and not from a simulation: parameters fixed in it
        change the others by their covariance, and no fit to a simulation follows.
    re_estimator : callable or None
        Of a regression, and where the estimate holds measured values fixed: the same estimator for a structure with
        fewer parts.
    deviations_of : callable or None
        Standard deviations of what the `re_estimator` gives, where they contain more than its simulation's.
    by_regression : Attribution or None
        Where the values are of output error behind a recorder: the same structure with the regression's values, which
        validation flights may prefer.
    in_turbulence : Refinement or None
        Of a regression that reports turbulence: the filter-error estimate of the completed structure, whose innovations
        are tested in place of the residuals of an open-loop simulation.
    predictions : CoefficientPredictions or None
        Of a structure found by regression: the coefficients of all logs with given values of it.
    other_derivatives : tuple of OtherDerivative
        Derivatives that differ on a validation flight.
    lowered : tuple of LoweredCoefficient
        Of a structure found by regression: coefficients of a validation flight whose R^2 it lowers, all derivatives of
        both structures free.
    noise_hidden : bool
        Whether a recorder that filters or colours all channels hides their noise: the last digits of a log then do not
        show it.
    dependence : tuple of ControlDependence, optional
        Test of each coefficient's residual against the controls, where a recorder hides the noise or gusts are
        suspected that are too small to be identified; None where residuals are compared with the noise alone.
    still_air : bool
        Whether, with that test, neither vanes nor forces show that the air may move: a slow residual is then no gust.
    """

    before: Refinement
    completed: Refinement
    completed_deviations: Deviations
    findings: tuple[Finding, ...]
    alternatives: tuple[Finding, ...]
    rounds: tuple[tuple[Score, ...], ...]
    refuted: Refuted = field(default_factory=dict)
    filter_error: FilterError | None = None
    suggested: tuple[SuggestedTerm, ...] = ()
    confirmed: tuple[Confirmed, ...] = ()
    eliminated: tuple[Finding, ...] = ()
    regressed: bool = False
    predictions: CoefficientPredictions | None = None
    other_derivatives: tuple[OtherDerivative, ...] = ()
    lowered: tuple[LoweredCoefficient, ...] = ()
    noise_hidden: bool = False
    dependence: tuple[ControlDependence, ...] | None = None
    still_air: bool = False
    in_turbulence: Refinement | None = None
    re_estimator: Callable[[Refinement], Refinement] | None = None
    deviations_of: Callable[[Refinement], Deviations] | None = None
    by_regression: Attribution | None = None

    @property
    def tested(self) -> Refinement:
        """The estimate whose residuals are tested against the noise: innovations in turbulence, else open loop."""
        return self.completed if self.in_turbulence is None else self.in_turbulence

    def re_estimated(self, start: Refinement, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
        """The estimate of a structure with fewer parts, by the estimator that the values are from."""
        return refine_on(start, manoeuvres) if self.re_estimator is None else self.re_estimator(start)

    @property
    def r_squared(self) -> tuple[CoefficientRow, ...]:
        """R^2 before, and after by the completed model at its present values; empty without a regression."""
        return () if self.predictions is None else self.predictions.r_squared(self.completed)

    @property
    def terms(self) -> tuple[Entry, ...]:
        """The found terms."""
        return tuple(finding.entry for finding in self.findings if finding.entry is not None)


def attribute_by_search(
    search: StructureSearch, validation: Sequence[Manoeuvre], *, moving_air: bool = False
) -> Attribution:
    """Structure search for the declared model's missing effects: its hypotheses, flow separation, disturbances.

    Parameters
    ----------
    search : StructureSearch
        The identification flights, the hypotheses and the declared structure.
    validation : sequence of Manoeuvre
        Flights that are not fitted; a part that makes their prediction worse is eliminated.
    moving_air : bool
        Whether the instruments show gusts by kinematics alone: the first search is then made in their presence.
    """
    results = multi_start_search(search, search.declared, validation, moving_air=moving_air)
    return _attributed(search, results, validation)


def attribute_without_disturbances(
    search: StructureSearch,
    validation: Sequence[Manoeuvre],
    *,
    moving_air: bool = False,
    doubted: Callable[[], None] = lambda: None,
) -> Attribution | None:
    """As `attribute_by_search`; None where flow separation or unmodelled forces would have to be tried.

    These take most of the time of a search, in vain where the residual is of a shape that no effect has. `doubted` is
    called as soon as None is likely.
    """
    results = search_without_disturbances(search, search.declared, validation, moving_air=moving_air, doubted=doubted)
    return None if results is None else _attributed(search, results, validation)


def _attributed(search: StructureSearch, results: MultiStartResult, validation: Sequence[Manoeuvre]) -> Attribution:
    """The attribution from the searches' results: acceptance tests, suggested terms, alternatives, standard errors."""
    before, manoeuvres, settings = search.declared, search.manoeuvres, search.settings
    accepted = accept(search, before, results, validation)
    completed, uncertainty, forces = accepted.completed, accepted.uncertainty, accepted.forces
    refuted = {part.label: Refutation.PREDICTION for part in accepted.refuted}
    suggested = suggested_terms(search, completed, refuted) if settings.reported or validation else ()
    confirmed = confirmed_terms(search, completed, suggested, validation)
    if confirmed:
        completed = with_confirmed(search, completed, [each.entry for each in confirmed])
        uncertainty = deviations(completed, manoeuvres)
        suggested = tuple(each for each in suggested if each not in [term.suggested for term in confirmed])
    with_forces = (
        filter_error(completed, forces, accepted.search_result.estimate.variance, manoeuvres) if forces else None
    )
    uncertainty = widened(uncertainty, with_forces)
    findings = findings_with_p_values(search, completed, uncertainty)
    alternatives = accepted.search_result.alternatives
    if forces is not None and settings.instruments_compared:
        # Those forces follow the open-loop residual of an alternative, and may so distinguish it where the motion alone
        # does not.
        alternatives = (*alternatives, *alternatives_to_parts(search, completed))
    elif forces is not None:
        completed, alternatives = replace_parts(search, completed, exclusive=True)
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
