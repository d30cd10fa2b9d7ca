"""Rows of text to numbers: fast where the file is valid, with the first wrong line in the error where it is not."""

from __future__ import annotations

import io
import math

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.table import FloatArray, shown

_BLOCK = 20_000
"""Numerical: lines that are converted together."""

_FEW = 100_000
"""Numerical: number of fields below which parsing one by one takes less time than the import of pandas."""

_MISSING = frozenset({"", "nan", "+nan", "-nan"})


def decode_text(data: bytes, path: str) -> bytes:
    """The file's bytes with uniform line ends and no byte-order mark.

    Raises
    ------
    LogError
        If the file is empty or contains bytes that do not occur in text files.
    """
    if not data.strip():
        raise LogError(f"{path}: the file is empty; record again or copy it again.")
    if b"\0" in data:
        raise LogError(
            f"{path}: byte {data.index(0) + 1} is zero, so this is a binary file (or UTF-16) and no text table; "
            "export the log as UTF-8 text or name its format in a channel map."
        )
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def parse_rows(body: bytes, delimiter: str | None, width: int, first_line: int, path: str) -> tuple[FloatArray, bool]:
    """The rows of numbers in `body`, shape (N, width), and whether blank lines were skipped.

    Parameters
    ----------
    body : bytes
        The rows, one per line.
    delimiter : str or None
        One character, or None for runs of white space.
    width : int
        Number of fields required in each row.
    first_line : int
        The line, from 1, in the file at which `body` starts; for messages.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If a row has another number of fields, or a field is neither a finite number nor missing.
    """
    # A tab at the end of a row is an empty last field.
    body = body.rstrip(b" \n") if delimiter == "\t" else body.rstrip()
    if not body:
        return np.empty((0, width)), False
    blanks = b"\n\n" in body or b"\n \n" in body
    if width * (body.count(b"\n") + 1) <= _FEW:
        return _parse_slowly(body, delimiter, width, first_line, path), blanks
    # pandas fills short rows with missing samples; a truncated file must not look like a gap in the recording.
    even = delimiter is None or body.count(delimiter.encode()) == (width - 1) * (body.count(b"\n") + 1)
    values = _parse_fast(body, delimiter) if (even or blanks) and not _holds_words(body) else None
    if values is None or _suspicious(values, width, short_rows=blanks or delimiter is None):
        values = _parse_by_blocks(body.split(b"\n"), delimiter, width, first_line, path)
    return values, blanks


def _holds_words(body: bytes) -> bool:
    """Whether True or FALSE may occur, which pandas converts to numbers; no number contains these letters."""
    return any(letter in body for letter in (b"r", b"R", b"s", b"S"))


def _suspicious(values: FloatArray, width: int, *, short_rows: bool) -> bool:
    """Whether the fast parser may have missed an infinite value or, where fields were not counted, short rows.

    It refuses rows that are too long, so that a matching number of separators excludes short ones.
    """
    return (
        values.shape[1] != width or bool(np.isinf(values).any()) or (short_rows and bool(np.isnan(values[:, -1]).any()))
    )


def _parse_by_blocks(lines: list[bytes], delimiter: str | None, width: int, first_line: int, path: str) -> FloatArray:
    """As `_parse_slowly`, applied only to the blocks of lines that the fast parser may have misread."""
    parts = []
    for start in range(0, len(lines), _BLOCK):
        block = lines[start : start + _BLOCK]
        body = b"\n".join(block)
        even = delimiter is None or all(line.count(delimiter.encode()) == width - 1 for line in block)
        values = _parse_fast(body, delimiter) if even and body.strip() and not _holds_words(body) else None
        short_rows = delimiter is None
        if values is None or _suspicious(values, width, short_rows=short_rows) or values.shape[0] != len(block):
            values = _parse_slowly(body, delimiter, width, first_line + start, path)
        parts.append(values)
    return np.concatenate(parts)


def _parse_fast(body: bytes, delimiter: str | None) -> FloatArray | None:
    """The numbers by pandas' compiled parser, or None where any field is not a number."""
    import pandas as pd  # not at the top: a short log is read without it

    try:
        frame = pd.read_csv(
            io.BytesIO(body),
            sep=r"\s+" if delimiter is None else delimiter,
            header=None,
            dtype=np.float64,
            skipinitialspace=True,
            keep_default_na=False,
            na_values=["", "nan", "NaN", "NAN"],
            engine="c",
            encoding="latin-1",
            quoting=3,
            low_memory=False,
        )
    except (ValueError, OverflowError, MemoryError):
        return None
    return np.asarray(frame.to_numpy(), dtype=np.float64)


def _parse_slowly(body: bytes, delimiter: str | None, width: int, first_line: int, path: str) -> FloatArray:
    """The numbers field by field; raises LogError at the first field or row that is wrong."""
    rows: list[list[float]] = []
    for offset, line in enumerate(body.decode("utf-8", errors="replace").split("\n")):
        if not line.strip():
            continue
        number = first_line + offset
        fields = line.split(delimiter)
        if len(fields) != width:
            raise LogError(
                f"{path}: line {number} has {len(fields)} field{'s' * (len(fields) != 1)}, but {width} were expected; "
                "complete or remove the line (the file may be truncated)."
            )
        rows.append([_number(field, number, column, path) for column, field in enumerate(fields, start=1)])
    return np.array(rows, dtype=np.float64).reshape(len(rows), width)


def _number(field: str, line: int, column: int, path: str) -> float:
    """One field as a finite number or NaN."""
    text = field.strip()
    if text.lower() in _MISSING:
        return math.nan
    try:
        # Python also accepts 1_000 as a number; no recorder writes that.
        value = math.nan if "_" in text else float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise LogError(
            f"{path}: line {line}, column {column} holds {shown(text)}, but a number was expected; "
            "correct it, or leave the field empty for a missing sample."
        )
    if math.isinf(value):
        raise LogError(
            f"{path}: line {line}, column {column} holds the infinite value {shown(text)}, but a finite number was "
            "expected; correct it, or leave the field empty for a missing sample."
        )
    return value


def is_number(field: str) -> bool:
    """Whether a field of text is a number or a missing sample's NaN."""
    try:
        float(field)
    except ValueError:
        return False
    return True
