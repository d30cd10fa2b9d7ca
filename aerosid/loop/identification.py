"""Identification of undeclared effects: the single processing chain that all commands, studies and tests call.

logs, aircraft -> manoeuvres -> do the instruments agree? -> the declared structure, re-estimated
               -> what it lacks -> terms that one coefficient alone could not tell from what was found
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from aerosid import compatibility
from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.loading import at_own_loading
from aerosid.compatibility import KinematicConsistency, contradicting
from aerosid.compiled.cores import begun
from aerosid.effects.aerodynamic_terms import searched_numbers
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.logs.channel_noise import with_declared_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.methods import Answer, Question, answer
from aerosid.loop.second_opinion import SecondOpinion, second_opinion
from aerosid.loop.settings import METHODS, USUAL, LoopSettings, Method, Progress
from aerosid.loop.unseen_sideslip import told_of_unseen_sideslip
from aerosid.model_error.paper_chain import Chain, run_chain
from aerosid.search.attribution import Attribution
from aerosid.search.candidate_terms import candidate_entries
from aerosid.search.indistinguishable_terms import CoefficientRival
from aerosid.search.structure_search import StructureSearch

if TYPE_CHECKING:
    from aerosid.model_error.in_flight import Frame


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
        The terms that were asked for.
    manoeuvres, validation : tuple of Manoeuvre
        The logs as the estimators take them: those that were fitted, and those that were predicted.
    agreement : KinematicConsistency or None
        Whether the instruments agree; None where that was not asked.
    found : Attribution or None
        What the declared model lacks; None where the instruments contradict each other, so that nothing is judged.
    hold_out : tuple of Manoeuvre
        Further logs, that touched no decision.
    declared_chain : callable or None
        Gives the paper's chain on the declared structure, of which nothing here is decided; None where it is not asked.
    rivals : tuple of CoefficientRival
        Terms that a coefficient by itself could not tell from a sensor's or a control's fault that was found.
    search : StructureSearch or None
        The fitted flights, the hypotheses and the settings: what further questions about the estimate are asked of.
    notes : tuple of str
        What the method has to say of itself.
    asking : callable or None
        Gives what the model error d(t) alone says, when it has been asked; None where it is not.
    decided_by : str
        The method whose answer it is.
    """

    aircraft: Aircraft
    plain: AerodynamicModel
    declared: AerodynamicModel
    candidates: tuple[Entry, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    validation: tuple[Manoeuvre, ...]
    agreement: KinematicConsistency | None
    found: Attribution | None
    rivals: tuple[CoefficientRival, ...] = ()
    notes: tuple[str, ...] = ()
    asking: Callable[[], SecondOpinion] | None = field(default=None, repr=False, compare=False)
    decided_by: Method = "likelihood"
    search: StructureSearch | None = field(default=None, repr=False, compare=False)
    hold_out: tuple[Manoeuvre, ...] = ()
    declared_chain: Callable[[], Chain] | None = field(default=None, repr=False, compare=False)

    @cached_property
    def second_opinion(self) -> SecondOpinion | None:
        """Whether the model error d(t) alone says the same; None where it was not asked."""
        return None if self.asking is None else self.asking()


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
        Manoeuvres that are only predicted: what lowers their prediction is not named.
    progress : callable
        Told the name of each stage as it begins.
    hold_out : sequence of FlightLog
        Manoeuvres that are made ready as the others are, and touch no decision.

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
    aircraft, logs, unseen = at_own_loading(aircraft, logs, [*validation, *hold_out])
    logs, unseen = (
        [with_declared_noise(log, aircraft.noise, aircraft.resolution) for log in part] for part in (logs, unseen)
    )
    plain, candidates = asked_of(logs, unseen[: len(validation)], aircraft)
    controls = controls_of(plain)
    manoeuvres, predicted = (tuple(prepare(log, aircraft, plain.columns) for log in part) for part in (logs, unseen))
    others, held_out = predicted[: len(validation)], predicted[len(validation) :]
    given = declared_effects(aircraft, controls, manoeuvres)
    declared = with_columns_of(plain, given)

    progress("checking data compatibility")
    opposed = contradicting(logs) if settings.kinematics and aircraft.axes in compatibility.CASES else None
    if opposed is not None:
        return Identification(
            aircraft, plain, declared, candidates, manoeuvres, others, opposed, None, hold_out=held_out
        )

    question = Question(aircraft, declared, tuple(given), candidates, manoeuvres, others)
    chain = _begun_chain(plain, question, settings)
    told = answer(question, settings, progress)
    second = None
    asked = settings.second_opinion and settings.method == METHODS[0] and settings.catalogue == "all"
    # Its cost is a multiple of the equations', and in air that moves d(t) is the air's.
    if asked and told.deciding == "likelihood":
        progress("cross-checking with the model error d(t)")
        second = begun(lambda: second_opinion(question, told, settings))
    return Identification(
        aircraft,
        plain,
        declared,
        candidates,
        manoeuvres,
        others,
        told.agreement,
        told.found,
        told.rivals,
        (
            *_told_of_axes(aircraft, settings, told),
            *told_of_unseen_sideslip(aircraft, told.found.completed.model, manoeuvres),
            *told.notes,
            *((NO_SECOND_OPINION,) if asked and told.deciding == "equations" else ()),
        ),
        second,
        told.deciding,
        told.search,
        held_out,
        chain,
    )


NO_SECOND_OPINION = (
    "The model error d(t) was not used as a cross-check: where kinematics do not close, it contains turbulence and "
    "recorder errors as well as the model's. With --method iebmee it decides."
)


def _told_of_axes(aircraft: Aircraft, settings: LoopSettings, told: Answer) -> tuple[str, ...]:
    """Note on checks that are not available for the axes of the model."""
    if settings.kinematics and aircraft.axes not in compatibility.CASES and told.agreement is None:
        return (f"The data compatibility check by kinematics is not available for a {aircraft.axes.name} model.",)
    return ()


def _begun_chain(plain: AerodynamicModel, question: Question, settings: LoopSettings) -> Callable[[], Chain] | None:
    """The paper's chain on the declared structure, begun beside the search of what it lacks."""
    if not settings.paper_chain:
        return None
    return begun(lambda: run_chain(plain, question.manoeuvres, question.free, settings.chain))


def asked_of(
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
    from aerosid.model_error.in_flight import InFlightSettings, frames  # late: of all runs a replay alone needs it

    aircraft, (log,), _ = at_own_loading(aircraft, [log], [])
    model, candidates = asked_of([log], [], aircraft)
    # The knots of a spline are taken from the whole record, which is not known on board.
    candidates = tuple(entry for entry in candidates if not searched_numbers(entry[1]))
    manoeuvre = prepare(with_declared_noise(log, aircraft.noise, aircraft.resolution), aircraft, model.columns)
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives if not d.fixed)
    return frames(model, manoeuvre, free, candidates, InFlightSettings(step=step))
