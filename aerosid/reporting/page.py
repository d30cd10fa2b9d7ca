"""Assemble report.html: one file with style, figures and scripts inside, that loads nothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup

from aerosid.reporting import words
from aerosid.reporting.figures.numbered import Figure, FigureBook
from aerosid.reporting.scripts import content_policy, page_scripts
from aerosid.reporting.sections import SECTIONS, Section
from aerosid.results import ClosedLoop
from aerosid.terms import Factor

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).parent / "templates"


def report_html(result: ClosedLoop, report: Report | None = None, *, interactive: bool = True) -> str:
    """The text of report.html; identical for an identical result and the same versions.

    Parameters
    ----------
    result : ClosedLoop
        What one run of the loop found. Every text in it is escaped.
    report : Report, optional
        Its sections, where they are composed already.
    interactive : bool
        Whether figures can be zoomed: plotly's script, 5 MB, stands in the page then. The still figures stand in it
        either way, for paper and for readers without scripts.

    Notes
    -----
    The page forbids itself requests, and scripts but its own by their checksums (Content-Security-Policy), so that
    even a text that escaped the escaping could do nothing.
    """
    report = report or compose(result)
    scripts = page_scripts(report.figures) if interactive else ()
    return (
        _environment()
        .get_template("page.html")
        .render(
            result=result,
            parts=report.parts,
            style=Markup((TEMPLATES / "style.css").read_text(encoding="utf-8")),
            scripts=[script.element for script in scripts],
            policy=content_policy(scripts),
        )
    )


@dataclass(frozen=True)
class Report:
    """The sections of a report with their bodies, which page and paper share, and its figures."""

    parts: tuple[tuple[Section, Markup], ...]
    figures: tuple[Figure, ...]


def compose(result: ClosedLoop) -> Report:
    """Every section that the result has something for."""
    figures = FigureBook()
    parts = []
    for section in SECTIONS:
        context = section.context(result, figures)
        if context is not None:
            body = _environment().get_template(f"{section.name}.html").render(result=result, **context)
            parts.append((section, Markup(body)))  # safe: rendered with autoescape
    return Report(tuple(parts), tuple(figures.figures))


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        number=words.number,
        deviation=words.with_deviation,
        p_value=words.p_value,
        hundredths=lambda value: f"{round(value, 2) + 0.0:.2f}".replace("-", "−"),
        ratio=words.ratio,
        symbol=symbol_html,
        term=term_html,
        effect=words.effect_sentence,
        shown=_shown,
        plain=words.plain,
        sentence=words.sentence,
        unit=lambda unit: words.shown_unit(unit).text,
    )
    return environment


def symbol_html(name: str) -> Markup:
    """A name as its symbol, the subscript set as one; escaped."""
    base, subscript = words.symbol(name)
    lowered = Markup("<sub>{}</sub>").format(subscript) if subscript else Markup("")
    return Markup("<var>{}{}</var>").format(base, lowered)


def term_html(text: str) -> Markup:
    """A term as a formula: `alpha^2` is α²; a text that is no term stays a text; escaped."""
    factors = words.factors_of(text)
    if factors is None:
        return Markup("{}").format(text)
    if not factors:
        return Markup("1")
    return Markup('<span class="formula">{}</span>').format(Markup("·").join(map(_factor_html, factors)))


def _factor_html(factor: Factor) -> Markup:
    body = symbol_html(factor.variable)
    if factor.shape == "abs":
        body = Markup("|{}|").format(body)
    elif factor.shape == "pos":
        sign = "−" if factor.offset >= 0.0 else "+"
        inner = body if factor.offset == 0.0 else Markup("{} {} {:g}").format(body, sign, abs(factor.offset))
        body = Markup("pos({})").format(inner)
    return body if factor.power == 1 else Markup("{}<sup>{}</sup>").format(body, factor.power)


def _shown(value: float | None, unit: str, digits: int = 2) -> str:
    """An SI number in the unit that the page shows."""
    return words.number(None if value is None else value * words.shown_unit(unit).factor, digits)
