"""Growth of a structure in the coefficient equations, beside what happens suddenly and beside flow separation."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from aerosid.compiled.cores import NumberSeenByCopies, both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import Estimate, RegressionProblem, estimate, weights_restricted_to
from aerosid.equation_error.selection.alternatives import with_replacements
from aerosid.equation_error.selection.cross_validation import (
    fits_of,
)
from aerosid.equation_error.selection.level_shifts import (
    as_hypothesis,
    level_shifts,
    shifts_of,
    with_shifts,
    without_shifts,
)
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion
from aerosid.equation_error.selection.starting_values import is_control_term, shows_separation
from aerosid.equation_error.selection.stepwise import Admitted, forward_selection, with_flow_separation
from aerosid.equation_error.selection.structure import SelectedStructure, penalised_likelihood

_Found = TypeVar("_Found")
_Other = TypeVar("_Other")


@dataclass(frozen=True)
class CoefficientSearch:
    """What is asked of the coefficients, and by which rules.

    Attributes
    ----------
    hypotheses : tuple of Hypothesis
    coefficients : tuple of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    fitted : RegressionProblem
        The coefficient equations of the identification recordings.
    criterion : SelectionCriterion
    admitted : callable
        What may enter on other grounds than the likelihood.
    log : callable
        Hears what enters and leaves, for a journal.
    """

    hypotheses: tuple[Hypothesis, ...]
    coefficients: tuple[str, ...]
    fitted: RegressionProblem
    criterion: SelectionCriterion
    admitted: Admitted
    log: Callable[[str], None]

    def hypotheses_except(self, refuted: Collection[Label]) -> list[Hypothesis]:
        """What is asked, but for what unseen recordings refused."""
        return [hypothesis for hypothesis in self.hypotheses if hypothesis.label not in refuted]

    def forward(
        self,
        initial: SelectedStructure,
        hypotheses: Sequence[Hypothesis],
        most: int,
        *,
        step_changes: bool = True,
        excluded: Collection[Label] = (),
    ) -> SelectedStructure:
        """Forward selection among what is not struck out; `step_changes`: and among changes at an instant."""
        *_, found = self.forward_selection(initial, hypotheses, most, step_changes=step_changes, excluded=excluded)
        return found

    def forward_selection(
        self,
        initial: SelectedStructure,
        hypotheses: Sequence[Hypothesis],
        most: int,
        *,
        step_changes: bool = True,
        excluded: Collection[Label] = (),
    ) -> Iterator[SelectedStructure]:
        """The structures that forward selection goes through."""
        return forward_selection(
            initial,
            self.criterion,
            hypotheses,
            kinematic=False,
            coefficients=self.coefficients if step_changes else (),
            most=most,
            admitted=self._admissible_except(excluded),
            log=self.log,
        )

    def in_parallel(
        self,
        one: Callable[[CoefficientSearch], _Found],
        other: Callable[[CoefficientSearch], _Other],
        common: Sequence[object],
    ) -> tuple[_Found, _Other]:
        """Two searches that need nothing of each other; the journal hears of one and then of the other.

        `common`: the frames of their estimates.
        """

        def logged(search: Callable[[CoefficientSearch], Any]) -> tuple[Any, list[str]]:
            messages: list[str] = []
            return search(replace(self, log=messages.append)), messages

        (first, messages), (second, other_messages) = both(lambda: logged(one), lambda: logged(other), common)
        for text in (*messages, *other_messages):
            self.log(text)
        return first, second

    def with_replacements(
        self, found: SelectedStructure, hypotheses: Sequence[Hypothesis], excluded: Collection[Label] = ()
    ) -> SelectedStructure:
        """The structure with each hypothesis changed for a likelier one, and with what such a change makes pay.

        By nothing that is struck out.
        """
        most = found.estimate.problem.settings.most
        for _ in range(found.estimate.problem.settings.rounds):
            exchanged = with_replacements(found, hypotheses, self.criterion, self._admissible_except(excluded))
            if exchanged is found:
                break
            self.log(f"  exchanged for {', '.join(' '.join(each.hypothesis.label) for each in exchanged.chosen)}")
            found = self.forward(exchanged, hypotheses, most, excluded=excluded)
        return found

    def _admissible_except(self, excluded: Collection[Label]) -> Admitted:
        """Whether an estimate may stand by these rules, its last hypothesis not struck out."""

        def is_admissible(found: Estimate, hypothesis: Hypothesis) -> bool:
            return hypothesis.label not in excluded and self.admitted(found, hypothesis)

        return is_admissible

    def worsens_prediction(self, before: Estimate, after: Estimate) -> bool:
        """Whether an unseen recording's coefficient is predicted worse by one estimate than by another before it.

        Worse in R^2 as it is reported, gusts left in: other numbers of an instrument change what is taken for them.
        What one coefficient loses another may gain.
        """
        whole = after.problem
        old, new = (
            fits_of(
                whole, estimate(self.fitted, each.point, weights_restricted_to(each, self.fitted, each.point), steps=4)
            )
            for each in (before, after)
        )
        validation = [(a.r2, b.r2) for a, b in zip(old, new, strict=True) if not a.fitted]
        settings = whole.settings
        worse = any(a - b > min(settings.least_rise, settings.rise_of_rest * (1.0 - a)) for a, b in validation)
        return worse and sum(a - b for a, b in validation) > 0.0

    def penalised_likelihood(self, selected: SelectedStructure) -> float:
        """Ln L less the cost of all that entered, level shifts of unseen recordings among it."""
        shifts = sum(self.criterion.penalty(as_hypothesis(active)) for active in shifts_of(selected.estimate))
        return penalised_likelihood(selected, self.criterion) - shifts


def select_with_level_shifts(search: CoefficientSearch, initial: SelectedStructure) -> SelectedStructure:
    """What the coefficients lack beside what happens suddenly on unseen recordings.

    The first structure was chosen where a sudden change of an unseen recording was noise, and may stand in its place:
    the search goes on from it, and begins anew where that is clearly likelier; where it is clearly less likely, not
    again beside the smaller shifts that come later. A shift once found stays, so that nothing is named for explaining
    it.
    """
    found, problem = _stepwise(search, initial), initial.estimate.problem
    lead = 0.0
    for _ in range(problem.settings.rounds):
        shifted = level_shifts(found.estimate, search.coefficients, search.criterion, problem.settings.most, search.log)
        if shifted is found.estimate:
            break
        current = SelectedStructure(shifted, found.chosen)
        if lead > problem.settings.clearly:
            found = _continued(search, current)
            continue
        found, restarted = search.in_parallel(
            functools.partial(_continued, found=current),
            functools.partial(_restarted, initial=initial, shifted=current),
            [problem],
        )
        continued_value, restarted_value = search.penalised_likelihood(found), search.penalised_likelihood(restarted)
        search.log(f"  with level shifts {continued_value:.1f}, restarted {restarted_value:.1f}")
        lead = continued_value - restarted_value
        if lead < -problem.settings.clearly:
            found = restarted
    return found


def _continued(search: CoefficientSearch, found: SelectedStructure) -> SelectedStructure:
    """The search gone on from a structure with level shifts beside it."""
    continued = search.forward(found, search.hypotheses, found.estimate.problem.settings.most)
    return search.with_replacements(continued, search.hypotheses)


def _restarted(search: CoefficientSearch, initial: SelectedStructure, shifted: SelectedStructure) -> SelectedStructure:
    """The search begun anew with the level shifts of another structure."""
    point = with_shifts(initial.estimate.point, shifts_of(shifted.estimate))
    restart = SelectedStructure(estimate(initial.estimate.problem, point, initial.estimate.solution.weights), ())
    return _with_restarted_shifts(search, _stepwise(search, restart))


def _with_restarted_shifts(search: CoefficientSearch, found: SelectedStructure) -> SelectedStructure:
    """A structure with its level shifts chosen anew where that is likelier with no fewer of them.

    A moment that shifts beside a moving centre of gravity is taken for that of a step, while the centre is not known.
    """
    problem, current = found.estimate.problem, shifts_of(found.estimate)
    reduced = estimate(problem, without_shifts(found.estimate), found.estimate.solution.weights)
    most = problem.settings.most
    restarted = SelectedStructure(
        level_shifts(reduced, search.coefficients, search.criterion, most, search.log), found.chosen
    )
    fewer = len(shifts_of(restarted.estimate)) < len(current)
    return found if fewer else max(found, restarted, key=search.penalised_likelihood)


def _stepwise(search: CoefficientSearch, initial: SelectedStructure) -> SelectedStructure:
    """What the coefficients lack; where that is worth more, with the controls first and flow separation second.

    A stall and the stabiliser and thrust that a pilot moves in it bend the coefficients together: powers of alpha that
    enter one by one would stand in the place of all three. Both ways are compared at the same number of effects.
    """
    problem, hypotheses = initial.estimate.problem, search.hypotheses
    most = problem.settings.most
    if shows_separation(problem):
        enough = NumberSeenByCopies(most)
        separated, (found, path) = search.in_parallel(
            functools.partial(_separation_first, initial=initial, enough=enough),
            functools.partial(_one_by_one, initial=initial, enough=enough),
            [problem],
        )
        if separated is None:
            return search.with_replacements(found, hypotheses)
        effects = len(separated.chosen)
        if search.penalised_likelihood(separated) > next(
            (value for count, value in path if count >= effects), path[-1][1]
        ):
            return search.with_replacements(separated, hypotheses)
    return search.with_replacements(search.forward(initial, hypotheses, most), hypotheses)


def _separation_first(
    search: CoefficientSearch, initial: SelectedStructure, enough: NumberSeenByCopies
) -> SelectedStructure | None:
    """What the coefficients lack, the controls first and flow separation second; None where it does not pay.

    `enough` is told the number of its effects.
    """
    problem, hypotheses = initial.estimate.problem, search.hypotheses
    controls = [hypothesis for hypothesis in hypotheses if is_control_term(hypothesis)]
    driven = search.forward(initial, controls, problem.settings.most, step_changes=False)
    separated = with_flow_separation(driven, problem, search.criterion, search.coefficients, search.log)
    if separated is not None:
        separated = search.forward(separated, hypotheses, problem.settings.most)
        enough.value = len(separated.chosen)
    return separated


def _one_by_one(
    search: CoefficientSearch, initial: SelectedStructure, enough: NumberSeenByCopies
) -> tuple[SelectedStructure, list[tuple[int, float]]]:
    """What the coefficients lack, up to a number of effects that may be told meanwhile.

    And of each structure on the way the number of its effects, and ln L less prices.
    """
    path = []
    for found in search.forward_selection(initial, search.hypotheses, initial.estimate.problem.settings.most):
        path.append((len(found.chosen), search.penalised_likelihood(found)))
        if len(found.chosen) >= enough.value:
            break
    return found, path
