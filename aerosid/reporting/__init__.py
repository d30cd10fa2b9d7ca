"""Reports of a closed loop: result.json, tables, page and paper, a summary on the terminal.

`result_schema` and `tables` define what scripts read. `sections` contains the sections of the report, each with a
template in templates/, and `figures` its figures; `page` assembles report.html and `paper` report.pdf. `writing` puts
all files in place at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aerosid.reporting.console import print_consequences, print_predictions, print_summary
    from aerosid.reporting.page import report_html
    from aerosid.reporting.result_json import result_file
    from aerosid.reporting.result_schema import ResultFile
    from aerosid.reporting.writing import write_report

_HOMES = {
    "ResultFile": "result_schema",
    "print_consequences": "console",
    "print_predictions": "console",
    "print_summary": "console",
    "report_html": "page",
    "result_file": "result_json",
    "write_report": "writing",
}
"""Module that defines each name. A process that runs JSBSim needs the units of the export and none of these."""

__all__ = [
    "ResultFile",
    "print_consequences",
    "print_predictions",
    "print_summary",
    "report_html",
    "result_file",
    "write_report",
]


def __getattr__(name: str) -> Any:
    """A public name, imported from the module that defines it; AttributeError for any other."""
    if name not in _HOMES:
        raise AttributeError(f"module 'aerosid.reporting' has no attribute {name!r}")
    import importlib

    value = getattr(importlib.import_module(f"aerosid.reporting.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
