"""Assembly of report.html: one file that contains style, figures and scripts, and loads nothing."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import Figure, FigureBook
from aerosid.reporting.scripts import content_policy, page_scripts
from aerosid.reporting.sections import SECTIONS, Section
from aerosid.reporting.templating import REPORT_TEMPLATES, page_environment, page_style
from aerosid.reporting.title_block import title_block


def report_html(result: ClosedLoop, report: Report | None = None, *, interactive: bool = True) -> str:
    """The text of report.html; identical for an identical result and the same versions.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop. Every text in it is escaped.
    report : Report, optional
        Its sections, where they have been composed already.
    interactive : bool
        Whether figures can be zoomed; plotly's script, 5 MB, is then part of the page. The still figures are included
        in both cases, for printing and for readers without scripts.

    Notes
    -----
    The page forbids requests, and scripts other than its own by their checksums (Content-Security-Policy), so that even
    an unescaped text could do nothing.
    """
    report = report or compose(result)
    scripts = page_scripts(report.figures) if interactive else ()
    return (
        page_environment(REPORT_TEMPLATES)
        .get_template("page.html")
        .render(
            result=result,
            parts=report.parts,
            title=report.title,
            facts=report.facts,
            style=page_style(),
            scripts=[script.element for script in scripts],
            policy=content_policy(scripts),
        )
    )


@dataclass(frozen=True)
class Report:
    """The sections of a report with their bodies, shared by page and paper, and its figures."""

    parts: tuple[tuple[Section, Markup], ...]
    figures: tuple[Figure, ...]
    title: Markup
    """The title block."""
    facts: tuple[tuple[str, str], ...]
    """Facts of the title block that the head of each page repeats."""


def compose(result: ClosedLoop, *, inline: bool = True) -> Report:
    """The title block, and every section that applies to the result; `inline`: with the figures as SVG."""
    figures = FigureBook(inline=inline)
    parts = []
    for section in SECTIONS:
        if section.of_identification and not result.identified:
            continue
        context = section.context(result, figures)
        if context is not None:
            body = (
                page_environment(REPORT_TEMPLATES).get_template(f"{section.name}.html").render(result=result, **context)
            )
            parts.append((section, Markup(body)))  # safe: rendered with autoescape
    block = title_block(result)
    title = page_environment(REPORT_TEMPLATES).get_template("title_block.html").render(block=block)
    facts = tuple((name, text) for name, text in block["run"] if name in ("Date", "Analyst"))
    return Report(tuple(parts), tuple(figures.figures), Markup(title), facts)  # safe: rendered with autoescape
