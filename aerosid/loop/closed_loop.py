"""Closed-loop model completion: identification, model error d(t), simulations, linear models and the next flight."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

import aerosid
from aerosid.aircraft import Aircraft
from aerosid.aircraft.plausibility import blamed_on_unusual_numbers, unusual_numbers
from aerosid.compiled.cores import begun
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.residual_tests import coloured_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.blas_threads import one_blas_thread
from aerosid.loop.completed_aircraft import complete_aircraft, completion_record
from aerosid.loop.contradicted_recording import contradicted_loop
from aerosid.loop.declared_patterns import notes_on_patterns
from aerosid.loop.derivative_table import DerivativeRow, derivative_rows, notes_on_insignificant_derivatives
from aerosid.loop.effect_rows import alternative_rows, effect_rows, with_correlations
from aerosid.loop.estimate_by_validation import CompletedEstimate, completed_estimate, note_on_regression
from aerosid.loop.flying_qualities.carried_deviations import TermCovariance
from aerosid.loop.flying_qualities.linear_analysis import LinearRow, analyse_models, requirement_for
from aerosid.loop.flying_qualities.mil_f_8785c import Requirement
from aerosid.loop.identification import Identification, identify
from aerosid.loop.insignificant_derivatives import Completion, note_on_failed_re_estimation
from aerosid.loop.model_error_pictures import ModelErrorPictures, model_error_pictures, prefilter_note
from aerosid.loop.model_validation.goodness import correlation_matrix, fit_rows, innovation_rows, scatter
from aerosid.loop.model_validation.leave_one_out import prediction_gains
from aerosid.loop.model_validation.open_loop_errors import compare, notes_on_step_changes
from aerosid.loop.model_validation.predictions import PredictionRow, prediction_rows
from aerosid.loop.motion_sampling import notes_on_sampling
from aerosid.loop.next_flight.plan import plan_next_flight
from aerosid.loop.next_flight.planned_flight import NextFlight
from aerosid.loop.provenance import NOBODY, Provenance, unusual_settings
from aerosid.loop.report_date import today
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES, Role, named_apart, require_logs, require_separate
from aerosid.loop.settings import USUAL, LoopSettings, Progress
from aerosid.loop.unmeasured_sideslip import note_on_missing_chain
from aerosid.loop.verdict import (
    Judgement,
    Verdict,
    judge,
    notes_on_coloured_noise,
    notes_on_lowered,
    notes_on_other_derivatives,
    notes_on_refuted,
    summarise,
    validation_decisions,
)
from aerosid.model_error.paper_chain.chain import Chain
from aerosid.search.attribution import Attribution
from aerosid.search.confirmation import note_on_confirmed
from aerosid.search.final_significance import note_on_eliminated
from aerosid.search.indistinguishable_terms import note_on_indistinguishable_terms
from aerosid.search.lowered_coefficients import as_written
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import note_on_suggested

ResultCallback = Callable[[ClosedLoop], None]


@one_blas_thread()
def close_loop(
    identification: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = USUAL,
    progress: Progress = lambda _stage: None,
    judged: ResultCallback = lambda _result: None,
    *,
    hold_out: Sequence[FlightLog] = (),
    provenance: Provenance = NOBODY,
) -> ClosedLoop:
    """Identify the missing effects, complete the model, and compare simulation errors before and after on every log.

    Parameters
    ----------
    identification : sequence of FlightLog
        Manoeuvres to fit, one joint estimate; at least one. Logs of one name are renamed by folder, span or number.
    aircraft : Aircraft
        The declared model.
    validation : sequence of FlightLog
        Manoeuvres that are predicted and may confirm or refute effects.
    progress : callable
        Called with the name of each stage as it begins.
    judged : callable
        Given verdict, findings and errors as soon as they are known: the result that is returned, yet without d(t),
        the cross-check by it, the paper's chain, linear models and the next flight, none of which changes them.
    hold_out : sequence of FlightLog
        Manoeuvres that are predicted by the completed model and used in no decision.
    provenance : Provenance
        Command line, analyst and remarks for the report; the day and the settings are filled in.

    Raises
    ------
    LogError
        Where a log lacks a channel that the model needs.
    AircraftError
        Where the aircraft file declares an effect without its numbers, or on a channel that the model does not hold.
    EstimationError
        Where the declared model cannot be simulated at all.
    UsageError
        Where the flight phase or the aircraft class is unknown, two logs hold the same samples, or there is no log.
    TypeError
        Where an argument is no log, no sequence of them, or no aircraft.
    """
    require_logs(identification, aircraft, validation, hold_out)
    require_separate(identification, validation, hold_out)
    identification, validation, hold_out = named_apart(identification, validation, hold_out)
    requirement = requirement_for(aircraft, settings.flight_phase, settings.aircraft_class)
    signed = replace(provenance, date=provenance.date or today(), settings=unusual_settings(settings))
    with blamed_on_unusual_numbers(aircraft):
        identified = identify(identification, aircraft, validation, settings, progress, hold_out=hold_out)
        if identified.found is None or identified.search is None:
            contradicted = contradicted_loop(identified, identified.aircraft, settings, signed, hold_out)
            judged(contradicted)
            return contradicted
        verdict, leaves = _judgement(identified.found, identified)
        progress("re-estimating with insignificant derivatives fixed")
        excited = verdict is not Verdict.NOT_EXCITED
        estimate = completed_estimate(identified.found, identified.aircraft, identified.search, excited=excited)
        if estimate.found is not identified.found:
            verdict, leaves = _judgement(estimate.found, identified)
        known = _Judged(identified, estimate, identified.search, verdict, leaves)
        result = _judged(known, settings, progress, signed)
        consequences = begun(lambda: _consequences(result, known, requirement, settings), yielding=True)
        judged(result)
        pictures = _pictures(known, settings, progress)
        opinion = identified.second_opinion
        if opinion is not None and opinion.is_silent and pictures is None and settings.paper_chain:
            opinion = None  # a model error that cannot be estimated is no witness that nothing is missing
        result = replace(result, second_opinion=opinion)
        progress("designing the next flight")
        return _completed(result, known, pictures, consequences(), settings)


def _judgement(found: Attribution, identified: Identification) -> Judgement:
    """Of one of the estimates of an identification."""
    return judge(found, identified.manoeuvres, identified.validation)


@dataclass(frozen=True)
class _Judged:
    """An identification with its verdict, and the estimate that it is of."""

    identified: Identification
    estimate: CompletedEstimate
    search: StructureSearch
    verdict: Verdict
    leaves_residual: bool

    @property
    def found(self) -> Attribution:
        """The estimate with every declared derivative free."""
        return self.estimate.found

    @property
    def completion(self) -> Completion:
        """Its completed model."""
        return self.estimate.completion

    @property
    def flights(self) -> dict[Role, tuple[Manoeuvre, ...]]:
        """The flights by their roles."""
        identified = self.identified
        return dict(zip(ROLES, (identified.manoeuvres, identified.validation, identified.hold_out), strict=True))

    def rows(self, chain: Chain | None) -> tuple[DerivativeRow, ...]:
        """The derivative table, with the estimates of recursive least squares where they are known."""
        scattered = scatter(self.found.completed, self.identified.manoeuvres)
        made, aircraft = self.completion, self.identified.aircraft
        return derivative_rows(
            aircraft, self.found, made.found, chain, scattered, made.fixed, made.contradicted, made.by_validation
        )


def _judged(known: _Judged, settings: LoopSettings, progress: Progress, provenance: Provenance) -> ClosedLoop:
    """Verdict, findings and simulation errors before and after on every log, shown first."""
    identified, completed, aircraft = known.identified, known.completion.found, known.identified.aircraft
    progress("simulating all logs")
    simulated, errors, coefficients = compare(identified.declared, completed, aircraft, *known.flights.values())
    # A regression gives its own R^2: it knows the sensor positions and the frequency band of the motion.
    shares = {(row.log, row.coefficient): row for row in completed.r_squared}
    measured = {(row.log, row.coefficient) for row in coefficients}
    progress("computing the error without each effect")
    gains = prediction_gains(completed, known.search, identified.validation, identified.hold_out)
    effects = effect_rows(completed, *gains)
    rows = known.rows(None)
    others, lowered = known.found.other_derivatives, as_written(known.found.lowered, shares.values())
    summary = summarise(known.verdict, effects, tuple(errors), others, lowered, leaves=known.leaves_residual)
    inertia = settings.attribution.inertia
    unusual = [f"In the aircraft file {warning}" for warning in unusual_numbers(aircraft)]
    patterns = () if known.verdict is Verdict.NOT_EXCITED else notes_on_patterns(rows, errors, aircraft, inertia)
    return ClosedLoop(
        version=aerosid.__version__,
        seed=settings.seed,
        aircraft=aircraft,
        completed_aircraft=_completed_aircraft(known, aircraft, provenance),
        identification=tuple(manoeuvre.log for manoeuvre in identified.manoeuvres),
        validation=tuple(manoeuvre.log for manoeuvre in identified.validation),
        verdict=known.verdict,
        summary=" ".join((summary, *unusual, *patterns)),
        effects=effects,
        alternatives=alternative_rows(completed),
        derivatives=rows,
        coefficients=(
            *(shares.get((row.log, row.coefficient), row) for row in coefficients),
            *(row for key, row in shares.items() if key not in measured),
        ),
        errors=tuple(errors),
        simulated=tuple(simulated),
        screening=(),
        model_error=(),
        prefilter=prefilter_note(None, settings),
        notes=(),
        fit=tuple(row for each in simulated for row in fit_rows(each)),
        innovations=tuple(innovation_rows(completed.completed, identified.manoeuvres)),
        correlation=correlation_matrix(known.found.completed, known.found.completed_deviations),
        kinematics=identified.agreement,
        hold_out=tuple(manoeuvre.log for manoeuvre in known.identified.hold_out),
        decided_by_validation=(
            validation_decisions(completed, known.completion.by_validation, estimator=bool(known.estimate.lost))
            if identified.validation
            else ()
        ),
        other_derivatives=others,
        provenance=provenance,
        settings=settings,
        decided_by=known.identified.decided_by,
    )


@dataclass(frozen=True)
class _Consequences:
    """Results that follow from the completed model; `unlinearised`: a note for each model without a trim."""

    linear: tuple[LinearRow, ...]
    unlinearised: tuple[str, ...]
    predictions: tuple[PredictionRow, ...]
    next_flight: NextFlight | None


def _consequences(
    result: ClosedLoop, known: _Judged, requirement: Requirement, settings: LoopSettings
) -> _Consequences:
    """Linear models, predictions ahead and the next flight, none of which uses the model error d(t)."""
    identified, aircraft = known.identified, result.aircraft
    linear, unlinearised = _linear(known, aircraft, requirement, settings)
    flown = [manoeuvre for those in known.flights.values() for manoeuvre in those]
    predictions = prediction_rows(identified.declared, known.completion.found, flown, result.simulated)
    ahead = None
    if settings.next_flight:
        limits = {**aircraft.limits, **settings.limits}
        ahead = plan_next_flight(known.found, identified.manoeuvres, result.derivatives, limits)
    return _Consequences(linear, unlinearised, predictions, ahead)


def _pictures(known: _Judged, settings: LoopSettings, progress: Progress) -> ModelErrorPictures | None:
    """The model error d(t) of the declared and the completed structure; None where it is not wanted or breaks down."""
    if not settings.paper_chain:
        return None
    progress("estimating the model error d(t)")
    identified = known.identified
    return model_error_pictures(
        identified.plain,
        identified.manoeuvres,
        identified.candidates,
        known.completion.found,
        identified.aircraft.coefficients,
        settings.chain,
        identified.declared_chain,
    )


def _completed(
    result: ClosedLoop,
    known: _Judged,
    pictures: ModelErrorPictures | None,
    further: _Consequences,
    settings: LoopSettings,
) -> ClosedLoop:
    """The complete result: model error d(t), linear models and the next flight added to the verdict and errors."""
    rows = known.rows(pictures.chain if pictures else None)
    correlations = pictures.correlations if pictures else {}
    return replace(
        result,
        effects=with_correlations(result.effects, known.completion.found, correlations),
        derivatives=rows,
        screening=pictures.screening if pictures else (),
        model_error=pictures.histories if pictures else (),
        prefilter=prefilter_note(pictures, settings),
        notes=_notes(known, pictures, further, rows, settings, result),
        linear=further.linear,
        next_flight=further.next_flight,
        regressors=pictures.regressors if pictures else (),
        predictions=further.predictions,
    )


def _completed_aircraft(judged: _Judged, aircraft: Aircraft, provenance: Provenance) -> Aircraft:
    """Completed aircraft file with its record of provenance."""
    identified, not_shown = judged.identified, judged.completion.not_shown
    logs = {role: [manoeuvre.log for manoeuvre in those] for role, those in judged.flights.items()}
    record = completion_record(aircraft, logs, judged.verdict, provenance, not_shown)
    return complete_aircraft(aircraft, judged.completion, len(identified.manoeuvres), record)


def _linear(
    judged: _Judged, aircraft: Aircraft, requirement: Requirement, settings: LoopSettings
) -> tuple[tuple[LinearRow, ...], tuple[str, ...]]:
    """Linear models of the declared and completed aircraft, and a note for each model that cannot be trimmed."""
    if not settings.linear_analysis:
        return (), ()
    model, free = judged.completion.found.completed.model, judged.found.completed.free
    # Of the estimate with all free: fixing a derivative at its declared value does not reduce its uncertainty.
    places = [n for n, entry in enumerate(free) if entry in model.entries]
    covariance = judged.found.completed_deviations.covariance[np.ix_(places, places)]
    uncertainty = TermCovariance(tuple(free[n] for n in places), covariance)
    flown = judged.identified.manoeuvres
    return analyse_models(aircraft, judged.identified.declared, model, uncertainty, flown, requirement)


def _notes(
    judged: _Judged,
    pictures: ModelErrorPictures | None,
    further: _Consequences,
    rows: Sequence[DerivativeRow],
    settings: LoopSettings,
    result: ClosedLoop,
) -> tuple[str, ...]:
    """Notes of the report: assumptions made on reading the logs, then remarks of each stage."""
    identified, found, opinion = judged.identified, judged.completion.found, result.second_opinion
    others = identified.validation
    names = [manoeuvre.log.name for manoeuvre in others]
    return (
        *_read(identified.manoeuvres, (*others, *identified.hold_out)),
        *(note_on_missing_chain(identified.manoeuvres) if pictures is None and settings.paper_chain else ()),
        *identified.notes,
        *note_on_regression(judged.estimate),
        *((opinion.sentence,) if opinion is not None else ()),
        *notes_on_refuted(found.refuted, by_blocks=not others),
        *notes_on_other_derivatives(found.other_derivatives),
        *notes_on_lowered(as_written(found.lowered, result.coefficients)),
        *note_on_indistinguishable_terms(identified.rivals),
        *note_on_eliminated(found, settings.attribution.final_deviations),
        *note_on_confirmed(found.confirmed, names, found.findings, settings.attribution.suggestion),
        *note_on_suggested(found.suggested),
        *notes_on_coloured_noise(coloured_noise(found.completed, identified.manoeuvres)),
        *notes_on_step_changes(found, (*others, *identified.hold_out)),
        *note_on_failed_re_estimation(judged.completion),
        *further.unlinearised,
        *notes_on_sampling(further.linear, identified.manoeuvres, result.effects, leaves=judged.leaves_residual),
        *notes_on_insignificant_derivatives(rows),
    )


def _read(manoeuvres: Sequence[Manoeuvre], others: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """Changes made to the logs on reading, without repetition."""
    notes = [f"{m.log.name}: {note}" for m in (*manoeuvres, *others) for note in (*m.log.notes, *m.notes)]
    return tuple(dict.fromkeys(notes))
