"""batch.html: the logs, the failures, and derivatives over manoeuvres, in one file that loads nothing."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from urllib.parse import quote

from aerosid import __version__, notation
from aerosid.reporting import words
from aerosid.reporting.figures.numbered import Figure, FigureBook
from aerosid.reporting.templating import page_environment, page_style
from aerosid.studies.batch.figures import condition_chart, usual_abscissa
from aerosid.studies.batch.run import REPORTS, Batch
from aerosid.studies.batch.table_texts import NOTE, cells, headings, structure_words

_TEMPLATES = Path(__file__).parent / "templates"


def page_html(batch: Batch, figure: Figure | None) -> str:
    """The text of batch.html; identical for an identical batch and the same versions.

    Parameters
    ----------
    batch : Batch
    figure : Figure or None
        From `drawn_figure`.
    """
    template = page_environment(_TEMPLATES).get_template("batch.html")
    return template.render(
        batch=batch,
        verdicts=Counter(row["verdict"].replace("_", " ") for row in batch.rows.values()),
        group_of=batch.conditions,
        headings=headings(),
        cells=cells,
        structure_words=structure_words,
        note=NOTE,
        figure=figure,
        report_of=lambda name: f"{REPORTS}/{quote(name)}/report.html" if batch.reports else None,
        effects_of=_effects,
        style=page_style(),
        version=__version__,
    )


def drawn_figure(batch: Batch, against: str | None = None) -> Figure | None:
    """Derivatives against a condition; None where no log contains it.

    Parameters
    ----------
    batch : Batch
    against : str, optional
        V, h, mach, alpha or mass; by default `figures.usual_abscissa`.
    """
    against = against or usual_abscissa({name: row["condition"] for name, row in batch.rows.items()})
    chart = condition_chart(batch.measured, against)
    if chart is None:
        return None
    symbol = "".join(words.symbol(against))
    caption = (
        f"Derivatives of every manoeuvre against {symbol} at its beginning, bars of two corrected standard errors to "
        "each side; the line is the aircraft file's prediction."
    )
    return FigureBook().add(chart, caption, caption)


def _effects(row: dict[str, list[dict[str, str]]]) -> str:
    """The effects of one log in words."""
    names = []
    for effect in row["effects"]:
        kind = effect["kind"].replace("_", " ")
        if effect["kind"] == "aero_term":
            names.append(f"{effect['where']} {effect['term']}")
        else:
            names.append(f"{kind} of {effect['where']}" if effect["where"] else kind)
    return ", ".join(names) or notation.MISSING
