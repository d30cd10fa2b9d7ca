"""Conversion of raw columns to a log in SI units: names, signs, units, delays, and derived channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.derived_channels import LAWS
from aerosid.logs.flight_log import ChannelSource, FloatArray, Position
from aerosid.logs.formats.table import RawTable, shown
from aerosid.logs.formats.units import UnitProblem, conversion
from aerosid.logs.settings import READING
from aerosid.logs.stamps import hole_notes, holes, spread_repeats
from aerosid.nomenclature import CHANNELS

if TYPE_CHECKING:
    from aerosid.logs.formats.channel_map import ChannelColumnMap, ChannelMap, ColumnMap


@dataclass
class Assembled:
    """A log under construction."""

    time: FloatArray
    channels: dict[str, FloatArray] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    sources: dict[str, ChannelSource] = field(default_factory=dict)
    positions: dict[str, Position] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    resolution: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def assemble_native(table: RawTable, path: str) -> Assembled:
    """The channels of a native log, whose header gives names and units.

    Raises
    ------
    LogError
        If time is missing or not increasing, or a unit does not convert.
    """
    names = [name or "" for name in table.names]
    if "time" not in names:
        raise LogError(f"{path}: the header has no column `time [s]` (it has {listed(names)}); add it.")
    values: dict[str, FloatArray] = {}
    log = Assembled(np.empty(0))
    for index, name in enumerate(names):
        unit = table.units[index]
        unit = "1" if unit is None else unit
        try:
            values[name] = in_glossary_unit(name, unit, initialised(name, table.values[:, [index]], log.notes)[:, 0])
        except UnitProblem as problem:
            raise LogError(f"{path}: channel {shown(name)} {problem}; correct the header.") from None
        log.units[name] = held_unit(name, unit)
        log.sources[name] = ChannelSource((name,), unit)
    log.time = _checked_time(values.pop("time"), table, path)
    log.channels = values
    del log.units["time"]
    derive_from_velocities(log)
    return log


def assemble_mapped(table: RawTable, mapping: ChannelMap, path: str, map_path: str) -> Assembled:
    """The channels of a channel map.

    Raises
    ------
    ChannelMapError
        If a column is not in the file, or a unit is missing or does not convert.
    LogError
        If time is not increasing.
    """
    place = Place(path, map_path)
    if mapping.time is None:
        raise ChannelMapError(f"{map_path}: key 'time' is missing; add it.")
    columns, unit = _read_with("time", mapping.time, table, place)
    time = scaled("time", mapping.time, columns.sum(axis=1), unit, place)
    table, time, notes = _judged_repeats(table, time)
    log = Assembled(_checked_time(time, table, path), notes=notes)
    log.sources["time"] = _source(mapping.time, unit, table, 0.0)
    taken: dict[str, ChannelColumnMap] = {}
    for name, alternatives in mapping.channels.items():
        if name == "time":
            raise ChannelMapError(f"{map_path}: [channels] holds time; give it by the key `time` above [channels].")
        entry = _first_held(name, alternatives, table, place, log.notes, optional=mapping.optional)
        if entry is None:
            continue
        taken[name] = entry
        columns, unit = _read_with(name, entry, table, place)
        recorded = initialised(name, columns, log.notes).sum(axis=1)
        log.channels[name] = scaled(name, entry, recorded, unit, place)
        log.units[name] = held_unit(name, unit)
        log.sources[name] = _source(entry, unit, table, entry.delay)
        if entry.position is not None:
            log.positions[name] = entry.position
        for given, declared in ((entry.noise, log.noise), (entry.resolution, log.resolution)):
            if given is not None:
                declared[name] = given * glossary_factor(name, unit)
    _move_earlier(log, taken, place)
    derive(log, mapping, place)
    return log


def derive(log: Assembled, mapping: ChannelMap, place: Place) -> None:
    """Adds the derived channels: by the map's laws, then from body velocities.

    Raises
    ------
    ChannelMapError
        If a law needs a channel that does not exist, or its unit does not convert.
    """
    for name, entry in mapping.derived.items():
        if name in log.channels:
            continue
        law = LAWS[entry.law]
        parents = entry.from_ or tuple(quantity for quantity, _ in law.inputs)
        lacking = [parent for parent in parents if parent not in log.channels]
        if lacking and mapping.optional:
            log.notes.append(f"{name}: not computed, {listed(lacking)} is not recorded")
            continue
        if lacking:
            raise ChannelMapError(
                f"{place.map}: [derived] {name} needs {listed(lacking)}, but {place.log} with this map holds "
                f"{listed(tuple(log.channels))}; map it, or name another channel in `from`."
            )
        arguments = []
        for parent, (_, wanted) in zip(parents, law.inputs, strict=True):
            try:
                factor, shift = conversion(log.units[parent], wanted)
            except UnitProblem as problem:
                raise ChannelMapError(f"{place.map}: [derived] {name}: {parent} {problem}; correct it.") from None
            arguments.append(factor * log.channels[parent] + shift)
        at = dict(zip("xyz", entry.position or (), strict=False))
        values = law.compute(*arguments, *(at[axis] for axis in law.constants))
        log.channels[name] = values
        log.units[name] = held_unit(name, law.unit)
        log.sources[name] = ChannelSource(parents, law.unit)
        log.notes.append(f"{name}: computed from {', '.join(parents)} ({entry.law})")
    derive_from_velocities(log)


def _first_held(
    name: str,
    alternatives: tuple[ChannelColumnMap, ...],
    table: RawTable,
    place: Place,
    notes: list[str],
    *,
    optional: bool,
) -> ChannelColumnMap | None:
    """The first alternative whose columns exist in the file; None where none does and the channel is optional."""
    for rank, entry in enumerate(alternatives):
        try:
            for column in entry.parts:
                _column_index(name, column, table, place)
        except ChannelMapError:
            if rank + 1 < len(alternatives):
                continue
            if not optional:
                raise
            notes.append(f"{name}: not in the recording, left out")
            return None
        if len(alternatives) > 1:
            notes.append(f"{name}: taken from {' + '.join(str(column) for column in entry.parts)}")
        if entry.note is not None:
            notes.append(f"{name}: {entry.note}")
        return entry
    return None


def _judged_repeats(table: RawTable, time: FloatArray) -> tuple[RawTable, FloatArray, list[str]]:
    """Stamps without repeats: duplicate rows are dropped, stamps of a coarse clock spread; others are left as wrong."""
    again = np.flatnonzero(np.diff(time) == 0.0) + 1
    if again.size == 0:
        return table, time, []
    same = (table.values[again] == table.values[again - 1]) | np.isnan(table.values[again])
    if bool(same.all()):
        keep = np.ones(time.size, dtype=bool)
        keep[again] = False
        kept = RawTable(table.names, table.units, table.values[keep], None)
        return kept, time[keep], [f"{again.size} rows repeat the one before them, stamp and all: they are left out"]
    spread, note = spread_repeats(time)
    return (table, time, []) if note is None else (table, spread, [note])


def cut_at_holes(log: Assembled, path: str) -> list[Assembled]:
    """The stretches of a table between gaps in its stamps, in order of time; gaps are never bridged.

    Raises
    ------
    LogError
        If none has enough samples.
    """
    cuts = holes(log.time)
    if cuts.shape[0] == 0:
        return [log]
    starts = [0, *np.searchsorted(log.time, cuts[:, 1]), log.time.size]
    spans = [(a, b) for a, b in pairwise(starts) if b - a >= READING.fewest_samples]
    if not spans:
        raise LogError(
            f"{path}: {cuts.shape[0]} gaps in its stamps leave no stretch of {READING.fewest_samples} samples; record "
            "without interruption."
        )
    log.notes += hole_notes([(low, high) for low, high in cuts.tolist()], len(spans), READING.fewest_samples)
    return [
        replace(log, time=log.time[a:b], channels={name: values[a:b] for name, values in log.channels.items()})
        for a, b in spans
    ]


@dataclass(frozen=True)
class Place:
    """Names of the log and of its map for a message."""

    log: str
    map: str


def listed(names: list[str] | tuple[str, ...]) -> str:
    """Names for a message, at most a line of them."""
    text = ", ".join(shown(name, 24) for name in names[:12])
    return f"{text}, … {len(names)} in all" if len(names) > 12 else text or "none"


def held_unit(name: str, unit: str) -> str:
    """The unit of a channel in the log: the glossary's, or the file's for a channel that is not in the glossary."""
    return CHANNELS[name].unit if name in CHANNELS else unit


def in_glossary_unit(name: str, unit: str, values: FloatArray) -> FloatArray:
    """The values in the glossary's unit; unchanged for a channel that is not in the glossary."""
    if name not in CHANNELS:
        return np.ascontiguousarray(values)
    factor, shift = conversion(unit, CHANNELS[name].unit)
    return np.ascontiguousarray(values) if (factor, shift) == (1.0, 0.0) else values * factor + shift


