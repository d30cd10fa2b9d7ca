"""Output-error estimate, in calm air, of the structure that the kinematic and coefficient equations show.

Regressions take what is measured for the motion itself and lose a little by it; where no gust moves the aircraft the
simulated motion is the better regressor (Klein & Morelli, Aircraft System Identification, section 6.4: equation error
for the structure, output error for the numbers). Scales and timings that kinematics measure keep those numbers, which
no error of the aerodynamic model moves, and so do zeros that the simulated motion does not determine; where a sensor
sits the forces know better than kinematics, which see distances alone. Each record has constants of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from aerosid.compiled.cores import begun
from aerosid.effects import KINDS, ActiveEffect, OutputEffect, frozen
from aerosid.effects.record_constant import record_constant
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.regression.standard_errors import corrected_covariance
from aerosid.estimation.deviations import Deviations, deviations
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.estimation.sent_fit import SentFit
from aerosid.flight_model.aerodynamics import CONSTANT
from aerosid.search.attribution import Attribution
from aerosid.search.equation_error_attribution import with_initial_states
from aerosid.search.final_significance import distance_from_none
from aerosid.search.findings import Finding, Part
from aerosid.search.structure_search import StructureSearch

Measured = Mapping[ActiveEffect, NDArray[np.float64]]
"""Effects whose numbers an estimate keeps, with the deviations (K,) of those numbers."""


def estimated_in_calm_air(found: Attribution, decision: EquationErrorDecision, search: StructureSearch) -> Attribution:
    """The attribution with the numbers of a simulated flight in place of the regression's.

    Raises
    ------
    EstimationError
        Where it cannot be simulated over the whole record.
    """
    plain = _with_record_constants(found.before, found.before.effects, {}, search.manoeuvres)
    declared_fit = begun(partial(_sent, plain, search.manoeuvres))
    seen = _measured(decision)
    measured = {active: errors for active, errors in seen.items() if not KINDS[active.effect.kind].is_zero}
    own = {active.name: active for active in seen}
    effects = tuple(own.get(active.name, active) for active in decision.completed.point.effects)
    start, completed, uncertainty = found.completed, found.completed, found.completed_deviations
    while True:
        completed, uncertainty = _estimated(start, effects, measured, search.manoeuvres)
        parts = search.parts(completed, uncertainty)
        weak = [part for part in parts if distance_from_none(part) < search.settings.final_deviations]
        if not weak:
            break
        gone = min(weak, key=distance_from_none)
        zero = own.get(gone.label[:2])
        if zero is not None and zero not in measured:
            measured |= {zero: seen[zero]}
            continue
        effects = without_moved(effects, completed.effects, gone)
        start = search.struck_out(replace(completed, effects=effects), [gone])
    before, _ = _as_told(plain, declared_fit(), found.before.effects, {}, search.manoeuvres)
    by_label = {part.label: part for part in parts}
    findings = [row for row in found.findings if (row.kind, row.where, row.term) in by_label]
    return replace(
        found,
        before=before,
        completed=completed,
        completed_deviations=uncertainty,
        findings=tuple(_with_numbers(row, by_label[row.kind, row.where, row.term], decision) for row in findings),
        fallen=tuple(row for row in found.findings if row not in findings),
        regressed=False,
        again=partial(_estimated_again, measured=measured, manoeuvres=search.manoeuvres),
    )


def without_moved(
    effects: Sequence[ActiveEffect], estimated: Sequence[ActiveEffect], gone: Part
) -> tuple[ActiveEffect, ...]:
    """The effects that an estimate began from, without the one that became a part; its numbers and moment have moved.

    `estimated`: in the same order, constants of single records after them.
    """
    return tuple(active for active, moved in zip(effects, estimated, strict=False) if moved != gone.active)


def _estimated_again(start: Refinement, *, measured: Measured, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
    """The estimate of a structure that an earlier one gave, the constants of its records free again."""
    effects = [active for active in start.effects if active.effect.kind in KINDS]
    return _estimated(start, effects, measured, manoeuvres)[0]


def _measured(decision: EquationErrorDecision) -> Measured:
    """The numbers that kinematics measure, from the identification recordings alone."""
    design = decision.kinematic_estimate.design
    deviation = np.sqrt(np.diag(corrected_covariance(design, decision.kinematic_estimate.solution)))
    return {
        active: deviation[[design.unknowns.index(("effect", i, k)) for k in range(len(active.values))]]
        for i, active in enumerate(decision.kinematic_estimate.point.effects)
        if isinstance(active.effect, OutputEffect) and active.values
    }


def _estimated(
    start: Refinement, effects: Sequence[ActiveEffect], measured: Measured, manoeuvres: Sequence[Manoeuvre]
) -> tuple[Refinement, Deviations]:
    """The likeliest numbers beside those that were measured, constants of each record among them.

    The constants of single records, and what was measured, are no longer free in the result; its deviations hold those
    of the measured ones.
    """
    wider = _with_record_constants(start, effects, measured, manoeuvres)
    return _as_told(wider, _sent(wider, manoeuvres), effects, measured, manoeuvres)


def _with_record_constants(
    start: Refinement, effects: Sequence[ActiveEffect], measured: Measured, manoeuvres: Sequence[Manoeuvre]
) -> Refinement:
    """Where an estimate begins: what was measured held, the constants of each record but the first free."""
    own = [
        ActiveEffect(record_constant(coefficient), (0.0,), manoeuvre.name)
        for manoeuvre in manoeuvres[1:]
        for coefficient, term in start.model.entries
        if term == CONSTANT
    ]
    acting = [frozen(active) if active in measured else active for active in effects]
    return replace(start, model=with_columns_of(start.model, own), effects=(*acting, *own))


def _sent(wider: Refinement, manoeuvres: Sequence[Manoeuvre]) -> tuple[SentFit, Deviations]:
    """The likeliest numbers with their deviations, as they go from core to core."""
    found = refine_on(wider, manoeuvres)
    return SentFit.of(found), deviations(found, manoeuvres)


def _as_told(
    wider: Refinement,
    fit: tuple[SentFit, Deviations],
    effects: Sequence[ActiveEffect],
    measured: Measured,
    manoeuvres: Sequence[Manoeuvre],
) -> tuple[Refinement, Deviations]:
    """An estimate that began at `wider` with the constants of single records and what was measured held."""
    sent, uncertainty = fit
    found = sent.refinement(wider.model, wider.free, wider.effects)
    told: list[ActiveEffect] = []
    corrected: list[NDArray[np.float64]] = []
    white: list[NDArray[np.float64]] = []
    first = 0
    for i, active in enumerate(found.effects):
        here = slice(first, first + active.slopes)
        first += active.slopes
        if i >= len(effects):
            told.append(frozen(active))
        elif effects[i] in measured:
            told.append(effects[i])
            corrected.append(measured[effects[i]])
            white.append(measured[effects[i]])
        else:
            told.append(active)
            corrected.append(uncertainty.effects[here])
            white.append(uncertainty.effects_white[here])
    uncertainty = replace(
        uncertainty,
        effects=np.concatenate([np.zeros(0), *corrected]),
        effects_white=np.concatenate([np.zeros(0), *white]),
    )
    return with_initial_states(found.model, found.free, told, manoeuvres), uncertainty


def _with_numbers(row: Finding, part: Part, decision: EquationErrorDecision) -> Finding:
    """A finding with the numbers of the part that it became."""
    return replace(
        row,
        value=part.value,
        std_error=part.std_error,
        parameters=part.parameters,
        p_value=float(min(1.0, 2.0 * ndtr(-part.ratio) * decision.hypothesis_count)),
    )
