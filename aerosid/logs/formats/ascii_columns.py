"""Columns of numbers as most recorders write them: any separator, with or without header lines."""

from __future__ import annotations

import re

from aerosid.errors import LogError
from aerosid.logs.formats.numbers import decode_text, is_number, parse_rows
from aerosid.logs.formats.table import RawTable

_DELIMITERS: tuple[str | None, ...] = (",", ";", "\t", None)
_NAME_WITH_UNIT = re.compile(r"(.+?)\s*(?!\[\d+\])[\[(]([^\[\]()]*)[\])]")  # `q[0]` is an element of an array
_SAMPLE, _ROWS = 65536, 40
"""Format: bytes, and rows at the end of these, from which the kind of rows is determined."""

_HEADER_LIMIT = 500
"""Format: maximum number of header lines before the first row of numbers: enough for any recorder."""


def read_ascii_columns(data: bytes, path: str) -> RawTable:
    """The columns of a table of numbers separated by white space, commas, semicolons or tabs.

    Parameters
    ----------
    data : bytes
        The file's contents, UTF-8 or Latin-1.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If no row of numbers is found or a row is wrong; the message names the line.

    Notes
    -----
    The last one or two header lines with as many fields as the rows are the names, and the names' units. A unit may
    also follow its name in brackets. Without such lines columns are numbered.
    """
    text = decode_text(data, path)
    header: list[str] = []
    start = 0
    while start < len(text) and len(header) < _HEADER_LIMIT:
        end = text.find(b"\n", start)
        end = len(text) if end < 0 else end
        line = _decode(text[start:end])
        found, delimiter = _numeric_width(line)
        if found:
            names, units = _names_and_units(header, delimiter, found)
            first_line = len(header) + 1
            values, blanks = parse_rows(_trim_separators(text[start:], delimiter), delimiter, found, first_line, path)
            return RawTable(names, units, values, None if blanks else first_line)
        header.append(line)
        start = end + 1
    raise LogError(
        f"{path}: no row of numbers was found in its first {len(header)} lines, but columns of numbers (decimal point, "
        "separated by white space, comma, semicolon or tab) were expected; check that this is the right file."
    )


def holds_words(data: bytes) -> bool:
    """Whether most rows of a table contain clock times or words, which `read_ascii_columns` refuses.

    One wrong field in a table of numbers does not make it a table of words.
    """
    lines = data[:_SAMPLE].replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    rows = [text for line in lines[-2 : max(2, len(lines) // 2) : -1][:_ROWS] if (text := _decode(line)).strip()]
    return 2 * sum(_numeric_width(text) == (0, None) for text in rows) > len(rows)


def _decode(raw: bytes) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _split(line: str, delimiter: str | None) -> list[str]:
    return [field.strip() for field in line.strip(" \n").split(delimiter)]


def _numeric_width(line: str) -> tuple[int, str | None]:
    """Number of fields and the separator, where every field of the line is a number or empty; else (0, None)."""
    for delimiter in _DELIMITERS:
        fields = _split(line, delimiter)
        numbers = sum(is_number(field) for field in fields)
        if numbers >= 1 and len(fields) >= 2 and all(is_number(field) or not field for field in fields):
            return len(fields), delimiter
    return 0, None


def _trim_separators(body: bytes, delimiter: str | None) -> bytes:
    """The rows without blanks that would count as fields or rows."""
    return body if delimiter is None else body.rstrip(b" \n")


def _names_and_units(
    header: list[str], delimiter: str | None, width: int
) -> tuple[tuple[str | None, ...], tuple[str | None, ...]]:
    rows: list[list[str]] = []
    for line in reversed(header):
        if not line.strip():
            continue
        fields = [field.strip('"') for field in _split(line.strip().lstrip("#%").strip(" "), delimiter)]
        if len(fields) != width or len(rows) == 2:
            break
        rows.insert(0, fields)
    if not rows:
        return (None,) * width, (None,) * width
    if len(rows) == 2:
        return tuple(name or None for name in rows[0]), tuple(unit or None for unit in rows[1])
    names: list[str | None] = []
    units: list[str | None] = []
    for field in rows[0]:
        match = _NAME_WITH_UNIT.fullmatch(field)
        names.append(match[1] if match else field or None)
        units.append(match[2].strip() if match else None)
    return tuple(names), tuple(units)
