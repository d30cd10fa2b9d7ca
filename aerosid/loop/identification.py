"""Identification of undeclared effects: the single processing chain that all commands, studies and tests call.

logs, aircraft -> manoeuvres -> data compatibility check -> the declared structure, re-estimated
               -> missing effects -> terms indistinguishable from them in one coefficient
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from aerosid import compatibility
from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.loading import at_own_loading
from aerosid.compatibility import KinematicConsistency, contradicting
from aerosid.compiled.cores import begun
from aerosid.effects.aerodynamic_terms import searched_parameters
from aerosid.errors import EstimationError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.linear_or_held_controls import notes_on_held_controls, with_likelier_interpolation
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.smooth_controls import (
    bent_controls,
    notes_on_smooth_controls,
    smoothed,
    smoothly_late,
    with_smooth_controls,
)
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.logs.channel_noise import with_declared_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.physical_values import require_computable
from aerosid.loop.identification_problem import IdentificationProblem, with_identified_instrument_errors
from aerosid.loop.methods import MethodResult, run_method
from aerosid.loop.motion_sampling import require_sampled_motion
from aerosid.loop.second_opinion import SecondOpinion, second_opinion
from aerosid.loop.settings import METHODS, USUAL, LoopSettings, Method, Progress
from aerosid.loop.unmeasured_sideslip import note_on_unmeasured_sideslip
from aerosid.model_error.paper_chain.chain import Chain, run_chain
from aerosid.search.attribution import Attribution
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.indistinguishable_terms import IndistinguishableTerm
from aerosid.search.structure_search import StructureSearch

if TYPE_CHECKING:
    from aerosid.model_error.paper_chain.in_flight import Frame


@dataclass(frozen=True)
class Identification:
    """Result of the identification chain, with everything later stages need from it.

    Attributes
    ----------
    aircraft : Aircraft
        The declared one, at the loading that was flown.
    plain : AerodynamicModel
        The declared model as its file gives it, with an input column for every candidate term.
    declared : AerodynamicModel
        The same with the columns that the file's own effects fill.
    candidates : tuple of Entry
        The candidate terms.
    manoeuvres, validation : tuple of Manoeuvre
        The logs as the estimators take them: those that were fitted, and those that were predicted.
    agreement : KinematicConsistency or None
        Data compatibility check; None where it was not requested.
    found : Attribution or None
        The missing effects; None where the instruments contradict each other, so that nothing is identified.
    hold_out : tuple of Manoeuvre
        Further logs, used in no decision.
    declared_chain : callable or None
        Gives the paper's chain on the declared structure, used in no decision; None where it is not requested.
    rivals : tuple of IndistinguishableTerm
        Terms that a coefficient alone cannot distinguish from an identified error of a sensor or control.
    search : StructureSearch or None
        The fitted flights, the hypotheses and the settings, for further estimates.
    notes : tuple of str
        Notes of the method for the report.
    pending_opinion : callable or None
        Gives the attribution by the model error d(t) alone when it has been computed; None without one.
    decided_by : str
        The method that decided.
    """

    aircraft: Aircraft
    plain: AerodynamicModel
    declared: AerodynamicModel
    candidates: tuple[Entry, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    validation: tuple[Manoeuvre, ...]
    agreement: KinematicConsistency | None
    found: Attribution | None
    rivals: tuple[IndistinguishableTerm, ...] = ()
    notes: tuple[str, ...] = ()
    pending_opinion: Callable[[], SecondOpinion] | None = field(default=None, repr=False, compare=False)
    decided_by: Method = "likelihood"
    search: StructureSearch | None = field(default=None, repr=False, compare=False)
    hold_out: tuple[Manoeuvre, ...] = ()
    declared_chain: Callable[[], Chain] | None = field(default=None, repr=False, compare=False)

    @cached_property
    def second_opinion(self) -> SecondOpinion | None:
        """Cross-check by the model error d(t) alone; None where it was not requested."""
        return None if self.pending_opinion is None else self.pending_opinion()


@dataclass(frozen=True)
class PreparedFlights:
    """Logs as the estimators take them, with the declared model that they can hold.

    Attributes
    ----------
    problem : IdentificationProblem
        Before the data compatibility check; its aircraft at the loading that was flown.
    logs : tuple of FlightLog
        The fitted ones, with the noise that the aircraft file declares.
    plain : AerodynamicModel
        As of `Identification`.
    """

    problem: IdentificationProblem
    logs: tuple[FlightLog, ...]
    plain: AerodynamicModel


def prepare_flights(
    logs: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    hold_out: Sequence[FlightLog] = (),
) -> PreparedFlights:
    """Logs and aircraft file as `identify` takes them, before anything is estimated.

    Raises
    ------
    LogError, AircraftError
        As of `identify`.
    """
    aircraft, logs, unseen = at_own_loading(aircraft, logs, [*validation, *hold_out])
    logs, unseen = (
        [with_declared_noise(log, aircraft.noise, aircraft.resolution) for log in part] for part in (logs, unseen)
    )
    require_computable(logs, unseen, aircraft.axes.required)
    plain, candidates = declared_with_candidates(logs, unseen[: len(validation)], aircraft)
    manoeuvres, predicted = (tuple(prepare(log, aircraft, plain.columns) for log in part) for part in (logs, unseen))
    given = tuple(declared_effects(aircraft, controls_of(plain), manoeuvres))
    require_sampled_motion(plain, (*manoeuvres, *predicted))
    others, held_out = predicted[: len(validation)], predicted[len(validation) :]
    declared = with_columns_of(plain, given)
    problem = IdentificationProblem(aircraft, declared, given, candidates, manoeuvres, others, held_out)
    return PreparedFlights(problem, tuple(logs), plain)


def identify(
    logs: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog] = (),
    settings: LoopSettings = USUAL,
    progress: Progress = lambda _stage: None,
    *,
    hold_out: Sequence[FlightLog] = (),
) -> Identification:
    """Identify what the declared model lacks, from fitted logs and logs that are only predicted.

    Parameters
    ----------
    logs : sequence of FlightLog
        Manoeuvres to fit, one joint estimate; at least one.
    aircraft : Aircraft
        The declared model.
    validation : sequence of FlightLog
        Manoeuvres that are only predicted: an effect that worsens their prediction is not accepted.
    progress : callable
        Called with the name of each stage as it begins.
    hold_out : sequence of FlightLog
        Manoeuvres that are prepared as the others are, and used in no decision.

    Raises
    ------
    LogError
        Where a log lacks a channel that the model needs.
    AircraftError
        Where the aircraft file declares an effect without its numbers, or on a channel that the model does not hold.
    EstimationError
        Where the declared model cannot be simulated at all.
    """
    progress("preparing the logs")
    ready = prepare_flights(logs, aircraft, validation, hold_out)

    progress("checking data compatibility")
    problem = _with_input_interpolation(ready.problem, settings)
    problem, opposed = _with_instrument_errors(problem, ready.logs, settings)
    if opposed is not None:
        return Identification(*_known(problem, ready.plain), opposed, None, hold_out=problem.held_out)

    chain = _started_chain(ready.plain, problem, settings)
    result = run_method(problem, settings, progress)
    if result.method == "likelihood" and settings.catalogue != "terms":
        smooth = _with_smooth_controls(problem, result)
        if smooth is not problem:
            problem, result = smooth, run_method(smooth, settings, progress)
    second = None
    cross_checked = settings.second_opinion and settings.method == METHODS[0] and settings.catalogue == "all"
    # Its cost is a multiple of the equations', and in turbulence d(t) contains the turbulence.
    if cross_checked and result.method == "likelihood":
        progress("cross-checking with the model error d(t)")
        importlib.import_module("scipy.optimize")  # each of the copies made from now on would import it for itself
        second = begun(lambda: second_opinion(problem, result, settings))
    return Identification(
        *_known(problem, ready.plain),
        result.agreement,
        result.found,
        result.rivals,
        (
            *_note_on_axes(problem.aircraft, settings, result),
            *notes_on_held_controls((*problem.manoeuvres, *problem.others, *problem.held_out)),
            *notes_on_smooth_controls(problem.manoeuvres[0]),
            *note_on_unmeasured_sideslip(problem.aircraft, result.found.completed.model, problem.manoeuvres),
            *result.notes,
            *((NO_CROSS_CHECK,) if cross_checked and result.method == "equations" else ()),
        ),
        second,
        result.method,
        result.search,
        problem.held_out,
        chain,
    )


def _with_input_interpolation(problem: IdentificationProblem, settings: LoopSettings) -> IdentificationProblem:
    """The problem with the controls of each flight linear or held between samples; linear in a study of terms."""
    if settings.catalogue == "terms":
        return problem

    flights = (*problem.manoeuvres, *problem.others, *problem.held_out)
    likelier = with_likelier_interpolation(flights, problem.declared, problem.free, problem.given)
    fitted, predicted = len(problem.manoeuvres), len(problem.manoeuvres) + len(problem.others)
    return replace(
        problem, manoeuvres=likelier[:fitted], others=likelier[fitted:predicted], held_out=likelier[predicted:]
    )


def _known(
    problem: IdentificationProblem, plain: AerodynamicModel
) -> tuple[
    Aircraft, AerodynamicModel, AerodynamicModel, tuple[Entry, ...], tuple[Manoeuvre, ...], tuple[Manoeuvre, ...]
]:
    """What an identification gives of the problem that it solved."""
    return problem.aircraft, plain, problem.declared, problem.candidates, problem.manoeuvres, problem.others


def _with_smooth_controls(problem: IdentificationProblem, result: MethodResult) -> IdentificationProblem:
    """The problem with controls that are smooth between samples where that is likelier, or the same."""
    controls = bent_controls(problem.manoeuvres)
    fitted = with_smooth_controls(problem.manoeuvres, result.found.completed, controls)
    if fitted is None:
        return problem
    others, held_out = (tuple(smoothed(each, controls) for each in part) for part in (problem.others, problem.held_out))
    given = smoothly_late(problem.given, controls)
    return replace(problem, given=given, manoeuvres=fitted, others=others, held_out=held_out)


def _with_instrument_errors(
    problem: IdentificationProblem, logs: Sequence[FlightLog], settings: LoopSettings
) -> tuple[IdentificationProblem, KinematicConsistency | None]:
    """The problem with its instrument errors, and contradictions of channels that no instrument error reconciles."""
    if not settings.kinematics or problem.aircraft.axes not in compatibility.CASES:
        return with_identified_instrument_errors(problem, settings), None

    compared = begun(lambda: contradicting(logs))
    try:
        found = with_identified_instrument_errors(problem, settings)
    except EstimationError:
        contradictions = compared()
        if contradictions is None:
            raise
        return problem, contradictions
    return found, compared()


NO_CROSS_CHECK = (
    "The model error d(t) was not used as a cross-check: where kinematics do not close, it contains turbulence and "
    "recorder errors as well as the model's. With --method iebmee it decides."
)


def _note_on_axes(aircraft: Aircraft, settings: LoopSettings, result: MethodResult) -> tuple[str, ...]:
    """Note on checks that are not available for the axes of the model."""
    if settings.kinematics and aircraft.axes not in compatibility.CASES and result.agreement is None:
        return (f"The data compatibility check by kinematics is not available for a {aircraft.axes.name} model.",)
    return ()


def _started_chain(
    plain: AerodynamicModel, problem: IdentificationProblem, settings: LoopSettings
) -> Callable[[], Chain] | None:
    """The paper's chain on the declared structure, started in parallel with the structure search."""
    if not settings.paper_chain:
        return None
    return begun(lambda: run_chain(plain, problem.manoeuvres, problem.free, settings.chain))


