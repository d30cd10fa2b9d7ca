"""Growth of a structure in the coefficient equations, beside what happens suddenly and beside flow separation."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from aerosid.compiled.cores import NumberSeenByCopies, both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import Estimate, Frame, estimate, weights_on
from aerosid.equation_error.selection.alternatives import replaced
from aerosid.equation_error.selection.cross_validation import (
    shares_of,
)
from aerosid.equation_error.selection.level_shifts import (
    as_hypothesis,
    level_shifts,
    shifts_of,
    with_shifts,
    without_shifts,
)
from aerosid.equation_error.selection.penalties import Label, Rules
from aerosid.equation_error.selection.starting_values import may_separate, of_controls
from aerosid.equation_error.selection.stepwise import Admitted, forward_steps, with_separation
from aerosid.equation_error.selection.structure import Selected, paid

_Found = TypeVar("_Found")
_Other = TypeVar("_Other")


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

    def open_but(self, refuted: Collection[Label]) -> list[Hypothesis]:
        """What is asked, but for what unseen recordings refused."""
        return [hypothesis for hypothesis in self.asked if hypothesis.label not in refuted]

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
        return forward_steps(
            begun,
            self.rules,
            asked,
            kinematic=False,
            coefficients=self.coefficients if sudden else (),
            most=most,
            admitted=self._admitted_but(struck_out),
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

    def replaced(self, found: Selected, asked: Sequence[Hypothesis], struck_out: Collection[Label] = ()) -> Selected:
        """The structure with each hypothesis changed for a likelier one, and with what such a change makes pay.

        By nothing that is struck out.
        """
        most = found.estimate.frame.settings.most
        for _ in range(found.estimate.frame.settings.rounds):
            changed = replaced(found, asked, self.rules, self._admitted_but(struck_out))
            if changed is found:
                break
            self.told(f"  exchanged for {', '.join(' '.join(each.hypothesis.label) for each in changed.chosen)}")
            found = self.forward(changed, asked, most, struck_out=struck_out)
        return found

    def _admitted_but(self, struck_out: Collection[Label]) -> Admitted:
        """Whether an estimate may stand by these rules, its last hypothesis not struck out."""

        def admitted(found: Estimate, hypothesis: Hypothesis) -> bool:
            return hypothesis.label not in struck_out and self.admitted(found, hypothesis)

        return admitted

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


def beside_level_shifts(search: CoefficientSearch, begun: Selected) -> Selected:
    """What the coefficients lack beside what happens suddenly on unseen recordings.

    The first structure was chosen where a sudden change of an unseen recording was noise, and may stand in its place:
    the search goes on from it, and begins anew where that is clearly likelier; where it is clearly less likely, not
    again beside the smaller shifts that come later. A shift once found stays, so that nothing is named for explaining
    it.
    """
    found, frame = _attributed(search, begun), begun.estimate.frame
    ahead = 0.0
    for _ in range(frame.settings.rounds):
        beside = level_shifts(found.estimate, search.coefficients, search.rules, frame.settings.most, search.told)
        if beside is found.estimate:
            break
        known = Selected(beside, found.chosen)
        if ahead > frame.settings.clearly:
            found = _onward(search, known)
            continue
        found, anew = search.side_by_side(
            functools.partial(_onward, found=known), functools.partial(_anew, begun=begun, beside=known), [frame]
        )
        search.told(f"  beside level shifts {search.paid(found):.1f}, begun anew {search.paid(anew):.1f}")
        ahead = search.paid(found) - search.paid(anew)
        if ahead < -frame.settings.clearly:
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
