"""Sections of the report in order: the decision first, then the evidence for it.

A section is one function `context(result, figures)` in a module here, one template of its name in templates/, and one
entry in `SECTIONS`. The function returns the variables of the template, or None where the section does not apply;
figures are made by `figures.add(chart, caption, label)` and placed by the macro `figure`. Everything in the page is
also in report.pdf.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.sections import (
    alternatives,
    candidates,
    card,
    decision,
    derivatives,
    effects,
    fit,
    glossary,
    instruments,
    linear,
    next_flight,
    prediction,
    predictions,
    qualification,
    readings,
    residual,
    screening,
)

Context = dict[str, Any]


@dataclass(frozen=True)
class Section:
    """One section: its anchor and template, its heading, and the function that fills the template."""

    name: str
    title: str
    context: Callable[[ClosedLoop, FigureBook], Context | None]
    of_identification: bool = True
    """Whether it tells of what was identified: it is left out where nothing was."""


SECTIONS = (
    Section("decision", "Decision summary", decision.context, of_identification=False),
    Section("instruments", "Data compatibility check", instruments.context, of_identification=False),
    Section("residual", "Residual and model error d(t)", residual.context),
    Section("candidates", "Candidate terms", candidates.context),
    Section("effects", "Identified effects", effects.context),
    Section("prediction", "Open-loop time histories", prediction.context, of_identification=False),
    Section("predictions", "Predictions one step and five seconds ahead", predictions.context),
    Section("qualification", "Simulator tolerances of 14 CFR Part 60", qualification.context),
    Section("alternatives", "Indistinguishable alternatives", alternatives.context),
    Section("next_flight", "Next flight", next_flight.context),
    Section("derivatives", "Derivatives", derivatives.context),
    Section("linear", "Modes and flying qualities", linear.context),
    Section("fit", "Goodness of fit", fit.context),
    Section("readings", "Channels read", readings.context, of_identification=False),
    Section("screening", "Appendix A: candidates screened", screening.context),
    Section("glossary", "Appendix B: symbols and terms", glossary.context, of_identification=False),
    Section("card", "Pilot’s card", card.context),
)
"""The report from top to bottom."""
