"""The closed loop: findings with d(t), simulations, tables, linear models and the next flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

import aerosid
from aerosid.aircraft import Aircraft
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.residual_tests import coloured_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.completed_aircraft import complete_aircraft, completion_record
from aerosid.loop.contradicted_recording import contradicted_loop
from aerosid.loop.derivative_table import DerivativeRow, derivative_rows, told_of_not_shown
from aerosid.loop.effect_rows import alternative_rows, effect_rows
from aerosid.loop.flying_qualities import Requirement
from aerosid.loop.goodness import correlation_matrix, fit_rows, innovation_rows, scatter
from aerosid.loop.identification import Identification, identify
from aerosid.loop.kept_derivatives import Completion, keep_declared, told_of_breakdown
from aerosid.loop.leave_one_out import prediction_gains
from aerosid.loop.linear_analysis import LinearRow, Spread, analyse_models, requirement_for
from aerosid.loop.model_error_pictures import ModelErrorPictures, model_error_pictures, prefilter_note
from aerosid.loop.next_flight.plan import plan_next_flight
from aerosid.loop.open_loop_errors import compare
from aerosid.loop.provenance import NOBODY, Provenance, today, unusual_settings
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES, Role, require_separate
from aerosid.loop.settings import USUAL, LoopSettings, Progress
from aerosid.loop.verdict import Verdict, judge, summarise, told_of_colour, told_of_decisions, told_of_refuted
from aerosid.search.attribution import Attribution
from aerosid.search.confirmation import told_of_confirmed
from aerosid.search.final_significance import told_of_fallen
from aerosid.search.indistinguishable_terms import told_of_rivals
from aerosid.search.structure_search import StructureSearch
from aerosid.search.suggested_terms import told_of_unproven


def close_loop(
    identification: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = USUAL,
    progress: Progress = lambda _stage: None,
    *,
    hold_out: Sequence[FlightLog] = (),
    provenance: Provenance = NOBODY,
) -> ClosedLoop:
    """What the declared model lacks, the completed model and the errors before and after, on every log.

    Parameters
    ----------
    identification : sequence of FlightLog
        Manoeuvres to fit, one joint estimate; at least one.
    aircraft : Aircraft
        The declared model.
    validation : sequence of FlightLog
        Manoeuvres that are predicted, and have a say in what is named: they confirm and refute.
    progress : callable
        Told the name of each stage as it begins.
    hold_out : sequence of FlightLog
        Manoeuvres that are predicted by the completed model and touch no decision.
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
        Where the flight phase or the aircraft class is unknown, or two logs hold the same samples.
    """
    require_separate(identification, validation, hold_out)
    requirement = requirement_for(aircraft, settings.flight_phase, settings.aircraft_class)
    signed = replace(provenance, date=provenance.date or today(), settings=unusual_settings(settings))
    identified = identify(identification, aircraft, validation, settings, progress)
    held_out = tuple(prepare(log, aircraft, identified.plain.columns) for log in hold_out)
    if identified.found is None or identified.search is None:
        return contradicted_loop(identified, aircraft, settings, signed, hold_out)
    verdict = judge(identified.found, identified.manoeuvres, identified.validation)
    progress("re-estimating beside what is not shown")
    excited = verdict is not Verdict.NOT_EXCITED
    completion = keep_declared(identified.found, aircraft, identified.search, excited=excited)
    judged = _Judged(identified, identified.found, identified.search, verdict, completion, held_out)
    return _reported(judged, aircraft, requirement, settings, progress, signed)


@dataclass(frozen=True)
class _Judged:
    """An identification with its verdict and the completed model; `found` has every declared derivative free."""

    identified: Identification
    found: Attribution
    search: StructureSearch
    verdict: Verdict
    completion: Completion
    held_out: tuple[Manoeuvre, ...]


def _reported(
    judged: _Judged,
    aircraft: Aircraft,
    requirement: Requirement,
    settings: LoopSettings,
    progress: Progress,
    provenance: Provenance,
) -> ClosedLoop:
    """The findings with all that a report shows of them: d(t), simulations, tables, linear models, the next flight."""
    identified, found, completed = judged.identified, judged.found, judged.completion.found
    manoeuvres, others, held_out = identified.manoeuvres, identified.validation, judged.held_out
    pictures = None
    if settings.paper_chain:
        progress("estimating the model error d(t)")
        pictures = model_error_pictures(
            identified.plain, manoeuvres, identified.candidates, completed, aircraft.coefficients, settings.chain
        )

    progress("simulating every log")
    simulated, errors, coefficients = compare(identified.declared, completed, aircraft, manoeuvres, others, held_out)
    progress("leaving each effect out")
    gains = [prediction_gains(completed, judged.search, flights) for flights in (others, held_out)]
    effects = effect_rows(completed, pictures.correlations if pictures else {}, *gains)
    linear, unlinearised = _linear(judged, aircraft, requirement, settings)
    rows = derivative_rows(
        aircraft,
        found,
        completed,
        pictures.chain if pictures else None,
        scatter(found.completed, manoeuvres),
        judged.completion.kept,
    )

    progress("designing the next flight")
    ahead = None
    if settings.next_flight:
        ahead = plan_next_flight(found, manoeuvres, rows, {**aircraft.limits, **settings.limits})
    return ClosedLoop(
        version=aerosid.__version__,
        seed=settings.seed,
        aircraft=aircraft,
        completed_aircraft=_completed(judged, aircraft, provenance),
        identification=tuple(manoeuvre.log for manoeuvre in manoeuvres),
        validation=tuple(manoeuvre.log for manoeuvre in others),
        verdict=judged.verdict,
        summary=summarise(judged.verdict, effects, tuple(errors)),
        effects=effects,
        alternatives=alternative_rows(completed),
        derivatives=rows,
        coefficients=tuple(coefficients),
        errors=tuple(errors),
        simulated=tuple(simulated),
        screening=pictures.screening if pictures else (),
        model_error=pictures.histories if pictures else (),
        prefilter=prefilter_note(pictures, settings),
        notes=_notes(judged, pictures, unlinearised, rows, settings),
        linear=linear,
        next_flight=ahead,
        fit=tuple(row for each in simulated for row in fit_rows(each)),
        innovations=tuple(innovation_rows(completed.completed, manoeuvres)),
        correlation=correlation_matrix(found.completed, found.completed_deviations),
        regressors=pictures.regressors if pictures else (),
        kinematics=identified.agreement,
        hold_out=tuple(manoeuvre.log for manoeuvre in held_out),
        decided_by_validation=told_of_decisions(completed),
        provenance=provenance,
        settings=settings,
    )


def _completed(judged: _Judged, aircraft: Aircraft, provenance: Provenance) -> Aircraft:
    """The aircraft file completed, with what made it."""
    identified, kept = judged.identified, judged.completion.kept
    flights: dict[Role, tuple[Manoeuvre, ...]] = dict(
        zip(ROLES, (identified.manoeuvres, identified.validation, judged.held_out), strict=True)
    )
    logs = {role: [manoeuvre.log for manoeuvre in those] for role, those in flights.items()}
    record = completion_record(aircraft, logs, judged.verdict, provenance, tuple(kept))
    return complete_aircraft(aircraft, judged.completion, len(identified.manoeuvres), record)


def _linear(
    judged: _Judged, aircraft: Aircraft, requirement: Requirement, settings: LoopSettings
) -> tuple[tuple[LinearRow, ...], tuple[str, ...]]:
    """The declared and the completed model linearised, and a sentence for each that cannot be trimmed."""
    if not settings.linear_analysis:
        return (), ()
    model, free = judged.completion.found.completed.model, judged.found.completed.free
    # Of the estimate where all are free: that a derivative is held at its declared value makes it no better known.
    places = [n for n, entry in enumerate(free) if entry in model.entries]
    covariance = judged.found.completed_deviations.covariance[np.ix_(places, places)]
    spread = Spread(tuple(free[n] for n in places), covariance)
    first = judged.identified.manoeuvres[0]
    return analyse_models(aircraft, judged.identified.declared, model, spread, first, requirement)


def _notes(
    judged: _Judged,
    pictures: ModelErrorPictures | None,
    unlinearised: Sequence[str],
    rows: Sequence[DerivativeRow],
    settings: LoopSettings,
) -> tuple[str, ...]:
    """What was assumed on reading, then what each stage has to say beside its numbers."""
    identified, found = judged.identified, judged.completion.found
    others = identified.validation
    return (
        *_read(identified.manoeuvres, (*others, *judged.held_out)),
        *(_BROKEN_DOWN if pictures is None and settings.paper_chain else ()),
        *told_of_refuted(found.refuted),
        *told_of_rivals(identified.rivals),
        *told_of_fallen(found, settings.attribution.final_deviations),
        *told_of_confirmed(found.confirmed, [manoeuvre.log.name for manoeuvre in others], found.findings),
        *told_of_unproven(found.unproven),
        *told_of_colour(coloured_noise(found.completed, identified.manoeuvres)),
        *told_of_breakdown(judged.completion),
        *unlinearised,
        *told_of_not_shown(rows),
    )


_BROKEN_DOWN = ("The model-error recursion broke down: derivatives of recursive least squares are missing.",)


def _read(manoeuvres: Sequence[Manoeuvre], others: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """What was done to the logs on reading, once each."""
    notes = [f"{m.log.name}: {note}" for m in (*manoeuvres, *others) for note in (*m.log.notes, *m.notes)]
    return tuple(dict.fromkeys(notes))
