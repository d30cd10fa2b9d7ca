"""The method that decides the structure: the one place where a method's name leads to its search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from aerosid.aircraft import Aircraft
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.search.attribution import Attribution, attribute
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.indistinguishable_terms import coefficient_rivals, told_of_rivals, with_rivals
from aerosid.search.model_error_attribution import attribute_by_model_error, told_of_unseen

if TYPE_CHECKING:
    from aerosid.compatibility import KinematicConsistency
    from aerosid.loop.identification import LoopSettings

Method = Literal["likelihood", "iebmee"]
"""likelihood: score tests and maximum likelihood; iebmee: the model error d(t) of Parameswaran & Raol 1994 alone."""

METHODS: tuple[Method, ...] = ("likelihood", "iebmee")

BEFORE = RefinementSettings(cost_tolerance=0.05)
"""A wrong structure creeps along a flat valley for long; a twentieth of -2 ln L moves none of its errors."""


@dataclass(frozen=True)
class Question:
    """What every method is asked.

    Attributes
    ----------
    aircraft : Aircraft
        The declared one.
    declared : AerodynamicModel
        Its model, with columns for what the file declares to act.
    given : tuple of ActiveEffect
        That, its numbers held.
    candidates : tuple of Entry
        Terms that may be missing.
    manoeuvres, others : tuple of Manoeuvre
        Flights that are fitted, and flights that are only predicted.
    agreement : KinematicConsistency or None
        What the instruments say of each other.
    """

    aircraft: Aircraft
    declared: AerodynamicModel
    given: tuple[ActiveEffect, ...]
    candidates: tuple[Entry, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    others: tuple[Manoeuvre, ...]
    agreement: KinematicConsistency | None = None

    @property
    def free(self) -> tuple[Entry, ...]:
        """Declared terms that are estimated."""
        return tuple((d.coefficient, d.term) for d in self.aircraft.derivatives if not d.fixed)

    def hypotheses(self, catalogue: str) -> tuple[Hypothesis, ...]:
        """What may be missing: terms, and of the whole catalogue what these flights can show."""
        terms = term_hypotheses(self.candidates)
        if catalogue != "all":
            return terms
        return terms + effect_hypotheses(self.declared, self.manoeuvres, self.aircraft.coefficients)


@dataclass(frozen=True)
class Answer:
    """What a method found, and what it has to say about it."""

    found: Attribution
    notes: tuple[str, ...] = ()


def answer(question: Question, settings: LoopSettings, progress: Callable[[str], None]) -> Answer:
    """What the method of the settings finds to be missing.

    Raises
    ------
    EstimationError
        Where the declared model cannot be simulated.
    """
    methods: dict[Method, Callable[[Question, LoopSettings, Callable[[str], None]], Answer]] = {
        "likelihood": by_likelihood,
        "iebmee": by_model_error,
    }
    return methods[settings.method](question, settings, progress)


def by_likelihood(question: Question, settings: LoopSettings, progress: Callable[[str], None]) -> Answer:
    """Score tests, trial fits and maximum likelihood."""
    progress("re-estimating the declared model")
    priors = _priors(question.aircraft) if settings.priors else ()
    manoeuvres, declared = question.manoeuvres, question.declared
    before = refine(declared, manoeuvres, question.free, effects=question.given, priors=priors, settings=BEFORE)
    progress("tracing the residual")
    hypotheses = question.hypotheses(settings.catalogue)
    if settings.catalogue != "all":
        return Answer(attribute(before, manoeuvres, hypotheses, (), replace(settings.attribution, disturbances=False)))
    found = attribute(
        before,
        manoeuvres,
        hypotheses,
        question.aircraft.coefficients,
        settings.attribution,
        declared,
        question.others,
        moving_air=question.agreement is not None and question.agreement.is_gusty,
    )
    rivals = coefficient_rivals(found, manoeuvres, hypotheses)
    return Answer(with_rivals(found, rivals), tuple(told_of_rivals(rivals)))


def by_model_error(question: Question, settings: LoopSettings, progress: Callable[[str], None]) -> Answer:
    """Prefilter, continuous IEBMEE with the fixed interval, partial correlation with d(t), recursive least squares."""
    progress("re-estimating the declared model")
    found, selection = attribute_by_model_error(
        question.declared,
        question.manoeuvres,
        question.free,
        question.given,
        question.hypotheses(settings.catalogue),
        question.aircraft.coefficients,
        settings.chain,
        settings.model_error,
        progress,
    )
    return Answer(found, tuple(told_of_unseen(selection)))


def _priors(aircraft: Aircraft) -> tuple[tuple[Entry, float, float], ...]:
    return tuple(
        ((d.coefficient, d.term), d.value, d.sigma) for d in aircraft.derivatives if d.sigma is not None and not d.fixed
    )


__all__ = ["METHODS", "Answer", "Method", "Question", "answer", "by_likelihood", "by_model_error"]
