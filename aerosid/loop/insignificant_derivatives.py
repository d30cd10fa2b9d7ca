"""Restricted re-estimation: derivatives that the record does not show are fixed at their declared values."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtrc, ndtr

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.derivative_table import is_shown
from aerosid.search.attribution import Attribution
from aerosid.search.final_significance import wald_ratio
from aerosid.search.restricted_estimate import restricted_estimate, restricted_to_first_order
from aerosid.search.structure_search import StructureSearch

BREAKDOWN = (
    "The re-estimation with insignificant derivatives fixed at their declared values failed: the completed aircraft "
    "holds the other derivatives from the estimate with all of them free, and the errors after are of that estimate."
)


@dataclass(frozen=True)
class Completion:
    """The completed model, as it is written, simulated and linearised.

    Attributes
    ----------
    found : Attribution
        The findings and the estimate with every insignificant derivative at its declared value. The standard
        errors are those of the estimate with all derivatives free: they include the uncertainty of the fixed ones.
    fixed : mapping of Entry to float
        The fixed derivatives, with their insignificant estimates.
    broke_down : bool
        Whether the re-estimation with the fixed ones failed: the other values are then those of the free estimate.
    contradicted : mapping of Entry to float or None
        Insignificant but not fixed: the declared value and an identified parameter contradict each other. By how many
        standard errors, were the effects' numbers known, the estimate is away; None where an identified parameter would
        not be significant beside the declared value.
    by_validation : tuple of Entry
        Fixed, or not, because the validation flights are predicted better so.
    """

    found: Attribution
    fixed: Mapping[Entry, float] = field(default_factory=dict)
    broke_down: bool = False
    contradicted: Mapping[Entry, float | None] = field(default_factory=dict)
    by_validation: tuple[Entry, ...] = ()

    @property
    def not_shown(self) -> tuple[Entry, ...]:
        """The insignificant derivatives, fixed or not."""
        return tuple(dict.fromkeys((*self.fixed, *self.contradicted, *self.by_validation)))


def fix_insignificant(found: Attribution, aircraft: Aircraft, search: StructureSearch, *, excited: bool) -> Completion:
    """The completed model with insignificant derivatives fixed at declared values and the others re-estimated.

    Parameters
    ----------
    found : Attribution
        With all declared derivatives free.
    aircraft : Aircraft
        The declared values.
    search : StructureSearch
        The flights that were fitted, with the settings.
    excited : bool
        Whether the flights are excited at all; otherwise every derivative is fixed.

    Notes
    -----
    Declared values cannot be mixed into a joint estimate afterwards: fixing a derivative changes those correlated with
    it. So the errors `after`, the linear model and the file are of one re-estimated model.

    Where fixing at a declared value makes an identified parameter insignificant, the flight contradicts that value
    together with the parameter: the derivative stays as estimated, and is reported as not significant. So it does where
    the declared values of a regression lie as many standard errors away as given by its own structure with the
    parameters of the identified effects; alternatives widen the bounds, but are not in the model.

    Validation flights have the last word: where they are predicted better with all insignificant derivatives of a
    coefficient at their declared values, or with none, beyond their noise, it is so.
    """
    declared = {(d.coefficient, d.term): d.value for d in aircraft.derivatives}
    estimate = _FreeEstimate(found, declared, search, excited)
    completion = estimate.completion()
    if not excited or found.predictions is None or completion.broke_down:
        return completion
    return _as_predicted_best(completion, estimate)


@dataclass(frozen=True)
class _FreeEstimate:
    """The estimate with all derivatives free, with the declared values that some of them may keep."""

    free: Attribution
    declared: Mapping[Entry, float]
    search: StructureSearch
    excited: bool

    def completion(self, held: Collection[Entry] = (), released: Collection[Entry] = ()) -> Completion:
        """The completion with some derivatives fixed, and others not, whatever the records show of them."""
        found, fixed = self.free, dict[Entry, float]()
        contradicted: dict[Entry, float | None] = {**self._contradicted((*held, *released))}
        while hidden := self._hidden(found, held, {*released, *contradicted}):
            estimated = {entry: found.completed.model.value(entry) for entry in hidden}
            try:
                restricted = restricted_estimate(found, {entry: self.declared[entry] for entry in hidden}, self.search)
            except EstimationError:
                return Completion(found, fixed | estimated, broke_down=True, contradicted=contradicted)
            lost = _no_longer_significant(found, restricted, self.search)
            if lost:
                chosen = [entry for entry in hidden if entry[0] in lost] or hidden
                contradicted |= dict.fromkeys(chosen)
                held = [entry for entry in held if entry not in chosen]
                continue
            fixed, found = fixed | estimated, restricted
        return Completion(found, fixed, contradicted=contradicted)

    def _hidden(self, found: Attribution, held: Collection[Entry], not_fixed: Collection[Entry]) -> list[Entry]:
        """Derivatives still to be fixed."""
        hidden = [*held, *_not_shown(found, self.declared, excited=self.excited)]
        return [e for e in dict.fromkeys(hidden) if e in found.completed.free and e not in not_fixed]

    def _contradicted(self, decided: Collection[Entry]) -> dict[Entry, float]:
        if not self.excited:
            return {}
        by_effects = _contradicted_by_effects(self.free, self.declared, self.search)
        return {entry: away for entry, away in by_effects.items() if entry not in decided}

    def to_first_order(self, fixed: Collection[Entry]) -> Refinement:
        """The estimate with some derivatives at their declared values, the others by their correlations."""
        values = {entry: self.declared[entry] for entry in fixed}
        return replace(self.free.completed, model=restricted_to_first_order(self.free, values))

    def is_hidden(self, found: Attribution, entry: Entry) -> bool:
        """Whether a derivative is insignificant in an estimate that has it free."""
        return entry in _not_shown(found, self.declared, excited=self.excited)


def _as_predicted_best(completion: Completion, estimate: _FreeEstimate) -> Completion:
    """The completion with all or none of each coefficient's insignificant derivatives fixed where that predicts better.

    On some validation flight, beyond its noise, and on none worse in any coefficient. Constants, which are free on each
    flight, take no part.
    """
    predictions = estimate.free.predictions
    assert predictions is not None

    def improves(coefficient: str, found: Refinement) -> bool:
        worse = predictions.worse(completion.found.completed, found)
        return any(place[1] == coefficient for place in worse)

    held: list[Entry] = []
    released: list[Entry] = []
    hidden = [entry for entry in completion.not_shown if entry[1].factors]
    for coefficient in dict.fromkeys(coefficient for coefficient, _ in hidden):
        own = [entry for entry in hidden if entry[0] == coefficient]
        for more, fewer in ((own, []), ([], own)):
            if {entry for entry in own if entry in completion.fixed} == set(more):
                continue
            expected = estimate.to_first_order([e for e in (*completion.fixed, *more) if e not in fewer])
            if not improves(coefficient, expected):
                continue
            tried = estimate.completion((*held, *more), (*released, *fewer))
            if tried.broke_down or any(entry not in tried.fixed for entry in more):
                continue
            lost = predictions.worse(tried.found.completed, completion.found.completed)
            if not lost and improves(coefficient, tried.found.completed):
                held = [entry for entry in (*held, *more) if entry not in fewer]
                released = [entry for entry in (*released, *fewer) if entry not in more]
                completion = tried
    free = [entry for entry in released if estimate.is_hidden(completion.found, entry)]
    return replace(completion, by_validation=(*held, *free))


def _contradicted_by_effects(
    found: Attribution, declared: Mapping[Entry, float], search: StructureSearch
) -> dict[Entry, float]:
    """Insignificant derivatives whose declared values the records contradict in the presence of identified effects.

    With each, how many standard errors its estimate alone is away from it, were the effects' numbers known.

    Jointly for each coefficient, by a chi-square test at the probability of the threshold of a named parameter. What is
    furthest from its declared value is released first: the others may agree with theirs once it is estimated.
    """
    beside = found.completed_deviations.beside_effects
    if beside is None:
        return {}
    hidden = _not_shown(found, declared, excited=True)
    model, free = found.completed.model, found.completed.free
    odds = 2.0 * ndtr(-search.settings.final_deviations)
    contradicted: dict[Entry, float] = {}
    for coefficient in dict.fromkeys(entry[0] for entry in hidden):
        own = [entry for entry in hidden if entry[0] == coefficient]
        while own:
            places = [free.index(entry) for entry in own]
            away = np.array([declared[entry] - model.value(entry) for entry in own])
            covariance = beside[np.ix_(places, places)]
            distance = float(away @ np.linalg.pinv(covariance, rcond=1e-12, hermitian=True) @ away)
            if chdtrc(len(own), distance) >= odds:
                break
            alone = np.abs(away) / np.sqrt(np.diag(covariance))
            furthest = int(np.argmax(alone))
            contradicted[own.pop(furthest)] = float(alone[furthest])
    return contradicted


def _no_longer_significant(found: Attribution, restricted: Attribution, search: StructureSearch) -> set[str]:
    """Coefficients of identified terms that were significant and are not, or gone, in a restricted estimate.

    An empty name for any other identified effect.
    """
    before, after = (
        {
            (*part.label, part.log, part.ordinal): (part.entry, wald_ratio(part))
            for part in search.parts(each.completed, each.completed_deviations)
            if not part.is_disturbance
        }
        for each in (found, restricted)
    )
    threshold = search.settings.final_deviations
    lost = [entry for key, (entry, ratio) in before.items() if ratio >= threshold > after.get(key, (None, 0.0))[1]]
    return {entry[0] if entry else "" for entry in lost}


def _not_shown(found: Attribution, declared: Mapping[Entry, float], *, excited: bool) -> tuple[Entry, ...]:
    """The free declared derivatives, constants among them, on which the record holds too little information."""
    completed, uncertainty = found.completed, found.completed_deviations

    def shown(n: int, entry: Entry) -> bool:
        value, error = completed.model.value(entry), float(uncertainty.corrected[n])
        return excited and is_shown(value, declared[entry], error, constant=not entry[1].factors)

    return tuple(entry for n, entry in enumerate(completed.free) if entry in declared and not shown(n, entry))


def note_on_failed_re_estimation(completion: Completion) -> list[str]:
    """A sentence where the re-estimation with fixed derivatives failed."""
    if not completion.broke_down:
        return []
    return [BREAKDOWN]
