"""Concurrent typesetting: report.pdf from a process that loads fonts and templates while the result is computed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from aerosid.compiled.cores import prepared

if TYPE_CHECKING:
    from aerosid.loop.result import ClosedLoop

    Printer = Callable[[ClosedLoop], Callable[[], bytes]]


def printing() -> AbstractContextManager[Printer]:
    """A printer that readies itself beside the block: given the result, it begins and gives what waits for the bytes.

    Without a second core it prints when the bytes are asked for.
    """
    return prepared(_printed, _made_ready)


def _printed(result: ClosedLoop) -> bytes:
    from aerosid.reporting.page import compose
    from aerosid.reporting.paper import report_pdf

    return report_pdf(result, compose(result, inline=False))


def _made_ready() -> None:
    """What printing needs of any result: libraries, templates and fonts, which take as long as the printing itself."""
    from aerosid.reporting.paper import load_typeface
    from aerosid.reporting.sections import SECTIONS
    from aerosid.reporting.templating import REPORT_TEMPLATES, page_environment

    load_typeface()
    for section in SECTIONS:
        page_environment(REPORT_TEMPLATES).get_template(f"{section.name}.html")
