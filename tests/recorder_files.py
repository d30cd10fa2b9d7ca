"""Small files in recorders' own formats, written by the formats' descriptions or their reference libraries."""

from __future__ import annotations

import io
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

_ULOG_TYPES = {"uint64_t": "Q", "float": "f", "float[3]": "3f", "float[4]": "4f", "int32_t": "i", "uint8_t": "B"}
_FLASH = {"Q": "Q", "f": "f", "B": "B", "I": "I", "h": "h", "c": "h", "n": "4s", "N": "16s", "Z": "64s", "d": "d",
          "b": "b", "H": "H", "i": "i"}  # fmt: skip


def _ulog_message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def ulog(
    topics: Sequence[tuple[str, int, str, Sequence[tuple[Any, ...]]]],
    nested: Sequence[str] = (),
    drop_outs: Mapping[int, int] | None = None,
) -> bytes:
    """A ULog file of topics (name, instance, fields as `type name;...`, rows), messages one topic after the other.

    `drop_outs`: ms by the number of the data message behind which each is written.
    """
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000)
    out += _ulog_message("B", bytes(40))
    for text in nested:
        out += _ulog_message("F", text.encode())
    for name, fields in dict.fromkeys((name, fields) for name, _, fields, _ in topics):
        out += _ulog_message("F", f"{name}:{fields}".encode())
    for number, (name, instance, _, _) in enumerate(topics):
        out += _ulog_message("A", struct.pack("<BH", instance, number) + name.encode())
    written = 0
    for number, (_, _, fields, rows) in enumerate(topics):
        types = [field.split()[0] for field in fields.rstrip(";").split(";")]
        code = "".join(_ULOG_TYPES.get(kind, "f") for kind in types)
        for row in rows:
            out += _ulog_message("D", struct.pack("<H", number) + struct.pack("<" + code, *row))
            written += 1
            if drop_outs and written in drop_outs:
                out += _ulog_message("O", struct.pack("<H", drop_outs[written]))
    return out


Fmt = tuple[int, str, str, str]
FMT_OF_FMT: Fmt = (128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")


def flash_format(form: Fmt) -> bytes:
    """The FMT message of a type (number, name, letters, fields)."""
    number, name, letters, fields = form
    length = 3 + struct.calcsize("<" + "".join(_FLASH[letter] for letter in letters))
    body = struct.pack("<BB4s16s64s", number, length, name.encode(), letters.encode(), fields.encode())
    return b"\xa3\x95\x80" + body


def flash_message(form: Fmt, *values: Any) -> bytes:
    """One message of a type."""
    packed = [value.encode() if isinstance(value, str) else value for value in values]
    return bytes((0xA3, 0x95, form[0])) + struct.pack("<" + "".join(_FLASH[letter] for letter in form[2]), *packed)


def tlog(messages: Sequence[tuple[int, Any]], system: int = 1) -> bytes:
    """A telemetry log of (arrival in us, message), packed by pymavlink in version 2."""
    from pymavlink.dialects.v20 import ardupilotmega

    packer = ardupilotmega.MAVLink(io.BytesIO(), srcSystem=system, srcComponent=1)
    return b"".join(struct.pack(">Q", arrival) + message.pack(packer) for arrival, message in messages)


def attitude(milliseconds: int, pitch: float, rate: float = 0.0) -> Any:
    """An ATTITUDE message."""
    from pymavlink.dialects.v20 import ardupilotmega

    return ardupilotmega.MAVLink_attitude_message(milliseconds, 0.0, pitch, 0.0, 0.0, rate, 0.0)


def inertial(milliseconds: int, force: float) -> Any:
    """A SCALED_IMU2 message, specific force along x in g."""
    from pymavlink.dialects.v20 import ardupilotmega

    return ardupilotmega.MAVLink_scaled_imu2_message(milliseconds, round(1e3 * force), 0, -1000, 0, 0, 0, 0, 0, 0)


def mdf4(path: Path, groups: Sequence[Mapping[str, tuple[np.ndarray, np.ndarray, str]]]) -> Path:
    """An MDF 4 file with one group for each mapping of name to (stamps, samples, unit)."""
    from asammdf import MDF, Signal

    file = MDF(version="4.10")
    for group in groups:
        file.append([Signal(samples, stamps, unit, name) for name, (stamps, samples, unit) in group.items()])
    saved = Path(file.save(path, overwrite=True))
    file.close()
    return saved


def tdms(channels: Sequence[tuple[str, str, np.ndarray, Mapping[str, Any]]]) -> bytes:
    """A TDMS file of (group, channel, samples, properties)."""
    from nptdms import ChannelObject, TdmsWriter

    target = io.BytesIO()
    with TdmsWriter(target) as writer:
        writer.write_segment([ChannelObject(group, name, data, dict(more)) for group, name, data, more in channels])
    return target.getvalue()


def hdf5(path: Path, datasets: Mapping[str, np.ndarray], *, matlab: bool = False) -> Path:
    """An HDF5 file, or a MATLAB 7.3 file, which is one behind 512 bytes of header and holds matrices transposed."""
    import h5py

    with h5py.File(path, "w", userblock_size=512 if matlab else 0) as file:
        for name, values in datasets.items():
            dataset = file.create_dataset(name, data=values.T if matlab and values.ndim == 2 else values)
            if matlab:
                dataset.attrs["MATLAB_class"] = np.bytes_("char" if values.dtype == np.uint16 else "double")
    if matlab:
        content = bytearray(path.read_bytes())
        content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
        path.write_bytes(content)
    return path


IGC = """AXXX001 test
{date}
I023636FXA3739TRT
{fixes}
"""


def igc(date: str, seconds: Sequence[int], pressure: Sequence[int], gnss: Sequence[int]) -> bytes:
    """An IGC file with its date line and one fix for each time of the day, s."""
    lines = []
    for moment, low, high in zip(seconds, pressure, gnss, strict=True):
        clock = f"{moment // 3600 % 24:02d}{moment // 60 % 60:02d}{moment % 60:02d}"
        lines.append(f"B{clock}5346296N02025184EA{low:05d}{high:05d}7338")
    return IGC.format(date=date, fixes="\n".join(lines)).encode()


def irig106(stamps: Sequence[int], states: Sequence[int]) -> bytes:
    """A chapter 10 file of one packet of discretes, built by the standard's layout."""
    messages = b"".join(struct.pack("<QI", stamp, state) for stamp, state in zip(stamps, states, strict=True))
    body = struct.pack("<I", 32 << 3) + messages
    header = struct.pack("<HHIIBBBB", 0xEB25, 7, 24 + len(body), len(body), 1, 0, 0, 0x29)
    header += int(stamps[0]).to_bytes(6, "little")
    return header + struct.pack("<H", sum(struct.unpack("<11H", header)) & 0xFFFF) + body


def g1000(rows: Sequence[str]) -> str:
    """A Garmin G1000 log of rows behind its three lines of header."""
    return (
        '#airframe_info, log_version="1.00", airframe_name="Cessna 172S"\n'
        "#yyy-mm-dd, hh:mm:ss,   hh:mm,  ident, ft Baro,     kt,    deg,    deg,      G\n"
        "  Lcl Date, Lcl Time, UTCOfst, AtvWpt,    AltB,    TAS,  Pitch,   Roll, NormAc\n" + "\n".join(rows) + "\n"
    )
