"""Close the loop: from manoeuvres and a declared aircraft to what is missing, a completed model and its errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

import aerosid
from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.compatibility import Agreement, check_kinematics
from aerosid.effects import ActiveEffect
from aerosid.equation_error.decision import decide
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.errors import EstimationError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.evidence import coloured_noise
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.open_loop import Response, on_log, respond
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.flight_model.longitudinal import OUTPUTS
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.completed_aircraft import complete_aircraft
from aerosid.loop.contradicted_recording import contradicted_loop
from aerosid.loop.goodness import correlation_matrix, fit_rows, innovation_rows, scatter, variance_inflation
from aerosid.loop.linear_analysis import Spread, analyse_models, requirement_for
from aerosid.loop.next_flight.plan import plan_next_flight
from aerosid.loop.result import (
    ClosedLoop,
    DerivativeRow,
    Effect,
    ErrorRow,
    Evidence,
    LinearRow,
    Parameter,
    PrefilterNote,
    Simulated,
    is_shown,
)
from aerosid.loop.verdict import judge, summarise, told_of_colour, told_of_refuted
from aerosid.model_error.coefficient_match import CoefficientRow, explained_shares
from aerosid.model_error.force_history import ErrorHistory, smoothed_histories
from aerosid.model_error.paper_chain import Chain, ChainSettings, run_chain
from aerosid.model_error.screening import (
    RegressorPicture,
    ScreeningRow,
    closest_rivals,
    error_histories,
    regressor_pictures,
    screen,
)
from aerosid.nomenclature import CHANNELS
from aerosid.search.attribution import Attribution, attribute
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.confirmation import told_of_confirmed
from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.findings import Finding
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.indistinguishable_terms import CoefficientRival, told_of_rivals
from aerosid.search.settings import AttributionSettings
from aerosid.search.suggested_terms import told_of_unproven

Progress = Callable[[str], None]


@dataclass(frozen=True)
class LoopSettings:
    """Every setting of the chain, in one place.

    Attributes
    ----------
    chain : ChainSettings
        Prefilter, model-error estimator and recursive least squares.
    attribution : AttributionSettings
        Which evidence lets a term enter where terms alone are asked for.
    equation_error : EquationErrorSettings
        Which evidence of the kinematic and coefficient equations lets anything enter.
    catalogue : "all" or "terms"
        Which kinds of effect are considered: all of them, or aerodynamic terms alone, for studies of many runs.
    paper_chain : bool
        Whether the model error d(t), its correlations and recursive least squares are wanted beside the estimate.
    linear_analysis : bool
        Whether modes and flying qualities of the models are wanted.
    kinematics : bool
        Whether the instruments are compared by kinematics first.
    priors : bool
        Whether the a-priori values of the aircraft file enter the estimate with their sigma; by default the flight
        alone speaks.
    seed : int
        Of every random draw; reported.
    flight_phase, aircraft_class : str or None
        Category and class for the levels of MIL-F-8785C; by default the aircraft file's, else B and II.
    next_flight : bool
        Whether an input is designed where something is left to decide.
    limits : mapping of str to (float, float)
        Of that input: alpha, n_z, V, theta, delta_e, delta_e_rate, SI; they win over those of the aircraft file.
    """

    chain: ChainSettings = field(default_factory=ChainSettings)
    attribution: AttributionSettings = field(default_factory=AttributionSettings)
    equation_error: EquationErrorSettings = field(default_factory=EquationErrorSettings)
    catalogue: Literal["all", "terms"] = "all"
    paper_chain: bool = True
    linear_analysis: bool = True
    kinematics: bool = True
    priors: bool = False
    seed: int = 0
    flight_phase: str | None = None
    aircraft_class: str | None = None
    next_flight: bool = True
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)


BEFORE = RefinementSettings(cost_tolerance=0.05)
"""A wrong structure creeps along a flat valley for long; a twentieth of -2 ln L moves none of its errors."""


def close_loop(
    identification: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = LoopSettings(),
    progress: Progress = lambda _stage: None,
) -> ClosedLoop:
    """What the declared model lacks, the completed model and the errors before and after, on every log.

    Parameters
    ----------
    identification : sequence of FlightLog
        Manoeuvres to fit, one joint estimate; at least one.
    aircraft : Aircraft
        The declared model.
    validation : sequence of FlightLog
        Manoeuvres that are only predicted.
    progress : callable
        Told the name of each stage as it begins.

    Raises
    ------
    LogError
        Where a log lacks a channel that the model needs.
    AircraftError
        Where the aircraft file declares an effect without its numbers, or on a channel that the model does not hold.
    EstimationError
        Where the declared model cannot be simulated at all.
    UsageError
        Where the flight phase or the aircraft class is unknown.
    """
    requirement = requirement_for(aircraft, settings.flight_phase, settings.aircraft_class)
    progress("reading the logs into the flight model")
    plain, candidates = _structure(identification, validation, aircraft)
    manoeuvres = [prepare(log, aircraft, plain.columns) for log in identification]
    others = [prepare(log, aircraft, plain.columns) for log in validation]
    given = declared_effects(aircraft, controls_of(plain), manoeuvres)
    declared = with_columns_of(plain, given)

    progress("comparing the instruments with each other")
    agreement = check_kinematics(identification) if settings.kinematics else None
    if agreement is not None and agreement.verdict is Agreement.INCONSISTENT:
        return contradicted_loop(identification, validation, aircraft, declared, manoeuvres, agreement, settings.seed)

    progress("re-estimating the declared model")
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives if not d.fixed)
    priors = _priors(aircraft) if settings.priors else ()
    hypotheses = term_hypotheses(candidates)
    rivals: list[CoefficientRival] = []
    if settings.catalogue == "all":
        before = _likeliest(declared, manoeuvres, free, given, priors)
        progress("tracing the residual")
        hypotheses += effect_hypotheses(declared, manoeuvres, aircraft.coefficients)
        decision = decide(
            declared, free, given, hypotheses, aircraft.coefficients, manoeuvres, others, settings.equation_error
        )
        found = attribute_by_equations(decision, manoeuvres, before)
        explained = [CoefficientRow(one.coefficient, one.recording, one.r2, other.r2) for one, other in decision.shares]
    else:
        explained = []
        before = refine(declared, manoeuvres, free, effects=given, priors=priors, settings=BEFORE)
        progress("tracing the residual")
        found = attribute(before, manoeuvres, hypotheses, (), replace(settings.attribution, disturbances=False))

    seen = None
    if settings.paper_chain:
        progress("estimating the model error d(t)")
        seen = _seen_in_d(plain, manoeuvres, candidates, found, aircraft.coefficients, settings.chain)
    chain = seen.chain if seen else None

    progress("simulating every log")
    simulated, errors, coefficients = _compare(declared, found, aircraft, manoeuvres, others)
    coefficients = explained or coefficients

    gain = _validation_gain(errors)
    effects = tuple(
        _effect(n, f, seen.correlations if seen else {}, gain) for n, f in enumerate(found.findings, start=1)
    )
    completed, deviations = found.completed, found.completed_deviations
    spread = Spread(completed.free, deviations.covariance)
    linear: tuple[LinearRow, ...] = ()
    unlinearised: tuple[str, ...] = ()
    if settings.linear_analysis:
        linear, unlinearised = analyse_models(aircraft, declared, completed.model, spread, manoeuvres[0], requirement)
    verdict = judge(found, manoeuvres, others)
    rows = _derivative_rows(aircraft, found, chain, scatter(completed, manoeuvres))
    progress("designing the next flight")
    ahead = None
    if settings.next_flight:
        ahead = plan_next_flight(found, manoeuvres, rows, {**aircraft.limits, **settings.limits})
    return ClosedLoop(
        version=aerosid.__version__,
        seed=settings.seed,
        aircraft=aircraft,
        completed_aircraft=complete_aircraft(aircraft, found, len(manoeuvres)),
        identification=tuple(identification),
        validation=tuple(validation),
        verdict=verdict,
        summary=summarise(verdict, effects, tuple(errors)),
        effects=effects,
        alternatives=tuple(_effect(n, other, {}, None) for n, other in enumerate(found.alternatives, start=1)),
        derivatives=rows,
        coefficients=tuple(coefficients),
        errors=tuple(errors),
        simulated=tuple(simulated),
        screening=seen.screening if seen else (),
        model_error=seen.histories if seen else (),
        prefilter=_prefilter_note(seen, settings),
        notes=(
            *_notes(manoeuvres, others, chain, settings),
            *told_of_refuted(found.refuted),
            *told_of_rivals(rivals),
            *told_of_confirmed(found.confirmed, [manoeuvre.log.name for manoeuvre in others]),
            *told_of_unproven(found.unproven),
            *told_of_colour(coloured_noise(completed, manoeuvres)),
            *unlinearised,
            *_not_shown(rows),
        ),
        linear=linear,
        next_flight=ahead,
        fit=tuple(row for each in simulated for row in fit_rows(each)),
        innovations=tuple(innovation_rows(completed, manoeuvres)),
        correlation=correlation_matrix(completed, deviations),
        regressors=seen.regressors if seen else (),
        kinematics=agreement,
    )


def _likeliest(
    declared: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    priors: Sequence[tuple[Entry, float, float]],
) -> Refinement | None:
    """The declared structure re-estimated by simulation; None where the record cannot be simulated from its values."""
    try:
        return refine(declared, manoeuvres, free, effects=given, priors=priors, settings=BEFORE)
    except EstimationError:
        return None


def _structure(
    logs: Sequence[FlightLog], others: Sequence[FlightLog], aircraft: Aircraft
) -> tuple[AerodynamicModel, tuple[Entry, ...]]:
    """The declared model with input columns for every candidate, and the candidates."""
    candidates = candidate_entries(aircraft, [*logs, *others])
    airspeed = float(np.nanmean(logs[0]["V"])) if "V" in logs[0] and np.isfinite(logs[0]["V"]).any() else 0.0
    return declared_model(aircraft, airspeed, [term for _, term in candidates]), candidates


def _priors(aircraft: Aircraft) -> tuple[tuple[Entry, float, float], ...]:
    return tuple(
        ((d.coefficient, d.term), d.value, d.sigma) for d in aircraft.derivatives if d.sigma is not None and not d.fixed
    )


@dataclass(frozen=True)
class _Seen:
    """What the paper's chain shows: the completed structure's values, with and without the filter, and its pictures."""

    chain: Chain
    unfiltered: Chain
    screening: tuple[ScreeningRow, ...]
    histories: tuple[ErrorHistory, ...]
    correlations: dict[Entry, float]
    regressors: tuple[RegressorPicture, ...]


def _seen_in_d(
    declared: AerodynamicModel,
    manoeuvres: Sequence[Manoeuvre],
    candidates: Sequence[Entry],
    found: Attribution,
    coefficients: Sequence[str],
    settings: ChainSettings,
) -> _Seen | None:
    """The paper's chain on the declared and on the completed structure; None where its recursion breaks down."""
    chosen = found.terms
    structure = (*found.before.free, *chosen)
    try:
        deficient = run_chain(declared, manoeuvres, found.before.free, settings)
        scores = found.rounds[0] if found.rounds else ()
        screening = screen(deficient, manoeuvres, candidates, chosen, scores, settings)
        completed = deficient
        if chosen:
            near = deficient.error_density
            completed = run_chain(declared.extended(chosen), manoeuvres, structure, settings, near)
        histories, correlations = smoothed_histories(found.completed, manoeuvres, coefficients, chosen)
        if not histories:
            histories, correlations = error_histories(completed, manoeuvres, chosen, settings)
        regressors = regressor_pictures(completed, manoeuvres, chosen, closest_rivals(screening, candidates), settings)
        u, w, q, theta = (float(number) for number in completed.error_density)
        off = replace(settings, filtering="off", error_density=(u, w, q, theta))
        unfiltered = completed
        if settings.filtering != "off" and any(part.butterworth for part in completed.fed):
            unfiltered = run_chain(declared.extended(chosen), manoeuvres, structure, off)
    except EstimationError:
        return None
    return _Seen(completed, unfiltered, screening, histories, correlations, regressors)