def glossary_factor(name: str, unit: str) -> float:
    """A difference in the file's unit, in the glossary's."""
    return abs(conversion(unit, CHANNELS[name].unit)[0]) if name in CHANNELS else 1.0


def _checked_time(time: FloatArray, table: RawTable, path: str) -> FloatArray:
    if time.size < READING.fewest_samples:
        found = f"{time.size} sample{'s' * (time.size != 1)}"
        raise LogError(f"{path}: the log holds {found}, but at least {READING.fewest_samples} are needed; export more.")
    missing = np.flatnonzero(~np.isfinite(time))
    if missing.size:
        raise LogError(f"{path}: {table.row_label(int(missing[0]))} has no time; complete or remove it.")
    wrong = np.flatnonzero(np.diff(time) <= 0.0)
    if wrong.size:
        row = int(wrong[0]) + 1
        verb = "repeats" if time[row] == time[row - 1] else "goes back"
        raise LogError(
            f"{path}: time {verb} at {table.row_label(row)} (channel time is {time[row]:.10g} s after "
            f"{time[row - 1]:.10g} s), but it must strictly increase; remove or repair that sample."
        )
    return np.ascontiguousarray(time)


def _column_index(name: str, column: int | str, table: RawTable, place: Place) -> int:
    """Index of the column, from 0."""
    if isinstance(column, int):
        if column > len(table.names):
            raise ChannelMapError(
                f"{place.map}: channel {name} is mapped to column {column}, but {place.log} has {len(table.names)} "
                "columns; correct the number."
            )
        return column - 1
    found = [index for index, held in enumerate(table.names) if held == column]
    if not found:
        # The header as written in the file, with its unit.
        found = [index for index, header in enumerate(_headers(table)) if "".join(column.split()) in header]
    if len(found) == 1:
        return found[0]
    if found:
        numbers = " and ".join(str(index + 1) for index in found)
        raise ChannelMapError(
            f"{place.map}: channel {name} is mapped to column {shown(column)}, which {place.log} holds twice (columns "
            f"{numbers}); map it by its number."
        )
    held_names = tuple(held for held in table.names if held)
    raise ChannelMapError(
        f"{place.map}: channel {name} is mapped to column {shown(column)}, but {place.log} holds "
        f"{listed(held_names) if held_names else 'columns without names'}; correct the name"
        f"{'' if held_names else ' to a number from 1'}."
    )


