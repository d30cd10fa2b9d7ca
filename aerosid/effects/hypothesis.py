"""A hypothesis: one effect that may be missing from the declared model, with the terms and effects that become free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from aerosid.effects import ActiveEffect, EffectParameter
from aerosid.effects.aerodynamic_terms import searched_parameters
from aerosid.flight_model.aerodynamics import Entry


@dataclass(frozen=True)
class Hypothesis:
    """One effect that may be missing from the declared model.

    Attributes
    ----------
    kind, where, term : str
        As in result.json.
    entries : tuple of Entry
        Terms that become free.
    effects : tuple of ActiveEffect
        Effects that become free, at their null values.
    time : float or None
        Of a step change, s.
    repetition : int
        Of a step change: known ones of the same kind and place on its record.
    """

    kind: str
    where: str
    term: str = ""
    entries: tuple[Entry, ...] = ()
    effects: tuple[ActiveEffect, ...] = ()
    time: float | None = None
    repetition: int = 0

    @cached_property
    def parameters(self) -> int:
        """Number of parameters that it adds, including the instant of a step and a spline's knot."""
        count = len(self.entries) + sum(len(active.values) for active in self.effects)
        return count + (self.time is not None) + self.searched_parameters

    @cached_property
    def searched_parameters(self) -> int:
        """Number of parameters inside its terms that were chosen from the flight (knots)."""
        return sum(searched_parameters(term) for _, term in self.entries)

    @property
    def is_plain_term(self) -> bool:
        """Whether it is a term without parameters chosen from the flight."""
        return self.kind == "aero_term" and not self.searched_parameters

    @property
    def label(self) -> tuple[str, str, str]:
        """Kind, place and term; of a further step change in one place, which is reported without, its ordinal."""
        return self.kind, self.where, self.term or (str(self.ordinal) if self.ordinal > 1 else "")

    @property
    def ordinal(self) -> int:
        """Which of several step changes in one place it is; 1 of any other hypothesis."""
        return max((active.ordinal for active in self.effects), default=1)

    @property
    def key(self) -> tuple[str, str, str, float | None, tuple[str, ...]]:
        """Unique key among the hypotheses of the same flights: step changes differ in their instant."""
        return *self.label, self.time, tuple(active.log for active in self.effects)

    def at(self, step: Sequence[float], trial: int) -> Hypothesis:
        """The hypothesis with its effects at `step` from the null value, as a start for a fit.

        A step past a limit shows that the effect is not linear so far: the trial value of the best score is then used.
        """
        place = 0
        moved = []
        for active in self.effects:
            values = []
            for parameter, value in zip(active.effect.parameters, active.values, strict=True):
                aim = value + step[place]
                inside = parameter.lowest < aim < parameter.highest
                values.append(aim if inside else parameter.trials[min(trial, len(parameter.trials) - 1)])
                place += 1
            moved.append(replace(active, values=tuple(values)))
        return replace(self, effects=tuple(moved))

    def by_chord(self, trial: int) -> Hypothesis:
        """The hypothesis with difference quotients over the distance to a trial value, as for a nonlinear delay."""
        if not self.effects:
            return self
        if trial not in self._chords:
            self._chords[trial] = replace(self, effects=tuple(_chord(active, trial) for active in self.effects))
        return self._chords[trial]

    @cached_property
    def _chords(self) -> dict[int, Hypothesis]:
        """Results of `by_chord`, which every score test of a search needs for the whole catalogue."""
        return {}


def _chord(active: ActiveEffect, trial: int) -> ActiveEffect:
    parameters = tuple(_stepping(parameter, trial) for parameter in active.effect.parameters)
    return replace(active, effect=replace(active.effect, parameters=parameters))


def _stepping(parameter: EffectParameter, trial: int) -> EffectParameter:
    reach = abs(parameter.trials[min(trial, len(parameter.trials) - 1)] - parameter.null)
    return replace(parameter, step=reach) if reach > 0.0 else parameter
