"""Stepwise search in the coefficient equations, with step changes of validation records and flow separation."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto

from aerosid.compiled.cores import NumberSeenByCopies, both
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.related_problems import as_compared, weights_restricted_to
from aerosid.equation_error.selection.alternatives import with_replacements
from aerosid.equation_error.selection.cross_validation import fits_of, prediction_residuals, predictions_against
from aerosid.equation_error.selection.level_shifts import (
    as_hypotheses,
    level_shifts,
    shifts_of,
    with_shifts,
    without_shifts,
)
from aerosid.equation_error.selection.penalties import Label, SelectionCriterion
from aerosid.equation_error.selection.starting_values import (
    is_control_term,
    may_replace_separation,
    shows_separation,
)
from aerosid.equation_error.selection.stepwise import (
    Admitted,
    SelectionHistory,
    forward_selection,
    with_flow_separation,
)
from aerosid.equation_error.selection.structure import SelectedStructure, estimate_without_all, penalised_likelihood

NEGLIGIBLE_FALL = 5e-4
"""Design: fall of R^2, 1, that refutes nothing, however little variance is unexplained. By reasoning: tables show three
digits."""


@dataclass(frozen=True)
class CoefficientSearch:
    """Candidates of the coefficient equations and the selection criterion.

    Attributes
    ----------
    hypotheses : tuple of Hypothesis
        Candidates.
    coefficients : tuple of str
        Drag or axial force, lift or normal force, moment, as the aircraft file names them.
    fitted : RegressionProblem
        The coefficient equations of the identification records.
    criterion : SelectionCriterion
    admitted : callable
        Admission of an estimate by criteria other than the likelihood.
    """

    hypotheses: tuple[Hypothesis, ...]
    coefficients: tuple[str, ...]
    fitted: RegressionProblem
    criterion: SelectionCriterion
    admitted: Admitted

    def hypotheses_except(self, refuted: Collection[Label]) -> list[Hypothesis]:
        """The candidates without those refuted by validation records."""
        return [hypothesis for hypothesis in self.hypotheses if hypothesis.label not in refuted]

    def forward(
        self,
        initial: SelectedStructure,
        hypotheses: Sequence[Hypothesis],
        most: int,
        *,
        step_changes: bool = True,
        excluded: Collection[Label] = (),
        history: SelectionHistory | None = None,
    ) -> SelectedStructure:
        """Forward selection without the `excluded` labels; `step_changes`: step changes are candidates too."""
        *_, found = self.forward_selection(
            initial, hypotheses, most, step_changes=step_changes, excluded=excluded, history=history
        )
        return found

    def forward_selection(
        self,
        initial: SelectedStructure,
        hypotheses: Sequence[Hypothesis],
        most: int,
        *,
        step_changes: bool = True,
        excluded: Collection[Label] = (),
        history: SelectionHistory | None = None,
    ) -> Iterator[SelectedStructure]:
        """The sequence of structures of a forward selection; `history`: of one that it continues."""
        return forward_selection(
            initial,
            self.criterion,
            hypotheses,
            kinematic=False,
            coefficients=self.coefficients if step_changes else (),
            most=most,
            admitted=self._admissible_except(excluded),
            history=history,
        )

    def with_replacements(
        self, found: SelectedStructure, hypotheses: Sequence[Hypothesis], excluded: Collection[Label] = ()
    ) -> SelectedStructure:
        """The structure with each effect replaced by a likelier one, and with effects that thereby become significant.

        No label in `excluded` may enter.
        """
        most = found.estimate.problem.settings.most
        for _ in range(found.estimate.problem.settings.rounds):
            exchanged = with_replacements(found, hypotheses, self.criterion, self._admissible_except(excluded))
            if exchanged is found:
                break
            found = self.forward(exchanged, hypotheses, most, excluded=excluded)
        return found

    def _admissible_except(self, excluded: Collection[Label]) -> Admitted:
        """Admission rule that also rejects an estimate whose last hypothesis is excluded."""

        def is_admissible(found: Estimate, hypothesis: Hypothesis) -> bool:
            return hypothesis.label not in excluded and self.admitted(found, hypothesis)

        return is_admissible

    def worsens_prediction(self, before: Estimate, after: Estimate) -> bool:
        """Whether the second of two estimates predicts a validation coefficient worse than the first.

        In terms of the reported R^2, gusts not removed: other instrument errors change what is attributed to gusts. A
        loss in one coefficient may be compensated by a gain in another.
        """
        settings, whole = after.problem.settings, as_compared(after.problem)
        old, new = (fits_of(whole, self._of_fitted(each)) for each in (before, after))
        validation = [(a.r2, b.r2) for a, b in zip(old, new, strict=True) if not a.fitted]
        worse = any(
            a - b > min(settings.least_rise, max(settings.rise_of_rest * (1.0 - a), NEGLIGIBLE_FALL))
            for a, b in validation
        )
        return worse and sum(a - b for a, b in validation) > 0.0

    def _of_fitted(self, found: Estimate) -> Estimate:
        """The structure of an estimate, estimated from the identification records alone."""
        return estimate(self.fitted, found.point, weights_restricted_to(found, self.fitted, found.point), steps=4)

    def refutes(self, before: Estimate, after: Estimate, penalty: float) -> bool:
        """Whether an instrument error loses more than its penalty in ln L and worsens the prediction of validation.

        `before`, `after`: the coefficients without and with it. On two quiet minutes of a Citation kinematics had an
        accelerometer early by .42 s and a vane late by .38 s, each by more than 50 in ln L; the coefficients of both
        records lost 29 by either, and R^2 of the unseen C_Z fell from .83 to .70.
        """
        loss = before.log_likelihood - after.log_likelihood
        return loss > penalty and self.worsens_prediction(before, after)

    def is_outvoted(self, before: Estimate, after: Estimate, proven: float) -> bool:
        """Whether coefficients lose by an instrument error, and validation ones more than it was proven by, in ln L.

        `before`, `after`: the coefficients without and with it; `proven`: its gain in both kinds of equations beyond
        its penalty. On half a record of ATTAS kinematics have V late by .36 s, 1 in ln L beyond the penalty, and R^2 of
        C_X of the other half falls from .992 to .974, by 2.6 standard errors.
        """
        if after.log_likelihood >= before.log_likelihood:
            return False
        whole = as_compared(after.problem)
        unseen = {index for index, recording in enumerate(whole.recordings) if not recording.fitted}
        old, new = (prediction_residuals(whole, self._of_fitted(each)) for each in (before, after))
        return predictions_against(old, {key: each for key, each in new.items() if key[0] in unseen}) > proven

    def penalised_likelihood(self, selected: SelectedStructure) -> float:
        """Ln L less the penalties of all effects, including those of level shifts of validation records."""
        shifts = sum(self.criterion.penalty(shift) for shift in as_hypotheses(selected.estimate))
        return penalised_likelihood(selected, self.criterion) - shifts


def select_with_level_shifts(search: CoefficientSearch, initial: SelectedStructure) -> SelectedStructure:
    """The structure selected from the coefficients together with level shifts of the validation records.

    The first structure was selected while step changes of validation records counted as noise, and may contain effects
    in their place: the search is continued from it and also restarted with the shifts. The restarted structure is taken
    where its penalised likelihood is clearly higher; where it is clearly lower, later, smaller shifts do not trigger a
    restart. A level shift once found is kept, so that no effect is selected for explaining it.

    From a structure that was selected before, with other instrument errors, the search is continued without a restart.
    """
    problem = initial.estimate.problem
    if initial.chosen:
        found, order, lead = continued(search, initial), _Order.EITHER, float("inf")
    else:
        (found, order), lead = _stepwise(search, initial), 0.0
    for _ in range(problem.settings.rounds):
        shifted = level_shifts(found.estimate, search.coefficients, search.criterion, problem.settings.most)
        if shifted is found.estimate:
            break
        current = SelectedStructure(shifted, found.chosen)
        if lead > problem.settings.clearly:
            found = continued(search, current)
            continue
        # The longer one here: it has both cores as soon as the other is done.
        restarted, found = both(
            functools.partial(_restarted, search, initial, current, order),
            functools.partial(continued, search, current),
            [problem],
        )
        continued_value, restarted_value = search.penalised_likelihood(found), search.penalised_likelihood(restarted)
        lead = continued_value - restarted_value
        if lead < -problem.settings.clearly:
            found = restarted
    return found


def _with_replacements_or_separation(search: CoefficientSearch, found: SelectedStructure) -> SelectedStructure:
    """The structure with likelier replacements, or with flow separation for all its nonlinear terms of alpha at once.

    Separation is searched for at the start, where a large undeclared delay or step change can hide it.
    """
    separated = _with_separation_for_terms(search, found)
    return search.with_replacements(found, search.hypotheses) if separated is None else separated


def _with_separation_for_terms(search: CoefficientSearch, found: SelectedStructure) -> SelectedStructure | None:
    """The structure with flow separation in place of its nonlinear terms of alpha.

    None where it is not clearly likelier, or predicts a validation record worse.
    """
    problem = found.estimate.problem
    terms = [each for each in found.chosen if may_replace_separation(each.hypothesis)]
    is_separated = any(each.hypothesis.kind == "flow_separation" for each in found.chosen)
    if not terms or is_separated or not shows_separation(problem):
        return None
    reduced = SelectedStructure(
        estimate_without_all(found, terms),
        tuple(each for each in found.chosen if each not in terms),
    )
    separated = with_flow_separation(reduced, problem, search.criterion, search.coefficients)
    if separated is None:
        return None
    separated = search.forward(separated, search.hypotheses, problem.settings.most)
    by_terms, by_separation = search.penalised_likelihood(found), search.penalised_likelihood(separated)
    is_likelier = by_separation > by_terms + problem.settings.clearly
    return separated if is_likelier and not search.worsens_prediction(found.estimate, separated.estimate) else None


def continued(search: CoefficientSearch, found: SelectedStructure) -> SelectedStructure:
    """Forward selection and replacement continued from a structure."""
    grown = search.forward(found, search.hypotheses, found.estimate.problem.settings.most)
    return search.with_replacements(grown, search.hypotheses)


def _restarted(
    search: CoefficientSearch, initial: SelectedStructure, shifted: SelectedStructure, order: _Order
) -> SelectedStructure:
    """The search restarted with the level shifts of another structure, in the order that was better before."""
    point = with_shifts(initial.estimate.point, shifts_of(shifted.estimate))
    restart = SelectedStructure(estimate(initial.estimate.problem, point, initial.estimate.solution.weights), ())
    found, _ = _stepwise(search, restart, order)
    return _with_restarted_shifts(search, found)


def _with_restarted_shifts(search: CoefficientSearch, found: SelectedStructure) -> SelectedStructure:
    """The structure with its level shifts selected again, where that is likelier with no fewer shifts.

    While the centre-of-gravity position is unknown, a moment due to its movement is taken for a step of the moment.
    """
    problem, current = found.estimate.problem, shifts_of(found.estimate)
    reduced = estimate(problem, without_shifts(found.estimate), found.estimate.solution.weights)
    most = problem.settings.most
    restarted = SelectedStructure(level_shifts(reduced, search.coefficients, search.criterion, most), found.chosen)
    fewer = len(shifts_of(restarted.estimate)) < len(current)
    return found if fewer else max(found, restarted, key=search.penalised_likelihood)


class _Order(Enum):
    """Order of a stepwise search of significantly higher penalised likelihood; `EITHER`: neither, or not compared."""

    EITHER = auto()
    SEPARATION_FIRST = auto()
    ONE_BY_ONE = auto()


def _stepwise(
    search: CoefficientSearch, initial: SelectedStructure, order: _Order = _Order.EITHER
) -> tuple[SelectedStructure, _Order]:
    """Stepwise structure; with controls and flow separation first where that gives the higher penalised likelihood.

    In a stall, separation and the simultaneous stabiliser and thrust inputs act on the coefficients together: powers of
    alpha entered one by one would replace all three. Both orders are compared at the same number of effects, unless one
    of them is known to be significantly better.
    """
    problem, hypotheses = initial.estimate.problem, search.hypotheses
    most = problem.settings.most
    if order is _Order.ONE_BY_ONE or not shows_separation(problem):
        return _with_replacements_or_separation(search, search.forward(initial, hypotheses, most)), order
    enough = NumberSeenByCopies(most)
    separation_first = functools.partial(_separation_first, search, initial, enough)
    if order is _Order.SEPARATION_FIRST and (known := separation_first()) is not None:
        return _with_replacements_or_separation(search, known), order
    separated, (found, path, history) = both(
        separation_first, functools.partial(_one_by_one, search, initial, enough), [problem]
    )
    if separated is None:
        return _with_replacements_or_separation(search, found), _Order.EITHER
    effects = len(separated.chosen)
    lead = search.penalised_likelihood(separated) - next(
        (value for count, value in path if count >= effects), path[-1][1]
    )
    if lead > 0.0:
        better = _Order.SEPARATION_FIRST if lead > problem.settings.alike else _Order.EITHER
        return _with_replacements_or_separation(search, separated), better
    if history is not None:
        found = search.forward(found, hypotheses, most, history=history)
    whole = _with_replacements_or_separation(search, found)
    return whole, _Order.ONE_BY_ONE if lead < -problem.settings.alike else _Order.EITHER


def _separation_first(
    search: CoefficientSearch, initial: SelectedStructure, enough: NumberSeenByCopies
) -> SelectedStructure | None:
    """Forward selection with the controls first and flow separation second; None where separation is not significant.

    Behind separation the controls are searched again, before all others: on a quasi-steady stall of the ATTAS the
    moment of the thrust shows only then, and a centre of gravity displaced by a third of the chord stood for it.
    `enough` receives the number of its effects.
    """
    problem, hypotheses = initial.estimate.problem, search.hypotheses
    controls = [hypothesis for hypothesis in hypotheses if is_control_term(hypothesis)]
    driven = search.forward(initial, controls, problem.settings.most, step_changes=False)
    separated = with_flow_separation(driven, problem, search.criterion, search.coefficients)
    if separated is not None:
        driven = search.forward(separated, controls, problem.settings.most, step_changes=False)
        separated = search.forward(driven, hypotheses, problem.settings.most)
        enough.value = len(separated.chosen)
    return separated


def _one_by_one(
    search: CoefficientSearch, initial: SelectedStructure, enough: NumberSeenByCopies
) -> tuple[SelectedStructure, list[tuple[int, float]], SelectionHistory | None]:
    """Forward selection up to a number of effects that may be set meanwhile.

    Also returned are, for each intermediate structure, the number of its effects and its penalised likelihood, and the
    history with which it can be continued: None where it came to its end.
    """
    path, history = [], SelectionHistory()
    most = initial.estimate.problem.settings.most
    for found in search.forward_selection(initial, search.hypotheses, most, history=history):
        path.append((len(found.chosen), search.penalised_likelihood(found)))
        if len(found.chosen) >= enough.value:
            return found, path, None if history.recurred else history.before(found)
    return found, path, None
