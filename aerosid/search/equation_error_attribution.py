"""Attribution from the equation-error decision with its own estimate; the simulation is a prediction only.

In turbulence an open-loop simulation does not follow the flight: its residuals are those of the air, and derivatives
fitted to them are wrong by several standard deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from aerosid.effects import ActiveEffect, PositionEffect, frozen
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.kinds import axes_of
from aerosid.effects.step_input import instant_if_step, rise_of
from aerosid.equation_error.decision import EquationErrorDecision
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.regression.estimate import Estimate
from aerosid.equation_error.selection.alternatives import Alternative
from aerosid.equation_error.selection.predicted_convergence import estimated_with_fewer_parts
from aerosid.equation_error.selection.regressor_errors import with_instrumental_values
from aerosid.equation_error.selection.turbulence import Turbulence
from aerosid.equation_error.selection.wald_tests import EffectEstimate
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import Deviations
from aerosid.estimation.fit_settings import WRONG_STRUCTURE, RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.search.attribution import Attribution
from aerosid.search.coefficient_predictions import CoefficientPredictions
from aerosid.search.findings import Finding, Parameters, log_of_step, named, parameters_of

Array = NDArray[np.float64]

STATES_ALONE = RefinementSettings(steps=20, step_tolerance=0.03, variance_tolerance=0.02, cost_tolerance=0.1)
"""With the derivatives held, the estimate of initial states and noise converges in few steps."""


@dataclass(frozen=True)
class _SimulatedEstimate:
    """An estimate with its standard deviations, those of the effects in the order of the point's effects."""

    refinement: Refinement
    uncertainty: Deviations


def attribute_by_equations(decision: EquationErrorDecision, manoeuvres: Sequence[Manoeuvre]) -> Attribution:
    """The decision as an attribution.

    Parameters
    ----------
    decision : EquationErrorDecision
        The result of the equation-error method.
    manoeuvres : sequence of Manoeuvre
        The identification flights.

    Raises
    ------
    EstimationError
        Where neither the declared nor the completed model can be simulated from any initial state.
    """
    simulated = _completed(decision, manoeuvres)
    declared = _declared(decision, manoeuvres)
    declared, completed = (
        replace(found, seen_on_others=decision.level_shifts) for found in (declared, simulated.refinement)
    )
    findings = [_finding(row, decision, simulated) for row in decision.findings]
    declared_air = {active.effect.kind for active in decision.completed.point.effects if not active.values}
    findings.extend(_gust(seen) for seen in decision.turbulence if seen.kind not in declared_air)
    return Attribution(
        declared,
        completed,
        simulated.uncertainty,
        tuple(findings),
        tuple(_alternative(row, decision.hypothesis_count) for row in decision.alternatives),
        (),
        decision.refuted,
        regressed=True,
        predictions=CoefficientPredictions(decision),
        re_estimator=partial(_re_estimated, decision=decision, manoeuvres=manoeuvres),
    )


