"""One flight as each recorder would have it: every stream at its own rate and phase, with jitter, in its own units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import recorder_files as files
from pyarrow import feather, parquet

from aerosid.logs.flight_log import FlightLog

BOOT = 120.0  # s on the recorder's clock when the flight's time is 0
TRAVEL = 25.0  # deg of the elevator at full command
FloatArray = np.ndarray[Any, np.dtype[np.float64]]


def stamps(log: FlightLog, rate: float, late: float, rng: np.random.Generator, jitter: float = 0.2) -> FloatArray:
    """Instants within the log at a rate, Hz, each off by up to `jitter` of the step, s."""
    step = 1.0 / rate
    count = int((log.time[-1] - log.time[0] - 0.3) / step)
    even = log.time[0] + 0.1 + late + step * np.arange(count)
    return np.asarray(even + jitter * step * rng.uniform(-1.0, 1.0, count))


def at(log: FlightLog, name: str, time: FloatArray) -> FloatArray:
    """A channel at other instants."""
    return np.interp(time, log.time, log[name])


def _rows(time: FloatArray, *columns: FloatArray) -> list[tuple[Any, ...]]:
    """Of a topic: when it was written, 0.4 ms late, when it was sampled, us, and its values."""
    sampled = np.round(1e6 * (time + BOOT)).astype(np.int64)
    return [
        (int(us + 400), int(us), *map(float, row))
        for us, row in zip(sampled, np.column_stack(columns), strict=True)
    ]  # fmt: skip


def ulog(log: FlightLog, path: Path) -> Path:
    """PX4: gyros and accelerometers at 250 Hz, attitude, command and a vane at 50, altitude at 25, airspeed at 10."""
    rng = np.random.default_rng(11)
    gyro, force = stamps(log, 250.0, 0.0, rng), stamps(log, 250.0, 0.001, rng)
    attitude, command, vane = (stamps(log, 50.0, late, rng) for late in (0.003, 0.007, 0.011))
    baro, pitot = stamps(log, 25.0, 0.002, rng), stamps(log, 10.0, 0.004, rng)
    half, (a_x, a_z) = 0.5 * at(log, "theta", attitude), (at(log, name, force) for name in ("a_x", "a_z"))
    elevator = -np.degrees(at(log, "delta_e", command)) / TRAVEL
    head = "uint64_t timestamp;uint64_t timestamp_sample;"

    def zero(time: FloatArray) -> FloatArray:
        return np.zeros(time.size)

    topics = [
        ("vehicle_angular_velocity", "float[3] xyz;", _rows(gyro, zero(gyro), at(log, "q", gyro), zero(gyro))),
        ("vehicle_acceleration", "float[3] xyz;", _rows(force, a_x, zero(force), a_z)),
        ("vehicle_attitude", "float[4] q;", _rows(attitude, np.cos(half), zero(half), np.sin(half), zero(half))),
        ("airspeed_validated", "float true_airspeed_m_s;", _rows(pitot, at(log, "V", pitot))),
        ("vehicle_air_data", "float baro_alt_meter;", _rows(baro, at(log, "h", baro))),
        ("vehicle_torque_setpoint", "float[3] xyz;", _rows(command, zero(command), elevator, zero(command))),
        ("sensor_vane", "float alpha;", _rows(vane, np.degrees(at(log, "alpha", vane)))),
    ]  # fmt: skip
    path.write_bytes(files.ulog([(name, 0, head + fields, rows) for name, fields, rows in topics]))
    return path


def dataflash(log: FlightLog, path: Path) -> Path:
    """ArduPilot: inertial unit at 100 Hz, attitude, vane and command at 50, altitude and airspeed at 25."""
    rng = np.random.default_rng(12)
    forms: list[tuple[files.Fmt, float, Callable[[FloatArray], list[Any]]]] = [
        ((130, "IMU", "Qfff", "TimeUS,GyrY,AccX,AccZ"), 100.0, lambda t: [at(log, n, t) for n in ("q", "a_x", "a_z")]),
        ((131, "ATT", "Qf", "TimeUS,Pitch"), 50.0, lambda t: [np.degrees(at(log, "theta", t))]),
        ((132, "AOA", "Qf", "TimeUS,AOA"), 50.0, lambda t: [np.degrees(at(log, "alpha", t))]),
        ((133, "AETR", "Qf", "TimeUS,Elev"), 50.0, lambda t: [-4500.0 * np.degrees(at(log, "delta_e", t)) / TRAVEL]),
        ((134, "CTUN", "Qf", "TimeUS,As"), 25.0, lambda t: [at(log, "V", t)]),
        ((135, "BARO", "Qf", "TimeUS,Alt"), 25.0, lambda t: [at(log, "h", t)]),
    ]
    content = files.flash_format(files.FMT_OF_FMT) + b"".join(files.flash_format(form) for form, _, _ in forms)
    messages = []
    for late, (form, rate, columns) in enumerate(forms):
        time = stamps(log, rate, 0.001 * late, rng)
        for moment, *row in zip(time, *columns(time), strict=True):
            us = round(1e6 * (moment + BOOT))
            messages.append((us, files.flash_message(form, us, *map(float, row))))
    path.write_bytes(content + b"".join(message for _, message in sorted(messages, key=lambda entry: entry[0])))
    return path


def tlog(log: FlightLog, path: Path) -> Path:
    """MAVLink over a fast link: attitude at 20 Hz, of which the rate leads, airspeed at 10."""
    from pymavlink.dialects.v20 import ardupilotmega as link

    rng = np.random.default_rng(13)
    messages: list[tuple[float, Any]] = []
    for moment in stamps(log, 20.0, 0.0, rng, 0.0):
        pitch, rate = (float(np.interp(moment, log.time, log[name])) for name in ("theta", "q"))
        boot = round(1e3 * (moment + BOOT))
        messages.append((moment, link.MAVLink_attitude_message(boot, 0.0, pitch, 0.0, 0.0, rate, 0.0)))
        elevator = round(1500.0 - 500.0 * np.degrees(float(np.interp(moment, log.time, log["delta_e"]))) / TRAVEL)
        channels = [1500, elevator, *([1500] * 6)]
        messages.append((moment, link.MAVLink_servo_output_raw_message(boot * 1000, 0, *channels)))
        speed, height = (float(np.interp(moment, log.time, log[name])) for name in ("V", "h"))
        messages.append((moment, link.MAVLink_vfr_hud_message(speed, speed, 0, 50, height, 0.0)))
    path.write_bytes(files.tlog([(round(1.6e15 + 1e6 * moment), message) for moment, message in messages]))
    return path


TABLE = ("V", "alpha", "q", "theta", "a_x", "a_z", "h", "delta_e")


def _every(log: FlightLog, step: float = 0.02) -> tuple[FloatArray, dict[str, FloatArray]]:
    time = np.arange(log.time[0], log.time[-1], step)
    return time + BOOT, {name: at(log, name, time) for name in TABLE}


def arrow(log: FlightLog, path: Path) -> Path:
    """Parquet or Feather: one table at 50 Hz, its stamps in ns."""
    time, columns = _every(log)
    table = pa.table({"t_ns": np.round(1e9 * time).astype(np.int64)} | columns)
    (parquet.write_table if path.suffix == ".parquet" else feather.write_feather)(table, path)
    return path


def hdf5(log: FlightLog, path: Path) -> Path:
    """HDF5: a data set a channel, or MATLAB 7.3's, which is the same behind a header."""
    time, columns = _every(log)
    return files.hdf5(path, {"t_ns": np.round(1e9 * time).astype(np.int64)} | columns, matlab=path.suffix == ".mat")


def mdf4(log: FlightLog, path: Path) -> Path:
    """MDF 4: a fast group of 100 Hz and a slow one of 50, each with its own start."""
    fast, slow = (
        stamps(log, rate, late, np.random.default_rng(14), 0.0) for rate, late in ((100.0, 0.0), (50.0, 0.013))
    )
    groups = [
        {name: (time + BOOT, at(log, name, time), log.units[name]) for name in names}
        for time, names in ((fast, ("q", "a_x", "a_z")), (slow, ("V", "alpha", "theta", "h", "delta_e")))
    ]
    return files.mdf4(path, groups)


def tdms(log: FlightLog, path: Path) -> Path:
    """TDMS: waveforms of 50 Hz that all start at once."""
    _, columns = _every(log)
    told = {"wf_increment": 0.02, "wf_start_offset": BOOT}
    path.write_bytes(files.tdms([("flight", name, values, told) for name, values in columns.items()]))
    return path
