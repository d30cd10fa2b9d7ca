"""Structure selection by equation error: instrument errors from kinematics first, then the aerodynamic coefficients."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.refutation import Refuted
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.joint_selection import ErrorsAndStructure, selected_jointly
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.regression.estimate import (
    Estimate,
    estimate,
)
from aerosid.equation_error.regression.linear_or_smooth_inputs import likelier_input_interpolation
from aerosid.equation_error.regression.related_problems import as_compared, weights_restricted_to
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.airspeed_bias import AirspeedBias
from aerosid.equation_error.selection.airspeed_calibration import uncertain_airspeed
from aerosid.equation_error.selection.alternatives import Alternative, gains_by_deletion
from aerosid.equation_error.selection.backward_elimination import eliminate_insignificant, improves_prediction
from aerosid.equation_error.selection.calibration import uncertain_scales
from aerosid.equation_error.selection.candidates import distinct_name, is_instrument_error
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.competing_alternatives import competing_alternatives
from aerosid.equation_error.selection.cross_validation import CoefficientFit, fits_with_shifts
from aerosid.equation_error.selection.damping_collinearity import (
    DampingCollinearity,
    damping_collinearity,
)
from aerosid.equation_error.selection.instrument_errors import (
    InstrumentErrors,
    on_identification_records,
    with_instrument_errors,
)
from aerosid.equation_error.selection.joint_errors import JointErrors
from aerosid.equation_error.selection.level_shifts import shifts_by_record, shifts_of_further
from aerosid.equation_error.selection.model_averaging import OmittedEffects, averaged_covariance
from aerosid.equation_error.selection.near_significant import (
    NearSignificant,
    near_significant_effects,
    with_validation_fits,
)
from aerosid.equation_error.selection.penalties import KinematicEvidence, Label, Name, effects_of
from aerosid.equation_error.selection.predicted_convergence import converged_as_predicted, estimated_with_fewer_parts
from aerosid.equation_error.selection.regressor_errors import (
    RegressorErrors,
    adopted_values,
    changes_of_fit,
    regressor_errors,
    with_instrumental_values,
    with_regressor_errors,
    with_values,
)
from aerosid.equation_error.selection.replication import replicated_effects
from aerosid.equation_error.selection.structure import SelectedStructure, structure_without
from aerosid.equation_error.selection.time_delays import DelayDiscrepancy, delay_discrepancies
from aerosid.equation_error.selection.turbulence import Turbulence, gust_fraction, turbulence_of
from aerosid.equation_error.selection.vane_position import IdentifiedVane
from aerosid.equation_error.selection.wald_tests import (
    EffectEstimate,
    confirmed_unknowns,
    effect_estimates,
    least_significant_of,
)
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import Entry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EquationErrorDecision:
    """Selected effects, and the estimates of the declared and the completed structure.

    Attributes
    ----------
    findings : tuple of EffectEstimate
        Effects identified by kinematics in order of significance, then the others in order of gain.
    alternatives : tuple of Alternative
        Indistinguishable replacements of the findings.
    before, completed : Estimate
        Declared and completed structure, coefficients regressed on the identification records alone.
    covariance : ndarray, shape (P, P)
        Of the completed estimate's unknowns, corrected for coloured residuals; of declared derivatives it includes the
        contribution of the choice among the alternatives.
    before_covariance : ndarray
        The same of the declared structure.
    turbulence : tuple of Turbulence
        Turbulence estimated from vanes and forces.
    coefficient_fits : tuple of (CoefficientFit, CoefficientFit)
        R^2 before and after, of each coefficient and record.
    gust_fraction : float
        RMS of the sideslip vane's difference from the inertial path over its total RMS, 1; infinite without a vane.
    kinematic_estimate : Estimate
        Instrument errors estimated from the kinematics of the identification records alone.
    hypothesis_count : int
        Number of hypotheses tested.
    refuted : mapping of label to Refutation
        Effects that were selected and refuted, with the grounds.
    damping : DampingCollinearity or None
        Part of an undeclared C_m alpha_dot_hat that the completed C_m q_hat contains.
    delay_discrepancies : tuple of DelayDiscrepancy
        Instruments whose time delay by kinematics alone differs from that by all equations.
    joint_evidence : mapping of label to KinematicEvidence
        Kinematic estimates of the instrument errors identified only by kinematics and coefficients jointly.
    near_significant : tuple of NearSignificant
        Effects that would be significant as single hypotheses: of kinematics, then of coefficients.
    uncertain_scales : tuple of ActiveEffect
        Scale factors of vanes, and scale factor and bias of the airspeed, that the standard errors contain, at their
        posterior root-mean-square size.
    level_shifts : mapping of str to tuple of ActiveEffect
        Step changes of validation and further records, by the name of each record.
    regressor_errors : tuple of RegressorErrors
        Coefficients whose derivatives errors in the regressors bias.
    vane : IdentifiedVane or None
        A vane whose position or dead time was identified beside its time delay.
    """

    findings: tuple[EffectEstimate, ...]
    alternatives: tuple[Alternative, ...]
    before: Estimate
    completed: Estimate
    covariance: Array
    before_covariance: Array
    turbulence: tuple[Turbulence, ...]
    coefficient_fits: tuple[tuple[CoefficientFit, CoefficientFit], ...]
    gust_fraction: float
    kinematic_estimate: Estimate
    hypothesis_count: int
    refuted: Refuted
    damping: DampingCollinearity | None = None
    delay_discrepancies: tuple[DelayDiscrepancy, ...] = ()
    joint_evidence: Mapping[Label, KinematicEvidence] = field(default_factory=dict)
    near_significant: tuple[NearSignificant, ...] = ()
    uncertain_scales: tuple[ActiveEffect, ...] = ()
    level_shifts: Mapping[str, tuple[ActiveEffect, ...]] = field(default_factory=dict)
    regressor_errors: tuple[RegressorErrors, ...] = ()
    vane: IdentifiedVane | None = None

    def with_instruments_held(self, effects: Iterable[ActiveEffect]) -> tuple[ActiveEffect, ...]:
        """Some effects of the completed structure, those that kinematics identified held at their values."""
        identified = self.completed.point.effects[: len(self.kinematic_estimate.point.effects)]
        return tuple(frozen(active) if any(active is each for each in identified) else active for active in effects)


def decide(
    errors: InstrumentErrors,
    coefficients: Sequence[str],
    declared: Mapping[Entry, tuple[float, float]] = MappingProxyType({}),
    further: Sequence[Manoeuvre] = (),
) -> EquationErrorDecision:
    """Select the undeclared effects by the coefficient equations, given the instrument errors identified by kinematics.

    Parameters
    ----------
    errors : InstrumentErrors
    coefficients : sequence of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    declared : mapping of Entry to (float, float)
        A-priori value and standard deviation of derivatives: evidence in the choice between structures.
    further : sequence of Manoeuvre
        Flights that take no part in the selection; their step changes are looked for with the selected structure.
    """
    start, hypotheses = errors.start, errors.hypotheses
    settings = errors.selected.estimate.problem.settings
    values = DeclaredValues(declared, settings.declared_tail, settings.declared_misjudged)
    joint = selected_jointly(errors, errors.selected, tuple(coefficients), values)
    identified, of_both, search, outcome, vane, compared, bias = joint
    fitted, evidence = search.fitted, search.criterion.evidence
    accepted, refuted = _accepted_structure(identified, search, outcome)
    structure, on_fitted, regressed, completed, covariance, biased = accepted
    fitted_estimate, chosen = on_fitted.estimate, (*joint.instrument_errors, *structure.chosen)
    jointly = [each.hypothesis for each in structure.chosen if distinct_name(each.hypothesis) in evidence]
    of_errors, of_structure = (
        competing_alternatives(identified, [h for h in hypotheses if is_instrument_error(h)]),
        competing_alternatives(structure, search.hypotheses_except(refuted)),
    )
    gains = {each.hypothesis.label: each.gain for each in joint.instrument_errors}
    gains |= {**gains_by_deletion(identified), **_gains_with_evidence(structure, jointly, evidence)}
    findings = effect_estimates(completed, covariance, chosen, gains, improves_prediction(structure, on_fitted))
    of_both = tuple(replace(row, gain=gains[row.replaces.label] - row.deficit) for row in of_both)
    # Effects that were selected, by either or both kinds of equations, or refuted by a validation record are none.
    excluded = {*refuted, *gains, *(row.hypothesis.label for row in of_both), *compared}
    alternatives = (*of_both, *(row for row in of_errors if row.hypothesis.label not in excluded), *of_structure)
    before = _declared_alike(start, fitted_estimate, biased)
    level_shifts = _level_shifts(structure, fitted_estimate, search, further)
    fits = functools.partial(fits_with_shifts, as_compared(fitted_estimate.problem), level_shifts)
    derivatives = [unknown for unknown in before.design.unknowns if unknown[0] in ("term", "one")]
    after = fits(completed)
    kinematic = (errors.selected if vane is None and bias is None else identified).estimate
    listed = {*refuted, *gains, *(row.hypothesis.label for row in alternatives)}
    omitted = _omitted(errors, identified, structure, search, listed)
    averaged = averaged_covariance(regressed, covariance, fitted_estimate, alternatives, derivatives, omitted)
    reported = with_values(fitted_estimate, adopted_values(biased))
    return EquationErrorDecision(
        findings=findings,
        alternatives=alternatives,
        before=before,
        completed=completed,
        covariance=averaged,
        before_covariance=corrected_covariance(before.design, before.solution),
        turbulence=turbulence_of(identified.estimate, fitted_estimate),
        coefficient_fits=tuple(zip(fits(before), after, strict=True)),
        gust_fraction=gust_fraction(identified.estimate, "beta"),
        kinematic_estimate=on_identification_records(identified).estimate,
        hypothesis_count=len(hypotheses),
        refuted=refuted,
        damping=damping_collinearity(reported, averaged),
        delay_discrepancies=delay_discrepancies(kinematic, outcome.errors, settings.deviations),
        joint_evidence=_joint_evidence(jointly, evidence, bias),
        near_significant=tuple(with_validation_fits(row, after, fitted, fits) for row in omitted.near_significant),
        uncertain_scales=omitted.scales,
        level_shifts=level_shifts,
        regressor_errors=biased,
        vane=vane,
    )


def _level_shifts(
    structure: SelectedStructure, fitted: Estimate, search: CoefficientSearch, further: Sequence[Manoeuvre]
) -> dict[str, tuple[ActiveEffect, ...]]:
    """Step changes of validation and further records, by the name of each record."""
    of_further = shifts_of_further(fitted, further, search.coefficients, search.criterion)
    return {**shifts_by_record(structure.estimate), **of_further}


def _declared_alike(start: Point, completed: Estimate, biased: Sequence[RegressorErrors]) -> Estimate:
    """The declared structure's estimate, its coefficients by the method by which those of the completed one are.

    By least squares where that predicts a record better: a deficient structure is given its better estimate.
    """
    found = estimated_with_fewer_parts(replace(completed.problem, of_recorded_motion=False), start, completed)
    for row in (row for row in biased if row.adopted):
        other = with_instrumental_values(found, {row.coefficient})
        if all(change >= 0.0 for _, change in changes_of_fit(found, other, row.coefficient)):
            found = other
    return found


def _joint_evidence(
    jointly: Sequence[Hypothesis], evidence: Mapping[Name, KinematicEvidence], bias: AirspeedBias | None
) -> dict[Label, KinematicEvidence]:
    """What kinematics show of the errors that they show only with the coefficients, an airspeed bias among them."""
    found = {hypothesis.label: evidence[distinct_name(hypothesis)] for hypothesis in jointly}
    return found if bias is None else {**found, bias.hypothesis.label: bias.evidence}


def _gains_with_evidence(
    structure: SelectedStructure, jointly: Sequence[Hypothesis], evidence: Mapping[Name, KinematicEvidence]
) -> dict[Label, float]:
    """Gain in ln L of each effect of the structure, of those identified jointly by both kinds of equations."""
    gains = gains_by_deletion(structure)
    for hypothesis in jointly:
        (active,) = effects_of(structure.estimate.point, hypothesis)
        gains[hypothesis.label] += evidence[distinct_name(hypothesis)].gain_at(active.values)
    return gains


def _omitted(
    errors: InstrumentErrors,
    identified: SelectedStructure,
    structure: SelectedStructure,
    search: CoefficientSearch,
    listed: Collection[Label],
) -> OmittedEffects:
    """What may exist beside the selected structure; `listed`: labels of what was selected, refuted or offered."""
    near_significant = near_significant_effects(errors, identified, structure, search, listed)
    acting = structure.estimate.point.effects
    scales = (
        *uncertain_scales(identified, errors.hypotheses, acting),
        *uncertain_airspeed(identified, errors.hypotheses, acting, structure.estimate),
    )
    return OmittedEffects(near_significant, scales, len(identified.estimate.point.effects))


class _Accepted(NamedTuple):
    """A structure, its fit to the identification records, and estimates and covariance with the instrument errors.

    `regressed` is by least squares, `completed` by instrumental variables where these are adopted. `covariance`
    contains the errors in the regressors of the `biased` coefficients.
    """

    structure: SelectedStructure
    on_fitted: SelectedStructure
    regressed: Estimate
    completed: Estimate
    covariance: Array
    biased: tuple[RegressorErrors, ...]


def _accepted_structure(
    identified: SelectedStructure, search: CoefficientSearch, outcome: ErrorsAndStructure
) -> tuple[_Accepted, Refuted]:
    """The structure without effects that instrument uncertainty could explain, and the labels of the refuted effects.

    An effect eliminated for that reason may have masked another, as a power of alpha does where the bias of alpha is
    uncertain: the remaining hypotheses are tested again, as after every elimination in the search itself.
    """
    settings = search.fitted.settings
    structure, refuted = outcome.structure, outcome.refuted
    eliminated: tuple[Label, ...] = ()
    for _ in range(settings.rounds):
        accepted = _significant(identified, search, outcome.errors, structure)
        removed = structure.labels_not_in(accepted.structure)
        if not removed:
            return accepted, refuted
        eliminated = (*eliminated, *removed)
        grown = search.forward(
            accepted.structure, search.hypotheses_except(refuted), settings.most, excluded=eliminated
        )
        if grown is accepted.structure:
            return accepted, refuted
        structure, refuted_now = eliminate_insignificant(search, grown)
        refuted = refuted | refuted_now
    return _significant(identified, search, outcome.errors, structure), refuted


def _significant(
    identified: SelectedStructure, search: CoefficientSearch, errors: JointErrors, structure: SelectedStructure
) -> _Accepted:
    """The structure after backward elimination by t-ratios that include the uncertainty of the instrument errors."""
    while True:
        point = structure.estimate.point
        weights = weights_restricted_to(structure.estimate, search.fitted, point)
        on_fitted = converged_as_predicted(likelier_input_interpolation(estimate(search.fitted, point, weights)))
        fitted = SelectedStructure(on_fitted, structure.chosen)
        regressed, covariance = _with_covariance(errors, fitted, structure)
        added = {entry for each in structure.chosen for entry in each.hypothesis.entries}
        biased = regressor_errors(fitted.estimate, added)
        covariance = with_regressor_errors(covariance, fitted.estimate, biased)
        completed = with_values(regressed, adopted_values(biased))
        findings = effect_estimates(completed, covariance, (*identified.chosen, *structure.chosen))
        insignificant = least_significant_of(findings, structure.chosen, search.fitted.settings.deviations)
        if insignificant is None:
            return _Accepted(structure, fitted, regressed, completed, covariance, biased)
        structure = structure_without(structure, insignificant)


def _with_covariance(
    errors: JointErrors, on_fitted: SelectedStructure, structure: SelectedStructure
) -> tuple[Estimate, Array]:
    """The estimate with the instrument errors among its unknowns, and the covariance of all.

    An effect shown by a single event of the identification records keeps the standard error by block deletion, unless
    it would be eliminated by that alone and the validation records replicate it.
    """
    completed, covariance = with_instrument_errors(errors, on_fitted.estimate)
    replicated = functools.partial(replicated_effects, selected=structure, fitted=on_fitted)
    confirmed = confirmed_unknowns(completed, covariance, structure.chosen, replicated)
    return with_instrument_errors(errors, on_fitted.estimate, confirmed) if confirmed else (completed, covariance)
