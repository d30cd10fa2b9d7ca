"""Attribution by partial correlation with the model error d(t) alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import Deviations
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.flight import simulate_outputs
from aerosid.model_error.flight_sweeps.flights_in_error import FlightsInError
from aerosid.model_error.flight_sweeps.forward_start import forward_forces
from aerosid.model_error.flight_sweeps.sweeps import is_seen
from aerosid.model_error.flight_sweeps.swept_model import ErrorStatistics, Sweep, SweepSettings, SweptModel
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.attribution import Attribution
from aerosid.search.findings import finding_among
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from aerosid.search.partial_correlation.stepwise import Selection, select

Array = NDArray[np.float64]


def attribute_by_model_error(
    declared: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    hypotheses: Sequence[Hypothesis],
    coefficients: Sequence[str],
    chain: ChainSettings,
    settings: ModelErrorSearchSettings,
    progress: Callable[[str], None] = lambda _stage: None,
    known: Attribution | None = None,
) -> tuple[Attribution, Selection]:
    """Stepwise selection of the declared model's missing effects by its model error d(t); with the selection itself.

    Parameters
    ----------
    declared : AerodynamicModel
        Structure and declared values.
    manoeuvres : sequence of Manoeuvre
        The identification flights, one joint estimate.
    free : sequence of Entry
        Declared terms that are re-estimated.
    given : sequence of ActiveEffect
        Effects that the aircraft file declares, their parameters held.
    hypotheses : sequence of Hypothesis
        The candidates.
    coefficients : sequence of str
        The aircraft's three.
    chain : ChainSettings
        Prefilter and weights of the forward estimate from which the sweeps start.
    known : Attribution, optional
        The attribution of the same flights by another method: the sweeps start from its motion in place of the forward
        estimate.

    Raises
    ------
    EstimationError
        Where the declared model with its d(t), or the completed one without, cannot be simulated.
    """
    start = None if known is None else _start_along(known, declared, manoeuvres, free, given, coefficients, settings)
    start = start or swept_start(declared, manoeuvres, free, given, coefficients, chain, settings)
    selection = select(start, manoeuvres, coefficients, hypotheses, settings, progress)
    _require_open_loop(selection.completed, manoeuvres)
    before, _ = _refinement(selection.before)
    completed, uncertainty = _refinement(selection.completed)
    findings = tuple(
        replace(finding_among(part, selection.tested, gain), p_value=p_value) for part, gain, p_value in selection.parts
    )
    found = Attribution(before, completed, uncertainty, findings, selection.alternatives, selection.rounds)
    return found, selection


def swept_start(
    declared: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    coefficients: Sequence[str],
    chain: ChainSettings,
    settings: ModelErrorSearchSettings,
) -> SweptModel:
    """The declared structure with the forward estimate's d(t)."""
    variance = Likelihood(declared, tuple(manoeuvres), tuple(free)).starting_variance()
    acting = [replace(m, flight=acting_flight(declared, m, given)[0], columns=declared.columns) for m in manoeuvres]
    forces = forward_forces(declared, acting, coefficients, chain)
    statistics = _statistics(forces, variance, settings.sweeps)
    states = tuple(manoeuvre.first_state for manoeuvre in manoeuvres)
    return SweptModel(declared, tuple(free), tuple(given), states, forces, statistics)


def _start_along(
    known: Attribution,
    declared: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    coefficients: Sequence[str],
    settings: ModelErrorSearchSettings,
) -> SweptModel | None:
    """The declared structure with the d(t) that reproduces the motion of a completed one; None where d(t) cannot.

    Along the motion the model error is the difference of the completed and the declared model. The sweeps converge to
    the same estimate from any start.
    """
    completed, before = known.completed, known.before
    if not all(is_seen(active) for active in completed.effects):
        return None
    values = declared.values.copy()
    values[declared.indices(free)] = [before.model.value(entry) for entry in free]
    variance = Likelihood(declared, tuple(manoeuvres), tuple(free)).starting_variance()
    no_error = tuple(np.zeros((manoeuvre.flight.time.size, len(coefficients))) for manoeuvre in manoeuvres)
    statistics = _statistics(no_error, variance, settings.sweeps)
    completed_start = SweptModel(
        completed.model, completed.free, completed.effects, completed.states, no_error, statistics
    )
    declared_start = SweptModel(
        declared.with_values(values), tuple(free), tuple(given), completed_start.states, no_error, statistics
    )
    start = FlightsInError(tuple(manoeuvres), tuple(coefficients)).carried(completed_start, declared_start)
    return replace(start, statistics=_statistics(start.forces, variance, settings.sweeps))


