"""HDF5 and MATLAB 7.3 (.mat, -v7.3), through h5py: every numeric data set by its path."""

from __future__ import annotations

import io
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.damaged_columns import guarded
from aerosid.logs.formats.missing_library import library
from aerosid.logs.recording import AnyArray, Column, Recording, Stream

MAGIC = b"\x89HDF\r\n\x1a\n"
MATLAB_MAGIC = b"MATLAB 7.3"
_MATLAB_TEXT = b"char"
_MOST_COLUMNS = 256
"""Format: maximum number of columns of one matrix: beyond, it is an image or a field, not a set of channels."""


def read_hdf5(data: bytes, path: str) -> Recording:
    """The numeric data sets of an HDF5 file, grouped by length.

    Parameters
    ----------
    data : bytes
        The file's contents.
    path : str
        The file, for messages.

    Raises
    ------
    If the file cannot be read as HDF5, or contains no numbers.
        If the file cannot be read as HDF5, or holds no numbers.

    Notes
    -----
    A vector is named by its path (`flight/alpha`), a matrix's columns by `path[0]` ... . MATLAB stores matrices
    transposed, text as uint16, and a cell array as references: text and references are no channels. HDF5 does not
    mark a data set as time; the channel map does.
    """
    h5py = library("h5py", path)
    try:
        file = h5py.File(io.BytesIO(data), "r")
    except OSError as error:
        detail = " ".join(str(error).split())[:80]
        raise LogError(f"{path}: the HDF5 file is damaged or truncated ({detail}); copy or save it again.") from None
    matlab = data.startswith(MATLAB_MAGIC)
    by_length: dict[int, dict[str, Column]] = {}
    try:
        for name, dataset in _datasets(h5py, file):
            for label, length, column in _columns(name, dataset, path, transposed=matlab):
                by_length.setdefault(length, {})[label] = column
    except (OSError, RuntimeError) as error:
        detail = " ".join(str(error).split())[:80]
        raise LogError(f"{path}: the HDF5 file is damaged ({detail}); copy or save it again.") from None
    if not by_length:
        raise LogError(f"{path}: no data set holds numbers; check that this is the right file.")
    return Recording("hdf5", tuple(Stream("", columns) for columns in by_length.values()))


def _datasets(h5py: Any, group: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every data set with its path, except MATLAB's internal groups, whose names begin with #."""
    for name, item in group.items():
        if name.startswith("#"):
            continue
        if isinstance(item, h5py.Group):
            yield from _datasets(h5py, item, f"{prefix}{name}/")
        elif isinstance(item, h5py.Dataset):
            yield f"{prefix}{name}", item


def _columns(name: str, dataset: Any, path: str, *, transposed: bool) -> Iterator[tuple[str, int, Column]]:
    shape = dataset.shape
    if shape is None or dataset.dtype.kind not in "fiub" or dataset.attrs.get("MATLAB_class") == _MATLAB_TEXT:
        return
    if "MATLAB_empty" in dataset.attrs or 0 in shape or not 1 <= len(shape) <= 2:
        return
    unit = dataset.attrs.get("units", dataset.attrs.get("unit"))
    unit = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else unit if isinstance(unit, str) else None
    if len(shape) == 1 or min(shape) == 1:
        yield name, max(shape), guarded(partial(_load, dataset, None, 0), path, name, unit)
        return
    # Samples are along MATLAB's rows, which are this file's columns; otherwise along the longer side.
    along = 1 if transposed else int(shape[1] > shape[0])
    width = shape[1 - along]
    if width <= _MOST_COLUMNS:
        for index in range(width):
            yield f"{name}[{index}]", shape[along], guarded(partial(_load, dataset, index, along), path, name, unit)


def _load(dataset: Any, index: int | None, along: int) -> AnyArray:
    if index is None:
        return np.asarray(dataset[()]).ravel()
    return np.asarray(dataset[:, index] if along == 0 else dataset[index, :])
