"""Structure selection in the coefficient equations, confirmed by every recording."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import NumberSeenByCopies, both, mapped
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sudden import is_sudden
from aerosid.equation_error.regression.design import compares_all
from aerosid.equation_error.regression.estimate import Estimate, Frame, estimate, weights_on
from aerosid.equation_error.regression.moderated_test import chance_of
from aerosid.equation_error.selection.alternatives import replaced
from aerosid.equation_error.selection.block_votes import blocks_of, over_blocks
from aerosid.equation_error.selection.candidates import told_apart
from aerosid.equation_error.selection.confirmation import is_needed, is_replicated
from aerosid.equation_error.selection.contradicted_coefficients import falls_of, with_contradictions
from aerosid.equation_error.selection.deletion import Chosen, Selected, left_out, paid, struck_out
from aerosid.equation_error.selection.evidence import distances, weakest
from aerosid.equation_error.selection.level_shifts import (
    as_hypothesis,
    comes_again,
    level_shifts,
    shift_columns,
    shifts_of,
    sudden_elsewhere,
    with_shifts,
    without_shifts,
)
from aerosid.equation_error.selection.prices import Label, Rules
from aerosid.equation_error.selection.starts import may_separate, of_controls
from aerosid.equation_error.selection.stepwise import Admitted, forward_steps, with_separation
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

_Found = TypeVar("_Found")
_Other = TypeVar("_Other")

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

    def forward(
        self,
        begun: Selected,
        asked: Sequence[Hypothesis],
        most: int,
        *,
        sudden: bool = True,
        struck_out: Collection[Label] = (),
    ) -> Selected:
        """Forward selection among what is not struck out; `sudden`: and among changes at an instant."""
        *_, found = self.forward_steps(begun, asked, most, sudden=sudden, struck_out=struck_out)
        return found

    def forward_steps(
        self,
        begun: Selected,
        asked: Sequence[Hypothesis],
        most: int,
        *,
        sudden: bool = True,
        struck_out: Collection[Label] = (),
    ) -> Iterator[Selected]:
        """The structures that forward selection goes through."""

        def admitted(found: Estimate, hypothesis: Hypothesis) -> bool:
            return hypothesis.label not in struck_out and self.admitted(found, hypothesis)

        return forward_steps(
            begun,
            self.rules,
            asked,
            kinematic=False,
            coefficients=self.coefficients if sudden else (),
            most=most,
            admitted=admitted,
            told=self.told,
        )

    def side_by_side(
        self,
        one: Callable[[CoefficientSearch], _Found],
        other: Callable[[CoefficientSearch], _Other],
        common: Sequence[object],
    ) -> tuple[_Found, _Other]:
        """Two searches that need nothing of each other; the journal hears of one and then of the other.

        `common`: the frames of their estimates.
        """

        def heard(search: Callable[[CoefficientSearch], Any]) -> tuple[Any, list[str]]:
            said: list[str] = []
            return search(replace(self, told=said.append)), said

        (first, said), (second, later) = both(lambda: heard(one), lambda: heard(other), common)
        for text in (*said, *later):
            self.told(text)
        return first, second

    def replaced(self, found: Selected, asked: Sequence[Hypothesis]) -> Selected:
        """The structure with each hypothesis changed for a likelier one, and with what such a change makes pay."""
        most = found.estimate.frame.settings.most
        for _ in range(found.estimate.frame.settings.rounds):
            changed = replaced(found, asked, self.rules, self.admitted)
            if changed is found:
                break
            found = self.forward(changed, asked, most)
        return found

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
        """Ln L less the cost of all that entered, level shifts of unseen recordings among it."""
        shifts = sum(self.rules.price(as_hypothesis(active)) for active in shifts_of(selected.estimate))
        return paid(selected, self.rules) - shifts


def searched(search: CoefficientSearch, begun: Selected) -> tuple[Selected, Labels]:
    """What the coefficients lack and every recording can bear; what left may have stood in another's place.

    Of the structures that stand after one round and another the likeliest counts, prices paid.
    """
    refuted: Labels = ()
    gone_before: Labels = ()
    most = begun.estimate.frame.settings.most
    found = _beside_level_shifts(search, begun)
    best: Selected | None = None
    met: set[frozenset[Label]] = set()
    for _ in range(begun.estimate.frame.settings.rounds + 1):
        met.add(frozenset(each.hypothesis.label for each in found.chosen))
        kept, refused_now = _standing(search, found)
        stand = {each.hypothesis.label for each in kept.chosen}
        gone = tuple(each.hypothesis.label for each in found.chosen if each.hypothesis.label not in stand)
        refuted, gone_before = (*refuted, *refused_now), (*gone_before, *gone)
        # What was refused since stands no more in what stood before.
        held = best is not None and not any(each.hypothesis.label in refused_now for each in best.chosen)
        best = max(best, kept, key=search.paid) if best is not None and held else kept
        open_ = [hypothesis for hypothesis in search.asked if hypothesis.label not in refuted]
        found = search.replaced(kept, open_)
        if gone:
            found = search.forward(found, open_, most, struck_out=gone_before)
        names = frozenset(each.hypothesis.label for each in found.chosen)
        if names == stand or names in met:  # what stood of it then would stand of it again
            break
    assert best is not None
    return best, refuted


def asked_where_contradicted(
    search: CoefficientSearch, found: Selected, refuted: Labels, faults: int
) -> tuple[CoefficientSearch, Selected, Labels]:
    """The structure with the terms that pay at the odds of a coefficient that the proven faults contradict, and these.

    Asked once a structure is found: what it explains contradicts no more. `faults`: how many of its effects are those.
    """
    falls = falls_of(found.estimate, faults)
    if not falls:
        return search, found, refuted
    search.told("  contradicted " + ", ".join(f"{name} {fall:.1f}" for name, fall in falls.items()))
    settings = found.estimate.frame.settings
    search = replace(search, rules=with_contradictions(search.rules, search.asked, falls, settings.contradicted))
    open_ = [h for h in search.asked if h.label in search.rules.likelier and h.label not in refuted]
    more = search.forward(found, open_, settings.most, sudden=False)
    if more is found:
        return search, found, refuted
    kept, refuted_now = _standing(search, more)
    return search, kept, (*refuted, *refuted_now)


def _beside_level_shifts(search: CoefficientSearch, begun: Selected) -> Selected:
    """What the coefficients lack beside what happens suddenly on unseen recordings.

    The first structure was chosen where a sudden change of an unseen recording was noise, and may stand in its place:
    the search goes on from it, and begins anew where that is clearly likelier. A shift once found stays, so that
    nothing is named for explaining it.
    """
    found, frame = _attributed(search, begun), begun.estimate.frame
    for _ in range(frame.settings.rounds):
        beside = level_shifts(found.estimate, search.coefficients, search.rules, frame.settings.most, search.told)
        if beside is found.estimate:
            break
        known = Selected(beside, found.chosen)
        found, anew = search.side_by_side(
            functools.partial(_onward, found=known), functools.partial(_anew, begun=begun, beside=known), [frame]
        )
        search.told(f"  beside level shifts {search.paid(found):.1f}, begun anew {search.paid(anew):.1f}")
        if search.paid(anew) > search.paid(found) + frame.settings.clearly:
            found = anew
    return found


def _onward(search: CoefficientSearch, found: Selected) -> Selected:
    """The search gone on from a structure with level shifts beside it."""
    onward = search.forward(found, search.asked, found.estimate.frame.settings.most)
    return search.replaced(onward, search.asked)


def _anew(search: CoefficientSearch, begun: Selected, beside: Selected) -> Selected:
    """The search begun anew with the level shifts of another structure."""
    point = with_shifts(begun.estimate.point, shifts_of(beside.estimate))
    afresh = Selected(estimate(begun.estimate.frame, point, begun.estimate.solution.weights), ())
    return _with_shifts_anew(search, _attributed(search, afresh))


def _with_shifts_anew(search: CoefficientSearch, found: Selected) -> Selected:
    """A structure with its level shifts chosen anew where that is likelier with no fewer of them.

    A moment that shifts beside a moving centre of gravity is taken for that of a step, while the centre is not known.
    """
    frame, known = found.estimate.frame, shifts_of(found.estimate)
    bare = estimate(frame, without_shifts(found.estimate), found.estimate.solution.weights)
    most = frame.settings.most
    anew = Selected(level_shifts(bare, search.coefficients, search.rules, most, search.told), found.chosen)
    fewer = len(shifts_of(anew.estimate)) < len(known)
    return found if fewer else max(found, anew, key=search.paid)


def _attributed(search: CoefficientSearch, begun: Selected) -> Selected:
    """What the coefficients lack; where that is worth more, with the controls first and flow separation second.

    A stall and the stabiliser and thrust that a pilot moves in it bend the coefficients together: powers of alpha that
    enter one by one would stand in the place of all three. Both ways are compared at the same number of effects.
    """
    frame, asked = begun.estimate.frame, search.asked
    most = frame.settings.most
    if may_separate(frame):
        enough = NumberSeenByCopies(most)
        separated, (found, grown) = search.side_by_side(
            functools.partial(_separated, begun=begun, enough=enough),
            functools.partial(_grown, begun=begun, enough=enough),
            [frame],
        )
        if separated is None:
            return search.replaced(found, asked)
        effects = len(separated.chosen)
        if search.paid(separated) > next((paid for count, paid in grown if count >= effects), grown[-1][1]):
            return search.replaced(separated, asked)
    return search.replaced(search.forward(begun, asked, most), asked)


def _separated(search: CoefficientSearch, begun: Selected, enough: NumberSeenByCopies) -> Selected | None:
    """What the coefficients lack, the controls first and flow separation second; None where it does not pay.

    `enough` is told the number of its effects.
    """
    frame, asked = begun.estimate.frame, search.asked
    controls = [hypothesis for hypothesis in asked if of_controls(hypothesis)]
    driven = search.forward(begun, controls, frame.settings.most, sudden=False)
    separated = with_separation(driven, frame, search.rules, search.coefficients, search.told)
    if separated is not None:
        separated = search.forward(separated, asked, frame.settings.most)
        enough.value = len(separated.chosen)
    return separated


def _grown(
    search: CoefficientSearch, begun: Selected, enough: NumberSeenByCopies
) -> tuple[Selected, list[tuple[int, float]]]:
    """What the coefficients lack, up to a number of effects that may be told meanwhile.

    And of each structure on the way the number of its effects, and ln L less prices.
    """
    grown = []
    for found in search.forward_steps(begun, search.asked, begun.estimate.frame.settings.most):
        grown.append((len(found.chosen), search.paid(found)))
        if len(found.chosen) >= enough.value:
            break
    return found, grown


def _standing(search: CoefficientSearch, selected: Selected) -> tuple[Selected, Labels]:
    """What stays significant on the fitted recordings, and lowers no coefficient of an unseen one."""
    refuted: list[tuple[str, str, str]] = []
    while True:
        point = selected.estimate.point
        completed = estimate(search.fitted, point, weights_on(selected.estimate, search.fitted, point), steps=4)
        fitted = Selected(completed, selected.chosen)
        replicated = functools.partial(is_replicated, selected, fitted)
        gone = weakest(completed, selected.chosen, replicated) or _of_few_blocks(search, selected, fitted)
        if gone is None:
            gone = _refused_one(search, selected, fitted)
            if gone is None:
                return selected, tuple(refuted)
            refuted.append(gone.hypothesis.label)
        search.told(f"  does not stand: {gone.hypothesis.label}")
        selected = left_out(selected, gone)


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
        if any(is_sudden(active) for active in hypothesis.effects) or told_apart(hypothesis) in search.rules.support:
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
