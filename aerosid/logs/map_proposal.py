"""Proposal of a channel map from names, units, and the physical relations between channels."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from aerosid.errors import AerosidError
from aerosid.logs.column_lookup import find_column
from aerosid.logs.fitting_map import fitting_ready_map, found_in
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import ready_maps
from aerosid.logs.formats.channel_map import load_channel_map
from aerosid.logs.recording import TICKS, FloatArray, Recording, as_floats
from aerosid.logs.settings import READING
from aerosid.logs.stamps import unusable
from aerosid.logs.unit_physics import ProposalSettings, ProposedChannel, apply_physics, judge_load_factor
from aerosid.signals.resampling import interpolate_to, median_step

# Names of channels in recorders, without unit, case and punctuation; the first match is used.
_NAMES: dict[str, tuple[str, ...]] = {
    "V": ("tas", "vtas", "trueairspeed", "trueairspeedms", "vtrue", "vtotal", "v", "airspeed", "va"),
    "alpha": ("alpha", "vaneaoa", "aoa", "alphacg", "angleofattack", "alphadeg"),
    "beta": ("beta", "aos", "ssa", "sideslip", "sideslipangle"),
    "p": ("p", "rollrate", "rollspeed", "gyrx", "pdegps", "xyz0", "gyrorad0"),
    "q": ("q", "pitchrate", "pitchspeed", "gyry", "qdegps", "xyz1", "gyrorad1"),
    "r": ("r", "yawrate", "yawspeed", "gyrz", "rdegps", "xyz2", "gyrorad2"),
    "phi": ("phi", "roll", "bank", "bankangle", "rollangle", "phideg"),
    "theta": ("theta", "pitch", "pitchangle", "thetadeg"),
    "psi": ("psi", "heading", "yaw", "hdg", "magneticheading", "headingdeg"),
    "a_x": ("ax", "accx", "xacc", "nx", "longitudinalacceleration", "accelx", "axg"),
    "a_y": ("ay", "accy", "yacc", "ny", "latac", "lateralacceleration", "accely", "ayg"),
    "a_z": ("az", "accz", "zacc", "nz", "normac", "normalacceleration", "accelz", "azg", "loadfactor"),
    "delta_e": ("deltae", "elevator", "elevatorposition", "elev", "de", "deltaedeg", "elevatordeflection"),
    "delta_a": ("deltaa", "aileron", "aileronposition", "ail", "da", "deltaadeg", "rightaileronposition"),
    "delta_r": ("deltar", "rudder", "rudderposition", "rudd", "dr", "deltardeg"),
    "h": (
        *("h", "palt", "pressurealtitude", "altp", "baroaltitude", "alt", "altitude", "altmsl", "altitudeasl"),
        "pressurealt",
    ),
    "rho": ("rho", "density", "airdensity"),
    "mach": ("mach", "machnumber"),
}
_UNIT_IN_NAME = {"_deg": "deg", "_degps": "deg/s", "_kt": "kt", "_ft": "ft", "_g": "g", "_rad": "rad", "_m_s": "m/s",
                 "_rad_s": "rad/s", "_m_s2": "m/s^2", "_kts": "kt", "_fps": "ft/s", "_mps": "m/s", "_radps": "rad/s",
                 "_rps": "rad/s",                  "_mps2": "m/s^2", "_ms2": "m/s^2", "_m": "m", "_1": "1"}  # fmt: skip
_TABLES = ("csv", "ascii", "mat")  # formats whose maps always name the column of time
_TIME = ("time", "t", "ts", "times", "timestamp", "timeus", "dastimearray")


@dataclass(frozen=True)
class Proposal:
    """A proposed map, to be read by the user.

    Attributes
    ----------
    format : str
        A key of `FORMATS`.
    time : tuple of (str, str) or None
        Column and unit of time; None where the streams have their own stamps.
    channels : dict of str to ProposedChannel
        By the glossary's name.
    text : str
        The map, TOML.
    """

    format: str
    time: tuple[str, str] | None
    channels: dict[str, ProposedChannel]
    text: str


def propose_map(recording: Recording, path: str, settings: ProposalSettings | None = None) -> Proposal:
    """A channel map for a recording: the ready one of its format as far as it fits, or one from names and physics.

    Parameters
    ----------
    recording : Recording
        As the recorder made it.
    path : str
        The file, for the map's first line.
    settings : ProposalSettings, optional
        Limits of the physical relations.

    Notes
    -----
    Entries that rest on physics alone, and might be wrong, are commented out with the reason, to be confirmed.
    """
    settings = settings or ProposalSettings()
    ready = fitting_ready_map(recording)
    if ready is not None:
        channels = _from_ready_map(recording, ready)
        text = _with_named(ready_maps()[ready], {k: v for k, v in _by_name(recording).items() if k not in channels})
        return Proposal(recording.format, None, channels, _level_flight(recording, channels, settings) + text)
    time = _time_column(recording)
    channels = _by_name(recording)
    tracks = _tracks(recording, channels, time)
    apply_physics(channels, tracks, settings)
    return Proposal(recording.format, time, channels, _toml(recording.format, time, channels, path))


def _level_flight(recording: Recording, channels: dict[str, ProposedChannel], settings: ProposalSettings) -> str:
    """A line on the convention of the vertical acceleration from its mean in level flight, to be confirmed."""
    if "a_z" not in channels:
        return ""
    mapped = channels["a_z"]
    raw = {name: replace(one, sign=1, offset=0.0, reasons=[]) for name, one in channels.items() if name in _LEVEL}
    log = _tracks(recording, raw, None)
    if log is None:
        return ""
    judge_load_factor(raw, log, settings)
    found = raw["a_z"]
    agrees = (found.sign, found.offset) == (mapped.sign, mapped.offset)
    word = "confirm it" if agrees else "THE MAP BELOW DIFFERS, correct it"
    return f"# {mapped.column}: {'; '.join(found.reasons)}: {word}.\n"


def _from_ready_map(recording: Recording, name: str) -> dict[str, ProposedChannel]:
    return {
        channel: ProposedChannel(
            " + ".join(column.label for column in columns),
            entry.unit or "",
            entry.sign,
            entry.offset,
            entry.scale,
            [f"ready map {name}"],
        )
        for channel, (entry, columns) in found_in(recording, name).items()
    }


def _with_named(ready: Path, named: dict[str, ProposedChannel]) -> str:
    """A ready map, followed by columns that it does not use and whose names suggest a channel, to be confirmed."""
    text, derived = ready.read_text(encoding="utf-8"), load_channel_map(ready).derived
    # Among a hundred messages P is a gain and AX the state of a filter: single letters identify nothing there.
    telling = {k: v for k, v in named.items() if k not in derived and len(_plain(v.column.rpartition(".")[2])) > 2}
    lines = [_line(name, replace(one, asked=True)) for name, one in telling.items()]
    if not lines:
        return text
    before, mark, after = text.partition("\n[derived]")
    return "\n".join([before.rstrip("\n"), *lines, ""]) + mark + after


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _by_name(recording: Recording) -> dict[str, ProposedChannel]:
    """Columns whose names identify a channel; of several the one with the highest rate."""
    by_plain: dict[str, list[tuple[float, str, str]]] = {}
    for stream in recording.streams:
        clock = stream.clock()
        rate = 0.0
        if clock is not None and unusable(clock) is None:
            step = median_step(np.sort(clock.seconds(clock.ticks[0])))
            rate = 1.0 / step if np.isfinite(step) else 0.0
        for name, column in stream.columns.items():
            label = f"{stream.label}.{name}" if stream.label else name
            unit = column.unit or next((u for end, u in _UNIT_IN_NAME.items() if name.lower().endswith(end)), "")
            last = name.rsplit("/", 1)[-1]
            by_plain.setdefault(_plain(last), []).append((-rate, label, unit))
            for end in _UNIT_IN_NAME:
                if last.lower().endswith(end):
                    by_plain.setdefault(_plain(last[: -len(end)]), []).append((-rate, label, unit))
    found = {}
    for channel, names in _NAMES.items():
        for name in names:
            if name in by_plain:
                _, label, unit = min(by_plain[name])
                found[channel] = ProposedChannel(label, unit, reasons=["by its name"])
                break
    return found


def _time_column(recording: Recording) -> tuple[str, str] | None:
    """The column of time of a table whose format does not define it."""
    clock = recording.streams[0].clock()
    if recording.format in _TABLES and clock is not None:
        return clock.name, next(unit for unit, tick in TICKS.items() if tick == clock.tick)
    if any(stream.clocks for stream in recording.streams):
        return None
    for stream in recording.streams:
        for name, column in stream.columns.items():
            last = name.rsplit("/", 1)[-1]
            if _plain(last) in _TIME:
                values = as_floats(column.load())
                rises = values.size > 1 and bool(np.all(np.diff(values) >= 0.0))
                if rises:
                    return name, column.unit if column.unit in TICKS else _tick_by_size(values)
    return None


def _tick_by_size(values: FloatArray) -> str:
    """The unit in which the stamps are a recent date, or else their step is between a millisecond and a minute."""
    dated = [unit for unit, tick in TICKS.items() if READING.dated_days[0] < values[0] * tick < READING.dated_days[1]]
    if dated:
        return dated[0]
    step = median_step(values)
    return next((unit for unit, tick in TICKS.items() if 1e-3 <= step * tick <= 60.0), "s")


def _tracks(
    recording: Recording, channels: dict[str, ProposedChannel], time: tuple[str, str] | None
) -> FlightLog | None:
    """The channels found, as raw numbers on the stamps of the fastest, for the comparisons; None without time."""
    series: dict[str, tuple[FloatArray, FloatArray]] = {}
    for name, proposed in channels.items():
        found = find_column(recording, proposed.column)
        clock = found.stream.clock()
        if clock is not None and unusable(clock) is None:
            stamps = clock.seconds(clock.ticks.min())
        elif time is not None and time[0] in found.stream.columns:
            raw = found.stream.columns[time[0]].load()
            stamps = (raw - raw[0]).astype(np.float64) * TICKS[time[1]]
        else:
            continue
        values = proposed.scale * as_floats(found.column.load())
        order = np.argsort(stamps, kind="stable")
        keep = order[np.concatenate([[True], np.diff(stamps[order]) > 0.0])]
        there = keep[np.isfinite(values[keep])]
        if there.size > 20:
            series[name] = (stamps[there], values[there])
    if not series:
        return None
    base = min((stamps for stamps, _ in series.values()), key=median_step)
    on_base = {
        name: interpolate_to(stamps, values, base, 6.0 * median_step(stamps))
        for name, (stamps, values) in series.items()
    }
    try:
        return FlightLog("proposal", base, on_base)
    except AerosidError:
        return None


def _toml(form: str, time: tuple[str, str] | None, channels: dict[str, ProposedChannel], path: str) -> str:
    lines = [
        f"# Proposed for {Path(path).name} from names, units and physics: read it, correct it, and take the # away",
        "# from what is confirmed. value = sign * scale * x + offset, the offset in the given unit.",
        "schema = 1",
        f"format = {_quoted(form)}",
    ]
    if time is not None:
        lines.append(f"time = {{ column = {_quoted(time[0])}, unit = {_quoted(time[1])} }}")
    lines += ["", "[channels]"]
    if not channels:
        lines.append(
            '# no column was recognised by its name; map it as in  alpha = { column = "its name", unit = "deg" }'
        )
    lines += [_line(name, proposed) for name, proposed in channels.items()]
    return "\n".join(lines) + "\n"


def _line(name: str, proposed: ProposedChannel) -> str:
    """One channel of a map; commented out where it has to be confirmed first."""
    parts = [f"column = {_quoted(proposed.column)}"]
    if proposed.unit:
        parts.append(f"unit = {_quoted(proposed.unit)}")
    if proposed.sign != 1:
        parts.append(f"sign = {proposed.sign}")
    if proposed.offset:
        parts.append(f"offset = {proposed.offset:g}")
    hidden = "# confirm: " if proposed.asked or not proposed.unit else ""
    return f"{hidden}{name} = {{ {', '.join(parts)} }}  # {'; '.join(proposed.reasons)}"


def _quoted(text: str) -> str:
    return '"' + "".join(_ESCAPES.get(mark, mark) for mark in text if mark.isprintable()) + '"'


_LEVEL = ("a_z", "phi", "V")  # by which level flight is recognised
_ESCAPES = {'"': '\\"', "\\": "\\\\"}
