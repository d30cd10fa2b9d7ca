"""Modes and flying qualities of the declared and the completed model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from aerosid.effects import KINDS
from aerosid.loop.flying_qualities.linear_analysis import LinearRow, StepRow
from aerosid.loop.flying_qualities.mode_levels import Level
from aerosid.loop.quantity import Parameter
from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.notation import MISSING, listed, number, with_deviation
from aerosid.reporting.figures.numbered import Figure, FigureBook
from aerosid.reporting.figures.step_response import step_response_chart
from aerosid.reporting.words import Unit, shown_unit

_WORDS = {
    "alpha": "angle of attack",
    "beta": "sideslip",
    "phi": "bank angle",
    "delta_e": "elevator",
    "delta_a": "aileron",
    "delta_r": "rudder",
    "thrust": "thrust",
    "frequency": "natural frequency, undamped",
    "damping": "damping ratio",
    "period": "period",
    "time_to_half": "time to half amplitude",
    "time_to_double": "time to double amplitude",
    "time_constant": "time constant",
    "root": "root",
    "phi_to_beta": "|φ/β| of the Dutch roll",
    "n_alpha": "n/α",
    "cap": "control anticipation parameter CAP",
}
_MODES = {"dutch_roll": "Dutch roll", "coupled_roll_spiral": "coupled roll and spiral"}
"""Names of modes that differ from their keys."""
EXTRAPOLATED = " †"
"""Mark of a number of a mode that lasts longer than the recordings."""

_LEVELS = {1: "1", 2: "2", 3: "3", 4: "worse than 3"}


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any] | None:
    """The numbers of both models next to each other, by groups, and the control steps; None without a model."""
    if not result.linear:
        return None
    groups: dict[str, dict[str, dict[str, Parameter]]] = {}
    marked = {(row.model, mode.name, name) for row in result.linear for mode in row.modes for name in mode.extrapolated}
    for row in result.linear:
        for name, numbers in _groups(row).items():
            for quantity, parameter in numbers.items():
                groups.setdefault(name, {}).setdefault(quantity, {})[row.model] = parameter
    models = [row.model for row in result.linear]
    first = result.linear[0]
    judged = dict.fromkeys(mode for row in result.linear for mode in row.levels)
    return {
        "models": models,
        "groups": {
            _mode(name): [_line(name, quantity, found, models, marked) for quantity, found in numbers.items()]
            for name, numbers in groups.items()
        },
        "condition": first,
        "levels": {_mode(mode): [_level(row, mode) for row in result.linear] for mode in judged},
        "left_out": sorted({KINDS[e.kind].short_name for e in result.completed_aircraft.effects}),
        "extrapolated": _said(result.linear),
        "pitches": "n_alpha" in first.qualities,
        "steps": [_step(result.linear, step, figures) for step in first.steps],
    }


def _step(rows: tuple[LinearRow, ...], step: StepRow, figures: FigureBook) -> Figure:
    """The figure of one control's step."""
    surface, size = _WORDS[step.control], number(step.size * shown_unit("rad").factor, 3)
    sense = CHANNELS[step.control].positive.split(" (")[0]
    held = ", thrust held" if "thrust" in rows[0].trim else ""
    caption = f"{surface.capitalize()} step of {size} deg, {sense}: linear response from trim{held}."
    shown = [CHANNELS[channel].name for channel in step.response]
    label = f"Time histories of {', '.join(shown[:-1])} and {shown[-1]} after a step of the {surface}"
    held_by = [row for row in rows if any(own.control == step.control for own in row.steps)]
    return figures.add(step_response_chart(held_by, step.control), caption, label.replace("true airspeed", "airspeed"))


def _mode(name: str) -> str:
    return _MODES.get(name, name.replace("_", " "))


def _groups(row: LinearRow) -> dict[str, Any]:
    modes = {mode.name: mode.numbers for mode in row.modes}
    return {"level flight": row.trim, **modes, "flying qualities": row.qualities}


def _line(
    group: str, quantity: str, found: dict[str, Parameter], models: list[str], marked: set[tuple[str, str, str]]
) -> dict[str, Any]:
    """One quantity: its name and unit, and each model's number in the unit shown, marked where extrapolated."""
    given = next(iter(found.values())).unit
    # A natural frequency is not a rate of turn: it stays in rad/s.
    unit = Unit(given, 1.0) if quantity == "frequency" else shown_unit(given)
    cells = []
    for model in models:
        parameter = found.get(model)
        spread = None if parameter is None or parameter.std_error is None else unit.factor * parameter.std_error
        text = with_deviation(None if parameter is None else unit.factor * parameter.value, spread)
        cells.append(text + (EXTRAPOLATED if (model, group, quantity) in marked else ""))
    return {"words": _WORDS.get(quantity, quantity), "unit": unit.text or "1", "cells": cells}


def _level(row: LinearRow, mode: str) -> str:
    """The level of a mode, marked where the mode lasts longer than the recordings."""
    beyond = any(each.name == mode and each.extrapolated for each in row.modes)
    level = _level_text(row.levels.get(mode))
    return level + (EXTRAPOLATED if beyond and level != MISSING else "")


def _level_text(found: Level | None) -> str:
    """The level, and the levels within two deviations where there are several."""
    if found is None:
        return MISSING
    best, worst = found.span or (found.level, found.level)
    level = _LEVELS[found.level]
    return level if best == worst else f"{level} ({_LEVELS[best]} to {_LEVELS[worst]} within 2 σ)"


def _said(rows: Sequence[LinearRow]) -> str:
    """Meaning of the mark, with the length of the longest recording; empty where nothing is marked."""
    record = rows[0].record
    names = dict.fromkeys(_mode(mode.name) for row in rows for mode in row.modes if mode.extrapolated)
    if record is None or not names:
        return ""
    return (
        f"{EXTRAPOLATED.strip()} Extrapolated: the longest identification record lasts {number(record, 3)} s, and "
        f"these numbers of the {listed(list(names))} refer to a longer time. They follow from the derivatives and were "
        "not observed in flight; their standard errors do not include the model's omissions in slower motion."
    )
