"""Cross-check of the attribution by the model error d(t), with the prediction errors of both models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.open_loop import prediction_errors
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.loop.methods import MethodResult, by_model_error
from aerosid.loop.model_validation.open_loop_errors import noise_doubts
from aerosid.loop.settings import LoopSettings
from aerosid.model_error.flight_sweeps.swept_model import SweepSettings
from aerosid.notation import number
from aerosid.search.attribution import Attribution
from aerosid.search.findings import labels, named
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings

QUICK = ModelErrorSearchSettings(
    shortlist=3,
    rounds=4,
    trial_sweeps=1,
    kept_statistics=True,
    far_ahead=4.0,
    least_share=0.9,
    unlike_share=0.2,
    jump_stride=1000,
    sweeps=SweepSettings(
        sweeps=3,
        tolerance=0.2,
        searches=(0,),
        first_spread=None,
        first_memory=1.0,
        shortest_memory=1.0,
        longest_memory=1.0,
        settled=1.0,
        shown=2.7,
        halvings=1,
    ),
)
"""The cross-check may cost a fifth of the loop: few trial fits, the statistics of d(t) estimated once a structure."""


@dataclass(frozen=True)
class CompetingStructure:
    """Structure identified by one method, and its error.

    Attributes
    ----------
    method : str
    effects : tuple of str
        As they are printed; empty where none was identified.
    error : float or None
        Median over channels and logs of the root-mean-square error over the noise, on flights that were not fitted
        (without such, on those that were), of the channels whose noise can be estimated; None where there is none, and
        where a simulation left its range.
    """

    method: str
    effects: tuple[str, ...]
    error: float | None


@dataclass(frozen=True)
class SecondOpinion:
    """Agreement of the two methods.

    Attributes
    ----------
    agrees : bool
        Whether both methods name the same effects.
    sentence : str
        The same as a sentence.
    role : str
        Of the flights on which the errors were taken: "validation" or "identification".
    structures : tuple of CompetingStructure
        Side by side, where the methods differ; one row where they agree.
    error_ratio : float or None
        Where they differ: the error of the model identified from d(t) over that of the deciding method's, channel by
        channel, the median; below 1 the former predicts better. None where a simulation left its range.
    """

    agrees: bool
    sentence: str
    role: str
    structures: tuple[CompetingStructure, ...]
    error_ratio: float | None = None

    @property
    def is_silent(self) -> bool:
        """Whether neither method identifies an effect."""
        return self.agrees and not any(structure.effects for structure in self.structures)


def second_opinion(problem: IdentificationProblem, first: MethodResult, settings: LoopSettings) -> SecondOpinion:
    """Attribution by method iebmee on the same flights, compared with that of the deciding method.

    Disturbances (gusts, forces of any shape) are statistics and no part of the comparison of names.
    """
    found = first.found
    role = "validation" if problem.others else "identification"
    flights = problem.others or problem.manoeuvres
    names = _names(found)
    errors = _errors(found, flights)
    own = CompetingStructure(first.method, names, _over_noise(errors, flights))
    try:
        # Without turbulence in the first result, a search for it in d(t) would only cost time.
        quick = replace(QUICK, gusts=bool(_disturbances(found)))
        quick_settings = replace(settings, model_error=quick)
        other = by_model_error(problem, quick_settings, lambda _stage: None, first).found
    except EstimationError as error:
        return SecondOpinion(False, note_without_second_opinion(error), role, (own,))
    others = _names(other)
    if set(names) == set(others):
        result = f"identifies {_listed(names)} too" if names else "identifies no effect either"
        return SecondOpinion(True, f"The model error d(t) alone (method iebmee) {result}.", role, (own,))
    theirs = _errors(other, flights)
    competing = CompetingStructure("iebmee", others, _over_noise(theirs, flights))
    ratio = _ratio(theirs, errors)
    sentence = (
        f"The two methods differ: {DECIDING[first.method]} {_listed(names)}, the model error d(t) alone "
        f"(method iebmee) {_listed(others)}. {_comparison(ratio, role, len(flights))}"
    )
    return SecondOpinion(False, sentence, role, (own, competing), ratio)


DECIDING = {"likelihood": "the likelihood identifies", "equations": "the equations identify"}
"""The deciding methods with which d(t) is compared, each with its verb."""


def note_without_second_opinion(error: EstimationError) -> str:
    """Reason why there is none, without the error's advice to use the default method, which was used already."""
    reason = str(error).partition(";")[0].rstrip(".")
    return f"No cross-check by the model error d(t): {reason}."


def _names(found: Attribution) -> tuple[str, ...]:
    """The named effects, without disturbances and each once."""
    disturbed = _disturbances(found)
    return tuple(sorted(named(label) for label in labels(found.findings) if label[:2] not in disturbed))


def _disturbances(found: Attribution) -> set[tuple[str, str]]:
    """Kind and place of what the air does: statistics without a number that is estimated."""
    return {active.name for active in found.completed.effects if not active.slopes and not active.held}


def _listed(names: Sequence[str]) -> str:
    return " and ".join(names) or "no effect"


def _comparison(ratio: float | None, role: str, count: int) -> str:
    """Sentence on the ratio of the open-loop errors of the two models."""
    flights = f"{role} flight{'s' if count > 1 else ''}"
    if ratio is None:
        return f"No errors on the {flights} can be compared: a simulation leaves its range."
    times = f"{number(ratio)} times that of the former"
    return f"On the {flights} the open-loop error of the latter is {times} (median channel)."


def _errors(found: Attribution, flights: Sequence[Manoeuvre]) -> list[dict[str, float | None]]:
    """Open-loop error of each channel on each flight; None where the simulation left its range."""
    return [prediction_errors(found.completed, flight) for flight in flights]


def _ratio(errors: Sequence[dict[str, float | None]], reference: Sequence[dict[str, float | None]]) -> float | None:
    """Median over channels and flights of one model's errors over another's."""
    ratios = []
    for ours, theirs in zip(errors, reference, strict=True):
        for channel, error in ours.items():
            other = theirs[channel]
            if error is None or other is None:
                return None
            if other > 0.0:
                ratios.append(error / other)
    return float(np.median(ratios)) if ratios else None


def _over_noise(errors: Sequence[dict[str, float | None]], flights: Sequence[Manoeuvre]) -> float | None:
    """Median of errors over the noise, of channels whose noise can be estimated."""
    doubts = noise_doubts(flights)
    ratios = []
    for flight, of_flight in zip(flights, errors, strict=True):
        for channel, error in of_flight.items():
            if error is None:
                return None
            noise = float(flight.noise[flight.row(channel)])
            if noise > 0.0 and (channel not in doubts or channel in flight.log.noise):
                ratios.append(error / noise)
    return float(np.median(ratios)) if ratios else None
