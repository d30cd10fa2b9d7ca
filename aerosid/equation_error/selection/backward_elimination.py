"""Backward elimination by corrected t-ratios, moderated tests over blocks and prediction of validation records."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

from aerosid.compiled.cores import mapped
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.flow_separation import is_breakdown
from aerosid.effects.refutation import Refutation
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.regression.design import uses_no_instruments
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.moderated_test import moderated_p_value
from aerosid.equation_error.regression.related_problems import as_compared, weights_restricted_to
from aerosid.equation_error.selection.airspeed_bias import is_shown_by_both
from aerosid.equation_error.selection.block_cross_validation import block_residuals, blocks_of
from aerosid.equation_error.selection.candidates import distinct_name
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.cross_validation import (
    PredictionResiduals,
    StepColumns,
    fits_of,
    is_unconfirmed,
    lowers_fit,
    predicts_worse,
    unexplained_rise,
    validation_residuals,
)
from aerosid.equation_error.selection.kinematic_evidence import affects_all_coefficients
from aerosid.equation_error.selection.level_shifts import (
    further_level_shifts,
    shift_columns,
)
from aerosid.equation_error.selection.penalties import Label, effects_of
from aerosid.equation_error.selection.replication import is_needed, replicated_effects
from aerosid.equation_error.selection.starting_values import MAINLY
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    deletions,
    estimate_without,
    optimum_without_all,
    structure_without,
)
from aerosid.equation_error.selection.wald_tests import distances_from_null, least_significant


def eliminate_insignificant(
    search: CoefficientSearch, selected: SelectedStructure
) -> tuple[SelectedStructure, dict[Label, Refutation]]:
    """Backward elimination of a structure: the retained structure, and the refuted labels with their grounds.

    An effect is retained while it is significant on the identification records and does not worsen the prediction of
    the validation records.
    """
    refuted: dict[Label, Refutation] = {}
    while True:
        fitted = on_identification_records(search, selected)
        replicated = functools.partial(replicated_effects, selected=selected, fitted=fitted)
        judged = _judged_by_coefficients(search, selected)
        removed = (
            _separation_at_a_limit(selected)
            or least_significant(fitted.estimate, judged, replicated)
            or _insignificant_by_blocks(search, selected, fitted)
        )
        if removed is None:
            removed, grounds = _refuted(search, selected, fitted), Refutation.PREDICTION
            if removed is None:
                removed, grounds = _lowering_its_fit(fitted), Refutation.OWN_FIT
            if removed is None:
                return selected, refuted
            refuted.setdefault(removed.hypothesis.label, grounds)
        selected = structure_without(selected, removed)


def _separation_at_a_limit(selected: SelectedStructure) -> SelectedEffect | None:
    """Flow separation that other effects, found later, have moved to a limit of its parameters.

    On a parabola of the Citation, alpha up to .16 rad, it ended at its upper limit of .36 rad, where it has no standard
    error, with a curve so flat that it stood for the drag polar.
    """
    separations = [each for each in selected.chosen if each.hypothesis.kind == "flow_separation"]
    for each in separations:
        if not all(map(is_breakdown, effects_of(selected.estimate.point, each.hypothesis))):
            return each
    return None


def _judged_by_coefficients(search: CoefficientSearch, selected: SelectedStructure) -> Sequence[SelectedEffect]:
    """The effects of a structure that the coefficients of the identification records must show by themselves.

    A bias of the airspeed is shown by the kinematics too, and by all records.
    """
    if not is_shown_by_both(selected, search.criterion):
        return selected.chosen
    return [each for each in selected.chosen if not affects_all_coefficients(each.hypothesis)]


def on_identification_records(search: CoefficientSearch, selected: SelectedStructure) -> SelectedStructure:
    """The structure re-estimated from the identification records alone."""
    point = selected.estimate.point
    weights = weights_restricted_to(selected.estimate, search.fitted, point)
    return SelectedStructure(estimate(search.fitted, point, weights, steps=4), selected.chosen)


def _insignificant_by_blocks(
    search: CoefficientSearch, selected: SelectedStructure, fitted: SelectedStructure
) -> SelectedEffect | None:
    """The effect of highest p-value by the moderated test over blocks, if above its share of the false-alarm rate.

    Step changes are excluded: they are single events by nature and were searched for at every instant. So are
    instrument errors with kinematic evidence, and effects that a validation record requires by itself.
    """
    found, worst = selected.estimate, None
    # Verified on longitudinal flights; with sideslip the penalty already lowers the false-alarm rate to a third.
    if not uses_no_instruments(found.design) or "v" in found.point.model.axes.integrated:
        return None
    for each in selected.chosen:
        hypothesis = each.hypothesis
        if (
            any(is_step_change(active) for active in hypothesis.effects)
            or distinct_name(hypothesis) in search.criterion.evidence
        ):
            continue
        p_value = min(
            (
                moderated_p_value(found.design, found.solution, index, distance)
                for index, distance in distances_from_null(found, hypothesis)
            ),
            default=0.0,
        )
        excess = p_value / search.criterion.allowed_false_alarm(hypothesis)
        if excess > 1.0 and (worst is None or excess > worst[0]) and not is_needed(selected, fitted, each):
            worst = excess, each
    return worst[1] if worst is not None else None


def _refuted(
    search: CoefficientSearch, selected: SelectedStructure, fitted: SelectedStructure
) -> SelectedEffect | None:
    """The effect of least gain without which a validation coefficient, or a left-out block, is predicted better."""
    if not selected.chosen:
        return None
    completed = fitted.estimate
    settings = completed.problem.settings
    predicted, threshold = _predictor(selected, completed)
    steps = shift_columns(selected.estimate)
    after = predicted(completed, steps)
    further = functools.cache(lambda: further_level_shifts(selected.estimate, search.coefficients, search.criterion))

    def is_refuted_by_prediction(each: SelectedEffect) -> bool:
        reduced = estimate_without(fitted, each)
        before = predicted(reduced, steps)
        if predicts_worse(before, after, threshold, settings.least_rise):
            # A step change in the validation record alone must not refute another effect.
            all_shifts = shift_columns(selected.estimate, further())
            predictions = predicted(reduced, all_shifts), predicted(completed, all_shifts)
            if not further() or predicts_worse(*predictions, threshold, settings.least_rise):
                return True
        sideways = [coefficient for coefficient, _ in each.hypothesis.entries if not is_symmetric(coefficient)]
        return any(is_unconfirmed(before, after, coefficient) for coefficient in sideways)

    tested = sorted(selected.chosen, key=lambda each: each.gain)
    results = mapped(is_refuted_by_prediction, tested, until=lambda result: result)
    return tested[len(results) - 1] if results[-1] else None


def _lowering_its_fit(fitted: SelectedStructure) -> SelectedEffect | None:
    """The term of least gain among those without which, each or all, their coefficient is fitted better.

    The residuals that decide are whitened: terms that fit these and not the coefficient itself stand for a drift.
    """
    by_coefficient: dict[str, list[SelectedEffect]] = {}
    for each in sorted(fitted.chosen, key=lambda each: each.gain):
        for coefficient, _ in each.hypothesis.entries:
            by_coefficient.setdefault(MAINLY[coefficient], []).append(each)
    if not by_coefficient:
        return None
    found = fitted.estimate
    compared, least = as_compared(found.problem), found.problem.settings.least_rise
    fits = fits_of(compared, found)

    def lowers(row: tuple[str, list[SelectedEffect]]) -> bool:
        coefficient, terms = row
        (reduced,) = deletions(fitted, terms) if len(terms) == 1 else [optimum_without_all(fitted, terms)]
        return lowers_fit(fits_of(compared, reduced.without_columns), fits, coefficient, least)

    tested = [
        (coefficient, removed)
        for coefficient, terms in by_coefficient.items()
        for removed in (*([each] for each in terms), *([terms] if len(terms) > 1 else []))
    ]
    results = mapped(lowers, tested, until=lambda result: result)
    return tested[len(results) - 1][1][0] if results[-1] else None


def _predictor(
    selected: SelectedStructure, completed: Estimate
) -> tuple[Callable[[Estimate, StepColumns], PredictionResiduals], float]:
    """Prediction residuals of validation records, or of left-out blocks if there are none, as function of an estimate.

    Also returned is the threshold, in standard deviations of the mean square, for a rise to count.
    """
    settings, whole = completed.problem.settings, selected.estimate.problem
    if all(recording.fitted for recording in whole.recordings):
        blocks = blocks_of(completed)
        threshold = settings.doubt if len(whole.recordings) > 1 else settings.block_doubt
        return lambda found, _steps: block_residuals(found, blocks), threshold
    return lambda found, steps: validation_residuals(whole, found, steps), settings.doubt


def improves_prediction(selected: SelectedStructure, fitted: SelectedStructure) -> dict[tuple[str, str, str], bool]:
    """Whether each effect improves the prediction of all validation coefficients together, by label.

    `fitted`: the structure on the identification records. Empty without validation records or blocks.
    """
    predicted, _ = _predictor(selected, fitted.estimate)
    steps = shift_columns(selected.estimate)
    after = predicted(fitted.estimate, steps)
    tested = selected.chosen if after else ()
    better = mapped(
        lambda each: unexplained_rise(predicted(estimate_without(fitted, each), steps), after) < 0.0, tested
    )
    return {each.hypothesis.label: result for each, result in zip(tested, better, strict=True)}
