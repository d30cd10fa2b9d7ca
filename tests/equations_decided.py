"""The equation-error decision on logs and an aircraft, as the loop asks for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.equation_error.decision import EquationErrorDecision, decide
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.equations.regular_recordings import read_recordings
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.regression.related_problems import coefficients_of_all
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors, identify_instrument_errors
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.logs.flight_log import FlightLog
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses


def decided(aircraft: Aircraft, logs: list[FlightLog], others: list[FlightLog]) -> EquationErrorDecision:
    a_priori = {(d.coefficient, d.term): (d.value, d.sigma) for d in aircraft.derivatives if d.sigma is not None}
    return decide(identified(aircraft, logs, others), aircraft.coefficients, declared=a_priori)


def named_values(found: EquationErrorDecision) -> dict[tuple[str, str], tuple[float, float]]:
    """Value and standard error of every finding, by kind and place."""
    return {(row.hypothesis.kind, row.hypothesis.where): (row.value, row.std_error) for row in found.findings}


def terms_lie_within(found: EquationErrorDecision, truth: Mapping[tuple[str, str], float], deviations: float) -> bool:
    """Whether every term of the completed structure is as true as its standard error says."""
    errors = np.sqrt(np.diag(found.covariance))
    values = zip(found.completed.design.unknowns, found.completed.solution.values, errors, strict=True)
    return all(
        abs(value - truth[entry[0], str(entry[1])]) < deviations * error
        for (kind, entry, *_), value, error in values
        if kind == "term"
    )


def identified(aircraft: Aircraft, logs: list[FlightLog], others: list[FlightLog]) -> InstrumentErrors:
    """The instrument errors identified by kinematics, the first stage alone."""
    candidates = candidate_entries(aircraft, [*logs, *others])
    model, manoeuvres, unseen = _prepared(aircraft, logs, others, candidates)
    free = [(d.coefficient, d.term) for d in aircraft.derivatives]
    hypotheses = term_hypotheses(candidates) + effect_hypotheses(model, manoeuvres, aircraft.coefficients)
    errors = identify_instrument_errors(model, free, (), hypotheses, manoeuvres, unseen, length=aircraft.length)
    assert errors is not None
    return errors


def declared(aircraft: Aircraft, logs: list[FlightLog], others: list[FlightLog]) -> Estimate:
    """The coefficients of the declared structure, as in `before` of `decided`, without a search."""
    candidates = candidate_entries(aircraft, [*logs, *others])
    model, manoeuvres, unseen = _prepared(aircraft, logs, others, candidates)
    settings = EquationErrorSettings()
    whole = coefficients_of_all(read_recordings(manoeuvres, unseen, settings), settings, model)
    problem = replace(whole, all_fitted=False)
    return estimate(problem, Point(model, tuple((d.coefficient, d.term) for d in aircraft.derivatives), ()))


def frames_of(
    aircraft: Aircraft, logs: list[FlightLog], others: list[FlightLog], candidates: Sequence[Entry]
) -> tuple[AerodynamicModel, RegressionProblem, RegressionProblem]:
    """The declared model, and the coefficient equations of all flights and of the fitted ones."""
    model, manoeuvres, unseen = _prepared(aircraft, logs, others, candidates)
    settings = EquationErrorSettings()
    whole = coefficients_of_all(read_recordings(manoeuvres, unseen, settings), settings, model)
    return model, whole, replace(whole, all_fitted=False)


def _prepared(
    aircraft: Aircraft, logs: list[FlightLog], others: list[FlightLog], candidates: Sequence[Entry]
) -> tuple[AerodynamicModel, list[Manoeuvre], list[Manoeuvre]]:
    """The declared model with columns for candidates, and the flights."""
    model = declared_model(aircraft, float(np.nanmean(logs[0]["V"])), [term for _, term in candidates])
    fitted, unseen = ([prepare(log, aircraft, model.columns) for log in part] for part in (logs, others))
    return model, fitted, unseen


def questioned(aircraft: Aircraft, log: FlightLog) -> tuple[AerodynamicModel, Manoeuvre]:
    """The declared model and a log as its flight, with no candidates."""
    model = declared_model(aircraft, float(np.nanmean(log["V"])))
    return model, prepare(log, aircraft, model.columns)
