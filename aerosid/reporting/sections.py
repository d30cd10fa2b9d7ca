"""The sections of the report: what each one needs to know. A new one is one function here, one line in `SECTIONS`
and one template of its name.
"""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from markupsafe import Markup

from aerosid.nomenclature import CHANNELS
from aerosid.reporting.charts import CHANNELS_A_CHART, inputs_to_draw, model_error_chart, strip_chart
from aerosid.reporting.inline_svg import inline_svg
from aerosid.reporting.judgement import DECISIONS, TONES, headline_rows, typical_gain, unproven
from aerosid.reporting.result_schema import input_files
from aerosid.reporting.tables import measured_channels
from aerosid.reporting.words import number, shown_unit
from aerosid.results import ClosedLoop, ErrorRow, Simulated

Context = dict[str, Any]


@dataclass(frozen=True)
class Section:
    """One section: its anchor and template, its heading, and what fills the template."""

    name: str
    title: str
    context: Callable[[ClosedLoop], Context]


@dataclass(frozen=True)
class Figure:
    """A figure with its number, its caption and a longer text for those who cannot see it."""

    number: int
    drawing: Markup
    caption: str


def decision(result: ClosedLoop) -> Context:
    """Verdict, effects, and the error before and after on the flights that were not used for the fit."""
    rows = headline_rows(result)
    return {
        "tone": TONES[result.verdict],
        "verdict": result.verdict.name.lower().replace("_", " "),
        "meaning": result.verdict.value,
        "decision": DECISIONS[result.verdict],
        "open_points": unproven(result),
        "held_back": bool(rows) and rows[0].role == "validation",
        "gain": typical_gain(rows),
        "logs": _by_log(rows),
        "scale": _scale(rows),
    }


def evidence(result: ClosedLoop) -> Context:
    """d(t) of each equation with what explains it, the screening of candidates, and the alternatives."""
    figures = []
    for i, log in enumerate(dict.fromkeys(history.log for history in result.model_error)):
        histories = [history for history in result.model_error if history.log == log]
        found = [
            f"{history.coefficient}: {', '.join(history.terms)}, correlation {number(history.correlation, 3)}"
            if history.terms
            else f"{history.coefficient}: nothing found"
            for history in histories
        ]
        caption = f"Model error d(t) of {log}. {'; '.join(found)}."
        label = f"Time histories of d(t) in {', '.join(history.coefficient for history in histories)}"
        drawing = inline_svg(model_error_chart(histories), f"error-{i}", label)
        figures.append(Figure(i + 1, drawing, caption))
    screening = sorted(result.screening, key=lambda row: -row.gain if math.isfinite(row.gain) else math.inf)
    return {
        "figures": figures,
        "chosen": [row for row in screening if row.chosen],
        "screening": screening,
    }


def histories(result: ClosedLoop) -> Context:
    """Strip charts of every log."""
    wanted = frozenset(variable for entry in result.completed_aircraft.derivatives for variable in entry.term.variables)
    number_before = len(dict.fromkeys(history.log for history in result.model_error))
    logs = []
    for simulated in result.simulated:
        rows = {row.channel: row for row in result.errors if row.log == simulated.log.name}
        figures = []
        for channels in _groups(measured_channels([simulated])):
            number_before += 1
            inputs = inputs_to_draw(simulated, wanted)
            noise = {channel: row.noise for channel, row in rows.items()}
            chart = strip_chart(simulated, channels, inputs, noise)
            caption = _strip_caption(simulated, channels, rows)
            label = f"Time histories of {', '.join(channels)}, their residuals, and {', '.join(inputs) or 'no input'}"
            drawing = inline_svg(chart, f"strip-{number_before}", label)
            figures.append(Figure(number_before, drawing, caption))
        logs.append({"log": simulated.log, "role": simulated.role, "figures": figures})
    return {"logs": logs, "trimmed": any(simulated.role == "validation" for simulated in result.simulated)}


def derivatives(result: ClosedLoop) -> Context:
    """The derivative table, coefficient by coefficient, with where the estimate lies beside the declared value."""
    groups: dict[str, list[Context]] = {}
    for row in result.derivatives:
        shift = None
        if row.declared is not None and row.std_error and row.shown:
            shift = (row.value - row.declared) / row.std_error
        groups.setdefault(row.coefficient, []).append({"row": row, "found": row.declared is None, "shift": shift})
    return {"groups": groups, "hidden": any(not row.shown for row in result.derivatives)}


