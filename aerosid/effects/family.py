"""Families of effects: their kinds, conditions of their candidacy, construction of an effect."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from aerosid.effects.kinds import ActiveEffect, Effect, Signal
from aerosid.flight_model.axes import LONGITUDINAL, Axes
from aerosid.flight_model.constants import Constants

Place = Literal["input", "channel", "coefficient", "axis", "inertia", "nothing"]


@dataclass(frozen=True)
class FlightData:
    """The data of one flight from which the catalogue selects candidate effects.

    Attributes
    ----------
    log : str
        Its name.
    time : ndarray, shape (N,)
        s.
    inputs : mapping of str to ndarray, shape (N,)
        The model's input columns, SI, without gaps.
    measured : mapping of str to ndarray, shape (N,)
        The measured outputs, SI, NaN where a sample is missing.
    noise : mapping of str to float
        Standard deviation of each measured output's noise.
    height : ndarray, shape (N,), or None
        Measured height above the ground, m; None where no altitude was measured.
    constants : Constants
        Of the declared aircraft.
    axes : Axes
        The case of the equations of motion.
    smooth : tuple of str
        The inputs that are smooth between samples; the others are linear.
    """

    log: str
    time: Signal
    inputs: Mapping[str, Signal]
    measured: Mapping[str, Signal]
    noise: Mapping[str, float]
    height: Signal | None
    constants: Constants
    axes: Axes
    smooth: tuple[str, ...] = ()

    @property
    def span(self) -> float:
        """Wing area over mean chord, m: about the wing's span."""
        return self.constants.wing_area / self.constants.mean_chord


@dataclass(frozen=True)
class Offer:
    """A candidate: effects that become free together, with parameters at their null values.

    `where` as reported, of a step change the log; `time` its instant, s.
    """

    kind: str
    where: str
    effects: tuple[ActiveEffect, ...]
    time: float | None = None


@dataclass(frozen=True)
class Planted:
    """A simulated effect for the catalogue's own tests, large enough to be identified in a usual flight.

    `where` as in result.json; `numbers` by the names of the effect's parameters, the leading one first. The flight
    starts at `altitude`, m, and its thrust oscillates slowly by the fraction `thrust_swing`; `axes` is the case of the
    equations of motion that shows it.
    """

    where: str
    numbers: Mapping[str, float]
    altitude: float = 1500.0
    thrust_swing: float = 0.0
    axes: Axes = LONGITUDINAL


@dataclass(frozen=True)
class Kind:
    """One kind of effect.

    Attributes
    ----------
    name : str
        As in result.json.
    place : str
        Meaning of its `where`: an input, a measured channel, a coefficient, a body axis (x, y or z), a moment or
        product of inertia, or nothing.
    sentence : str
        Sentence on `{where}`, for a report.
    made : callable
        The effect at a place, from its parameters by name and the sampling interval, s, as an aircraft file declares.
    planted : tuple of Planted
        Examples.
    negative : bool
        Whether its first parameter may be below zero.
    follows_its_score : bool
        Whether it is linear enough in its parameters for the score test to rank it correctly when it is large.
    optional : tuple of str
        Optional parameters.
    noun : str
        Its name in a sentence, with the article; empty: `a` and its name in words.
    below : str
        The sentence where its parameter is below null and means the opposite; empty: the same.
    is_bias : bool
        Whether it is an instrument's bias, which differs between flights.
    rarity : float
        Additional gain in -2 ln L required compared with a commoner effect of the same response.
    rare_places : tuple of str
        Places of which alone that is required.
    """

    name: str
    place: Place
    sentence: str
    made: Callable[[str, Mapping[str, float], float], Effect]
    planted: tuple[Planted, ...]
    negative: bool = True
    follows_its_score: bool = True
    optional: tuple[str, ...] = ()
    noun: str = ""
    below: str = ""
    is_bias: bool = False
    rarity: float = 0.0
    rare_places: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Its name in a sentence: `a control lag`."""
        return self.noun or f"a {self.name.replace('_', ' ')}"

    @property
    def short_name(self) -> str:
        """`gust` as in a table: the noun without its article, else the kind."""
        return self.words.removeprefix("an ").removeprefix("a ")

    def describe(self, where: str, value: float) -> str:
        """The sentence for a place and a value."""
        return ((value < 0.0 and self.below) or self.sentence).format(where=where)

    def rarity_at(self, where: str) -> float:
        """The additional gain in -2 ln L that is required at a place."""
        return self.rarity if not self.rare_places or where in self.rare_places else 0.0

    @property
    def leading(self) -> str:
        """The name of the first parameter, which result.json calls its value."""
        return next(iter(self.planted[0].numbers))

    @property
    def required(self) -> tuple[str, ...]:
        """The names of the required parameters; additions to coefficients are optional."""
        return tuple(n for n in self.planted[0].numbers if not n.startswith("C_") and n not in self.optional)


@dataclass(frozen=True)
class Family:
    """The kinds of one file, and their candidates for some flights.

    `offered(flights, controls, coefficients)` with the names of the surfaces that declared terms use, and of the
    coefficients that may change; None where the search itself tries the family.
    """

    kinds: tuple[Kind, ...]
    offered: Callable[[tuple[FlightData, ...], tuple[str, ...], tuple[str, ...]], Iterable[Offer]] | None = None


def at_null(effect: Effect, log: str = "") -> ActiveEffect:
    """The effect with its parameters at their null values."""
    return ActiveEffect(effect, tuple(parameter.null for parameter in effect.parameters), log)
