"""Tables of text that contain words, as avionics and simulators write: clocks, enumerations, two rows of names."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.clock_text import looks_like_clock, looks_like_date, microseconds_of_clock
from aerosid.logs.recording import TICKS, AnyArray, Clock, Column, Recording, Stream, column
from aerosid.logs.settings import READING

if TYPE_CHECKING:
    import pandas as pd

_DELIMITERS = (",", ";", "\t", "|")
# A number in brackets is the element of an array, not a unit.
_NAME_WITH_UNIT = re.compile(r"(.*\S)\s*[\[(]\s*(?!\d+\s*[\])])([^\[\]()]*?)\s*[\])]")
_COMMA_NUMBER = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_HEADER_LIMIT = 200
"""Format: maximum number of lines before the first row of data."""

_LOOKED_AT = 40
"""Format: rows from which the decimal mark is determined."""

_TIME_NAMES = ("time", "t", "timestamp", "elapsed time", "real,_time", "t_s", "time_s")
_MICROSECONDS = "timestamp"  # PX4's tools write this column in us, without a unit


@dataclass(frozen=True)
class Dialect:
    """Layout of a table of text, from the channel map; what is not given is determined from the file.

    Attributes
    ----------
    delimiter : str or None
        Separator of the fields; one character.
    decimal : str or None
        Decimal mark, `.` or `,`.
    names_line : int or None
        The line, from 1, with the names; data follow after it.
    """

    delimiter: str | None = None
    decimal: str | None = None
    names_line: int | None = None


@dataclass
class _Header:
    """Names, units and alternative names of each column."""

    names: list[str] = field(default_factory=list)
    units: list[str | None] = field(default_factory=list)
    aliases: dict[str, str] = field(default_factory=dict)


def read_delimited_text(data: bytes, path: str, dialect: Dialect | None = None) -> Recording:
    """The columns of a table of text, with its clock times and dates as stamps.

    Parameters
    ----------
    data : bytes
        The file's contents, UTF-8 or Latin-1.
    path : str
        The file, for messages.
    dialect : Dialect, optional
        Known properties of the file.

    Raises
    ------
    LogError
        If no row of data is found.

    Notes
    -----
    The row of names is the last one before the data that has as many fields, or the one before that where it names
    units too; a row after `#` contains units. A column is found by its name, by its whole header (`V [m/s]`) and by the
    name in a second row of names. A field that is not a number is a missing sample.
    """
    dialect = dialect or Dialect()
    lines = _lines(data, path)
    delimiter, first = _layout(lines, dialect)
    if first is None:
        raise LogError(f"{path}: no row of numbers was found under a row of names; check that this is the right file.")
    rows = [line for line in lines[first:] if line.strip()]
    width = Counter(line.count(delimiter) + 1 for line in rows[: 4 * _LOOKED_AT]).most_common(1)[0][0]
    notes = []
    if rows[-1].count(delimiter) + 1 < width and len(rows) > 1:
        # The field after its last separator may be a truncated number.
        rows[-1] = rows[-1][: rows[-1].rfind(delimiter) + 1]
        notes.append("the file ends inside its last line: the recording was cut off; its complete part is read")
    frame = _frame(rows, delimiter, width)
    header = _header([line for line in lines[:first] if line.strip()], delimiter, width)
    decimal = dialect.decimal or _decimal(frame, delimiter)
    columns = {
        name: Column(partial(_numbers, frame.iloc[:, index], decimal), header.units[index])
        for index, name in enumerate(header.names)
    }
    clocks = _clocks(frame, header, columns)
    return Recording("text", (Stream("", columns, clocks, aliases=header.aliases),), tuple(notes))


def _lines(data: bytes, path: str) -> list[str]:
    if not data.strip():
        raise LogError(f"{path}: the file is empty; record again or copy it again.")
    if b"\0" in data:
        raise LogError(f"{path}: byte {data.index(0) + 1} is zero, so this is not text; name its format in a map.")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _layout(lines: list[str], dialect: Dialect) -> tuple[str, int | None]:
    """The separator, and the index of the first row of data."""
    best: tuple[tuple[bool, bool, int], str, int] | None = None
    for delimiter in (dialect.delimiter,) if dialect.delimiter else _DELIMITERS:
        first = dialect.names_line
        for index, line in enumerate(lines[:_HEADER_LIMIT]) if first is None else ():
            fields = _fields(line, delimiter)
            if len(fields) > 1 and _is_data(fields) and not line.lstrip().startswith("#"):
                first = index
                break
        if first is not None and first < len(lines):
            width = len(_fields(lines[first], delimiter))
            named = any(abs(len(_fields(line, delimiter)) - width) <= 1 for line in lines[max(first - 2, 0) : first])
            # A comma may be the decimal mark; the others do not occur in numbers.
            worth = (named and width > 2, delimiter != ",", width)
            if best is None or worth > best[0]:
                best = (worth, delimiter, first)
    return (dialect.delimiter or ",", None) if best is None else (best[1], best[2])


def _fields(line: str, delimiter: str) -> list[str]:
    return [part.strip().strip('"').strip() for part in line.strip(" ").split(delimiter)]


def _is_data(fields: list[str]) -> bool:
    filled = [word for word in fields if word]
    numbers = sum(_is_number(word) or looks_like_clock(word) or looks_like_date(word) for word in filled)
    return bool(filled) and numbers >= READING.numeric_share * len(filled)


def _is_number(word: str) -> bool:
    if _COMMA_NUMBER.fullmatch(word):
        return True
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def _frame(rows: list[str], delimiter: str, width: int) -> pd.DataFrame:
    """The rows as words, shape (N, width); surplus fields of a row are cut off."""
    import pandas as pd

    return pd.read_csv(
        io.StringIO("\n".join(rows)),
        sep=delimiter,
        header=None,
        names=list(range(width)),
        usecols=list(range(width)),
        dtype=str,
        skipinitialspace=True,
        keep_default_na=False,
        na_filter=False,
        engine="c",
        quotechar='"',
        on_bad_lines="skip",
        index_col=False,
    )


def _header(lines: list[str], delimiter: str, width: int) -> _Header:
    """Names from the rows above the data."""
    rows: list[tuple[bool, list[str]]] = []
    for line in reversed(lines):
        fields = _fields(line.lstrip("#% "), delimiter)
        # A data row often ends in a separator that its header lacks, or vice versa.
        if abs(len(fields) - width) > 1 or len(rows) == 2:
            break
        rows.insert(0, (line.lstrip().startswith(("#", "%")), [*fields, ""][:width]))
    if not rows:
        return _Header([f"column {index + 1}" for index in range(width)], [None] * width)
    marked = [fields for mark, fields in rows if mark]
    named = [fields for mark, fields in rows if not mark] or marked[-1:]
    units = marked[0] if marked and marked[0] is not named[0] else None
    second = named[1] if len(named) > 1 else None
    bracketed = sum(_NAME_WITH_UNIT.fullmatch(word) is not None for word in named[0])
    if second is not None and units is None and bracketed == 0:
        units, second = second, None
    return _filled(named[0], units, second)


def _filled(names: list[str], units: list[str] | None, second: list[str] | None) -> _Header:
    header = _Header()
    for index, whole in enumerate(names):
        match = _NAME_WITH_UNIT.fullmatch(whole)
        plain = (match[1] if match else whole).strip("_ ") or f"column {index + 1}"
        name = plain if plain not in header.names else whole
        name = name if name not in header.names else f"{whole} ({index + 1})"
        header.names.append(name)
        header.units.append((match[2] if match else units[index] if units else None) or None)
        for other in (whole, second[index] if second else ""):
            if other and other not in header.names:
                header.aliases.setdefault(other, name)
    return header


def _decimal(frame: pd.DataFrame, delimiter: str) -> str:
    """The decimal mark: a comma where fields contain one that is not the separator, else a point."""
    if delimiter == ",":
        return "."
    words = frame.head(_LOOKED_AT).to_numpy().ravel()
    commas = sum(_COMMA_NUMBER.fullmatch(str(word).strip()) is not None for word in words)
    points = sum("." in str(word) and _is_number(str(word)) for word in words)
    return "," if commas > points else "."


def _numbers(words: pd.Series[str], decimal: str) -> AnyArray:
    """The column's numbers; NaN where a field is not a number."""
    import pandas as pd

    if decimal == ",":
        words = words.str.replace(",", ".", regex=False)
    values = np.asarray(pd.to_numeric(words, errors="coerce"), dtype=np.float64)
    return np.where(np.isinf(values), np.nan, values)


