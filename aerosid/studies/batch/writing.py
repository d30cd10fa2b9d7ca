"""Writing of the tables over manoeuvres: all of them, or none under its final name."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from aerosid import __version__
from aerosid.file_set import Writer, text, write_files
from aerosid.reporting.file_names import FILES
from aerosid.reporting.paper import page_pdf
from aerosid.reporting.result_json import portable
from aerosid.studies.batch.page import drawn_figure, page_html
from aerosid.studies.batch.run import REPORTS, Batch
from aerosid.studies.batch.table import structure_of
from aerosid.studies.batch.table_texts import manoeuvres_csv, table_csv, table_latex, table_markdown

SCHEMA = 1
"""Format: version of batch.json."""

TABLES = (
    "batch.html",
    "batch.pdf",
    "batch.json",
    "derivative_table.csv",
    "derivative_table.md",
    "derivative_table.tex",
    "manoeuvres.csv",
)
"""The files of all logs together."""


def files_of(names: Sequence[str], reports: bool) -> tuple[Path, ...]:
    """All files of a batch of logs with these names, below its folder."""
    own = (Path(REPORTS, name, file) for name in names for file in FILES) if reports else ()
    return (*map(Path, TABLES), *own)


def batch_json(batch: Batch) -> dict[str, Any]:
    """Contents of batch.json: every log with its verdict, effects and derivatives, and the failures with reasons."""
    group_of, structure_number = batch.conditions, batch.structures
    return {
        "schema": SCHEMA,
        "aerosid": __version__,
        "aircraft": {"path": portable(batch.aircraft.path), "sha256": batch.aircraft.sha256},
        "logs": [
            {"log": name, "condition_number": group_of[name], "structure": structure_number[structure_of(row)], **row}
            for name, row in batch.rows.items()
        ],
        "failures": [{"log": name, "reason": reason} for name, reason in batch.failures.items()],
    }


def write_batch(batch: Batch, directory: Path, against: str | None = None) -> tuple[Path, ...]:
    """The paths of the files written.

    Parameters
    ----------
    against : str, optional
        V, h, mach, alpha or mass: abscissa of the figures of derivatives.

    Raises
    ------
    UsageError
        Where the folder cannot be written.
    """
    table = batch.table
    figure = drawn_figure(batch, against)
    page = page_html(batch, figure)
    writers: tuple[Writer, ...] = (
        text(page),
        lambda path: path.write_bytes(page_pdf(page, [figure] if figure else [], __version__)),
        text(json.dumps(batch_json(batch), indent=2, allow_nan=False) + "\n"),
        text(table_csv(table)),
        text(table_markdown(table)),
        text(table_latex(table)),
        text(manoeuvres_csv(batch.measured, batch.conditions)),
    )
    return write_files(directory, dict(zip(TABLES, writers, strict=True)))
