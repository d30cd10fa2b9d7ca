"""The coefficient equations of all records, and an estimate carried over to problems with other ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.gust_response import (
    GustResponse,
    expected_gust_responses,
    expected_rotary_responses,
)
from aerosid.equation_error.equations.points import Point, Unknown
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.declared_values import DeclaredValues
from aerosid.equation_error.regression.design import Weights
from aerosid.equation_error.regression.estimate import Estimate, estimate
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.flight_model.aerodynamics import AerodynamicModel


def coefficients_of_all(
    recordings: tuple[Recording, ...], settings: EquationErrorSettings, declared: AerodynamicModel
) -> RegressionProblem:
    """The coefficient equations of all records, with the responses to gusts that a declared model lets expect."""
    by_flow, by_rate = expected_gust_responses(declared), expected_rotary_responses(declared)
    responses: dict[Unknown, GustResponse] = {("gust", name): each for name, each in by_flow.items()}
    responses |= {("rotary_gust", name): each for name, each in by_rate.items()}
    return RegressionProblem(recordings, COEFFICIENT, settings, all_fitted=True, gust_responses=responses)


def likeliest_estimate(found: Estimate, frames: Iterable[RegressionProblem]) -> Estimate:
    """The likeliest of an estimate and those of the same structure in other problems."""
    best = found
    for problem in frames:
        tried = estimate(problem, found.point, found.solution.weights)
        if tried.log_likelihood > best.log_likelihood:
            best = tried
    return best


def fitted_alone(problem: RegressionProblem, recording: Recording) -> RegressionProblem:
    """The problem of one of the records alone, its coefficients fitted."""
    return replace(problem, recordings=(replace(recording, fitted=True),), all_fitted=False)


def as_compared(problem: RegressionProblem) -> RegressionProblem:
    """The problem in which a model's coefficients are compared with the measured ones, on every record."""
    settings = replace(
        problem.settings, blend=problem.settings.blend_compared, blend_aside=problem.settings.blend_compared
    )
    return replace(problem, settings=settings, all_fitted=True)


def compared_with(values: DeclaredValues, found: Estimate) -> Estimate:
    """An estimate of coefficient equations whose likelihood contains its disagreement with a-priori values."""
    if values.among(found.design.unknowns) is None:
        return found
    return estimate(replace(found.problem, declared=values), found.point, found.solution.weights)


def weights_restricted_to(found: Estimate, problem: RegressionProblem, point: Point) -> Weights:
    """An estimate's colours and sizes for the equations of a problem that contains fewer of them."""
    index = {segment: s for s, segment in enumerate(found.design.segments)}
    own = [index[each.recording, each.equation] for each in problem.segments(point)]
    weights = found.solution.weights
    return replace(weights, colours=tuple(weights.colours[s] for s in own), sizes=weights.sizes[own])
