"""Modes and flying qualities of the declared and the completed model."""

from __future__ import annotations

from typing import Any

from aerosid.loop.linear_analysis import LinearRow
from aerosid.loop.quantity import Parameter
from aerosid.loop.result import ClosedLoop
from aerosid.notation import MISSING, number, with_deviation
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.figures.step_response import step_response_chart
from aerosid.reporting.words import Unit, shown_unit

_WORDS = {
    "alpha": "angle of attack",
    "delta_e": "elevator",
    "thrust": "thrust",
    "frequency": "natural frequency, undamped",
    "damping": "damping ratio",
    "period": "period",
    "time_to_half": "time to half amplitude",
    "time_to_double": "time to double amplitude",
    "n_alpha": "n/α",
    "cap": "control anticipation parameter CAP",
}
_LEVELS = {1: "1", 2: "2", 3: "3", 4: "worse than 3"}


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any] | None:
    """The numbers of both models beside each other, group by group, and the elevator step; None without a model."""
    if not result.linear:
        return None
    groups: dict[str, dict[str, dict[str, Parameter]]] = {}
    for row in result.linear:
        for name, numbers in _groups(row).items():
            for quantity, parameter in numbers.items():
                groups.setdefault(name, {}).setdefault(quantity, {})[row.model] = parameter
    models = [row.model for row in result.linear]
    first = result.linear[0]
    size = number(first.step_size * shown_unit("rad").factor, 3)
    caption = f"Elevator step of {size} deg, trailing edge down: linear response from trim, thrust held."
    label = "Time histories of airspeed, angle of attack, pitch rate and pitch angle after a step of the elevator"
    return {
        "models": models,
        "groups": {
            name.replace("_", " "): [_line(quantity, found, models) for quantity, found in numbers.items()]
            for name, numbers in groups.items()
        },
        "condition": first,
        "levels": [_level(row) for row in result.linear],
        "phugoid_levels": [_LEVELS.get(row.phugoid_level or 0, MISSING) for row in result.linear],
        "left_out": sorted({e.kind.replace("_", " ") for e in result.completed_aircraft.effects}),
        "step": figures.add(step_response_chart(result.linear), caption, label),
    }


def _groups(row: LinearRow) -> dict[str, Any]:
    modes = {mode.name: mode.numbers for mode in row.modes}
    return {"level flight": row.trim, **modes, "flying qualities": row.qualities}


def _line(quantity: str, found: dict[str, Parameter], models: list[str]) -> dict[str, Any]:
    """One quantity: its words and unit, and each model's number in the unit shown."""
    given = next(iter(found.values())).unit
    # A natural frequency is no rate of turn: it stays in rad/s.
    unit = Unit(given, 1.0) if quantity == "frequency" else shown_unit(given)
    cells = []
    for model in models:
        parameter = found.get(model)
        spread = None if parameter is None or parameter.std_error is None else unit.factor * parameter.std_error
        cells.append(with_deviation(None if parameter is None else unit.factor * parameter.value, spread))
    return {"words": _WORDS.get(quantity, quantity), "unit": unit.text or "1", "cells": cells}


def _level(row: LinearRow) -> str:
    """The level, and the levels within two deviations where there are several."""
    if row.short_period_level is None:
        return MISSING
    said = _LEVELS[row.short_period_level]
    best, worst = row.short_period_level_range or (row.short_period_level,) * 2
    return said if best == worst else f"{said} ({_LEVELS[best]} to {_LEVELS[worst]} within 2 σ)"
