"""Levels of flying qualities of a linear model's modes, with the levels within two deviations of their numbers."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from aerosid.flight_model.modes import (
    DUTCH_ROLL,
    LONGITUDINAL_NAMES,
    PHUGOID,
    ROLL,
    ROLL_SPIRAL,
    SHORT_PERIOD,
    SPIRAL,
    Mode,
)
from aerosid.loop.flying_qualities.mil_f_8785c import (
    Requirement,
    divergence_level,
    dutch_roll_level,
    phugoid_level,
    roll_level,
    roll_spiral_level,
    short_period_level,
    spiral_level,
)
from aerosid.loop.quantity import Parameter

QUALITIES = "qualities"
"""The group of numbers that belong to no mode alone."""

Numbers = Mapping[tuple[str, str], Parameter]
"""Every number of an analysis by (mode, quantity)."""


@dataclass(frozen=True)
class Level:
    """Level 1 to 3 of one mode, 4 where worse; `span`: best and worst within two deviations, None where unknown."""

    level: int
    span: tuple[int, int] | None = None


_JUDGES: Mapping[str, tuple[tuple[tuple[str, str], ...], Callable[..., int]]] = {
    SHORT_PERIOD: (
        ((SHORT_PERIOD, "frequency"), (SHORT_PERIOD, "damping"), (QUALITIES, "n_alpha")),
        short_period_level,
    ),
    DUTCH_ROLL: (
        ((DUTCH_ROLL, "frequency"), (DUTCH_ROLL, "damping"), (QUALITIES, "phi_to_beta")),
        dutch_roll_level,
    ),
    ROLL: (((ROLL, "root"),), roll_level),
    SPIRAL: (((SPIRAL, "root"),), spiral_level),
    ROLL_SPIRAL: (((ROLL_SPIRAL, "frequency"), (ROLL_SPIRAL, "damping")), roll_spiral_level),
}
"""What each mode is judged by, and the function that takes these numbers and the requirement."""

_NEVER_NEGATIVE = ("frequency", "phi_to_beta")


def mode_levels(numbers: Numbers, modes: Sequence[Mode], requirement: Requirement) -> dict[str, Level]:
    """The level of each mode that there is a requirement for, by the mode's name.

    Where the short period has become a divergence, its level is that of the divergence.
    """
    found = {}
    for name, (keys, judge) in _JUDGES.items():
        if all(key in numbers for key in keys):
            found[name] = _with_span([numbers[key] for key in keys], [key[1] for key in keys], judge, requirement)
    doubling = [
        row.value
        for (mode, name), row in numbers.items()
        if name == "time_to_double" and mode in LONGITUDINAL_NAMES and mode != PHUGOID
    ]
    if SHORT_PERIOD not in found and doubling:
        found[SHORT_PERIOD] = Level(divergence_level(min(doubling)))
    for mode in modes:
        if mode.name == PHUGOID:
            found[PHUGOID] = Level(phugoid_level(mode.damping, mode.time_to_double))
    return found


def _with_span(
    rows: Sequence[Parameter], names: Sequence[str], judge: Callable[..., int], requirement: Requirement
) -> Level:
    level = judge(*(row.value for row in rows), requirement)
    if any(row.std_error is None for row in rows):
        return Level(level)
    corners = []
    for signs in itertools.product((-2.0, 0.0, 2.0), repeat=len(rows)):
        moved = [row.value + sign * (row.std_error or 0.0) for row, sign in zip(rows, signs, strict=True)]
        ends = [max(value, 0.0) if name in _NEVER_NEGATIVE else value for value, name in zip(moved, names, strict=True)]
        corners.append(judge(*ends, requirement))
    return Level(level, (min(corners), max(corners)))
