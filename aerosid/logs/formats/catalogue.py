"""Catalogue of recorder formats: how each is recognised, read and mapped."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass

from aerosid.logs.formats.ascii_columns import read_ascii_columns
from aerosid.logs.formats.matlab5 import read_matlab5
from aerosid.logs.formats.native_csv import read_native_csv
from aerosid.logs.formats.table import RawTable
from aerosid.logs.recording import Recording


@dataclass(frozen=True)
class Format:
    """One recorder format.

    Attributes
    ----------
    read : callable
        From the file's bytes and its name (for messages) to its columns or, with several clocks, its streams.
    suffixes : tuple of str
        File suffixes by which the format is guessed; each may be followed by `.gz`.
    self_describing : bool
        Whether the file itself names channels and units, so that it needs no channel map.
    description : str
        One line for `aerosid formats`.
    magic : tuple of bytes
        First bytes of such a file, where they identify the format; they take precedence over the suffix.
    ready_map : str or None
        The bundled channel map, used where no other is given.
    extra : str or None
        The extra of aerosid that installs the reader's library.
    several_clocks : bool
        Whether its streams have stamps of their own.
    """

    read: Callable[[bytes, str], RawTable | Recording]
    suffixes: tuple[str, ...]
    self_describing: bool
    description: str
    magic: tuple[bytes, ...] = ()
    ready_map: str | None = None
    extra: str | None = None
    several_clocks: bool = False


def _late(module: str, function: str) -> Callable[[bytes, str], Recording]:
    """A reader that is imported on first use: some need large libraries and compilers."""

    def read(data: bytes, path: str) -> Recording:
        found = getattr(importlib.import_module(f"aerosid.logs.formats.{module}"), function)(data, path)
        assert isinstance(found, Recording)  # as annotated by the readers
        return found

    return read


FORMATS: dict[str, Format] = {
    "csv": Format(read_native_csv, (".csv",), True, "aerosid's own: a header row `name [unit], ...`, then numbers"),
    "ascii": Format(
        read_ascii_columns,
        (".asc", ".txt", ".dat", ".tsv", ".csv"),
        False,
        "columns separated by blanks, comma, semicolon or tab; header or none",
    ),
    "text": Format(
        _late("delimited_text", "read_delimited_text"),
        (),
        False,
        "tables with clock times and words: Garmin, JSBSim, X-Plane, PX4's CSV",
    ),
    "mat": Format(
        read_matlab5, (".mat",), False, "MATLAB 5 to 7: one matrix, a struct, or one variable a channel", (b"MATLAB 5",)
    ),
    "hdf5": Format(
        _late("hdf5", "read_hdf5"),
        (".h5", ".hdf5", ".hdf"),
        False,
        "HDF5 and MATLAB 7.3: every data set of numbers by its path",
        (b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3"),
        extra="hdf5",
    ),
    "parquet": Format(_late("arrow", "read_parquet"), (".parquet",), False, "Apache Parquet, one table", (b"PAR1",)),
    "feather": Format(
        _late("arrow", "read_feather"), (".feather", ".arrow"), False, "Feather, Arrow IPC", (b"ARROW1", b"FEA1")
    ),
    "ulog": Format(
        _late("ulog", "read_ulog"), (".ulg",), False, "PX4 ULog", (b"ULog\x01\x12\x35",), "px4", several_clocks=True
    ),
    "dataflash": Format(
        _late("dataflash", "read_dataflash"),
        (".bin",),
        False,
        "ArduPilot DataFlash, binary",
        (b"\xa3\x95\x80",),
        "ardupilot",
        several_clocks=True,
    ),
    "dataflash_text": Format(
        _late("dataflash_text", "read_dataflash_text"),
        (".log",),
        False,
        "ArduPilot DataFlash, text",
        (),
        "ardupilot",
        several_clocks=True,
    ),
    "tlog": Format(
        _late("mavlink_log", "read_tlog"),
        (".tlog",),
        False,
        "MAVLink telemetry log",
        (),
        "mavlink",
        "mavlink",
        several_clocks=True,
    ),
    "mdf4": Format(
        _late("mdf4", "read_mdf4"),
        (".mf4", ".mdf"),
        False,
        "ASAM MDF 4",
        (b"MDF     ", b"UnFinMF "),
        extra="mdf4",
        several_clocks=True,
    ),
    "tdms": Format(
        _late("tdms", "read_tdms"), (".tdms",), False, "LabVIEW TDMS", (b"TDSm",), extra="tdms", several_clocks=True
    ),
    "irig106": Format(
        _late("irig106", "read_irig106"),
        (".ch10", ".c10"),
        False,
        "IRIG 106 chapter 10: discretes, raw bus words (experimental)",
        (b"\x25\xeb",),
        extra="irig106",
        several_clocks=True,
    ),
    "igc": Format(_late("igc", "read_igc"), (".igc",), False, "FAI IGC, gliders' fixes", extra="igc"),
}
