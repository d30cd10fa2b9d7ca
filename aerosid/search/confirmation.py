"""Confirmation of suggested terms by an independent estimate on validation flights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from aerosid.effects.step_input import is_step_change
from aerosid.equation_error.selection.starting_values import MAINLY
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine, refine_on
from aerosid.estimation.open_loop import on_log
from aerosid.flight_model.aerodynamics import Entry
from aerosid.model_error.paper_chain.coefficient_match import explained_shares
from aerosid.notation import number, with_deviation
from aerosid.search.disturbance_search import with_unmodelled_forces
from aerosid.search.findings import Finding
from aerosid.search.settings import SuggestionSettings
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import SuggestedTerm, reason

VALIDATION_ESTIMATE = RefinementSettings(steps=30, step_tolerance=0.03, cost_tolerance=0.5, disturbances=False)
"""Start of the fit with unmodelled forces: a tenth of a standard deviation is accurate enough."""


@dataclass(frozen=True)
class Confirmed:
    """A suggested term with its independent estimate from the validation flights.

    Attributes
    ----------
    suggested : SuggestedTerm
        The estimate from the fitted flights.
    value, std_error : float
        From the validation flights alone, in the presence of unmodelled forces.
    p_value : float
        Of the validation estimate under the null hypothesis, times the number of terms tested (Bonferroni).
    """

    suggested: SuggestedTerm
    value: float
    std_error: float
    p_value: float

    @property
    def entry(self) -> Entry:
        """Coefficient and term."""
        return self.suggested.entry


def confirmed_terms(
    search: StructureSearch, completed: Refinement, suggested: Sequence[SuggestedTerm], validation: Sequence[Manoeuvre]
) -> tuple[Confirmed, ...]:
    """The suggested terms that the validation flights confirm.

    Notes
    -----
    Only the suggested terms are tested on these flights, not all candidates, so that the critical t-ratio is lower. A
    term is confirmed where its estimate from them alone, with unmodelled forces in every coefficient, has the suggested
    sign and exceeds the critical ratio, and where the value from the fitted flights explains more of the coefficient
    measured on them than no term does. The coefficient is compared and not the motion, which other model errors affect.
    """
    if not validation:
        return ()
    critical_ratio = float(-ndtri(search.settings.confirmed / max(len(suggested), 1)))
    found = []
    for each in suggested:
        try:
            value, error = _estimate_on_validation(search, completed, each, validation, critical_ratio)
        except EstimationError:
            continue
        ratio = np.sign(each.finding.value) * value / error
        if ratio > critical_ratio and _explains_validation_coefficient(search, completed, each, validation):
            p_value = float(min(1.0, ndtr(-ratio) * len(suggested)))
            found.append(Confirmed(each, value, error, p_value))
    return tuple(found)


def with_confirmed(search: StructureSearch, completed: Refinement, entries: Sequence[Entry]) -> Refinement:
    """The estimate with some terms added."""
    return refine_on(completed.with_terms(entries), search.manoeuvres)


def note_on_confirmed(
    confirmed: Sequence[Confirmed],
    flights: Sequence[str],
    findings: Sequence[Finding],
    settings: SuggestionSettings,
) -> list[str]:
    """One sentence per confirmed term, for the notes: the final value, and the validation flights' own estimate.

    Parameters
    ----------
    flights : sequence of str
        Names of the validation flights.
    findings : sequence of Finding
        The findings with their final values.
    settings : SuggestionSettings
        `apart`: standard errors from which the difference of the two values is reported.
    """
    final = {finding.entry: finding for finding in findings}
    sentences = []
    for each in confirmed:
        finding = final.get(each.entry, each.suggested.finding)
        difference = abs(finding.value - each.value) / float(np.hypot(finding.std_error, each.std_error))
        comparison = (
            f" The two values differ by {number(difference)} standard errors." if difference > settings.apart else ""
        )
        sentences.append(
            f"Confirmed: {each.entry[0]} {each.entry[1]} = {with_deviation(finding.value, finding.std_error)} "
            f"is not significant on the fitted flights ({reason(each.suggested, finding)}), but the validation flights "
            f"({' and '.join(flights)}) confirm it by an independent estimate of the same sign: "
            f"{with_deviation(each.value, each.std_error)}. So they took part in the selection.{comparison}"
        )
    return sentences


def _estimate_on_validation(
    search: StructureSearch,
    completed: Refinement,
    each: SuggestedTerm,
    validation: Sequence[Manoeuvre],
    critical_ratio: float,
) -> tuple[float, float]:
    """The term's validation estimate and its standard deviation; infinite where white residuals already reject it."""
    fuller = completed.with_terms([each.entry])
    own = refine(
        fuller.model,
        validation,
        fuller.free,
        effects=[active for active in completed.effects if not is_step_change(active)],
        variance=completed.variance,
        settings=VALIDATION_ESTIMATE,
    )
    place = own.free.index(each.entry)
    value, white = own.model.value(each.entry), float(np.sqrt(own.covariance[place, place]))
    if np.sign(each.finding.value) * value < critical_ratio * white:
        return 0.0, np.inf  # coloured residuals can only increase the standard deviation
    other = StructureSearch(
        tuple(validation), search.hypotheses, search.step_coefficients, own, search.settings, search.declared_values
    )
    forced = with_unmodelled_forces(other, own) if search.step_coefficients else own
    uncertainty = deviations(forced, validation)
    return forced.model.value(each.entry), float(max(uncertainty.corrected[place], uncertainty.white[place]))


def _explains_validation_coefficient(
    search: StructureSearch, completed: Refinement, each: SuggestedTerm, validation: Sequence[Manoeuvre]
) -> bool:
    """Whether the value from the fitted flights explains more of the coefficient measured on the validation flights."""
    fuller = with_confirmed(search, completed, [each.entry])
    coefficient = MAINLY.get(each.entry[0], each.entry[0])
    unexplained = []
    for manoeuvre in validation:
        pair = [(at.model, on_log(at, manoeuvre)) for at in (completed, fuller)]
        rows = [row for row in explained_shares(pair[0], pair[1], manoeuvre) if row.coefficient == coefficient]
        unexplained += [(1.0 - row.r2_before, 1.0 - row.r2_after) for row in rows]
    without, with_term = np.sum(unexplained, axis=0) if unexplained else (0.0, 0.0)
    return bool(with_term < search.settings.suggestion.less * without)