def _compare(
    declared: AerodynamicModel,
    found: Attribution,
    aircraft: Aircraft,
    manoeuvres: Sequence[Manoeuvre],
    others: Sequence[Manoeuvre],
) -> tuple[list[Simulated], list[ErrorRow], list[CoefficientRow]]:
    """Open-loop simulations and their errors on every log, and the shares of the measured coefficients explained."""
    simulated, rows, shares = [], [], []
    variance = found.completed.variance
    logs = [(m, "identification") for m in manoeuvres] + [(m, "validation") for m in others]
    for n, (manoeuvre, role) in enumerate(logs):
        effects, given = on_log(found.completed, manoeuvre), on_log(found.before, manoeuvre)
        # Each search of an initial state begins at the nearest one known: the estimate's own, or the last model's.
        fitted = n < len(manoeuvres)
        plain = respond(declared, manoeuvre, variance, effects=given)
        at = found.before.states[n] if fitted else plain.states[0]
        before = respond(found.before.model, manoeuvre, variance, effects=given, state=at)
        at = found.completed.states[n] if fitted else before.states[0]
        after = respond(found.completed.model, manoeuvre, variance, effects=effects, state=at)
        trimmed = respond(
            found.completed.model,
            manoeuvre,
            variance,
            effects=effects,
            constants_of=aircraft.coefficients,
            state=after.states[0],
        )
        responses = {"declared": plain, "before": before, "after": after, "trimmed": trimmed}
        simulated.append(_simulated(manoeuvre, role, responses))
        rows.extend(_error_rows(manoeuvre, role, responses))
        shares.extend(explained_shares((found.before.model, given), (found.completed.model, effects), manoeuvre))
    return simulated, rows, shares