def errors(result: ClosedLoop) -> Context:
    """Root-mean-squares on every log, and the share of the coefficients' variance that is explained."""
    return {"logs": _by_log(result.errors), "coefficients": result.coefficients}


def readings(result: ClosedLoop) -> Context:
    """Which columns of the files became which channels, and what was done to them."""
    logs: list[Context] = []
    names: dict[str, None] = {}
    roles = [("identification", log) for log in result.identification]
    for role, log in [*roles, *(("validation", log) for log in result.validation)]:
        channels = []
        for name, values in log.channels.items():
            known = np.isfinite(values)
            channels.append(
                {
                    "channel": name,
                    "unit": log.units.get(name, "1"),
                    "source": log.sources.get(name),
                    "position": log.positions.get(name),
                    "missing": int(values.size - known.sum()),
                    "low": float(values[known].min()) if known.any() else None,
                    "high": float(values[known].max()) if known.any() else None,
                }
            )
        logs.append({"log": log, "role": role, "channels": channels})
        names.update(dict.fromkeys(log.channels))
    return {"logs": logs, "glossary": [CHANNELS[name] for name in names if name in CHANNELS]}


def origin(result: ClosedLoop) -> Context:
    """What is needed to get the same report again."""
    packages = {"aerosid": result.version, "Python": platform.python_version()}
    for name in ("numpy", "scipy", "numba"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = "not installed"
    return {"packages": packages, "inputs": input_files(result)}


SECTIONS = (
    Section("decision", "What is to be decided", decision),
    Section("evidence", "The evidence", evidence),
    Section("histories", "Measured and simulated", histories),
    Section("derivatives", "Derivatives", derivatives),
    Section("errors", "Errors and explained variance", errors),
    Section("readings", "What was read", readings),
    Section("origin", "Versions and inputs", origin),
)
"""The report from top to bottom."""


def _by_log(rows: Sequence[ErrorRow]) -> list[Context]:
    logs = dict.fromkeys((row.log, row.role) for row in rows)
    return [
        {"log": log, "role": role, "rows": [row for row in rows if (row.log, row.role) == (log, role)]}
        for log, role in logs
    ]


def _scale(rows: Sequence[ErrorRow]) -> Context:
    """Where errors stand on a line from the noise (1) to the largest multiple of it, in per cent of its length."""
    multiples = [value / row.noise for row in rows for value in (row.before, row.after) if value and row.noise > 0.0]
    decades = max(1.0, math.log10(max(multiples, default=10.0)))

    def place(value: float | None, noise: float) -> float | None:
        if not value or not noise > 0.0 or not math.isfinite(value / noise):
            return None
        return round(100.0 * min(max(math.log10(value / noise) / decades, 0.0), 1.0), 1)

    return {"place": place, "ticks": [(f"{10**k}×", round(100.0 * k / decades, 1)) for k in range(int(decades) + 1)]}


def _groups(channels: Sequence[str]) -> list[Sequence[str]]:
    """The channels in as few charts of nearly equal size as the page allows."""
    charts = -(-len(channels) // CHANNELS_A_CHART)
    size = -(-len(channels) // max(charts, 1)) or 1
    return [channels[i : i + size] for i in range(0, len(channels), size)]


def _strip_caption(simulated: Simulated, channels: Sequence[str], rows: dict[str, ErrorRow]) -> str:
    """What the chart shows, with the numbers that the eye is to find in it."""
    parts = []
    for channel in channels:
        name = CHANNELS[channel].name if channel in CHANNELS else channel
        row = rows.get(channel)
        if row is None:
            parts.append(name)
            continue
        unit = shown_unit(row.unit)
        before, after = (
            "diverged" if value is None else number(value * unit.factor, 2) for value in (row.before, row.after)
        )
        parts.append(f"{name} {before} → {after} {unit.text}".rstrip())
    use = "not used for the fit" if simulated.role == "validation" else "used for the fit"
    return f"{simulated.log.name} ({simulated.role}, {use}); error re-estimated → completed: {'; '.join(parts)}."
