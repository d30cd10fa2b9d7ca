"""Families of effects: their names, when they are offered, how one is made."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from aerosid.effects.kinds import ActiveEffect, Effect, Signal
from aerosid.flight_model.axes import LONGITUDINAL, Axes
from aerosid.flight_model.constants import Constants

Place = Literal["input", "channel", "coefficient", "axis", "inertia", "nothing"]


@dataclass(frozen=True)
class Flown:
    """One flight as the catalogue sees it before anything is asked of it.

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
    """

    log: str
    time: Signal
    inputs: Mapping[str, Signal]
    measured: Mapping[str, Signal]
    noise: Mapping[str, float]
    height: Signal | None
    constants: Constants
    axes: Axes

    @property
    def span(self) -> float:
        """Wing area over mean chord, m: about the wing's span."""
        return self.constants.wing_area / self.constants.mean_chord


@dataclass(frozen=True)
class Offer:
    """A question to the flights: effects that become free together, at the numbers at which they are none.

    `where` as reported, of a sudden change the log; `time` its moment, s.
    """

    kind: str
    where: str
    effects: tuple[ActiveEffect, ...]
    time: float | None = None


@dataclass(frozen=True)
class Planted:
    """An example for the catalogue's own tests: an effect with numbers, large enough to be named in a usual flight.

    `where` as in result.json; `numbers` by the names of the effect's parameters, the leading one first. The flight
    begins at `altitude`, m, and its thrust swings slowly by the share `thrust_swing` either way; `axes` are the motion
    that shows it.
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
        What stands in its `where`: an input, a measured channel, a coefficient, a body axis (x, y or z), a moment or
        product of inertia, or nothing.
    sentence : str
        What it says of `{where}`, for a report.
    made : callable
        The effect at a place, from its numbers by name and the sampling interval, s: what an aircraft file declares.
    planted : tuple of Planted
        Examples.
    negative : bool
        Whether its first number may be below zero.
    follows_its_score : bool
        Whether it is near enough to linear in its numbers for the score test to rank it rightly when it is large.
    optional : tuple of str
        Numbers that it may do without.
    noun : str
        What a sentence calls it, with its article; empty: `a` and its name in words.
    below : str
        The sentence where its number is below none and says the opposite; empty: the same.
    is_zero : bool
        Whether it is the zero of an instrument, which differs between flights.
    rarity : float
        What it must bring in -2 ln L beyond a commoner effect that does the same.
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
    is_zero: bool = False
    rarity: float = 0.0

    @property
    def words(self) -> str:
        """What a sentence calls it: `a control lag`."""
        return self.noun or f"a {self.name.replace('_', ' ')}"

    def said(self, where: str, value: float) -> str:
        """The sentence for a place and a number."""
        return ((value < 0.0 and self.below) or self.sentence).format(where=where)

    @property
    def leading(self) -> str:
        """The name of the number that result.json calls its value: the first."""
        return next(iter(self.planted[0].numbers))

    @property
    def required(self) -> tuple[str, ...]:
        """The names of the numbers without which there is no effect; what it adds to coefficients may be left out."""
        return tuple(n for n in self.planted[0].numbers if not n.startswith("C_") and n not in self.optional)


@dataclass(frozen=True)
class Family:
    """The kinds of one file, and what of them is worth asking of some flights.

    `offered(flights, controls, coefficients)` with the names of the surfaces that declared terms use, and of the
    coefficients that may change; None where the search brings the family in by itself.
    """

    kinds: tuple[Kind, ...]
    offered: Callable[[tuple[Flown, ...], tuple[str, ...], tuple[str, ...]], Iterable[Offer]] | None = None


def at_null(effect: Effect, log: str = "") -> ActiveEffect:
    """The effect with the numbers at which it is none."""
    return ActiveEffect(effect, tuple(parameter.null for parameter in effect.parameters), log)
