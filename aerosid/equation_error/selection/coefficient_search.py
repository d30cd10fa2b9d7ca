"""Structure selection in the coefficient equations, confirmed by every recording."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sudden import is_sudden, moment
from aerosid.equation_error.regression.design import compares_all
from aerosid.equation_error.regression.estimate import Estimate, Frame, estimate, weights_on
from aerosid.equation_error.regression.moderated_test import chance_of
from aerosid.equation_error.selection.alternatives import replaced
from aerosid.equation_error.selection.block_votes import blocks_of, over_blocks
from aerosid.equation_error.selection.candidates import joined, told_apart
from aerosid.equation_error.selection.confirmation import is_replicated
from aerosid.equation_error.selection.deletion import Chosen, Selected, left_out, without
from aerosid.equation_error.selection.evidence import distances, weakest
from aerosid.equation_error.selection.prices import Rules, total_cost
from aerosid.equation_error.selection.starts import MAINLY, may_separate, of_controls, sudden_hypotheses
from aerosid.equation_error.selection.stepwise import Admitted, forward, with_separation
from aerosid.equation_error.selection.votes import (
    Jumps,
    Predicted,
    beside_gusts,
    refused,
    share_lost,
    shares_of,
    unconfirmed,
)

Array = NDArray[np.float64]

Labels = tuple[tuple[str, str, str], ...]
"""Names of hypotheses."""


@dataclass(frozen=True)
class CoefficientSearch:
    """What is asked of the coefficients, and by which rules.

    Attributes
    ----------
    asked : tuple of Hypothesis
    coefficients : tuple of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    fitted : Frame
        The coefficient equations of the identification recordings.
    rules : Rules
    admitted : callable
        What may enter on other grounds than the likelihood.
    told : callable
        Hears what enters and leaves, for a journal.
    """

    asked: tuple[Hypothesis, ...]
    coefficients: tuple[str, ...]
    fitted: Frame
    rules: Rules
    admitted: Admitted
    told: Callable[[str], None]

    def forward(self, begun: Selected, asked: Sequence[Hypothesis], most: int, *, sudden: bool = True) -> Selected:
        """Forward selection among some hypotheses; `sudden`: and among changes at an instant."""
        return forward(
            begun,
            begun.estimate.frame,
            self.rules,
            asked,
            kinematic=False,
            coefficients=self.coefficients if sudden else (),
            most=most,
            admitted=self.admitted,
            told=self.told,
        )

    def replaced(self, found: Selected, asked: Sequence[Hypothesis]) -> Selected:
        """The structure with each hypothesis changed for a likelier one."""
        return replaced(found, asked, self.rules, self.admitted)

    def refuses(self, before: Estimate, after: Estimate) -> bool:
        """Whether an unseen recording's coefficient is predicted worse by one estimate than by another before it.

        Worse in R^2 as it is reported, gusts left in: other numbers of an instrument change what is taken for them.
        What one coefficient loses another may gain.
        """
        whole = after.frame
        old, new = (
            shares_of(whole, estimate(self.fitted, each.point, weights_on(each, self.fitted, each.point), steps=4))
            for each in (before, after)
        )
        unseen = [(a.r2, b.r2) for a, b in zip(old, new, strict=True) if not a.fitted]
        settings = whole.settings
        worse = any(a - b > min(settings.least_rise, settings.rise_of_rest * (1.0 - a)) for a, b in unseen)
        return worse and sum(a - b for a, b in unseen) > 0.0

    def paid(self, selected: Selected) -> float:
        """Ln L less the cost of all that entered."""
        chosen = [each.hypothesis for each in selected.chosen]
        return selected.estimate.log_likelihood - total_cost(self.rules, selected.estimate.point, chosen)


def searched(search: CoefficientSearch, begun: Selected) -> tuple[Selected, Labels]:
    """What the coefficients lack and every recording can bear; what was refused may have stood in another's place."""
    refuted: Labels = ()
    most = begun.estimate.frame.settings.most
    found = _attributed(search, begun)
    for _ in range(begun.estimate.frame.settings.rounds):
        kept, refused_now = _standing(search, found)
        refuted = (*refuted, *refused_now)
        open_ = [hypothesis for hypothesis in search.asked if hypothesis.label not in refuted]
        found = search.replaced(kept, open_)
        if refused_now:
            found = search.forward(found, open_, most)
        if {each.hypothesis.label for each in found.chosen} == {each.hypothesis.label for each in kept.chosen}:
            return kept, refuted
    kept, refused_now = _standing(search, found)
    return kept, (*refuted, *refused_now)


def _attributed(search: CoefficientSearch, begun: Selected) -> Selected:
    """What the coefficients lack; where that is worth more, with the controls first and flow separation second.

    A stall and the stabiliser and thrust that a pilot moves in it bend the coefficients together: powers of alpha that
    enter one by one would stand in the place of all three. Both ways are compared at the same number of effects.
    """
    frame, asked = begun.estimate.frame, search.asked
    most = frame.settings.most
    if may_separate(frame):
        controls = [hypothesis for hypothesis in asked if of_controls(hypothesis)]
        driven = search.forward(begun, controls, most, sudden=False)
        separated = with_separation(driven, frame, search.rules, search.coefficients, search.told)
        if separated is not None:
            separated = search.forward(separated, asked, most)
            found = search.forward(begun, asked, len(separated.chosen))
            if search.paid(separated) > search.paid(found):
                return search.replaced(separated, asked)
    return search.replaced(search.forward(begun, asked, most), asked)


