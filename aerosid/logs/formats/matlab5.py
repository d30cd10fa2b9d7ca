"""MATLAB 5 to 7 .mat files: one matrix, a struct, or one variable per channel."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.matlab5_elements import check_elements
from aerosid.logs.formats.table import FloatArray, RawTable

_DEEPEST = 6
"""Format: maximum depth of nested structs: beyond, it is not a log."""


def read_matlab5(data: bytes, path: str) -> RawTable:
    """The columns of a MATLAB file: those of its largest matrix by number, and vectors of the same length by name.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If the file cannot be read as MATLAB 5 to 7, or contains no channels.

    Notes
    -----
    A struct's fields are named `field`, those of several structs `struct.field`. Samples are along the rows of a matrix
    unless it has more columns than rows.
    """
    variables = _load(data, path)
    arrays = list(_numeric(variables, "", 0))
    roots = {name.split(".", 1)[0] for name, _ in arrays}
    if len(roots) == 1 and all("." in name for name, _ in arrays):
        arrays = [(name.split(".", 1)[1], values) for name, values in arrays]
    matrices = [(name, values) for name, values in arrays if min(values.shape) > 1]
    vectors = [(name, values.ravel()) for name, values in arrays if min(values.shape) == 1 and values.size > 1]
    names: list[str | None] = []
    columns: list[FloatArray] = []
    if matrices:
        _, matrix = max(matrices, key=lambda item: item[1].size)
        matrix = matrix if matrix.shape[0] >= matrix.shape[1] else matrix.T
        names += [None] * matrix.shape[1]
        columns += list(matrix.T)
        samples = matrix.shape[0]
    elif vectors:
        samples = Counter(values.size for _, values in vectors).most_common(1)[0][0]
    else:
        found = ", ".join(variables) or "nothing"
        raise LogError(
            f"{path}: the file holds {found}, but a numeric matrix, vectors or a struct of them was expected."
        )
    for name, values in vectors:
        if values.size == samples:
            names.append(name)
            columns.append(values)
    table = np.column_stack(columns)
    infinite = np.argwhere(np.isinf(table))
    if infinite.size:
        row, column = infinite[0]
        raise LogError(
            f"{path}: sample {row + 1}, column {names[column] or column + 1} is infinite, but a finite number was "
            "expected; correct it, or set NaN for a missing sample."
        )
    return RawTable(tuple(names), (None,) * len(names), table)


def _load(data: bytes, path: str) -> dict[str, object]:
    import scipy.io

    if not data:
        raise LogError(f"{path}: the file is empty; record again or copy it again.")
    if data[:8] == b"\x89HDF\r\n\x1a\n" or data[:10] == b"MATLAB 7.3":
        raise LogError(f"{path}: this is a MATLAB 7.3 (HDF5) file, but MATLAB 5 to 7 was expected; save it with `-v7`.")
    # A version-5 file is marked in its first 128 bytes; scipy would read any other bytes as version 4.
    if not data.startswith(b"MATLAB 5"):
        raise LogError(f"{path}: the file does not start with a MATLAB 5 header; save it from MATLAB with `-v7`.")
    try:
        check_elements(data)
        # The stubs do not declare that an open file is accepted.
        loaded = scipy.io.loadmat(cast(Any, io.BytesIO(data)))
    except Exception as error:  # noqa: BLE001  damaged bytes can raise any exception in scipy
        detail = " ".join(str(error).split())[:80]
        raise LogError(f"{path}: the MATLAB file is damaged or truncated ({detail}); copy or save it again.") from None
    return {name: value for name, value in loaded.items() if not name.startswith("__")}


def _numeric(variables: dict[str, object], prefix: str, depth: int) -> Iterator[tuple[str, FloatArray]]:
    """Every real two-dimensional array in the variables and in structs of them, with its dotted name."""
    for name, value in variables.items():
        if not isinstance(value, np.ndarray) or value.ndim != 2 or value.size == 0:
            continue
        if value.dtype.names and value.size == 1 and depth < _DEEPEST:
            record = value.flat[0]
            fields = {field: record[field] for field in value.dtype.names}
            yield from _numeric(fields, f"{prefix}{name}.", depth + 1)
        elif value.dtype.kind in "fiub":
            yield f"{prefix}{name}", value.astype(np.float64)