def _re_estimated(start: Refinement, *, decision: EquationErrorDecision, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
    """The regression of a structure with fewer parts, instrument errors held, with the initial states it needs."""
    completed = decision.completed
    acting = completed.point.effects
    effects = decision.with_instruments_held(
        active for active, simulated in zip(acting, _simulated(acting), strict=True) if simulated in start.effects
    )
    point = Point(start.model, start.free, effects)
    adopted = {row.coefficient for row in decision.regressor_errors if row.adopted}
    found = with_instrumental_values(estimated_with_fewer_parts(completed.problem, point, completed), adopted).point
    held = tuple(map(frozen, found.effects))
    return replace(with_initial_states(found.model, (), held, manoeuvres), seen_on_others=decision.level_shifts)


def _simulated(effects: Sequence[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """The effects as the likelihood takes them: sensor positions held."""
    return tuple(frozen(active) if isinstance(active.effect, PositionEffect) else active for active in effects)


def _of_equations(found: Estimate, covariance: Array, manoeuvres: Sequence[Manoeuvre]) -> _SimulatedEstimate:
    """The regression's estimate with the initial states and noise that its simulation needs."""
    point = found.point
    refinement = with_initial_states(point.model, point.free, _simulated(point.effects), manoeuvres, point.effects)
    return _SimulatedEstimate(refinement, _deviations(found, covariance, refinement))


def _completed(decision: EquationErrorDecision, manoeuvres: Sequence[Manoeuvre]) -> _SimulatedEstimate:
    """The completed structure's regression; where that cannot be simulated, its output-error estimate.

    Collinear derivatives that hardly matter to the regression may make an aircraft that no simulation holds.
    """
    found, covariance = decision.completed, decision.covariance
    try:
        return _of_equations(found, covariance, manoeuvres)
    except EstimationError:
        refinement = _by_output_error(found.point, decision, manoeuvres)
        return _SimulatedEstimate(refinement, _deviations(found, covariance, refinement))


def _declared(decision: EquationErrorDecision, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
    """The declared structure's regression; where that cannot be simulated, its output-error estimate.

    Without what is missing a regression may give an aircraft so unstable that not even a filter holds it to the flight,
    such as C_n_beta = -1 where thrust changes it: that ends no loop, since the completed structure has what is missing.
    """
    try:
        return _of_equations(decision.before, decision.before_covariance, manoeuvres).refinement
    except EstimationError:
        return _by_output_error(decision.before.point, decision, manoeuvres)


def _by_output_error(point: Point, decision: EquationErrorDecision, manoeuvres: Sequence[Manoeuvre]) -> Refinement:
    """The output-error estimate of a structure, started from the declared values and those of its further terms."""
    given = decision.kinematic_estimate.point.model
    values = [(given if entry in given.places else point.model).value(entry) for entry in point.model.entries]
    effects, model = _simulated(point.effects), point.model.with_values(np.array(values))
    return refine(model, manoeuvres, point.free, effects=effects, settings=WRONG_STRUCTURE)


def with_initial_states(
    model: AerodynamicModel,
    free: Sequence[Entry],
    effects: Sequence[ActiveEffect],
    manoeuvres: Sequence[Manoeuvre],
    acting: Sequence[ActiveEffect] | None = None,
) -> Refinement:
    """A model of given parameter values with the initial states and the noise that its simulation needs.

    Parameters
    ----------
    free : sequence of Entry
        Which of its terms are reported as estimated.
    effects : sequence of ActiveEffect
        As the likelihood takes them.
    acting : sequence of ActiveEffect, optional
        Those that act while the states are estimated, where they differ.

    Raises
    ------
    EstimationError
        Where it cannot be simulated over the whole record from any initial state.
    """
    held = [frozen(active) for active in (effects if acting is None else acting)]
    fitted = refine(model, manoeuvres, (), effects=held, settings=STATES_ALONE)
    likelihood = Likelihood(model, tuple(manoeuvres), tuple(free))
    likelihood.held_to_data = fitted.held_to_data
    at = likelihood.evaluate(model.values, fitted.states, tuple(effects), fitted.variance)
    if at is None:
        raise EstimationError(
            "the model found by equation error cannot be simulated over the whole record; shorten it with --from and "
            "--to."
        )
    return Refinement(
        model=model,
        free=tuple(free),
        states=at.states,
        effects=tuple(effects),
        variance=at.variance,
        cost=at.cost,
        information=at.information,
        converged=True,
        held_to_data=likelihood.held_to_data,
    )


def _deviations(found: Estimate, covariance: Array, refinement: Refinement) -> Deviations:
    """The regression's standard deviations of the free entries and of the effects' parameters."""
    unknowns = found.design.unknowns
    rows = np.zeros((len(refinement.free), len(unknowns)))
    for n, entry in enumerate(refinement.free):
        own = [p for p, unknown in enumerate(unknowns) if unknown[0] in ("term", "one") and unknown[1] == entry]
        rows[n, own] = 1.0 / max(len(own), 1)
    shared = rows @ covariance @ rows.T
    white = np.sqrt(np.maximum(np.diag(rows @ found.solution.covariance @ rows.T), 0.0))
    corrected = np.sqrt(np.maximum(np.diag(shared), 0.0))
    size = np.where(corrected > 0.0, corrected, 1.0)
    correlation = np.abs(shared / np.outer(size, size)) - np.eye(len(size))
    numbers = [
        unknowns.index(("effect", i, k))
        for i, active in enumerate(found.point.effects)
        if not isinstance(active.effect, PositionEffect)
        for k in range(len(active.values))
    ]
    known = [p for p, unknown in enumerate(unknowns) if unknown[0] == "effect"]
    answers = rows @ found.solution.covariance[:, known]
    inverse = np.linalg.pinv(found.solution.covariance[np.ix_(known, known)], rcond=1e-12, hermitian=True)
    return Deviations(
        corrected=corrected,
        white=white,
        published=corrected,
        covariance=shared,
        correlation_max=np.max(correlation, axis=1, initial=0.0),
        effects=np.sqrt(np.diag(covariance)[numbers]),
        effects_white=np.sqrt(np.diag(found.solution.covariance)[numbers]),
        beside_effects=rows @ found.solution.covariance @ rows.T - answers @ inverse @ answers.T,
    )


def _finding(row: EffectEstimate, decision: EquationErrorDecision, simulated: _SimulatedEstimate) -> Finding:
    """A finding with the values of the final estimate."""
    kind, where, term = row.hypothesis.kind, row.hypothesis.where, row.hypothesis.term
    entry: Entry | None = row.hypothesis.entries[0] if row.hypothesis.entries else None
    values: tuple[float, ...] = (row.value,)
    errors, ratio = row.std_errors, row.ratio
    active = row.active
    if entry is not None:
        place = simulated.refinement.free.index(entry)
        values = (simulated.refinement.model.value(entry),)
        errors = (float(simulated.uncertainty.corrected[place]),)
        ratio = abs(values[0]) / errors[0] if errors[0] > 0.0 else np.inf
    elif active is not None and not isinstance(active.effect, PositionEffect):
        place = decision.completed.point.effects.index(active)
        first = sum(len(each.values) for each in simulated.refinement.effects[:place])
        active = simulated.refinement.effects[place]
        values = active.values
        errors = tuple(float(e) for e in simulated.uncertainty.effects[first : first + len(values)])
    elif active is not None:
        values = active.values
    return Finding(
        kind=kind,
        where=where,
        term=term,
        entry=entry,
        value=values[0],
        std_error=errors[0],
        unit=active.effect.parameters[0].unit if active is not None else "1",
        time=instant_if_step(active),
        log=log_of_step(active),
        ordinal=active.ordinal if active is not None else 1,
        p_value=float(min(1.0, 2.0 * ndtr(-ratio) * decision.hypothesis_count)),
        gain=2.0 * row.gain,
        along=axes_of(row.active),
        parameters=_parameters(row, active, errors),
        unseen_better=row.improves_prediction,
    )


def _parameters(row: EffectEstimate, active: ActiveEffect | None, errors: Sequence[float]) -> Parameters:
    """The parameters of an effect; of a step change the time that it takes, chosen among a few."""
    if active is None:
        return ()
    if row.hypothesis.time is not None:
        return (("rise", rise_of(active), float("nan"), "s"),)
    return parameters_of(active, errors)


def _alternative(row: Alternative, tested: int) -> Finding:
    """An alternative as a finding."""
    hypothesis: Hypothesis = row.hypothesis
    kind, where, term = hypothesis.kind, hypothesis.where, hypothesis.term
    return Finding(
        kind=kind,
        where=where,
        term=term,
        entry=hypothesis.entries[0] if hypothesis.entries else None,
        value=row.value,
        std_error=row.std_error,
        unit=row.active.effect.parameters[0].unit if row.active is not None else "1",
        time=instant_if_step(row.active),
        log=log_of_step(row.active),
        p_value=float(min(1.0, 2.0 * ndtr(-row.ratio) * tested)),
        gain=2.0 * row.gain,
        along=axes_of(row.active),
        instead_of=named(row.replaces.label),
        worse_by=2.0 * row.deficit,
        margin=2.0 * row.margin,
    )


def _gust(seen: Turbulence) -> Finding:
    """The turbulence along one axis, shown by a vane and its force together, as a finding."""
    return Finding(
        kind=seen.kind,
        where="",
        term="",
        entry=None,
        value=seen.sigma,
        std_error=seen.sigma_error,
        unit="m/s",
        time=None,
        p_value=float(2.0 * ndtr(-seen.response / seen.response_error)),
        gain=(seen.response / seen.response_error) ** 2,
        parameters=(
            ("sigma", seen.sigma, seen.sigma_error, "m/s"),
            ("length", seen.length, float("nan"), "m"),
        ),
    )
