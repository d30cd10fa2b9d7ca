"""Goodness of fit of every flight, in numbers beyond the root-mean-square error."""

from __future__ import annotations

from typing import Any

from aerosid.loop.model_validation.goodness import FitRow
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.autocorrelations import autocorrelations
from aerosid.reporting.figures.numbered import Figure, FigureBook


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any] | None:
    """Explained variance, Theil's coefficient and whiteness of every channel, and the innovations' whiteness."""
    if not (result.coefficients or result.fit or result.innovations):
        return None
    logs: dict[str, list[FitRow]] = {}
    for row in result.fit:
        if row.variant == "after":
            logs.setdefault(row.log, []).append(row)
    samples = {simulated.log.name: simulated.log.samples for simulated in result.simulated}
    drawn = {
        log: _figure(log, [row for row in result.fit if row.log == log], samples.get(log, 1), figures) for log in logs
    }
    innovations = {(row.log, row.channel): row for row in result.innovations}
    return {"coefficients": result.coefficients, "logs": logs, "figures": drawn, "innovations": innovations}


def _figure(log: str, rows: list[FitRow], samples: int, figures: FigureBook) -> Figure | None:
    """The autocorrelations of a log's residuals; None where every simulation diverged."""
    if not any(row.autocorrelation for row in rows):
        return None
    caption = f"Autocorrelation of the open-loop residuals of {log}; white noise stays in the band."
    label = f"Autocorrelations of the residuals of {', '.join(dict.fromkeys(row.channel for row in rows))}"
    return figures.add(autocorrelations(rows, samples), caption, label)