def declared_with_candidates(
    logs: Sequence[FlightLog], others: Sequence[FlightLog], aircraft: Aircraft
) -> tuple[AerodynamicModel, tuple[Entry, ...]]:
    """The declared model with input columns for every candidate, and the candidates."""
    candidates = candidate_entries(aircraft, [*logs, *others])
    return declared_model(aircraft, logs[0].mean_airspeed, [term for _, term in candidates]), candidates


def replayed(log: FlightLog, aircraft: Aircraft, step: float) -> Iterator[Frame]:
    """Replay of a recorded flight as identified on board, one frame every `step` s.

    Raises
    ------
    LogError
        Where the log lacks a channel that the model needs.
    EstimationError
        Where the recursion leaves the model's range.
    """
    from aerosid.model_error.paper_chain.in_flight import (  # late: of all runs a replay alone needs it
        InFlightSettings,
        frames,
    )

    aircraft, (log,), _ = at_own_loading(aircraft, [log], [])
    model, candidates = declared_with_candidates([log], [], aircraft)
    # The knots of a spline are taken from the whole record, which is not known on board.
    candidates = tuple(entry for entry in candidates if not searched_parameters(entry[1]))
    manoeuvre = prepare(with_declared_noise(log, aircraft.noise, aircraft.resolution), aircraft, model.columns)
    return frames(model, manoeuvre, aircraft.free, candidates, InFlightSettings(step=step))
