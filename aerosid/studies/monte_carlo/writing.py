"""Writing of study.json, runs.parquet, study.html and study.pdf: all of them, or none under its final name."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from aerosid import __version__
from aerosid.file_set import Writer, text, write_files
from aerosid.reporting.paper import page_pdf
from aerosid.reporting.result_json import portable
from aerosid.studies.monte_carlo.page import drawn_figures, page_html
from aerosid.studies.monte_carlo.run import Study
from aerosid.studies.workers import FAILURE

SCHEMA = 1
"""Format: version of study.json."""

FILES = ("study.json", "runs.parquet", "study.html", "study.pdf")


def study_json(study: Study) -> dict[str, Any]:
    """Contents of study.json. `snr` is null without noise and "recorded" with the noise of the base log."""
    return {
        "schema": SCHEMA,
        "aerosid": __version__,
        "seed": study.plan.seed,
        "runs": study.plan.runs,
        "plan": _portable(study.plan.describe()),
        "levels": [asdict(level) for level in study.levels],
        "failures": [{"reason": reason, "runs": count} for reason, count in sorted(study.failures.items())],
    }


def _portable(described: Any) -> Any:
    """The plan with paths that are meaningful on another machine."""
    if isinstance(described, dict):
        return {
            name: portable(value) if name == "path" and isinstance(value, str) else _portable(value)
            for name, value in described.items()
        }
    return [_portable(value) for value in described] if isinstance(described, list) else described


def write_runs(study: Study, path: Path) -> None:
    """Every run as one row of a Parquet file, level by level.

    Columns: `snr` ("none" without noise), `noise_colour`, `run`, `failure`, `found` (effects in one text), of each true
    derivative its estimate and three standard errors, of each predicted output its error before and after.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    truth = study.trials.truth
    names = [f"{coefficient} {term}" for coefficient, term in truth.free]
    numbers = [(f"{name}{suffix}", key, n) for n, name in enumerate(names) for key, suffix in _SUFFIXES.items()]
    if truth.validation is not None:
        outputs = truth.validation.manoeuvre.outputs
        numbers += [(f"{key}_{name}", key, n) for key in ("before", "after") for n, name in enumerate(outputs)]
    schema = pa.schema(
        [
            ("snr", pa.string()),
            ("noise_colour", pa.float64()),
            ("run", pa.int64()),
            ("failure", pa.string()),
            ("found", pa.string()),
            *((column, pa.float64()) for column, _, _ in numbers),
        ]
    )
    with pq.ParquetWriter(path, schema) as writer:
        for level, (snr, colour) in enumerate(study.plan.levels):
            rows = study.rows(level)
            label = "none" if snr is None else f"{snr:g}" if isinstance(snr, float) else snr
            columns = {
                "snr": [label] * len(rows),
                "noise_colour": [colour] * len(rows),
                "run": list(range(len(rows))),
                "failure": [row.get(FAILURE) for row in rows],
                "found": [_named(row) for row in rows],
                **{column: [row[key][n] if key in row else None for row in rows] for column, key, n in numbers},
            }
            writer.write_table(pa.table(columns, schema=schema))


_SUFFIXES = {"values": "", "own": " std_error", "published": " std_error_published", "plain": " std_error_plain"}


def _named(row: dict[str, Any]) -> str | None:
    if "found" not in row:
        return None
    return "; ".join(f"{kind}:{where}:{term}={value!r}" for kind, where, term, value, _ in row["found"])


def write_study(study: Study, directory: Path) -> tuple[Path, ...]:
    """The paths of the files written.

    Raises
    ------
    UsageError
        Where the folder cannot be written.
    """
    groups = drawn_figures(study)
    page = page_html(study, groups)
    figures = [drawn.figure for _, drawings in groups for drawn in drawings]
    writers: tuple[Writer, ...] = (
        text(json.dumps(study_json(study), indent=2, allow_nan=False) + "\n"),
        lambda path: write_runs(study, path),
        text(page),
        lambda path: path.write_bytes(page_pdf(page, figures, __version__)),
    )
    return write_files(directory, dict(zip(FILES, writers, strict=True)))
