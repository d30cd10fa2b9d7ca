"""Confirmation on validation flights of terms that the fitted flights only suggest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from aerosid.effects.sudden import is_sudden
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine, refine_on
from aerosid.estimation.open_loop import on_log
from aerosid.flight_model.aerodynamics import Entry
from aerosid.model_error.coefficient_match import explained_shares
from aerosid.notation import number, with_deviation
from aerosid.search.disturbance_search import with_unmodelled_forces
from aerosid.search.findings import Finding
from aerosid.search.settings import SuggestionSettings
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import SuggestedTerm, reason

VALIDATION_ESTIMATE = RefinementSettings(steps=30, step_tolerance=0.03, cost_tolerance=0.5, disturbances=False)
"""Where the search among forces begins: a tenth of a deviation moves nothing."""


USUAL = SuggestionSettings()
"""The settings of a loop unless told otherwise."""

BODY_AXES = {"C_L": "C_Z", "C_D": "C_X"}
"""Where a coefficient along the wind shows most in those that are measured."""


@dataclass(frozen=True)
class Confirmed:
    """A term that was suggested, and its number from flights that were not fitted, by themselves.

    Attributes
    ----------
    suggested : Unproven
        What the fitted flights say of it.
    value, std_error : float
        From the others alone, among forces of any shape.
    p_value : float
        Of the others' saying so by chance; counts how many terms they were asked about.
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
    """The suggested terms that other flights show too.

    Notes
    -----
    Those flights are asked about few terms, not about all that may enter, so that fewer deviations leave no doubt.
    A term stands where its number from them alone, every coefficient off by forces of any shape, has the sign that was
    suggested and is that far from zero, and where the number of the fitted flights explains the coefficient that they
    measured better than none. That is asked of the coefficient and not of the motion, which what else is missing moves.
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
    """The estimate with some terms beside what it holds."""
    return refine_on(completed.with_terms(entries), search.manoeuvres)


def note_on_confirmed(
    confirmed: Sequence[Confirmed],
    flights: Sequence[str],
    findings: Sequence[Finding] = (),
    settings: SuggestionSettings = USUAL,
) -> list[str]:
    """A sentence for each, for the notes: the number that is named, and the other flights' own.

    Parameters
    ----------
    flights : sequence of str
        Names of the flights that were asked.
    findings : sequence of Finding
        What is named, with its final numbers.
    settings : SuggestionSettings
        From how many standard errors on two numbers are told to differ.
    """
    final = {finding.entry: finding for finding in findings}
    sentences = []
    for each in confirmed:
        named = final.get(each.entry, each.suggested.finding)
        apart = abs(named.value - each.value) / float(np.hypot(named.std_error, each.std_error))
        size = f" The two numbers are {number(apart)} standard errors apart." if apart > settings.apart else ""
        sentences.append(
            f"Confirmed: {each.entry[0]} {each.entry[1]} = {with_deviation(named.value, named.std_error)} "
            f"is not proven by what was fitted ({reason(each.suggested, named)}), but what was not "
            f"({' and '.join(flights)}) shows it by itself too, with the same sign: "
            f"{with_deviation(each.value, each.std_error)}. The errors there had a part in naming it.{size}"
        )
    return sentences


def _estimate_on_validation(
    search: StructureSearch,
    completed: Refinement,
    each: SuggestedTerm,
    validation: Sequence[Manoeuvre],
    critical_ratio: float,
) -> tuple[float, float]:
    """The term's number from other flights alone and its deviation; infinite where a first look is enough to refuse."""
    fuller = completed.with_terms([each.entry])
    own = refine(
        fuller.model,
        validation,
        fuller.free,
        effects=[active for active in completed.effects if not is_sudden(active)],
        variance=completed.variance,
        settings=VALIDATION_ESTIMATE,
    )
    place = own.free.index(each.entry)
    value, white = own.model.value(each.entry), float(np.sqrt(own.covariance[place, place]))
    if np.sign(each.finding.value) * value < critical_ratio * white:
        return 0.0, np.inf  # white residuals are the most that could be hoped for
    other = StructureSearch(
        tuple(validation), search.hypotheses, search.step_coefficients, own, search.settings, search.declared_values
    )
    forced = with_unmodelled_forces(other, own) if search.step_coefficients else own
    uncertainty = deviations(forced, validation)
    return forced.model.value(each.entry), float(max(uncertainty.corrected[place], uncertainty.white[place]))


def _explains_validation_coefficient(
    search: StructureSearch, completed: Refinement, each: SuggestedTerm, validation: Sequence[Manoeuvre]
) -> bool:
    """Whether the number of the fitted flights explains more of the coefficient that the others measured."""
    fuller = with_confirmed(search, completed, [each.entry])
    coefficient = BODY_AXES.get(each.entry[0], each.entry[0])
    unexplained = []
    for manoeuvre in validation:
        pair = [(at.model, on_log(at, manoeuvre)) for at in (completed, fuller)]
        rows = [row for row in explained_shares(pair[0], pair[1], manoeuvre) if row.coefficient == coefficient]
        unexplained += [(1.0 - row.r2_before, 1.0 - row.r2_after) for row in rows]
    without, with_term = np.sum(unexplained, axis=0) if unexplained else (0.0, 0.0)
    return bool(with_term < search.settings.suggestion.less * without)