def _statistics(forces: Sequence[Array], variance: Array, settings: SweepSettings) -> ErrorStatistics:
    """Start values of the statistics of d(t)."""
    first = settings.first_spread
    standard_deviations = (first,) * forces[0].shape[1] if first is not None else _standard_deviations(forces, settings)
    return ErrorStatistics(standard_deviations, settings.first_memory, variance)


def _standard_deviations(forces: Sequence[Array], settings: SweepSettings) -> tuple[float, ...]:
    """Root mean square of d(t) in each coefficient, all flights together."""
    rms = np.sqrt(np.mean(np.concatenate(forces) ** 2, axis=0))
    return tuple(np.clip(rms, settings.least_spread, settings.most_spread).tolist())


def note_on_unobservable(selection: Selection) -> list[str]:
    """One sentence on the kinds of effect that the method cannot observe, for the notes."""
    kinds = ", ".join(kind.replace("_", " ") for kind in (*selection.unobservable, "flow_separation"))
    sentence = (
        "Method iebmee: d(t) shows terms, step changes, turbulence and errors of controls and sensors. It has no "
        f"regressor for {kinds}, which were not tested: use the default method for those."
    )
    return [sentence]


def _require_open_loop(completed: Sweep, manoeuvres: Sequence[Manoeuvre]) -> None:
    """Raise where the completed model diverges in an open-loop simulation, whose errors the report states."""
    swept = completed.swept
    model = with_columns_of(swept.model, swept.effects)
    for manoeuvre, state in zip(manoeuvres, swept.states, strict=True):
        flight, _ = acting_flight(model, manoeuvre, swept.effects)
        outputs, _ = simulate_outputs(state, flight, np.array(model.values), model.table, model.constants)
        if not np.isfinite(outputs).all():
            k = int(np.flatnonzero(~np.isfinite(outputs).all(axis=1))[0])
            raise EstimationError(
                f"{manoeuvre.name}: without its d(t) the model found by method iebmee leaves its range at "
                f"{flight.time[k]:.2f} s (sample {k + 1}), so that no error can be stated; use the default method, "
                "which holds an unstable aircraft to the data."
            )


def _refinement(sweep: Sweep) -> tuple[Refinement, Deviations]:
    """The estimate and its standard deviations in the order of the loop: free terms, initial states, effects."""
    swept, fit = sweep.swept, sweep.fit
    free, slopes = len(swept.free), swept.slopes
    count = sum(state.size for state in swept.states)
    states = np.arange(free + slopes, free + slopes + count)
    order = np.concatenate([np.arange(free), states, np.arange(free, free + slopes)])
    columns = fit.whitened(sweep.rows.known)[:, order]
    effects = swept.effects
    model = with_columns_of(swept.model, effects)
    if swept.statistics.gust is not None:
        effects = (*effects, swept.statistics.gust)
        model = with_columns_of(model, effects)
    refinement = Refinement(
        model=model,
        free=swept.free,
        states=swept.states,
        effects=effects,
        variance=swept.statistics.variance,
        cost=sweep.cost,
        information=columns.T @ columns,
        converged=sweep.converged,
    )
    white = sweep.rows.known[:, order]
    bounds = _deviations(white.T @ white)
    corrected = np.sqrt(np.diag(fit.covariance))
    covariance = fit.covariance[:free, :free]
    return refinement, Deviations(
        corrected=corrected[:free],
        white=bounds[:free],
        published=corrected[:free],
        covariance=covariance,
        correlation_max=_largest_correlation(fit.covariance)[:free],
        effects=corrected[free : free + slopes],
        effects_white=bounds[free + count :],
    )


def _deviations(information: Array) -> Array:
    scale = np.sqrt(np.diag(information))
    held = np.flatnonzero(scale > 0.0)
    found = np.full(scale.size, np.inf)
    inner = information[np.ix_(held, held)] / np.outer(scale[held], scale[held])
    found[held] = np.sqrt(np.diag(np.linalg.pinv(inner, rcond=1e-13, hermitian=True))) / scale[held]
    return found


def _largest_correlation(covariance: Array) -> Array:
    """Largest correlation of each parameter with any other, (m,); zero where it is not determined."""
    deviation = np.sqrt(np.diag(covariance))
    held = np.flatnonzero(np.isfinite(deviation) & (deviation > 0.0))
    relation = np.zeros_like(covariance)
    relation[np.ix_(held, held)] = covariance[np.ix_(held, held)] / np.outer(deviation[held], deviation[held])
    np.fill_diagonal(relation, 0.0)
    return np.asarray(np.max(np.abs(relation), axis=1))
