"""Two methods on one question: does the model error d(t) say the same as the likelihood, and which predicts better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.open_loop import on_log, respond
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.loop.methods import Question, by_model_error
from aerosid.loop.settings import LoopSettings, Progress
from aerosid.search.attribution import Attribution
from aerosid.search.findings import labels, named
from aerosid.search.model_error_settings import ModelErrorSearchSettings

QUICK = ModelErrorSearchSettings(shortlist=3, rounds=4, trial_sweeps=2)
"""A second opinion may cost a fifth of the loop: half the trial fits, which rank alike where an effect is plain."""


@dataclass(frozen=True)
class RivalStructure:
    """What one method found, and its error.

    Attributes
    ----------
    method : str
    effects : tuple of str
        As a person writes them; empty where nothing was named.
    error : float or None
        Median over channels and logs of the root-mean-square error over the noise, on flights that were not fitted
        (without such, on those that were); None where a simulation left its range.
    """

    method: str
    effects: tuple[str, ...]
    error: float | None


@dataclass(frozen=True)
class SecondOpinion:
    """Whether d(t) says the same.

    Attributes
    ----------
    agrees : bool
        Whether both methods name the same effects.
    sentence : str
        The same for a person.
    role : str
        Of the flights on which the errors were taken: "validation" or "identification".
    structures : tuple of RivalStructure
        Side by side, where the methods differ; one row where they agree.
    """

    agrees: bool
    sentence: str
    role: str
    structures: tuple[RivalStructure, ...]


def second_opinion(question: Question, found: Attribution, settings: LoopSettings, progress: Progress) -> SecondOpinion:
    """What method iebmee says of the same flights, beside what was found by the likelihood.

    Disturbances (gusts, forces of any shape) are statistics and no part of the comparison of names.
    """
    progress("asking the model error d(t)")
    role = "validation" if question.others else "identification"
    flights = question.others or question.manoeuvres
    names = _names(found)
    try:
        other = by_model_error(question, replace(settings, model_error=QUICK), lambda _stage: None).found
    except EstimationError as error:
        sentence = f"The model error d(t) gives no second opinion: {error}"
        return SecondOpinion(False, sentence, role, (RivalStructure("likelihood", names, _error(found, flights)),))
    others = _names(other)
    own = RivalStructure("likelihood", names, _error(found, flights))
    if set(names) == set(others):
        told = f"names {_listed(names)} too" if names else "names nothing either"
        return SecondOpinion(True, f"The model error d(t) alone (method iebmee) {told}.", role, (own,))
    rival = RivalStructure("iebmee", others, _error(other, flights))
    sentence = (
        f"The two methods differ: the likelihood names {_listed(names)} ({_times(own.error)} on the {role} flight), "
        f"the model error d(t) alone (method iebmee) {_listed(others)} ({_times(rival.error)})."
    )
    return SecondOpinion(False, sentence, role, (own, rival))


def _names(found: Attribution) -> tuple[str, ...]:
    """The named effects, without disturbances and each once."""
    disturbed = {active.name for active in found.completed.effects if not active.slopes and not active.held}
    return tuple(sorted(named(label) for label in labels(found.findings) if label[:2] not in disturbed))


def _listed(names: Sequence[str]) -> str:
    return " and ".join(names) or "nothing"


def _times(error: float | None) -> str:
    return "no error can be stated" if error is None else f"{error:.3g} times the noise"


def _error(found: Attribution, flights: Sequence[Manoeuvre]) -> float | None:
    ratios = []
    for flight in flights:
        response = respond(
            found.completed.model, flight, found.completed.variance, effects=on_log(found.completed, flight)
        )
        for channel, value in response.rms.items():
            noise = float(flight.noise[LONGITUDINAL.outputs.index(channel)])
            if value is None:
                return None
            if noise > 0.0:
                ratios.append(value / noise)
    return float(np.median(ratios)) if ratios else None
