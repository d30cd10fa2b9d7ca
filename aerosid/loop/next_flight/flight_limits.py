"""Limits of the next flight: those given, or the flown range with a margin."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import UsageError
from aerosid.flight_model.axes import Axes
from aerosid.flight_model.constants import GRAVITY
from aerosid.logs.formats.quantity import read_quantity
from aerosid.logs.formats.units import UnitProblem
from aerosid.loop.next_flight.predicted_flight import SURFACES

MOTION = {"alpha": "rad", "n_z": "1", "V": "m/s", "theta": "rad", "beta": "rad", "phi": "rad"}
"""Quantities of the motion that can be limited, as far as a case answers with them."""

RATES = {f"{name}_rate": "rad/s" for name in SURFACES}
UNITS = {**MOTION, **dict.fromkeys(SURFACES, "rad"), **RATES}
"""What can be limited."""


def _least() -> Mapping[str, float]:
    motion = {"alpha": 0.035, "n_z": 0.25, "V": 3.0, "theta": 0.1, "beta": 0.05, "phi": 0.2}
    return {**motion, "delta_e": 0.02, "delta_r": 0.04, "delta_a": 0.04}


@dataclass(frozen=True)
class RangeSettings:
    """How far a next flight may go where no limit is given; chosen, found on no recording.

    Attributes
    ----------
    beyond : float
        Share of the flown range, 1, by which an input may leave it at either end.
    margin : float
        Share of the way from trim to a limit, 1, that a prediction keeps free: the models differ, and so does the air.
    rate : float
        rad/s of a surface where nothing is given: what a pilot's step at a yoke takes, 0.2 s for 6 deg.
    least : mapping of str to float
        Either way of trim, SI, where a record shows no motion to go by.
    """

    beyond: float = 0.2
    margin: float = 0.1
    rate: float = 0.5
    least: Mapping[str, float] = field(default_factory=_least)


RANGES = RangeSettings()
"""The ranges of every next flight."""


@dataclass(frozen=True)
class FlightLimits:
    """Limits of the recorded motion and of the surfaces.

    Attributes
    ----------
    ranges : mapping of str to (float, float)
        Lowest and highest alpha [rad], n_z [1], V [m/s], theta, beta, phi and surfaces [rad], those that the case has.
    rates : mapping of str to float
        Greatest rate of each surface, rad/s.
    given : frozenset of str
        Those that were given; the others follow from what was flown.
    axes : Axes
        The case.
    """

    ranges: Mapping[str, tuple[float, float]]
    rates: Mapping[str, float]
    given: frozenset[str]
    axes: Axes

    def room(
        self,
        outputs: NDArray[np.float64],
        surfaces: Mapping[str, NDArray[np.float64]],
        still: Mapping[str, float],
    ) -> float:
        """How far a prediction stays from the limits: 1 at trim, 0 at the margin's edge, negative beyond it.

        Parameters
        ----------
        outputs : ndarray, shape (N, m)
            Sensor outputs, from trim.
        surfaces : mapping of str to ndarray, shape (N,)
            Each surface, rad.
        still : mapping of str to float
            The limited quantities at trim. A model in which a sensor reads with another offset begins elsewhere: its
            excursions count.
        """
        if not np.isfinite(outputs).all():
            return -np.inf
        least = 1.0
        for name, values in shown(outputs, surfaces, self.axes).items():
            low, high = self.ranges[name]
            trim = still[name]
            if not low < trim < high:
                return -np.inf
            excursion = values - values[0]
            used = max(float(np.max(excursion)) / (high - trim), float(np.min(excursion)) / (low - trim))
            least = min(least, 1.0 - used / (1.0 - RANGES.margin))
        return least


def shown(
    outputs: NDArray[np.float64], surfaces: Mapping[str, NDArray[np.float64]], axes: Axes
) -> dict[str, NDArray[np.float64]]:
    """The limited quantities (N,) of a prediction (N, m); n_z is that of the place where a_z is measured."""
    row = {name: outputs[:, place] for place, name in enumerate(axes.outputs)}
    if "a_z" in row:
        row["n_z"] = -row["a_z"] / GRAVITY
    return {**{name: row[name] for name in MOTION if name in row}, **surfaces}


def flight_limits(
    flown: Sequence[tuple[NDArray[np.float64], Mapping[str, NDArray[np.float64]]]],
    still: Mapping[str, float],
    given: Mapping[str, tuple[float, float]],
    axes: Axes,
) -> FlightLimits:
    """The limits, those that are not given from what was flown.

    Parameters
    ----------
    flown : sequence of (ndarray (N, m), mapping of str to ndarray (N,))
        Outputs of each record, as the completed model simulates them without noise, and its surfaces.
    still : mapping of str to float
        The limited quantities in steady flight.
    given : mapping of str to (float, float)
        Limits that were given, SI; of rates the second number counts.
    """
    ranges = {}
    records = [shown(*record, axes) for record in flown]
    for name in records[0]:
        if name in given:
            ranges[name] = given[name]
            continue
        low = min(float(np.nanmin(record[name])) for record in records)
        high = max(float(np.nanmax(record[name])) for record in records)
        reach, least = RANGES.beyond * (high - low), RANGES.least[name]
        ranges[name] = min(low - reach, still[name] - least), max(high + reach, still[name] + least)
    rates = {name: given.get(f"{name}_rate", (-RANGES.rate, RANGES.rate))[1] for name in flown[0][1]}
    return FlightLimits(ranges, rates, frozenset(given), axes)


_NUMBER = re.compile(r"^\s*[+-]?[\d.]+(?:[eE][+-]?\d+)?")


def _has_unit(word: str) -> bool:
    return bool(_NUMBER.sub("", word, count=1).strip())


def read_limit(text: str) -> tuple[str, tuple[float, float]]:
    """A limit in words, `alpha=-2:12deg` or `delta_e_rate=20deg/s`, in SI.

    Raises
    ------
    UsageError
        Where the quantity is none that can be limited, or the numbers are no range.
    """
    name, _, rest = text.partition("=")
    name = name.strip()
    unit = UNITS.get(name)
    wrong = f"--limit is {text!r}"
    if unit is None:
        raise UsageError(f"{wrong}; limit one of {', '.join(UNITS)}, as in alpha=-2:12deg.")
    spelled = {"rad": "deg", "rad/s": "deg/s"}.get(unit)
    *lower, upper = rest.split(":")
    behind = _NUMBER.sub("", upper, count=1).strip()  # a unit behind the last number is that of all
    try:
        numbers = [read_quantity(word if _has_unit(word) else f"{word} {behind}", unit) for word in (*lower, upper)]
    except UnitProblem:
        numbers = []
    if name in RATES and len(numbers) == 1:
        numbers = [-numbers[0], numbers[0]]
    if len(numbers) != 2 or not -1e6 < numbers[0] < numbers[1] < 1e6:
        example = f"{name}=20deg/s" if name in RATES else f"{name}=LOW:HIGH"
        raise UsageError(f"{wrong}; give a range from low to high in {unit}{f' or {spelled}' if spelled else ''}, as "
                         f"in {example}.")  # fmt: skip
    return name, (numbers[0], numbers[1])
