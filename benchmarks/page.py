"""The benchmark as one static page, with the style of every other page of this package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from aerosid import __version__
from aerosid.file_set import text, write_files
from aerosid.reporting.figures.numbered import Figure
from aerosid.reporting.templating import page_environment, page_style
from benchmarks.sections import Section, Table

_TEMPLATES = Path(__file__).parent / "templates"


def page_html(sections: Sequence[Section], facts: Sequence[str]) -> str:
    """The text of the page: `facts` of machine and versions first."""
    environment = page_environment(_TEMPLATES)
    environment.tests.update(table=lambda part: isinstance(part, Table), figure=lambda part: isinstance(part, Figure))
    template = environment.get_template("benchmark.html")
    return template.render(sections=sections, facts=facts, style=page_style(), version=__version__)


def write_page(sections: Sequence[Section], facts: Sequence[str], folder: Path) -> Path:
    """Write index.html into the folder; its path."""
    folder.mkdir(parents=True, exist_ok=True)
    (written,) = write_files(folder, {"index.html": text(page_html(sections, facts))})
    return written