def _simulated(manoeuvre: Manoeuvre, role: str, responses: dict[str, Response]) -> Simulated:
    names = manoeuvre.outputs

    def channels(values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        return {name: values[:, OUTPUTS.index(name)] for name in names}

    return Simulated(
        log=manoeuvre.log,
        role=role,
        measured=channels(manoeuvre.flight.measured),
        **{variant: channels(response.outputs) for variant, response in responses.items()},
    )


def _error_rows(manoeuvre: Manoeuvre, role: str, responses: dict[str, Response]) -> list[ErrorRow]:
    rows = []
    for name in manoeuvre.outputs:
        i = OUTPUTS.index(name)
        trimmed = responses["trimmed"].rms[name]
        spread = float(np.nanvar(manoeuvre.flight.measured[:, i]))
        rows.append(
            ErrorRow(
                log=manoeuvre.log.name,
                role=role,
                channel=name,
                unit=CHANNELS[name].unit,
                declared=responses["declared"].rms[name],
                before=responses["before"].rms[name],
                after=responses["after"].rms[name],
                trimmed=trimmed,
                noise=float(manoeuvre.noise[i]),
                r2_trimmed=None if trimmed is None or spread == 0.0 else 1.0 - trimmed**2 / spread,
            )
        )
    return rows


def _validation_gain(errors: Sequence[ErrorRow]) -> float | None:
    """Median over channels of before/after on the validation logs."""
    ratios = [
        row.before / row.after
        for row in errors
        if row.role == "validation" and row.before is not None and row.after is not None and row.after > 0.0
    ]
    return float(np.median(ratios)) if ratios else None


def _effect(rank: int, finding: Finding, correlations: dict[Entry, float], gain: float | None) -> Effect:
    correlation = correlations.get(finding.entry) if finding.entry is not None else None
    return Effect(
        rank=rank,
        kind=finding.kind,
        where=finding.where,
        term=finding.term,
        value=finding.value,
        std_error=finding.std_error,
        unit=finding.unit,
        evidence=Evidence(correlation, finding.p_value, gain, finding.gain),
        time=finding.time,
        parameters={name: Parameter(value, _finite(error), unit) for name, value, error, unit in finding.parameters},
        instead_of=finding.instead_of,
    )


def _derivative_rows(
    aircraft: Aircraft, found: Attribution, chain: Chain | None, scattered: Mapping[Entry, float]
) -> tuple[DerivativeRow, ...]:
    """One row for each declared or found term, coefficient by coefficient."""
    declared = {(d.coefficient, d.term): d for d in aircraft.derivatives}
    completed, spread = found.completed, found.completed_deviations
    inflation, beside = variance_inflation(completed), found.filter_error
    rows = []
    order = sorted(dict.fromkeys([*declared, *completed.free]), key=lambda entry: aircraft.coefficients.index(entry[0]))
    for entry in order:
        row = declared.get(entry)
        given = row.value if row else None
        if entry not in completed.free:
            value = completed.model.value(entry)
            rows.append(DerivativeRow(entry[0], str(entry[1]), given, given, value, None, None, None, None, None, True))
            continue
        n = completed.free.index(entry)
        value, error = completed.model.value(entry), float(spread.corrected[n])
        in_chain = chain is not None and entry in chain.entries
        rows.append(
            DerivativeRow(
                coefficient=entry[0],
                term=str(entry[1]),
                declared=given,
                refitted=found.before.model.value(entry) if entry in found.before.free else None,
                value=value,
                std_error=_finite(error),
                std_error_white=_finite(float(spread.white[n])),
                rls=chain.model.value(entry) if chain is not None and in_chain else None,
                rls_std_error=_finite(float(chain.std_errors[chain.entries.index(entry)]))
                if chain is not None and in_chain
                else None,
                correlation_max=_finite(float(spread.correlation_max[n])),
                shown=is_shown(value, given, error),
                variance_inflation=_finite(float(inflation[n])),
                scatter=scattered.get(entry),
                filter_error=_finite(float(beside.values[n])) if beside else None,
                filter_error_std_error=_finite(float(beside.deviations[n])) if beside else None,
            )
        )
    return tuple(rows)


def _not_shown(rows: Sequence[DerivativeRow]) -> list[str]:
    """One sentence for each derivative that the record cannot show, with what hides it."""
    sentences = []
    for row in rows:
        if row.shown:
            continue
        error = "no bound" if row.std_error is None else f"a standard error of {row.std_error:.2g}"
        why = ""
        if row.correlation_max is not None and row.correlation_max > 0.95:
            why = f"; its correlation with another estimate is {row.correlation_max:.3f}"
        sentences.append(
            f"These records cannot show {row.coefficient} {row.term}: {row.value:.3g} has {error}{why}. Do not read it "
            "as measured."
        )
    return sentences


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _prefilter_note(seen: _Seen | None, settings: LoopSettings) -> PrefilterNote:
    if not settings.paper_chain:
        return PrefilterNote("off", None, "The model error d(t) was not asked for.", "")
    filtering = settings.chain.filtering
    if seen is None:
        return PrefilterNote(filtering, None, "The model-error recursion broke down on this flight.", "")
    fed = seen.chain.fed[0]
    if fed.cut_off is None:
        return PrefilterNote("off", None, "Switched off.", "")
    reason = " ".join(f"{text}." for text in fed.cut_off.explanations)
    if seen.unfiltered is seen.chain:
        return PrefilterNote("off", None, reason, "")
    places = seen.chain.model.indices(seen.chain.entries)
    moved = np.abs(seen.chain.model.values - seen.unfiltered.model.values)[places] / seen.chain.std_errors
    most = int(np.nanargmax(moved))
    coefficient, term = seen.chain.entries[most]
    effect = (
        f"Without the filter the estimates of recursive least squares move by {float(np.nanmedian(moved)):.2g} "
        f"standard errors in the median and by at most {float(moved[most]):.2g} ({coefficient} {term}); the refined "
        "values do not use it."
    )
    return PrefilterNote(filtering, fed.cut_off.cut_off_hz, reason, effect)


def _notes(
    manoeuvres: Sequence[Manoeuvre], others: Sequence[Manoeuvre], chain: Chain | None, settings: LoopSettings
) -> tuple[str, ...]:
    notes = [f"{m.log.name}: {note}" for m in (*manoeuvres, *others) for note in (*m.log.notes, *m.notes)]
    if chain is None and settings.paper_chain:
        notes.append("The model-error recursion broke down: derivatives of recursive least squares are missing.")
    return tuple(dict.fromkeys(notes))
