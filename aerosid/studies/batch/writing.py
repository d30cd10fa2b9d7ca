"""Writing of the tables over manoeuvres: all of them, or none under its final name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from aerosid import __version__
from aerosid.file_set import text, write_files
from aerosid.reporting.paper import page_pdf
from aerosid.reporting.result_json import portable
from aerosid.studies.batch.page import drawn_figure, page_html
from aerosid.studies.batch.run import Batch
from aerosid.studies.batch.table import structure_of
from aerosid.studies.batch.table_texts import manoeuvres_csv, table_csv, table_latex, table_markdown

SCHEMA = 1
"""Format: version of batch.json."""


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
    return write_files(
        directory,
        {
            "batch.html": text(page),
            "batch.pdf": lambda path: path.write_bytes(page_pdf(page, [figure] if figure else [], __version__)),
            "batch.json": text(json.dumps(batch_json(batch), indent=2, allow_nan=False) + "\n"),
            "derivative_table.csv": text(table_csv(table)),
            "derivative_table.md": text(table_markdown(table)),
            "derivative_table.tex": text(table_latex(table)),
            "manoeuvres.csv": text(manoeuvres_csv(batch.measured, batch.conditions)),
        },
    )
