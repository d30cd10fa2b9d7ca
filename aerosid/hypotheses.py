"""Everything that is asked of a flight: a hypothesis for each term, sensor, control and moment that may be to blame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.effects import CATALOGUE, ActiveEffect, Effect, EffectParameter, Flown, InputEffect, OutputEffect
from aerosid.effects.aerodynamic_terms import searched_numbers
from aerosid.effects.cg_shift import centre_column
from aerosid.effects.disturbance import GUST_COLUMN
from aerosid.effects.step_change import offset_column, offset_term
from aerosid.effects.thrust import THRUST_COLUMN
from aerosid.longitudinal import OUTPUTS
from aerosid.manoeuvre import Manoeuvre
from aerosid.terms import COEFFICIENTS


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
        Of a sudden change, s.
    """

    kind: str
    where: str
    term: str = ""
    entries: tuple[Entry, ...] = ()
    effects: tuple[ActiveEffect, ...] = ()
    time: float | None = None

    @property
    def parameters(self) -> int:
        """How many numbers it adds, the moment of a step and a spline's knot among them."""
        count = len(self.entries) + sum(len(active.values) for active in self.effects)
        return count + (self.time is not None) + self.searched

    @property
    def searched(self) -> int:
        """How many numbers inside its terms were chosen from the flight."""
        return sum(searched_numbers(term) for _, term in self.entries)

    @property
    def is_plain_term(self) -> bool:
        """Whether it is a term with no number inside it that was chosen from the flight."""
        return self.kind == "aero_term" and not self.searched

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
        if not self.effects:
            return self
        return replace(self, effects=tuple(_chord(active, trial) for active in self.effects))


def _chord(active: ActiveEffect, trial: int) -> ActiveEffect:
    parameters = tuple(_stepping(parameter, trial) for parameter in active.effect.parameters)
    return replace(active, effect=replace(active.effect, parameters=parameters))


def _stepping(parameter: EffectParameter, trial: int) -> EffectParameter:
    reach = abs(parameter.trials[min(trial, len(parameter.trials) - 1)] - parameter.null)
    return replace(parameter, step=reach) if reach > 0.0 else parameter


def term_hypotheses(candidates: Sequence[Entry]) -> tuple[Hypothesis, ...]:
    """One for each candidate term."""
    return tuple(Hypothesis("aero_term", entry[0], str(entry[1]), entries=(entry,)) for entry in candidates)


def effect_hypotheses(
    model: AerodynamicModel, manoeuvres: Sequence[Manoeuvre], coefficients: Sequence[str] = ()
) -> tuple[Hypothesis, ...]:
    """One for each offer of the catalogue.

    Parameters
    ----------
    model : AerodynamicModel
        The declared one; its terms say which controls act.
    manoeuvres : sequence of Manoeuvre
        The identification flights.
    coefficients : sequence of str
        Those that may change suddenly; none: no sudden changes are offered.
    """
    span = model.constants.wing_area / model.constants.mean_chord
    flights = tuple(_flown(manoeuvre, span) for manoeuvre in manoeuvres)
    offers = [
        offer
        for family in CATALOGUE
        if family.offered is not None
        for offer in family.offered(flights, controls_of(model), tuple(coefficients))
    ]
    return tuple(Hypothesis(o.kind, o.where, effects=o.effects, time=o.time) for o in offers)


def controls_of(model: AerodynamicModel) -> tuple[str, ...]:
    """The surfaces that the model's terms use."""
    used = {name for _, term in model.entries for name in term.variables}
    return tuple(name for name in model.columns[8:] if name.startswith("delta_") and name in used)


def _flown(manoeuvre: Manoeuvre, span: float) -> Flown:
    flight = manoeuvre.flight
    places = {name: OUTPUTS.index(name) for name in manoeuvre.outputs}
    return Flown(
        log=manoeuvre.name,
        time=flight.time,
        inputs=dict(zip(manoeuvre.columns, flight.inputs.T, strict=True)),
        measured={name: flight.measured[:, i] for name, i in places.items()},
        noise={name: float(manoeuvre.noise[i]) for name, i in places.items()},
        height=flight.measured[:, places["h"]] - manoeuvre.ground if "h" in places else None,
        span=span,
    )


FILLED = {
    GUST_COLUMN: "gust",
    THRUST_COLUMN: "thrust_change",
    centre_column("x"): "cg_x",
    centre_column("z"): "cg_z",
}
"""Input columns that no channel fills and no term names, with the field of `Constants` that says where they are."""


def with_gust(model: AerodynamicModel) -> AerodynamicModel:
    """The model with an input column for the vertical gust velocity."""
    return _with_filled(model, GUST_COLUMN)


def _with_filled(model: AerodynamicModel, column: str) -> AerodynamicModel:
    extended = model.with_columns([column])
    place = {FILLED[column]: extended.columns.index(column) - 8}
    return replace(extended, constants=extended.constants._replace(**place))


def with_offsets(model: AerodynamicModel, coefficients: Sequence[str]) -> AerodynamicModel:
    """The model with an input column that adds to each coefficient directly; zero until an effect fills it."""
    entries = [(name, offset_term(name)) for name in coefficients]
    extended = model.with_columns(offset_column(name) for name in coefficients).extended(entries)
    values = extended.values.copy()
    values[extended.indices(entries)] = 1.0
    return extended.with_values(values)


def with_columns_of(model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> AerodynamicModel:
    """The model with the input columns that effects fill and no channel does."""
    wanted = {column for active in effects for column in _columns(active.effect)}
    for column in FILLED:
        if column in wanted:
            model = _with_filled(model, column)
    return with_offsets(model, [name for name in COEFFICIENTS if offset_column(name) in wanted])


def _columns(effect: Effect) -> tuple[str, ...]:
    if isinstance(effect, InputEffect):
        return (effect.where_acts,)
    return () if isinstance(effect, OutputEffect) else effect.columns
