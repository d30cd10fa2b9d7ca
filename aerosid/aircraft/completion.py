"""Writing of findings into the text of an aircraft file, its comments and layout kept."""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AoT, InlineTable, KeyType, SingleKey

from aerosid.aircraft.completion_record import without_comments_above, write_record
from aerosid.aircraft.model import Aircraft, CompletionRecord, DeclaredEffect
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError
from aerosid.flight_model.terms import Term, parse_term

_SMALLEST_SIGMA = 1e-12
"""Numerical: an a-priori deviation of zero could not be read back."""

_FOUND = "found by aerosid, not in the declared model"
_NOT_SHOWN = "not significant in the flights"


def complete(
    aircraft: Aircraft,
    values: Mapping[tuple[str, str], tuple[float, float | None]],
    effects: Sequence[DeclaredEffect],
    not_shown: Sequence[tuple[str, str]] = (),
    record: CompletionRecord | None = None,
) -> Aircraft:
    """The aircraft with values and effects taken over; see `Aircraft.completed`.

    The new text is read again like any file, so that what is returned is what a reader of the written file gets.

    Raises
    ------
    AircraftError
        Where a value is no finite number, a term cannot be read, or the coefficient is none of the model's.
    """
    wanted: dict[tuple[str, Term], tuple[float, float | None]] = {}
    for (coefficient, text), (value, std_error) in values.items():
        _check(aircraft, coefficient, text, value)
        wanted[coefficient, parse_term(text)] = (value, std_error)
    kept = [(coefficient, parse_term(text)) for coefficient, text in not_shown]
    text = _edited(aircraft, wanted, effects, kept, record)
    completed = aircraft_from_text(text, aircraft.path, hashlib.sha256(text.encode()).hexdigest())
    missed = wanted.keys() - {(entry.coefficient, entry.term) for entry in completed.derivatives}
    if missed or len(completed.effects) < len(aircraft.effects):
        raise _odd_layout(aircraft, f"{len(missed)} entries could not be placed")
    return completed


def save_aircraft(aircraft: Aircraft, path: str | Path) -> None:
    """Write the aircraft's text; under the final name stands either the whole file or what stood there before.

    Raises
    ------
    AircraftError
        Where the file cannot be written.
    """
    target = Path(path)
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            stream.write(aircraft.text)
        # mkstemp makes files for the owner's eyes only; a result is as readable as any other new file
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, target)
    except OSError as error:
        if temporary:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
        raise AircraftError(
            f"{target} cannot be written ({error.strerror}); check that its folder exists and is writable"
        ) from None


def _check(aircraft: Aircraft, coefficient: str, text: str, value: float) -> None:
    if coefficient not in aircraft.coefficients:
        raise AircraftError(
            f"{aircraft.path}: {coefficient} does not fit this model, whose coefficients are "
            f"{', '.join(aircraft.coefficients)}; give the value for one of these"
        )
    if not math.isfinite(value):
        raise AircraftError(f"{aircraft.path}: the value of {coefficient} {text} is {value}, expected a finite number")


def _edited(
    aircraft: Aircraft,
    wanted: Mapping[tuple[str, Term], tuple[float, float | None]],
    effects: Sequence[DeclaredEffect],
    kept: Sequence[tuple[str, Term]],
    record: CompletionRecord | None,
) -> str:
    """The text of the file with the values replaced in place, and the comments that no longer hold beside them."""
    try:
        document = tomlkit.parse(aircraft.text)
    except TOMLKitError as error:  # tomllib has read it, so the two libraries disagree about an odd layout
        raise _odd_layout(aircraft, str(error)[:120]) from None
    declared = {(entry.coefficient, entry.term): entry for entry in aircraft.derivatives}
    derivatives: Any = document["derivatives"]
    spelling = {
        (coefficient, parse_term(text)): text
        for coefficient in aircraft.coefficients
        for text in derivatives.get(coefficient, {})
    }
    for (coefficient, term), (value, std_error) in wanted.items():
        entry = declared.get((coefficient, term))
        if entry is None:
            _add_entry(derivatives[coefficient], str(term), _numbers(value, std_error))
        elif not entry.fixed:
            table = derivatives[coefficient]
            without_comments_above(table, spelling[coefficient, term])
            _update(table, spelling[coefficient, term], _numbers(value, std_error), f"declared {entry.value:.6g}")
    for coefficient, term in kept:
        remark = _NOT_SHOWN if (coefficient, term) in wanted else f"as declared: {_NOT_SHOWN}"
        _mark_not_shown(derivatives[coefficient], spelling[coefficient, term], remark)
    if effects:
        _write_effects(document, aircraft, effects)
    if record is not None:
        write_record(document, record)
    return tomlkit.dumps(document)


