"""Provenance in the text of a completed aircraft file: its table `[completed]`, its source, and comments that went."""

from __future__ import annotations

from typing import Any

import tomlkit
from tomlkit.items import Comment, Null, Table

from aerosid.aircraft.model import CompletionRecord

_LONGEST_SOURCE = 1500
"""Display: characters of the declared file's own source that are kept: a model may be completed many times."""


def write_record(document: tomlkit.TOMLDocument, record: CompletionRecord) -> None:
    """Write what made the numbers into the document: `[completed]`, and `source` of `[aircraft]`."""
    aircraft: Any = document["aircraft"]
    aircraft["source"] = source_of(record)
    document.pop("completed", None)
    document.append("completed", _table(record))


def source_of(record: CompletionRecord) -> str:
    """The completed file's `source`: one sentence with what made the numbers and where those began."""
    if record.verdict == "inconsistent_data":
        return _unchanged(record)
    fitted = " and ".join(log.name for log in record.logs if log.role == "identification") or "no log"
    begun = f"; declared in {record.declared_file}" if record.declared_file else ""
    own = f" ({record.declared_source})" if record.declared_source else ""
    kept = f"; not significant: {', '.join(record.not_shown)}" if record.not_shown else ""
    return f"estimated by {record.program} on {record.date} from {fitted}{begun}{own}{kept}"


def _unchanged(record: CompletionRecord) -> str:
    """The source of a file in which nothing was estimated."""
    logs = " and ".join(log.name for log in record.logs) or "the logs"
    declared = f"as declared in {record.declared_file}" if record.declared_file else "as declared"
    own = f" ({record.declared_source})" if record.declared_source else ""
    return (
        f"{declared}{own}; nothing estimated by {record.program} on {record.date}: channels of {logs} contradict others"
    )


def shortened(source: str) -> str:
    """A declared file's source, cut where it is very long."""
    return source if len(source) <= _LONGEST_SOURCE else source[: _LONGEST_SOURCE - 1] + "…"


def _table(record: CompletionRecord) -> Any:
    table = tomlkit.table()
    table.trivia.indent = "\n"
    table.comment("written by aerosid: origin of the numbers of this file")
    table["by"] = record.program
    table["date"] = record.date
    table["verdict"] = record.verdict
    table["bounds"] = record.bounds
    table["not_shown"] = list(record.not_shown)
    if record.settings:
        settings = tomlkit.inline_table()
        settings.update(record.settings)
        table["settings"] = settings
    declared = tomlkit.table()
    declared["file"] = record.declared_file
    declared["sha256"] = record.declared_sha256
    declared["source"] = record.declared_source
    table["declared"] = declared
    logs = tomlkit.aot()
    for log in record.logs:
        row = tomlkit.table()
        row["name"] = log.name
        row["role"] = log.role
        row["sha256"] = log.sha256
        row["from"] = log.start
        row["to"] = log.stop
        logs.append(row)
    if record.logs:
        table["logs"] = logs
    return table


def without_comments_above(table: Any, key: str) -> None:
    """Take away the comment lines directly above an entry: they are about the number that it no longer holds."""
    if not isinstance(table, Table):
        return  # an inline table has no lines
    body = table.value.body
    place = next((n for n, (name, _) in enumerate(body) if name is not None and name.key == key), 0)
    while place > 0 and isinstance(body[place - 1][1], Comment):
        place -= 1
        body[place] = (None, Null())
