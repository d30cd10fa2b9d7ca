"""aerosid's own log format: CSV with one header row `name [unit], ...`."""

from __future__ import annotations

import re

from aerosid.errors import LogError
from aerosid.logs.formats.numbers import decode_text, is_number, parse_rows
from aerosid.logs.formats.table import RawTable, shown

_UNIT = re.compile(rb"\s\[[^\]]*\]|\[[^\]\d][^\]]*\]")  # `q[0]` is an element of an array, `q [1]` has a unit
_FIELD = re.compile(r"([^\[\]]+?)\s*\[([^\[\]]*)\]")


def read_native_csv(data: bytes, path: str) -> RawTable:
    """The columns of a native log.

    Parameters
    ----------
    data : bytes
        The file's contents, UTF-8.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If the header or a row is wrong; the message names the line.
    """
    text = decode_text(data, path)
    start, line = _skip_comments(text)
    end = text.find(b"\n", start)
    end = len(text) if end < 0 else end
    header = _header_text(text[start:end], line, path)
    names, units = _parse_header(header, line, path)
    values, blanks = parse_rows(text[end + 1 :], ",", len(names), line + 1, path)
    return RawTable(names, units, values, None if blanks else line + 1)


def looks_native(data: bytes) -> bool:
    """Whether the first row that is not a comment gives units in brackets."""
    text = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r", b"\n")
    start, _ = _skip_comments(text)
    return _UNIT.search(text[start:].split(b"\n", 1)[0]) is not None


def _skip_comments(text: bytes) -> tuple[int, int]:
    """Offset and line number, from 1, of the first line that is neither a comment nor blank."""
    start, line = 0, 1
    while start < len(text):
        end = text.find(b"\n", start)
        end = len(text) if end < 0 else end
        content = text[start:end].strip()
        if content and not content.startswith(b"#"):
            break
        start, line = end + 1, line + 1
    return start, line


def _header_text(raw: bytes, line: int, path: str) -> str:
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        raise LogError(
            f"{path}: line {line}, byte {error.start + 1} is not UTF-8, but a header row `time [s], ...` was expected; "
            "save the file as UTF-8, or read it as another format through a channel map."
        ) from None


_OTHER_SEPARATORS = {";": "semicolons", "\t": "tabs"}


def _parse_header(header: str, line: int, path: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    fields = [field.strip().strip('"').strip() for field in header.split(",")]
    if not header.strip() or all(is_number(field) for field in fields):
        found = "nothing" if not header.strip() else "numbers"
        raise LogError(
            f"{path}: line {line} holds {found}, but a header row `time [s], alpha [rad], ...` was expected; "
            "add it, or read the file as `ascii` through a channel map."
        )
    names: list[str] = []
    units: list[str] = []
    for column, field in enumerate(fields, start=1):
        match = _FIELD.fullmatch(field)
        if match is None:
            if separator := next((words for sign, words in _OTHER_SEPARATORS.items() if sign in field), None):
                raise LogError(
                    f"{path}: line {line} separates its columns by {separator}, but a log without a channel map has "
                    "commas, and decimal points; let `aerosid channels` propose a channel map, and give it with "
                    "--channels."
                )
            raise LogError(
                f"{path}: line {line}, column {column} is headed {shown(field)}, but `name [unit]` was expected; "
                "add the unit ([1] where there is none), or read the file through a channel map."
            )
        if match[1] in names:
            raise LogError(
                f"{path}: line {line} names channel {shown(match[1])} twice (columns {names.index(match[1]) + 1} and "
                f"{column}); rename or remove one."
            )
        names.append(match[1])
        units.append(match[2].strip())
    return tuple(names), tuple(units)