def _odd_layout(aircraft: Aircraft, reason: str) -> AircraftError:
    return AircraftError(
        f"{aircraft.path}: its layout cannot be edited ({reason}); write each table once, below its own header"
    )


def _numbers(value: float, std_error: float | None) -> dict[str, float]:
    """Value and sigma as they are written: more digits than any estimate holds, fewer than a double's noise."""
    numbers = {"value": float(f"{value:.12g}")}
    if std_error is not None and math.isfinite(std_error):
        numbers["sigma"] = float(f"{max(std_error, _SMALLEST_SIGMA):.6g}")
    return numbers


def _update(table: Any, name: str, numbers: Mapping[str, float], remark: str) -> None:
    """Replace value and sigma; a sigma, a mark or a comment that is of the old number would be false and goes."""
    entry: Any = table[name]
    for key, number in numbers.items():
        item = tomlkit.item(number)
        if not isinstance(entry, InlineTable):
            item.comment(remark)
        entry[key] = item
    for key in ("sigma", "shown"):
        if key not in numbers and key in entry:
            del entry[key]
    _remark(table, entry, remark)


def _mark_not_shown(table: Any, name: str, remark: str) -> None:
    """Mark an entry that is not significant in the flights, whether its value is declared or estimated."""
    entry: Any = table[name]
    entry["shown"] = False
    _remark(table, entry, remark)


def _remark(table: Any, entry: Any, remark: str) -> None:
    """A comment beside an entry on a line of its own, in place of what stood there."""
    if isinstance(entry, InlineTable) and not isinstance(table, InlineTable):
        entry.comment(remark)


def _add_entry(table: Any, name: str, numbers: Mapping[str, float]) -> None:
    """A new entry at the end of its table, written like the entries that people write."""
    entry = tomlkit.value("{ " + ", ".join(f"{key} = {number!r}" for key, number in numbers.items()) + " }")
    if not isinstance(table, InlineTable):
        entry.comment(_FOUND)
    table.append(SingleKey(name, t=KeyType.Basic), entry)


def _write_effects(document: tomlkit.TOMLDocument, aircraft: Aircraft, effects: Sequence[DeclaredEffect]) -> None:
    """Append effects; one that stands there already takes the new numbers in its place."""
    declared = [_identity(effect) for effect in aircraft.effects]
    if not declared:
        document.pop("effects", None)  # an empty list cannot take tables
        document.append("effects", tomlkit.aot())
    listed: Any = document["effects"]
    for effect in effects:
        table = _effect_table(effect, inline=not isinstance(listed, AoT))
        if _identity(effect) in declared:
            old = listed[declared.index(_identity(effect))]
            for key in ("value", "std_error", "parameters"):
                if key in table:
                    old[key] = table[key]
                elif key in old:
                    del old[key]
        else:
            listed.append(table)


def _identity(effect: DeclaredEffect) -> tuple[str, str, str, float | None, str]:
    return effect.kind, effect.where, effect.term, effect.time, effect.log


def _effect_table(effect: DeclaredEffect, inline: bool) -> Any:
    table: Any = tomlkit.inline_table() if inline else tomlkit.table()
    if not inline:
        table.trivia.indent = "\n"  # a blank line before the header
    table["kind"] = effect.kind
    table["where"] = effect.where
    for key, text in (("term", effect.term), ("log", effect.log)):
        if text:
            table[key] = text
    for key, number in (("value", effect.value), ("std_error", effect.std_error), ("time", effect.time)):
        if number is not None:
            table[key] = float(f"{number:.12g}")
    if effect.parameters:
        parameters = tomlkit.inline_table()
        for name, number in effect.parameters.items():
            parameter = tomlkit.inline_table()
            parameter["value"] = float(f"{number:.12g}")
            parameters[name] = parameter
        table["parameters"] = parameters
    return table
