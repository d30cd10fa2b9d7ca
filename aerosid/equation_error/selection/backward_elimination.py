"""What of a structure stands: significant on the fitted recordings, and refused by no unseen one."""

from __future__ import annotations

import functools
from collections.abc import Callable

from aerosid.compiled.cores import mapped
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.sudden import is_sudden
from aerosid.equation_error.regression.design import uses_no_instruments
from aerosid.equation_error.regression.estimate import Estimate, estimate, weights_restricted_to
from aerosid.equation_error.regression.moderated_test import moderated_p_value
from aerosid.equation_error.selection.block_cross_validation import block_residuals, blocks_of
from aerosid.equation_error.selection.candidates import distinct_name
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.cross_validation import (
    PredictionResiduals,
    StepColumns,
    is_unconfirmed,
    predicts_worse,
    unexplained_rise,
    validation_residuals,
)
from aerosid.equation_error.selection.level_shifts import (
    further_level_shifts,
    recurs_on_validation,
    shift_columns,
    shifts_of,
)
from aerosid.equation_error.selection.replication import is_needed, is_replicated
from aerosid.equation_error.selection.structure import (
    SelectedEffect,
    SelectedStructure,
    estimate_without,
    structure_without,
)
from aerosid.equation_error.selection.wald_tests import distances_from_null, least_significant

Labels = tuple[tuple[str, str, str], ...]


def eliminate_insignificant(search: CoefficientSearch, selected: SelectedStructure) -> tuple[SelectedStructure, Labels]:
    """What stays significant on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        fitted = on_identification_records(search, selected)
        replicated = functools.partial(is_replicated, selected, fitted)
        removed = least_significant(fitted.estimate, selected.chosen, replicated) or _insignificant_by_blocks(
            search, selected, fitted
        )
        if removed is None:
            removed = _refuted(search, selected, fitted)
            if removed is None:
                return selected, tuple(refuted)
            refuted.append(removed.hypothesis.label)
        search.log(f"  does not stand: {removed.hypothesis.label}")
        selected = structure_without(selected, removed)


def on_identification_records(search: CoefficientSearch, selected: SelectedStructure) -> SelectedStructure:
    """The structure as the fitted recordings alone show it."""
    point = selected.estimate.point
    weights = weights_restricted_to(selected.estimate, search.fitted, point)
    return SelectedStructure(estimate(search.fitted, point, weights, steps=4), selected.chosen)


def _insignificant_by_blocks(
    search: CoefficientSearch, selected: SelectedStructure, fitted: SelectedStructure
) -> SelectedEffect | None:
    """The chosen one that the noise of the few blocks that show it makes most easily, where it does so too easily.

    What is sudden is one event by its nature, and was looked for at every instant; a fault that kinematics show as well
    has another witness; and what an unseen recording needs by itself is no chance of a few blocks.
    """
    found, worst = selected.estimate, None
    # Shown on longitudinal flights; with sideslip false alarms are a third as likely by their price already.
    if not uses_no_instruments(found.design) or "v" in found.point.model.axes.integrated:
        return None
    for each in selected.chosen:
        hypothesis = each.hypothesis
        if (
            any(is_sudden(active) for active in hypothesis.effects)
            or distinct_name(hypothesis) in search.criterion.evidence
        ):
            continue
        chance = min(
            (
                moderated_p_value(found.design, found.solution, place, away)
                for place, away in distances_from_null(found, hypothesis)
            ),
            default=0.0,
        )
        excess = chance / search.criterion.allowed_false_alarm(hypothesis)
        if excess > 1.0 and (worst is None or excess > worst[0]) and not is_needed(selected, fitted, each):
            worst = excess, each
    return worst[1] if worst is not None else None


def _refuted(
    search: CoefficientSearch, selected: SelectedStructure, fitted: SelectedStructure
) -> SelectedEffect | None:
    """The chosen one of least gain with which an unseen coefficient, or an unseen block, is predicted worse."""
    if not selected.chosen:
        return None
    completed = fitted.estimate
    settings = completed.problem.settings
    predicted, doubt = _predictor(selected, completed)
    known_shifts = shifts_of(selected.estimate)
    steps = shift_columns(selected.estimate)
    after = predicted(completed, steps)
    further = functools.cache(lambda: further_level_shifts(selected.estimate, search.coefficients, search.criterion))

    def is_refuted_by_prediction(each: SelectedEffect) -> bool:
        reduced = estimate_without(fitted, each)
        before = predicted(reduced, steps)
        if predicts_worse(before, after, doubt, settings.least_rise):
            if recurs_on_validation(
                (*known_shifts, *(found.point.effects[-1] for found in further())), each.hypothesis
            ):
                return False
            # An unseen recording in which something happens suddenly refuses nothing by that.
            all_shifts = shift_columns(selected.estimate, further())
            predictions = predicted(reduced, all_shifts), predicted(completed, all_shifts)
            if not further() or predicts_worse(*predictions, doubt, settings.least_rise):
                return True
        sideways = [coefficient for coefficient, _ in each.hypothesis.entries if not is_symmetric(coefficient)]
        return any(is_unconfirmed(before, after, coefficient) for coefficient in sideways)

    tested = sorted(selected.chosen, key=lambda each: each.gain)
    answers = mapped(is_refuted_by_prediction, tested, until=lambda answer: answer)
    return tested[len(answers) - 1] if answers[-1] else None


def _predictor(
    selected: SelectedStructure, completed: Estimate
) -> tuple[Callable[[Estimate, StepColumns], PredictionResiduals], float]:
    """What an estimate leaves of unseen recordings, or of blocks of the fitted ones where all are; and the doubt."""
    settings, whole = completed.problem.settings, selected.estimate.problem
    if all(recording.fitted for recording in whole.recordings):
        blocks = blocks_of(completed)
        doubt = settings.doubt if len(whole.recordings) > 1 else settings.block_doubt
        return lambda found, _jumps: block_residuals(found, blocks), doubt
    return lambda found, jumps: validation_residuals(whole, found, jumps), settings.doubt


def improves_prediction(selected: SelectedStructure, fitted: SelectedStructure) -> dict[tuple[str, str, str], bool]:
    """Whether the unseen recordings' coefficients are together predicted better with each chosen one; by its label.

    `fitted`: the structure on the fitted recordings. Empty where nothing is unseen.
    """
    predicted, _ = _predictor(selected, fitted.estimate)
    steps = shift_columns(selected.estimate)
    after = predicted(fitted.estimate, steps)
    tested = selected.chosen if after else ()
    better = mapped(
        lambda each: unexplained_rise(predicted(estimate_without(fitted, each), steps), after) < 0.0, tested
    )
    return {each.hypothesis.label: answer for each, answer in zip(tested, better, strict=True)}