def _headers(table: RawTable) -> list[tuple[str, ...]]:
    """Each column's name with its unit in brackets, without blanks."""
    return [
        () if name is None or unit is None else tuple("".join(f"{name}{a}{unit}{b}".split()) for a, b in ("[]", "()"))
        for name, unit in zip(table.names, table.units, strict=True)
    ]


def _read_with(name: str, entry: ColumnMap, table: RawTable, place: Place) -> tuple[FloatArray, str]:
    """The entry's columns, shape (N, number of columns), and their unit."""
    indices = [_column_index(name, column, table, place) for column in entry.parts]
    units = {table.units[index] for index in indices}
    unit = entry.unit if entry.unit is not None else units.pop() if len(units) == 1 else None
    if unit is None:
        raise ChannelMapError(
            f"{place.map}: channel {name} has no `unit`, and {place.log} gives none for its column; add the unit."
        )
    return table.values[:, indices], unit


def scaled(name: str, entry: ColumnMap, recorded: FloatArray, unit: str, place: Place) -> FloatArray:
    """Sign * scale * x + offset, in the glossary's unit; ChannelMapError where the unit does not convert."""
    values = entry.sign * entry.scale * recorded + entry.offset
    try:
        return in_glossary_unit(name, unit, values)
    except UnitProblem as problem:
        raise ChannelMapError(f"{place.map}: channel {name} of {place.log} {problem}; correct `unit`.") from None


