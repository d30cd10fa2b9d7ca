"""What of a structure stands: significant on the fitted recordings, and refused by no unseen one."""

from __future__ import annotations

import functools
from collections.abc import Callable

from aerosid.compiled.cores import mapped
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.regression.design import compares_all
from aerosid.equation_error.regression.estimate import Estimate, estimate, weights_on
from aerosid.equation_error.regression.moderated_test import chance_of
from aerosid.equation_error.selection.block_votes import blocks_of, over_blocks
from aerosid.equation_error.selection.candidates import told_apart
from aerosid.equation_error.selection.coefficient_search import CoefficientSearch
from aerosid.equation_error.selection.confirmation import is_needed, is_replicated
from aerosid.equation_error.selection.deletion import Chosen, Selected, left_out, struck_out
from aerosid.equation_error.selection.evidence import distances, weakest
from aerosid.equation_error.selection.level_shifts import (
    comes_again,
    shift_columns,
    shifts_of,
    sudden_elsewhere,
)
from aerosid.equation_error.selection.votes import (
    Jumps,
    Predicted,
    beside_gusts,
    refused,
    share_lost,
    unconfirmed,
)

Labels = tuple[tuple[str, str, str], ...]


def standing(search: CoefficientSearch, selected: Selected) -> tuple[Selected, Labels]:
    """What stays significant on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        fitted = on_fitted(search, selected)
        replicated = functools.partial(is_replicated, selected, fitted)
        gone = weakest(fitted.estimate, selected.chosen, replicated) or _of_few_blocks(search, selected, fitted)
        if gone is None:
            gone = _refused_one(search, selected, fitted)
            if gone is None:
                return selected, tuple(refuted)
            refuted.append(gone.hypothesis.label)
        search.told(f"  does not stand: {gone.hypothesis.label}")
        selected = left_out(selected, gone)


def on_fitted(search: CoefficientSearch, selected: Selected) -> Selected:
    """The structure as the fitted recordings alone show it."""
    point = selected.estimate.point
    weights = weights_on(selected.estimate, search.fitted, point)
    return Selected(estimate(search.fitted, point, weights, steps=4), selected.chosen)


def _of_few_blocks(search: CoefficientSearch, selected: Selected, fitted: Selected) -> Chosen | None:
    """The chosen one that the noise of the few blocks that show it makes most easily, where it does so too easily.

    What is sudden is one event by its nature, and was looked for at every instant; a fault that kinematics show as well
    has another witness; and what an unseen recording needs by itself is no chance of a few blocks.
    """
    found, worst = selected.estimate, None
    # Shown on longitudinal flights; with sideslip false alarms are a third as likely by their price already.
    if not compares_all(found.design) or "v" in found.point.model.axes.integrated:
        return None
    for each in selected.chosen:
        hypothesis = each.hypothesis
        if (
            any(is_step_change(active) for active in hypothesis.effects)
            or told_apart(hypothesis) in search.rules.support
        ):
            continue
        chance = min(
            (chance_of(found.design, found.solution, place, away) for place, away in distances(found, hypothesis)),
            default=0.0,
        )
        excess = chance / search.rules.chance(hypothesis)
        if excess > 1.0 and (worst is None or excess > worst[0]) and not is_needed(selected, fitted, each):
            worst = excess, each
    return worst[1] if worst is not None else None


def _refused_one(search: CoefficientSearch, selected: Selected, fitted: Selected) -> Chosen | None:
    """The chosen one of least gain with which an unseen coefficient, or an unseen block, is predicted worse."""
    if not selected.chosen:
        return None
    completed = fitted.estimate
    settings = completed.frame.settings
    predicted, doubt = _jury(selected, completed)
    known = shifts_of(selected.estimate)
    steps = shift_columns(selected.estimate)
    after = predicted(completed, steps)
    further = functools.cache(lambda: sudden_elsewhere(selected.estimate, search.coefficients, search.rules))

    def is_refused(each: Chosen) -> bool:
        bare = struck_out(fitted, each)
        before = predicted(bare, steps)
        if refused(before, after, doubt, settings.least_rise):
            if comes_again((*known, *(found.point.effects[-1] for found in further())), each.hypothesis):
                return False
            # An unseen recording in which something happens suddenly refuses nothing by that.
            every = shift_columns(selected.estimate, further())
            beside = predicted(bare, every), predicted(completed, every)
            if not further() or refused(*beside, doubt, settings.least_rise):
                return True
        sideways = [coefficient for coefficient, _ in each.hypothesis.entries if not is_symmetric(coefficient)]
        return any(unconfirmed(before, after, coefficient) for coefficient in sideways)

    asked = sorted(selected.chosen, key=lambda each: each.gain)
    answers = mapped(is_refused, asked, until=lambda answer: answer)
    return asked[len(answers) - 1] if answers[-1] else None


def _jury(selected: Selected, completed: Estimate) -> tuple[Callable[[Estimate, Jumps], Predicted], float]:
    """What an estimate leaves of unseen recordings, or of blocks of the fitted ones where all are; and the doubt."""
    settings, whole = completed.frame.settings, selected.estimate.frame
    if all(recording.fitted for recording in whole.recordings):
        blocks = blocks_of(completed)
        doubt = settings.doubt if len(whole.recordings) > 1 else settings.block_doubt
        return lambda found, _jumps: over_blocks(found, blocks), doubt
    return lambda found, jumps: beside_gusts(whole, found, jumps), settings.doubt


def predicted_better(selected: Selected, fitted: Selected) -> dict[tuple[str, str, str], bool]:
    """Whether the unseen recordings' coefficients are together predicted better with each chosen one; by its label.

    `fitted`: the structure on the fitted recordings. Empty where nothing is unseen.
    """
    predicted, _ = _jury(selected, fitted.estimate)
    steps = shift_columns(selected.estimate)
    after = predicted(fitted.estimate, steps)
    asked = selected.chosen if after else ()
    better = mapped(lambda each: share_lost(predicted(struck_out(fitted, each), steps), after) < 0.0, asked)
    return {each.hypothesis.label: answer for each, answer in zip(asked, better, strict=True)}
