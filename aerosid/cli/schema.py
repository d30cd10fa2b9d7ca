"""Command `schema`: JSON Schemas of the files and documents that scripts read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from aerosid.cli.options import out_file
from aerosid.cli.output import written
from aerosid.errors import UsageError

if TYPE_CHECKING:
    from pydantic import BaseModel

DOCUMENTS = ("result", "check", "batch", "study")
"""result.json, what `check --json` prints, batch.json, study.json."""


def schema_command(
    document: Annotated[
        str, typer.Argument(metavar="DOCUMENT", help=f"One of {', '.join(DOCUMENTS)}.", show_default=False)
    ],
    out: Annotated[Path | None, out_file("Output file; default the terminal.")] = None,
) -> None:
    """Writes the JSON Schema (draft 2020-12) of result.json, of `check --json`, of batch.json or of study.json."""
    from aerosid.file_set import text, write_files

    if document not in DOCUMENTS:
        raise UsageError(f"no schema is named {document!r}, expected one of {', '.join(DOCUMENTS)}; give one of them.")
    content = schema_text(document)
    if out is None:
        typer.echo(content, nl=False)
    else:
        written("schema", write_files(out.parent, {out.name: text(content)}))


def schema_text(document: str) -> str:
    """The schema of one document: identical bytes for identical versions."""
    schema: Mapping[str, Any] = _models()[document].model_json_schema(by_alias=True)
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2) + "\n"


def _models() -> dict[str, type[BaseModel]]:
    from aerosid.reporting.check_schema import CheckFile
    from aerosid.reporting.result_schema import ResultFile
    from aerosid.studies.batch.batch_schema import BatchFile
    from aerosid.studies.monte_carlo.study_schema import StudyFile

    models: tuple[type[BaseModel], ...] = (ResultFile, CheckFile, BatchFile, StudyFile)
    return dict(zip(DOCUMENTS, models, strict=True))