def _source(entry: ColumnMap, unit: str, table: RawTable, delay: float) -> ChannelSource:
    labels = []
    for column in entry.parts:
        held = table.names[column - 1] if isinstance(column, int) else None
        labels.append(f"{column} ({held})" if held else str(column))
    return ChannelSource(tuple(labels), unit, float(entry.sign), entry.scale, entry.offset, delay)


def initialised(name: str, recorded: FloatArray, notes: list[str]) -> FloatArray:
    """The recorded columns; numbers written before the channel started are missing samples."""
    word = (recorded != 0.0) & (np.abs(recorded) < READING.uninitialised)
    count = int(np.count_nonzero(word))
    if not count:
        return recorded
    notes.append(f"{name}: {count} uninitialised words (below 10⁻²⁰⁰) taken as missing")
    return np.where(word, np.nan, recorded)


def _move_earlier(log: Assembled, entries: Mapping[str, ChannelColumnMap], place: Place) -> None:
    """Removes recording delays: the value at t is the recording at t + delay, linear between samples."""
    span = float(log.time[-1] - log.time[0])
    for name, entry in entries.items():
        if entry.delay == 0.0:
            continue
        if abs(entry.delay) >= span:
            raise ChannelMapError(
                f"{place.map}: channel {name} has a delay of {entry.delay:g} s, but {place.log} lasts {span:g} s; "
                "give the delay in seconds."
            )
        wanted = log.time + entry.delay
        moved = np.interp(wanted, log.time, log.channels[name], left=np.nan, right=np.nan)
        lost = int(np.count_nonzero((wanted < log.time[0]) | (wanted > log.time[-1])))
        log.channels[name] = moved
        log.notes.append(
            f"{name}: moved {abs(entry.delay):g} s {'earlier' if entry.delay > 0 else 'later'} by linear "
            f"interpolation; {lost} samples at the {'end' if entry.delay > 0 else 'start'} are missing"
        )


def derive_from_velocities(log: Assembled) -> None:
    """V and alpha (and beta, with v) from the body velocities, where they are not recorded."""
    if "u" not in log.channels or "w" not in log.channels:
        return
    u, w = log.channels["u"], log.channels["w"]
    v = log.channels.get("v")
    parents = ("u", "w") if v is None else ("u", "v", "w")
    speed = np.sqrt(u**2 + w**2 + (0.0 if v is None else v**2))
    derived = {"V": speed, "alpha": np.arctan2(w, u)}
    if v is not None:
        derived["beta"] = np.arcsin(np.clip(v / np.where(speed > 0.0, speed, np.nan), -1.0, 1.0))
    for name, values in derived.items():
        if name not in log.channels:
            log.channels[name] = values
            log.units[name] = CHANNELS[name].unit
            log.sources[name] = ChannelSource(parents, CHANNELS[name].unit)
            log.notes.append(f"{name}: computed from {', '.join(parents)}")
