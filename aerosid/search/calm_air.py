"""Output-error estimate, in calm air, of the structure that the kinematic and coefficient equations show.

Regressions use the measured motion as regressors, whose noise biases the estimate a little; where no gust moves the
aircraft the simulated motion is the better regressor (Klein & Morelli, Aircraft System Identification, section 6.4:
equation error for the structure, output error for the parameters). Scale factors and time delays that kinematics
measure keep those values, which no error of the aerodynamic model affects, and so do biases that the simulated motion
does not determine; sensor positions are estimated better from the forces than from kinematics, which show distances
alone, and so is the time delay of the lateral accelerometer. Each record has constants of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from aerosid.compiled.cores import begun
from aerosid.effects import KINDS, ActiveEffect, OutputEffect, PositionEffect, frozen
from aerosid.effects.kinds import axes_of
from aerosid.effects.record_constant import record_constant
from aerosid.effects.sensor_position import sensor_place, sensor_position
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.equations.channels import MEASURED_BY
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.equation_error.selection.joint_errors import DELAY_KINDS, SIDE_FORCE
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.transferred_fit import TransferredFit
from aerosid.flight_model.aerodynamics import CONSTANT
from aerosid.search.attribution import Attribution
from aerosid.search.equation_error_attribution import with_initial_states
from aerosid.search.final_significance import wald_ratio
from aerosid.search.findings import Finding, Part
from aerosid.search.structure_search import StructureSearch

Measured = Mapping[ActiveEffect, NDArray[np.float64]]
"""Effects whose values an estimate holds fixed, with the standard deviations (K,) of those values."""


def output_error_in_calm_air(
    found: Attribution, decision: EquationErrorDecision, search: StructureSearch, *, noise_hidden: bool = False
) -> Attribution:
    """The attribution with output-error estimates in place of the regression's.

    Parameters
    ----------
    noise_hidden : bool
        Whether a recorder filters or colours all channels. What the model lacks, which a simulation integrates, is then
        no longer small beside the noise: the standard errors contain it.

    Raises
    ------
    EstimationError
        Where it cannot be simulated over the whole record.
    """
    plain = _with_record_constants(found.before, found.before.effects, {}, search.manoeuvres)
    declared_fit = begun(lambda: TransferredFit.of(refine_on(plain, search.manoeuvres)))
    measured_by_kinematics = _measured(decision)
    measured = {
        active: errors for active, errors in measured_by_kinematics.items() if not KINDS[active.effect.kind].is_bias
    }
    by_name = {active.name: active for active in measured_by_kinematics}
    effects = tuple(by_name.get(active.name, active) for active in decision.completed.point.effects)
    regression = found if noise_hidden else None
    start, failed = found.completed, dict[tuple[object, ...], Part]()
    while True:
        completed, uncertainty = _estimated(start, effects, measured, search.manoeuvres, regression)
        parts = search.parts(completed, uncertainty)
        weak = [part for part in parts if wald_ratio(part) < search.settings.final_deviations]
        if not weak:
            fewer = along_fewer_axes(effects, completed.effects, parts, search.settings.final_deviations)
            if fewer is None:
                break
            effects, start = fewer, completed
            continue
        eliminated = min(weak, key=wald_ratio)
        zero = by_name.get(eliminated.label[:2])
        if zero is not None and zero not in measured:
            measured |= {zero: measured_by_kinematics[zero]}
            continue
        failed[_key(eliminated)] = eliminated
        effects = without_eliminated(effects, completed.effects, eliminated)
        start = search.reduced_structure(replace(completed, effects=effects), [eliminated])
    before = declared_fit().refinement(plain.model, plain.free, plain.effects)
    before = _with_measured_values_held(before, found.before.effects, {}, search.manoeuvres)
    by_key = {_key(part): part for part in parts}
    rows = {(row.kind, row.where, row.term, row.log, row.ordinal): row for row in found.findings}
    return replace(
        found,
        before=before,
        completed=completed,
        completed_deviations=uncertainty,
        findings=tuple(_with_numbers(row, by_key[key], decision) for key, row in rows.items() if key in by_key),
        eliminated=tuple(_with_numbers(row, failed[key], decision) for key, row in rows.items() if key in failed),
        regressed=False,
        re_estimator=partial(_re_estimated, measured=measured, manoeuvres=search.manoeuvres),
        deviations_of=partial(_deviations, measured=measured, manoeuvres=search.manoeuvres, regression=regression),
    )


def along_fewer_axes(
    effects: Sequence[ActiveEffect], estimated: Sequence[ActiveEffect], parts: Sequence[Part], least: float
) -> tuple[ActiveEffect, ...] | None:
    """The effects with a sensor's position along the axes alone that are shown.

    A position is significant where one of its axes is; another, within `least` standard errors, is none to be named.
    `estimated`: as of `without_eliminated`. None where every axis is shown.
    """
    for part in parts:
        if part.active is None or not isinstance(part.active.effect, PositionEffect) or len(part.active.values) < 2:
            continue
        ratios = [abs(value) / error if error > 0.0 else np.inf for _, value, error, _ in part.parameters]
        shown = [n for n, ratio in enumerate(ratios) if ratio >= least]
        if len(shown) < len(ratios):
            where, axes = part.active.effect.where, "".join(part.active.effect.axes[n] for n in shown)
            effect = sensor_position(where, axes) if len(shown) == 1 else sensor_place(where, axes)
            fewer = replace(part.active, effect=effect, values=tuple(part.active.values[n] for n in shown))
            pairs = zip(effects, estimated, strict=False)
            return tuple(fewer if moved == part.active else active for active, moved in pairs)
    return None


def differ(one: Attribution, other: Attribution, deviations: float) -> bool:
    """Whether any derivative of two estimates differs by more than a number of the standard errors of both."""
    errors = [
        dict(zip(each.completed.free, each.completed_deviations.published.tolist(), strict=True))
        for each in (one, other)
    ]
    return any(
        abs(one.completed.model.value(entry) - other.completed.model.value(entry))
        > deviations * float(np.hypot(errors[0][entry], errors[1][entry]))
        for entry in errors[0]
        if entry[1] != CONSTANT and entry in errors[1]
    )


def _key(part: Part) -> tuple[object, ...]:
    return (*part.label, part.log, part.ordinal)


def _with_model_error(uncertainty: Deviations, estimated: Refinement, found: Attribution) -> Deviations:
    """Standard deviations that contain what the model lacks, as the residuals of the coefficient equations show it.

    A simulation's residuals are those of the sensors and of unmodelled forces that it integrates, slow beside a short
    record. To the variances from the simulation come the regression's at given numbers of the effects, whose residuals
    are these forces themselves; of the effects' numbers the larger deviation is taken.
    """
    beside = found.completed_deviations.beside_effects
    if beside is None:
        return uncertainty
    of_forces = dict(zip(found.completed.free, np.sqrt(np.diag(beside)), strict=True))
    forces = np.array([of_forces.get(entry, 0.0) for entry in estimated.free])
    rows = {(row.kind, row.where, row.log, row.ordinal): row for row in found.findings if row.entry is None}
    effects = uncertainty.effects.copy()
    place = 0
    for active in estimated.effects:
        row = rows.get((*active.name, active.log, active.ordinal))
        own = effects[place : place + active.slopes]
        if row is not None and own.size:
            errors = [error for _, _, error, _ in row.parameters] or [row.std_error]
            if isinstance(active.effect, PositionEffect):  # it may have fewer axes than in the regression
                errors = [errors[row.along.index(axis)] for axis in active.effect.axes]
            own[0] = np.fmax(own[0], errors[0])
            if len(errors) == own.size:  # not of a step, whose instant the regression takes as given
                own[:] = np.fmax(own, errors)
        place += active.slopes
    return replace(uncertainty.no_smaller_than(np.hypot(uncertainty.corrected, forces)), effects=effects)


def without_eliminated(
    effects: Sequence[ActiveEffect], estimated: Sequence[ActiveEffect], eliminated: Part
) -> tuple[ActiveEffect, ...]:
    """The effects that an estimate started from, without the eliminated one, whose values and instant have changed.

    `estimated`: in the same order, followed by the constants of single records.
    """
    return tuple(active for active, moved in zip(effects, estimated, strict=False) if moved != eliminated.active)


def _re_estimated(start: Refinement, *, measured: Measured, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
    """The estimate of a reduced structure, the constants of its records free again."""
    effects = _of_aircraft(start)
    fit = refine_on(_with_record_constants(start, effects, measured, manoeuvres), manoeuvres)
    return _with_measured_values_held(fit, effects, measured, manoeuvres)


def _deviations(
    found: Refinement, *, measured: Measured, manoeuvres: Sequence[Manoeuvre], regression: Attribution | None
) -> Deviations:
    """Standard deviations of such an estimate, estimated again with the constants of its records free."""
    return _estimated(found, _of_aircraft(found), measured, manoeuvres, regression)[1]


def _of_aircraft(found: Refinement) -> list[ActiveEffect]:
    """The effects without the constants of single records."""
    return [active for active in found.effects if active.effect.kind in KINDS]


def _measured(decision: EquationErrorDecision) -> Measured:
    """The values that kinematics measure, from the identification records alone."""
    design = decision.kinematic_estimate.design
    deviation = np.sqrt(np.diag(corrected_covariance(design, decision.kinematic_estimate.solution)))
    return {
        active: deviation[[design.unknowns.index(("effect", i, k)) for k in range(len(active.values))]]
        for i, active in enumerate(decision.kinematic_estimate.point.effects)
        if isinstance(active.effect, OutputEffect) and active.values and not _is_shown_by_forces(active)
    }


def _is_shown_by_forces(active: ActiveEffect) -> bool:
    """Whether an error is a time delay of the lateral accelerometer: a path integrated from it shows little of it."""
    return active.effect.where == MEASURED_BY[SIDE_FORCE] and active.effect.kind in DELAY_KINDS


def _estimated(
    start: Refinement,
    effects: Sequence[ActiveEffect],
    measured: Measured,
    manoeuvres: Sequence[Manoeuvre],
    regression: Attribution | None = None,
) -> tuple[Refinement, Deviations]:
    """Maximum-likelihood estimate with measured values held and constants of each record free.

    In the result neither the constants of single records nor the measured values are free; its standard deviations
    contain those of the measured values, and, with a `regression`, what that shows of unmodelled forces.
    """
    fit = refine_on(_with_record_constants(start, effects, measured, manoeuvres), manoeuvres)
    uncertainty = _with_deviations_of_measured_values(deviations(fit, manoeuvres), fit, effects, measured)
    found = _with_measured_values_held(fit, effects, measured, manoeuvres)
    return found, uncertainty if regression is None else _with_model_error(uncertainty, found, regression)


def _with_record_constants(
    start: Refinement, effects: Sequence[ActiveEffect], measured: Measured, manoeuvres: Sequence[Manoeuvre]
) -> Refinement:
    """Start of an estimate: measured values held, the constants of each record but the first free."""
    constants = [
        ActiveEffect(record_constant(coefficient), (0.0,), manoeuvre.name)
        for manoeuvre in manoeuvres[1:]
        for coefficient, term in start.model.entries
        if term == CONSTANT
    ]
    acting = [frozen(active) if active in measured else active for active in effects]
    return replace(start, model=with_columns_of(start.model, constants), effects=(*acting, *constants))


def _with_measured_values_held(
    fit: Refinement, effects: Sequence[ActiveEffect], measured: Measured, manoeuvres: Sequence[Manoeuvre]
) -> Refinement:
    """An estimate of these effects and constants of single records, neither the constants nor measured values free."""
    own = [given if given in measured else moved for given, moved in zip(effects, fit.effects, strict=False)]
    constants = [frozen(moved) for moved in fit.effects[len(effects) :]]
    return with_initial_states(fit.model, fit.free, (*own, *constants), manoeuvres)


def _with_deviations_of_measured_values(
    uncertainty: Deviations, fit: Refinement, effects: Sequence[ActiveEffect], measured: Measured
) -> Deviations:
    """The standard deviations of such an estimate, of the effects alone: measured values have those of kinematics."""
    corrected: list[NDArray[np.float64]] = [np.zeros(0)]
    white: list[NDArray[np.float64]] = [np.zeros(0)]
    first = 0
    for given, moved in zip(effects, fit.effects, strict=False):
        here = slice(first, first + moved.slopes)
        first += moved.slopes
        corrected.append(measured[given] if given in measured else uncertainty.effects[here])
        white.append(measured[given] if given in measured else uncertainty.effects_white[here])
    return replace(uncertainty, effects=np.concatenate(corrected), effects_white=np.concatenate(white))


def _with_numbers(row: Finding, part: Part, decision: EquationErrorDecision) -> Finding:
    """A finding with the values of the part that it became."""
    return replace(
        row,
        value=part.value,
        std_error=part.std_error,
        time=part.time,
        parameters=part.parameters if row.time is None else row.parameters,
        p_value=float(min(1.0, 2.0 * ndtr(-part.ratio) * decision.hypothesis_count)),
        along=axes_of(part.active),
    )