def _clocks(frame: pd.DataFrame, header: _Header, columns: dict[str, Column]) -> tuple[Clock, ...]:
    """Stamps from columns of clock times, combined with the date, or from a column named time."""
    clocks: list[Clock] = []
    date = next((i for i in range(frame.shape[1]) if looks_like_date(str(frame.iat[0, i]))), None)
    dates = None if date is None else [str(word) for word in frame.iloc[:, date]]
    for index in range(frame.shape[1]):
        if looks_like_clock(str(frame.iat[0, index])):
            words = [str(word) for word in frame.iloc[:, index]]
            stamps = microseconds_of_clock(words, dates)
            if stamps is not None:
                clocks.append(Clock(header.names[index], stamps, TICKS["us"]))
                columns[header.names[index]] = column(stamps, "us")
    known = {clock.name for clock in clocks}
    return (*clocks, *numeric_clocks({name: one for name, one in columns.items() if name not in known}))


def numeric_clocks(columns: Mapping[str, Column]) -> tuple[Clock, ...]:
    """Stamps from numeric columns whose names denote time.

    Parameters
    ----------
    columns : mapping of str to Column
        Of a single table.
    """
    named = [(name, one) for name, one in columns.items() if name.lower() in _TIME_NAMES]
    return tuple(clock for name, one in named for clock in _numeric_clock(name, one.unit, one))


def _numeric_clock(name: str, unit: str | None, source: Column) -> list[Clock]:
    values = source.load()
    if not np.isfinite(values).all():
        return []
    unit = unit or ("us" if name == _MICROSECONDS and bool(np.all(values == np.round(values))) else "s")
    if unit not in TICKS:
        return []
    whole = unit != "s"
    return [Clock(name, values.astype(np.int64) if whole else values, TICKS[unit])]
