"""Strip charts of every log, measured and simulated, flights not used in the fit first."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from aerosid.loop.model_validation.open_loop_errors import ErrorRow, Simulated
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES
from aerosid.nomenclature import CHANNELS
from aerosid.notation import number
from aerosid.reporting.error_rows import by_log
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.figures.strip_charts import CHANNELS_A_CHART, inputs_to_draw, strip_chart
from aerosid.reporting.judgement import headline_rows
from aerosid.reporting.roles import label_of
from aerosid.reporting.simulator_tolerances import within
from aerosid.reporting.tables import measured_channels
from aerosid.reporting.words import shown_unit


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any]:
    """Strip charts and errors of every log."""
    wanted = result.completed_aircraft.variables
    groups = {(group["log"], group["role"]): group for group in by_log(result.errors, result)}
    headline = {row.role for row in headline_rows(result)}
    logs = []
    for simulated in sorted(result.simulated, key=lambda simulated: -ROLES.index(simulated.role)):
        rows = {row.channel: row for row in result.errors if row.log == simulated.log.name}
        noise = {channel: row.noise for channel, row in rows.items()}
        inputs = inputs_to_draw(simulated, wanted)
        edges = {name: within(simulated, name) for name in simulated.measured}
        corridors = {name: pair for name, pair in edges.items() if pair is not None}
        drawn = []
        for channels in _groups(measured_channels([simulated])):
            chart = strip_chart(simulated, channels, inputs, noise, corridors)
            label = f"Time histories of {', '.join(channels)}, their residuals, and {', '.join(inputs) or 'no input'}"
            drawn.append(figures.add(chart, _caption(simulated, channels, rows, result), label))
        # The errors of the headline flights are in the decision summary.
        errors = None if simulated.role in headline else groups.get((simulated.log.name, simulated.role))
        logs.append(
            {
                "log": simulated.log,
                "role": simulated.role,
                "label": label_of(simulated.role, result),
                "figures": drawn,
                "errors": errors,
                "tolerance": bool(corridors),
            }
        )
    return {"logs": logs, "trimmed": any(simulated.role != "identification" for simulated in result.simulated)}


def _groups(channels: Sequence[str]) -> list[Sequence[str]]:
    """The channels in as few charts of nearly equal size as the page permits."""
    charts = -(-len(channels) // CHANNELS_A_CHART)
    size = -(-len(channels) // max(charts, 1)) or 1
    return [channels[i : i + size] for i in range(0, len(channels), size)]


def _caption(simulated: Simulated, channels: Sequence[str], rows: dict[str, ErrorRow], result: ClosedLoop) -> str:
    """Caption of the chart, with the numbers that it illustrates."""
    parts = []
    for channel in channels:
        name = CHANNELS[channel].name if channel in CHANNELS else channel
        row = rows.get(channel)
        if row is None:
            parts.append(name)
            continue
        unit = shown_unit(row.unit)
        shown = (row.before, row.after) if result.identified else (row.declared,)
        errors = ["diverged" if value is None else number(value * unit.factor, 2) for value in shown]
        parts.append(f"{name} {' → '.join(errors)} {unit.text}".rstrip())
    of = "error re-estimated → completed" if result.identified else "error of the declared model"
    label = label_of(simulated.role) if result.identified else label_of(simulated.role, result)
    return f"{simulated.log.name} ({label}); {of}: {'; '.join(parts)}."
