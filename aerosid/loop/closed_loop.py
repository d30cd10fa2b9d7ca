"""The closed loop: findings with d(t), simulations, tables, linear models and the next flight."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import aerosid
from aerosid.aircraft import Aircraft
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.residual_tests import coloured_noise
from aerosid.flight_model.aerodynamics import Entry
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.completed_aircraft import complete_aircraft
from aerosid.loop.contradicted_recording import contradicted_loop
from aerosid.loop.declared_patterns import told_of_patterns
from aerosid.loop.derivative_table import DerivativeRow, derivative_rows, told_of_not_shown
from aerosid.loop.effect_rows import Effect, effect_row
from aerosid.loop.flying_qualities import Requirement
from aerosid.loop.goodness import correlation_matrix, fit_rows, innovation_rows, scatter
from aerosid.loop.identification import Identification, identify
from aerosid.loop.linear_analysis import LinearRow, Spread, analyse_models, requirement_for
from aerosid.loop.model_error_pictures import ModelErrorPictures, model_error_pictures, prefilter_note
from aerosid.loop.next_flight.plan import plan_next_flight
from aerosid.loop.open_loop_errors import ErrorRow, compare, validation_gain
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import USUAL, LoopSettings, Progress
from aerosid.loop.verdict import judge, summarise, told_of_colour, told_of_refuted
from aerosid.search.attribution import Attribution
from aerosid.search.confirmation import told_of_confirmed
from aerosid.search.indistinguishable_terms import told_of_rivals
from aerosid.search.suggested_terms import told_of_unproven

Told = Callable[[ClosedLoop], None]


def close_loop(
    identification: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = USUAL,
    progress: Progress = lambda _stage: None,
    judged: Told = lambda _result: None,
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
    judged : callable
        Given verdict, findings and errors as soon as they are known: the result that is returned, yet without d(t),
        the paper's chain, linear models and the next flight, none of which changes them.

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
    identified = identify(identification, aircraft, validation, settings, progress)
    aircraft = identified.aircraft
    if identified.found is None:
        contradicted = contradicted_loop(identified, aircraft, settings.seed)
        judged(contradicted)
        return contradicted
    progress("simulating every log")
    result = _judged(identified, identified.found, aircraft, settings)
    judged(result)
    return _completed(result, identified, identified.found, requirement, settings, progress)


def _judged(identified: Identification, found: Attribution, aircraft: Aircraft, settings: LoopSettings) -> ClosedLoop:
    """The findings with the errors before and after on every log, and the verdict: what an engineer waits for."""
    manoeuvres, others = identified.manoeuvres, identified.validation
    simulated, errors, coefficients = compare(identified.declared, found, aircraft, manoeuvres, others)
    effects = _effects(found, {}, errors)
    verdict = judge(found, manoeuvres, others)
    rows = derivative_rows(aircraft, found, None, scatter(found.completed, manoeuvres))
    return ClosedLoop(
        version=aerosid.__version__,
        seed=settings.seed,
        aircraft=aircraft,
        completed_aircraft=complete_aircraft(aircraft, found, len(manoeuvres)),
        identification=tuple(manoeuvre.log for manoeuvre in manoeuvres),
        validation=tuple(manoeuvre.log for manoeuvre in others),
        verdict=verdict,
        summary=" ".join((summarise(verdict, effects, tuple(errors)), *told_of_patterns(rows, errors))),
        effects=effects,
        alternatives=tuple(effect_row(n, other, {}, None) for n, other in enumerate(found.alternatives, start=1)),
        derivatives=rows,
        coefficients=tuple(coefficients),
        errors=tuple(errors),
        simulated=tuple(simulated),
        screening=(),
        model_error=(),
        prefilter=prefilter_note(None, settings),
        notes=(),
        fit=tuple(row for each in simulated for row in fit_rows(each)),
        innovations=tuple(innovation_rows(found.completed, manoeuvres)),
        correlation=correlation_matrix(found.completed, found.completed_deviations),
        kinematics=identified.agreement,
    )


def _completed(
    result: ClosedLoop,
    identified: Identification,
    found: Attribution,
    requirement: Requirement,
    settings: LoopSettings,
    progress: Progress,
) -> ClosedLoop:
    """The result with all that a report shows beside the verdict: d(t), linear models, the next flight."""
    aircraft, manoeuvres = result.aircraft, identified.manoeuvres
    pictures = None
    if settings.paper_chain:
        progress("estimating the model error d(t)")
        pictures = model_error_pictures(
            identified.plain, manoeuvres, identified.candidates, found, aircraft.coefficients, settings.chain
        )
    rows = derivative_rows(aircraft, found, pictures.chain if pictures else None, scatter(found.completed, manoeuvres))
    linear, unlinearised = _linear(identified, found, aircraft, requirement, settings)

    progress("designing the next flight")
    ahead = None
    if settings.next_flight:
        ahead = plan_next_flight(found, manoeuvres, rows, {**aircraft.limits, **settings.limits})
    return replace(
        result,
        effects=_effects(found, pictures.correlations if pictures else {}, result.errors),
        derivatives=rows,
        screening=pictures.screening if pictures else (),
        model_error=pictures.histories if pictures else (),
        prefilter=prefilter_note(pictures, settings),
        notes=_notes(identified, found, pictures, unlinearised, rows, settings),
        linear=linear,
        next_flight=ahead,
        regressors=pictures.regressors if pictures else (),
    )


def _effects(found: Attribution, correlations: dict[Entry, float], errors: Sequence[ErrorRow]) -> tuple[Effect, ...]:
    gain = validation_gain(errors)
    return tuple(effect_row(n, f, correlations, gain) for n, f in enumerate(found.findings, start=1))


def _linear(
    identified: Identification,
    found: Attribution,
    aircraft: Aircraft,
    requirement: Requirement,
    settings: LoopSettings,
) -> tuple[tuple[LinearRow, ...], tuple[str, ...]]:
    """The declared and the completed model linearised, and a sentence for each that cannot be trimmed."""
    if not settings.linear_analysis:
        return (), ()
    completed = found.completed
    spread = Spread(completed.free, found.completed_deviations.covariance)
    first = identified.manoeuvres[0]
    return analyse_models(aircraft, identified.declared, completed.model, spread, first, requirement)


def _notes(
    identified: Identification,
    found: Attribution,
    pictures: ModelErrorPictures | None,
    unlinearised: Sequence[str],
    rows: Sequence[DerivativeRow],
    settings: LoopSettings,
) -> tuple[str, ...]:
    """What was assumed on reading, then what each stage has to say beside its numbers."""
    others = identified.validation
    return (
        *_read(identified.manoeuvres, others),
        *(_BROKEN_DOWN if pictures is None and settings.paper_chain else ()),
        *told_of_refuted(found.refuted),
        *told_of_rivals(identified.rivals),
        *told_of_confirmed(found.confirmed, [manoeuvre.log.name for manoeuvre in others]),
        *told_of_unproven(found.unproven),
        *told_of_colour(coloured_noise(found.completed, identified.manoeuvres)),
        *unlinearised,
        *told_of_not_shown(rows),
    )


_BROKEN_DOWN = ("The model-error recursion broke down: derivatives of recursive least squares are missing.",)


def _read(manoeuvres: Sequence[Manoeuvre], others: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """What was done to the logs on reading, once each."""
    notes = [f"{m.log.name}: {note}" for m in (*manoeuvres, *others) for note in (*m.log.notes, *m.notes)]
    return tuple(dict.fromkeys(notes))
