"""Concurrent typesetting: report.pdf from a process that loads fonts and templates during the computation."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from aerosid.compiled.prepared_copy import prepared

if TYPE_CHECKING:
    from aerosid.loop.result import ClosedLoop

    Printer = Callable[[ClosedLoop], Callable[[], bytes]]


def printing() -> AbstractContextManager[Printer]:
    """A printer that prepares itself during the block: given the result, it starts and returns a wait for the bytes.

    Without a second core it prints when the bytes are requested.
    """
    return prepared(_printed, _made_ready)


def _printed(result: ClosedLoop) -> bytes:
    from aerosid.reporting.page import compose
    from aerosid.reporting.paper import report_pdf

    return report_pdf(result, compose(result, inline=False))


def _made_ready() -> None:
    """Loads the libraries, templates and fonts of any result, which takes as long as the printing itself."""
    from aerosid.reporting.paper import load_typeface
    from aerosid.reporting.sections import SECTIONS
    from aerosid.reporting.templating import REPORT_TEMPLATES, page_environment

    load_typeface()
    for section in SECTIONS:
        page_environment(REPORT_TEMPLATES).get_template(f"{section.name}.html")
