"""Raw table of a reader: the file's columns as numbers, with their names and units where the file gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RawTable:
    """Columns as recorded, before names, signs and units are interpreted.

    Attributes
    ----------
    names : tuple of (str or None), length M
        Column names; None where the file gives none.
    units : tuple of (str or None), length M
        Units as written in the file; None where the file gives none.
    values : ndarray, shape (N, M)
        Numbers as recorded; NaN where a sample is missing.
    first_line : int or None
        The line, from 1, of the first row of numbers; None in binary files and where blank lines were skipped.
    """

    names: tuple[str | None, ...]
    units: tuple[str | None, ...]
    values: FloatArray
    first_line: int | None = None

    def row_label(self, row: int) -> str:
        """Location of a row in the file, for messages: `line 12`, or `sample 11` where lines are not known."""
        return f"sample {row + 1}" if self.first_line is None else f"line {self.first_line + row}"


def shown(text: object, limit: int = 40) -> str:
    """Text from a file, quoted, stripped of control characters and cut to `limit` characters for a message."""
    raw = str(text)
    cut = "".join(mark if mark.isprintable() else "?" for mark in raw[:limit])
    return f"'{cut}…'" if len(raw) > limit else f"'{cut}'"