def _standing(search: CoefficientSearch, selected: Selected) -> tuple[Selected, Labels]:
    """What stays significant on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        point = selected.estimate.point
        completed = estimate(search.fitted, point, weights_on(selected.estimate, search.fitted, point), steps=4)
        replicated = functools.partial(is_replicated, selected, completed)
        gone = weakest(completed, selected.chosen, replicated) or _of_few_blocks(search, selected)
        if gone is None:
            gone = _refused_one(search, selected, completed)
            if gone is None:
                return selected, tuple(refuted)
            refuted.append(gone.hypothesis.label)
        search.told(f"  does not stand: {gone.hypothesis.label}")
        selected = left_out(selected, gone)


def _of_few_blocks(search: CoefficientSearch, selected: Selected) -> Chosen | None:
    """The chosen one that the noise of the few blocks that show it makes most easily, where it does so too easily.

    What is sudden is one event by its nature, and was looked for at every instant; a fault that kinematics show as well
    has another witness.
    """
    found, worst = selected.estimate, None
    # Shown on longitudinal flights; with sideslip false alarms are a third as likely by their price already.
    if not compares_all(found.design) or "v" in found.point.model.axes.integrated:
        return None
    for each in selected.chosen:
        hypothesis = each.hypothesis
        if any(is_sudden(active) for active in hypothesis.effects) or told_apart(hypothesis) in search.rules.support:
            continue
        chance = min(
            (chance_of(found.design, found.solution, place, away) for place, away in distances(found, hypothesis)),
            default=0.0,
        )
        excess = chance / search.rules.chance(hypothesis)
        if excess > 1.0 and (worst is None or excess > worst[0]):
            worst = excess, each
    return worst[1] if worst is not None else None


def _refused_one(search: CoefficientSearch, selected: Selected, completed: Estimate) -> Chosen | None:
    """The chosen one of least gain with which an unseen coefficient, or an unseen block, is predicted worse."""
    if not selected.chosen:
        return None
    settings = completed.frame.settings
    predicted, doubt = _jury(selected, completed)
    after = predicted(completed, {})
    elsewhere: list[Estimate] | None = None
    for each in sorted(selected.chosen, key=lambda each: each.gain):
        bare = estimate(completed.frame, without(completed.point, each), completed.solution.weights, steps=4)
        before = predicted(bare, {})
        if refused(before, after, doubt, settings.least_rise):
            elsewhere = _sudden_elsewhere(search, selected) if elsewhere is None else elsewhere
            if _comes_again(elsewhere, each.hypothesis):
                continue
            # An unseen recording in which something happens suddenly refuses nothing by that.
            jumps = _jumps(elsewhere)
            if not jumps or refused(predicted(bare, jumps), predicted(completed, jumps), doubt, settings.least_rise):
                return each
        sideways = [coefficient for coefficient, _ in each.hypothesis.entries if not is_symmetric(coefficient)]
        if any(unconfirmed(before, after, coefficient) for coefficient in sideways):
            return each
    return None


def _jury(selected: Selected, completed: Estimate) -> tuple[Callable[[Estimate, Jumps], Predicted], float]:
    """What an estimate leaves of unseen recordings, or of blocks of the fitted ones where all are; and the doubt."""
    settings, whole = completed.frame.settings, selected.estimate.frame
    if all(recording.fitted for recording in whole.recordings):
        blocks = blocks_of(completed)
        doubt = settings.doubt if len(whole.recordings) > 1 else settings.block_doubt
        return lambda found, _jumps: over_blocks(found, blocks), doubt
    return lambda found, jumps: beside_gusts(whole, found, jumps), settings.doubt


def predicted_better(selected: Selected, completed: Estimate) -> dict[tuple[str, str, str], bool]:
    """Whether the unseen recordings' coefficients are together predicted better with each chosen one; by its label.

    `completed`: the structure on the fitted recordings. Empty where nothing is unseen.
    """
    predicted, _ = _jury(selected, completed)
    after = predicted(completed, {})
    falls: dict[tuple[str, str, str], bool] = {}
    for each in selected.chosen if after else ():
        bare = estimate(completed.frame, without(completed.point, each), completed.solution.weights, steps=4)
        falls[each.hypothesis.label] = share_lost(predicted(bare, {}), after) < 0.0
    return falls


def _sudden_elsewhere(search: CoefficientSearch, selected: Selected) -> list[Estimate]:
    """Estimates with each sudden change that an unseen recording has at a price, the change its last effect."""
    base = selected.estimate
    rows = []
    for again in sudden_hypotheses(base.frame, base, search.coefficients, fitted=False):
        found = estimate(base.frame, joined(base.point, again), base.solution.weights, steps=4)
        if found.gain_over(base) > search.rules.price(again):
            rows.append(found)
    return rows


def _comes_again(elsewhere: Sequence[Estimate], hypothesis: Hypothesis) -> bool:
    """Whether a sudden change happens on an unseen recording too: that cannot refute it by being there."""
    return any(is_sudden(active) for active in hypothesis.effects) and any(
        (found.point.effects[-1].effect.kind, found.point.effects[-1].effect.where)
        == (hypothesis.kind, hypothesis.where)
        for found in elsewhere
    )


def _jumps(elsewhere: Sequence[Estimate]) -> dict[tuple[int, str], Array]:
    """Columns (n, k) of the steps of coefficients among some sudden changes, by recording and coefficient."""
    columns: dict[tuple[int, str], list[Array]] = {}
    for found in elsewhere:
        active = found.point.effects[-1]
        for place, recording in enumerate(found.frame.recordings):
            key = (place, MAINLY.get(active.effect.where, ""))
            if recording.name == active.log and key in found.design.segments:
                at = recording.time[recording.band.rows(recording.time.size)]
                columns.setdefault(key, []).append((at > moment(active)).astype(np.float64))
    return {key: np.column_stack(rows) for key, rows in columns.items()}
