"""Everything that is asked of a flight: a hypothesis for each term, sensor, control and moment that may be to blame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.effects import ActiveEffect, Effect, EffectParameter
from aerosid.effects.control import control_effects
from aerosid.effects.disturbance import GUST_COLUMN
from aerosid.effects.sensor import sensor_effects
from aerosid.effects.step_change import jump_at, offset_column, offset_term
from aerosid.longitudinal import OUTPUTS
from aerosid.manoeuvre import Manoeuvre
from aerosid.nomenclature import CHANNELS

STEP_GRID = 48
"""Moments at which a step change is tried on each log; the best is then refined between its neighbours."""


@dataclass(frozen=True)
class Hypothesis:
    """One thing that the declared model may lack.

    Attributes
    ----------
    kind, where, term : str
        As in result.json.
    entries : tuple of Entry
        Terms that become free.
    effects : tuple of ActiveEffect
        Effects that become free, at the values at which they are none.
    time : float or None
        Of a step change, s.
    """

    kind: str
    where: str
    term: str = ""
    entries: tuple[Entry, ...] = ()
    effects: tuple[ActiveEffect, ...] = ()
    time: float | None = None

    @property
    def parameters(self) -> int:
        """How many numbers it adds, the moment of a step among them."""
        count = len(self.entries) + sum(len(active.values) for active in self.effects)
        return count + (self.time is not None)

    @property
    def label(self) -> tuple[str, str, str]:
        """Kind, place and term: what a person would call it."""
        return self.kind, self.where, self.term

    def at(self, step: Sequence[float], trial: int) -> Hypothesis:
        """The hypothesis with its effects away from none by `step`, as a start for a fit.

        A step past a limit says that the effect is not linear so far: the trial value that scored best is taken then.
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
        """The hypothesis with its derivatives taken over the distance of a trial: a delay is not linear."""
        return replace(self, effects=tuple(_chord(active, trial) for active in self.effects))


def _chord(active: ActiveEffect, trial: int) -> ActiveEffect:
    parameters = tuple(_stepping(parameter, trial) for parameter in active.effect.parameters)
    return replace(active, effect=replace(active.effect, parameters=parameters))


def _stepping(parameter: EffectParameter, trial: int) -> EffectParameter:
    reach = abs(parameter.trials[min(trial, len(parameter.trials) - 1)] - parameter.null)
    return replace(parameter, step=reach) if reach > 0.0 else parameter


def at_null(effect: Effect, log: str = "") -> ActiveEffect:
    """The effect with the numbers at which it is none."""
    return ActiveEffect(effect, tuple(parameter.null for parameter in effect.parameters), log)


def term_hypotheses(candidates: Sequence[Entry]) -> tuple[Hypothesis, ...]:
    """One for each candidate term."""
    return tuple(Hypothesis("aero_term", entry[0], str(entry[1]), entries=(entry,)) for entry in candidates)


def sensor_hypotheses(manoeuvres: Sequence[Manoeuvre]) -> tuple[Hypothesis, ...]:
    """Bias, scale, delay and lag of every measured output."""
    found: list[Hypothesis] = []
    for i, channel in enumerate(OUTPUTS):
        noise = [manoeuvre.noise[i] for manoeuvre in manoeuvres if channel in manoeuvre.outputs]
        if noise:
            effects = sensor_effects(channel, CHANNELS[channel].unit, max(float(np.mean(noise)), 1e-9))
            found.extend(Hypothesis(e.kind, channel, effects=(at_null(e),)) for e in effects)
    return tuple(found)


def control_hypotheses(model: AerodynamicModel, manoeuvres: Sequence[Manoeuvre]) -> tuple[Hypothesis, ...]:
    """Lag, delay, rate limit and dead band of every control that moves."""
    found: dict[tuple[str, str], Hypothesis] = {}
    for place, channel in enumerate(model.columns[8:], start=8):
        if not channel.startswith("delta_"):
            continue
        widest = max(manoeuvres, key=lambda manoeuvre: float(np.ptp(manoeuvre.flight.inputs[:, place])))
        for effect in control_effects(channel, widest.flight.time, widest.flight.inputs[:, place]):
            found[effect.kind, channel] = Hypothesis(effect.kind, channel, effects=(at_null(effect),))
    return tuple(found.values())


def step_hypotheses(manoeuvres: Sequence[Manoeuvre], coefficients: Sequence[str]) -> tuple[Hypothesis, ...]:
    """Step changes of all coefficients together, on each log at the moments of a grid."""
    found = []
    for manoeuvre in manoeuvres:
        time = manoeuvre.flight.time
        interval = float(np.median(np.diff(time)))
        for moment in time[0] + (time[-1] - time[0]) * np.linspace(0.06, 0.94, STEP_GRID):
            effects = tuple(at_null(jump_at(name, float(moment), interval), manoeuvre.name) for name in coefficients)
            found.append(Hypothesis("step_change", manoeuvre.name, effects=effects, time=float(moment)))
    return tuple(found)


def with_gust(model: AerodynamicModel) -> AerodynamicModel:
    """The model with an input column for the vertical gust velocity."""
    extended = model.with_columns([GUST_COLUMN])
    return replace(extended, constants=extended.constants._replace(gust=extended.columns.index(GUST_COLUMN) - 8))


def with_offsets(model: AerodynamicModel, coefficients: Sequence[str]) -> AerodynamicModel:
    """The model with an input column that adds to each coefficient directly; zero until an effect fills it."""
    entries = [(name, offset_term(name)) for name in coefficients]
    extended = model.with_columns(offset_column(name) for name in coefficients).extended(entries)
    values = extended.values.copy()
    values[extended.indices(entries)] = 1.0
    return extended.with_values(values)
