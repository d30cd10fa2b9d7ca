"""ASAM MDF 4 (.mf4), through asammdf: each channel group with its own stamps, samples read on demand."""

from __future__ import annotations

import contextlib
import gc
import io
import logging
import re
import sys
from datetime import UTC, datetime
from functools import partial
from typing import Any

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.formats.damaged_columns import guarded
from aerosid.logs.formats.missing_library import library
from aerosid.logs.recording import AnyArray, Clock, Column, Recording, Stream

MAGIC = (b"MDF     ", b"UnFinMF ")
_MASTER = (2, 3)
"""Format: types of channels that contain stamps."""

_NUMBER_TYPES = range(6)  # integers and floats of both byte orders; text and byte arrays have higher numbers
_FRAMES = "CAN_DataFrame"


def read_mdf4(data: bytes, path: str) -> Recording:
    """The channel groups of an MDF 4 file, each on its own raster, without resampling.

    Parameters
    ----------
    data : bytes
        The file's contents; the file itself is never written, an unfinalised one is completed in memory.
    path : str
        The file, for messages.

    Raises
    ------
    LogError
        If asammdf is not installed, the file is damaged, or it contains bus frames and no signals.
    """
    asammdf = library("asammdf", path)
    if not data.startswith(MAGIC):
        raise LogError(f"{path}: the file does not start as an MDF file does; check that it is the right file.")
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    file, failed = _opened(asammdf, data)
    if file is None:
        raise LogError(f"{path}: the MDF file is damaged or truncated ({failed}); copy it again from the recorder.")
    streams, notes = [], []
    for index, group in enumerate(file.groups):
        if group.channel_group.cycles_nr:
            stream = _stream(file, index, group, path)
            if stream.columns:
                streams.append(stream)
    if not streams:
        raise LogError(f"{path}: no group of the MDF file holds a sample of a number; check that it is the right file.")
    if all(stream.name.startswith("group") and any(_FRAMES in name for name in stream.columns) for stream in streams):
        notes.append(
            "the file holds frames of a bus and no signals: decode it with the bus's DBC file first (asammdf's "
            "extract_bus_logging), a list of frames is not a signal"
        )
    if data.startswith(MAGIC[1]):
        notes.append("the recorder did not finalise the file; it was finished in memory, and the file left as it is")
    start = file.header.start_time
    return Recording("mdf4", tuple(streams), tuple(notes), (), _utc(start))


def _opened(asammdf: Any, data: bytes) -> tuple[Any, str]:
    """The file, or None and the error message of asammdf.

    A partly constructed object of asammdf raises again in its destructor, where `except` cannot catch it: it is deleted
    in here, while unraisable exceptions are ignored.
    """
    listening = sys.unraisablehook
    sys.unraisablehook = lambda unraisable: None  # noqa: ARG005
    try:
        return asammdf.MDF(io.BytesIO(data)), ""
    except Exception as error:  # noqa: BLE001  damaged bytes can raise any exception in asammdf
        # asammdf names what it was given, which is the place of bytes in memory.
        told = re.sub(r"'?<_io\.BytesIO object at 0x[0-9a-f]+>'?", "it", str(error))
        failed = " ".join(told.split())[:80] or type(error).__name__
    finally:
        gc.collect()
        sys.unraisablehook = listening
    return None, failed


def _utc(start: Any) -> datetime | None:
    return start.astimezone(UTC) if isinstance(start, datetime) and start.year > 1970 else None


def _stream(file: Any, index: int, group: Any, path: str) -> Stream:
    stamps = np.asarray(file.get_master(index), dtype=np.float64)
    columns: dict[str, Column] = {}
    for at, channel in enumerate(group.channels):
        if channel.channel_type in _MASTER:
            continue
        numeric = channel.data_type in _NUMBER_TYPES
        if numeric and not _is_array(group, at):
            load = partial(_load, file, index, at)
            columns[channel.name] = guarded(load, path, channel.name, _unit(channel))
    return Stream(f"group {index}", columns, (Clock("master", stamps, 1.0),))


def _is_array(group: Any, at: int) -> bool:
    dependencies = group.channel_dependencies[at]
    return bool(dependencies)


def _unit(channel: Any) -> str | None:
    unit = channel.unit
    if not unit and channel.conversion is not None:
        unit = channel.conversion.unit
    return unit or None


def _load(file: Any, group: int, at: int) -> AnyArray:
    """The samples in physical units by the file's own conversion; text among them is missing."""
    with contextlib.redirect_stdout(io.StringIO()):
        values = np.asarray(file.get(group=group, index=at).samples)
    if values.dtype.kind not in "fiub" or values.ndim != 1:
        raw = np.asarray(file.get(group=group, index=at, raw=True).samples)
        return raw if raw.ndim == 1 and raw.dtype.kind in "fiub" else np.full(values.shape[0], np.nan)
    return values
