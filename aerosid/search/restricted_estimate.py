"""Restricted estimation: a structure re-estimated with some of its coefficients fixed at given values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.search.attribution import Attribution
from aerosid.search.equation_error_attribution import with_initial_states
from aerosid.search.final_significance import eliminate_by_wald_test
from aerosid.search.finding_evidence import findings_with_p_values
from aerosid.search.structure_search import StructureSearch
from aerosid.signals.restricted_least_squares import restricted_least_squares


def restricted_estimate(found: Attribution, values: Mapping[Entry, float], search: StructureSearch) -> Attribution:
    """The attribution with some entries fixed, by the estimator that its findings are from.

    Parameters
    ----------
    found : Attribution
        With these entries free.
    values : mapping of Entry to float
        Their fixed values, in the coefficient's unit.
    search : StructureSearch
        The flights that were fitted, with the settings.

    Raises
    ------
    EstimationError
        Where the others cannot be estimated with them.
    """
    if found.regressed:
        return _restricted_regression(found, values, search)
    return eliminate_by_wald_test(_restricted_likelihood(found, values, search), search)


def _restricted_likelihood(found: Attribution, values: Mapping[Entry, float], search: StructureSearch) -> Attribution:
    """The maximum-likelihood estimate of the others, started from that with all free."""
    completed = found.completed
    numbers = completed.model.values.copy()
    for entry, value in values.items():
        numbers[completed.model.index(entry)] = value
    places = [n for n, entry in enumerate(completed.free) if entry not in values]
    free = tuple(completed.free[n] for n in places)
    start = replace(completed, model=completed.model.with_values(numbers), free=free)
    restricted = found.re_estimated(start, search.manoeuvres)
    uncertainty = found.completed_deviations.of_entries(places)
    with_forces = found.filter_error
    if with_forces is not None:
        with_forces = replace(with_forces, values=with_forces.values[places], deviations=with_forces.deviations[places])
    findings = findings_with_p_values(search, restricted, uncertainty)
    return replace(
        found, completed=restricted, completed_deviations=uncertainty, filter_error=with_forces, findings=findings
    )


def _restricted_regression(found: Attribution, values: Mapping[Entry, float], search: StructureSearch) -> Attribution:
    """The restricted regression of the others, simulated with its own initial states; effects keep their values."""
    completed = found.completed
    rest = [n for n, entry in enumerate(completed.free) if entry not in values]
    model = restricted_to_first_order(found, values)
    free = tuple(completed.free[n] for n in rest)
    estimate = with_initial_states(model, free, completed.effects, search.manoeuvres)
    findings = tuple(
        replace(finding, value=model.value(finding.entry)) if finding.entry in free else finding
        for finding in found.findings
    )
    uncertainty = found.completed_deviations.of_entries(rest)
    return replace(found, completed=estimate, completed_deviations=uncertainty, findings=findings)


def restricted_to_first_order(found: Attribution, values: Mapping[Entry, float]) -> AerodynamicModel:
    """The model with some entries at given values and the others moved by their correlations; effects are unchanged.

    Exact for a regression at given numbers of the effects; of output error the first step of a re-estimation.
    """
    completed, uncertainty = found.completed, found.completed_deviations
    covariance = uncertainty.covariance if uncertainty.beside_effects is None else uncertainty.beside_effects
    fixed = [n for n, entry in enumerate(completed.free) if entry in values]
    places = completed.model.indices(completed.free)
    numbers = completed.model.values.copy()
    numbers[places] = restricted_least_squares(
        completed.model.values[places],
        np.where(np.isfinite(covariance), covariance, 0.0),
        fixed,
        [values[completed.free[n]] for n in fixed],
    )
    return completed.model.with_values(numbers)
