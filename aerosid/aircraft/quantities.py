"""Units in aircraft files: texts such as "180 kt" or "-0.0127 1/deg" become SI numbers before the schema sees them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aerosid.aircraft.schema import UNITS, shown
from aerosid.errors import AircraftError
from aerosid.flight_model.terms import parse_term
from aerosid.nomenclature import CHANNELS

NUMBERS_OF_A_DERIVATIVE = ("value", "sigma")


def with_si_numbers(document: Mapping[str, Any], path: str) -> dict[str, Any]:
    """The tables of a file with each text that gives a number with its unit as the number in SI.

    Parameters
    ----------
    document : mapping
        As TOML gives it. What is no text stays as it is, and so do texts where no unit belongs.
    path : str
        Names the file in sentences.

    Raises
    ------
    AircraftError
        Where the text is no number with a unit, or the unit is not known or of another dimension.
    """
    converted: dict[str, Any] = {}
    for name, table in document.items():
        if name == "derivatives" and isinstance(table, Mapping):
            converted[name] = {key: _derivatives(entries, path, f"{name}.{key}") for key, entries in table.items()}
        elif isinstance(table, Mapping):
            converted[name] = {key: _in_si(value, UNITS.get(f"{name}.{key}"), path, f"{name}.{key}")
                               for key, value in table.items()}  # fmt: skip
        else:
            converted[name] = table
    return converted


def _derivatives(entries: Any, path: str, key: str) -> Any:
    """The entries of one coefficient: a value per degree squared of alpha^2 becomes one per radian squared."""
    if not isinstance(entries, Mapping):
        return entries
    return {
        term: {
            name: _in_si(
                value, per_term(term) if name in NUMBERS_OF_A_DERIVATIVE else None, path, f"{key}.{term}.{name}"
            )
            for name, value in entry.items()
        }
        if isinstance(entry, Mapping)
        else entry
        for term, entry in entries.items()
    }


def per_term(term: str) -> str:
    """The unit of a derivative: one over the angles in its term; other variables count in SI."""
    try:
        factors = parse_term(term).factors
    except AircraftError:
        return "1"  # the reader of terms says what is wrong with it
    angles = sum(f.power for f in factors if f.variable in CHANNELS and CHANNELS[f.variable].unit == "rad")
    return "1" if angles == 0 else "1/rad" if angles == 1 else f"1/rad^{angles}"


def _in_si(value: Any, unit: str | None, path: str, key: str) -> Any:
    if isinstance(value, list):
        return [_in_si(each, unit, path, key) for each in value]
    if unit is None or not isinstance(value, str):
        return value
    if _is_bare(value):
        return value  # a number in quotes by mistake, which the schema tells
    from aerosid.logs.formats.quantity import read_quantity
    from aerosid.logs.formats.units import UnitProblem

    try:
        return read_quantity(value, unit)
    except UnitProblem as problem:
        raise AircraftError(
            f"{path}: {key} is {shown(value)}, which {problem}; write a number in {unit}, or a number with its unit "
            "in quotes"
        ) from None


def _is_bare(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
