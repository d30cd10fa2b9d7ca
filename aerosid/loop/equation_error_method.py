"""Structure by kinematic and coefficient equations; in calm air its values by output error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from aerosid.compiled.replicas import replicated
from aerosid.equation_error.decision import EquationErrorDecision, decide
from aerosid.equation_error.selection.control_dependence import ControlDependence, dependence_on_records
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors
from aerosid.equation_error.selection.turbulence import Turbulence, may_be_turbulent
from aerosid.estimation.fit_settings import RESIDUAL_TESTS
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.equation_error_notes import (
    note_on_damping,
    note_on_delay,
    note_on_near_significant,
    note_on_regressor_errors,
    note_on_residuals,
    note_on_supported_error,
    note_on_unsized_turbulence,
    note_on_vane,
    notes_on_bridged_holes,
    notes_on_calibration,
    notes_on_rotary_gusts,
)
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.loop.settings import LoopSettings
from aerosid.search.attribution import Attribution
from aerosid.search.calm_air import differ, output_error_in_calm_air
from aerosid.search.declared_inertia import with_declared_inertia
from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.equivalent_causes import with_equivalent_causes
from aerosid.search.structure_search import StructureSearch
from aerosid.search.turbulence_innovations import with_turbulence_innovations


@dataclass(frozen=True)
class EquationErrorResult:
    """The attribution with its decision, the search for further estimates, and notes for the report."""

    found: Attribution
    search: StructureSearch
    notes: tuple[str, ...]
    decision: EquationErrorDecision


def identified_by_equations(
    errors: InstrumentErrors,
    problem: IdentificationProblem,
    settings: LoopSettings,
    a_priori: Mapping[Entry, tuple[float, float]],
) -> EquationErrorResult:
    """The undeclared effects by the coefficient equations, with the identified instrument errors applied.

    Parameters
    ----------
    a_priori : mapping of Entry to (float, float)
        Value and standard deviation of the derivatives that the aircraft file gives one.

    Raises
    ------
    EstimationError
        Where neither the declared nor the completed model can be simulated.
    """
    coefficients, further = problem.aircraft.coefficients, problem.reconstructed_hold_out
    decision = replicated(lambda: decide(errors, coefficients, declared=a_priori, further=further))
    found = attribute_by_equations(decision, problem.manoeuvres)
    search = StructureSearch(
        problem.manoeuvres,
        problem.hypotheses(settings.catalogue),
        coefficients,
        found.before,
        settings.attribution,
        problem.declared,
    )
    hidden = errors.least_noise_ratio > RESIDUAL_TESTS.coloured_ratio
    suspected = not decision.turbulence and may_be_turbulent(decision.completed)
    calm = decision.gust_fraction <= settings.equation_error.calm and not decision.turbulence
    dependence = _dependence(decision) if hidden or suspected else None
    still = hidden and not (decision.turbulence or suspected)
    unsized = _unsized_turbulence(decision, found, settings.equation_error.deviations)

    def finished(found: Attribution) -> Attribution:
        found = with_turbulence_innovations(found, search)
        found = with_equivalent_causes(found, problem.aircraft, problem.manoeuvres)
        found = with_declared_inertia(found, problem.aircraft, settings.attribution.inertia)
        sized = tuple(each for each in found.findings if each.kind not in {air.kind for air in unsized})
        return replace(found, findings=sized, noise_hidden=hidden, dependence=dependence, still_air=still)

    chosen = output_error_in_calm_air(found, decision, search, noise_hidden=hidden) if calm else found
    if suspected and differ(chosen, found, settings.equation_error.deviations):
        calm, chosen = False, found  # gusts bias output error, and leave the regression what it is
    result = finished(chosen)
    if calm and hidden and problem.others:
        result = replace(result, by_regression=finished(found))
    notes = (*_notes(decision, problem), *map(note_on_unsized_turbulence, unsized))
    if hidden or dependence is not None:
        notes = (*notes, note_on_residuals(result))
    return EquationErrorResult(result, search, notes, decision)


def _unsized_turbulence(decision: EquationErrorDecision, found: Attribution, deviations: float) -> list[Turbulence]:
    """The turbulence among the findings, not that of the aircraft file, whose size is not so many errors from none."""
    kinds = {finding.kind for finding in found.findings}
    return [each for each in decision.turbulence if each.kind in kinds and not each.has_known_size(deviations)]


def _notes(decision: EquationErrorDecision, problem: IdentificationProblem) -> tuple[str, ...]:
    """What the decision saw beside its findings."""
    together, vane = decision.joint_evidence, decision.vane
    notes = [
        *notes_on_bridged_holes((*problem.manoeuvres, *problem.others)),
        *(note_on_delay(each) for each in decision.delay_discrepancies),
        *(
            note_on_vane(vane, row)
            for row in decision.findings
            if vane is not None and row.hypothesis is vane.effect.hypothesis
        ),
        *(
            note_on_supported_error(row, together[row.hypothesis.label])
            for row in decision.findings
            if row.hypothesis.label in together and not together[row.hypothesis.label].is_uninformative
        ),
        *(note_on_near_significant(row) for row in decision.near_significant),
        *notes_on_calibration(decision.uncertain_scales, decision.completed),
        *notes_on_rotary_gusts(decision.completed.problem.rotary_gusts),
        *(note_on_regressor_errors(row) for row in decision.regressor_errors),
        note_on_damping(decision.damping) if decision.damping is not None else "",
    ]
    return tuple(note for note in notes if note)


def _dependence(decision: EquationErrorDecision) -> tuple[ControlDependence, ...] | None:
    """The test of the completed structure's residuals against the controls; None where that is not possible."""
    acting = decision.with_instruments_held(decision.completed.point.effects)
    return dependence_on_records(decision.completed, acting, decision.level_shifts)
