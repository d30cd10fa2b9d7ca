"""Reading of aircraft files."""

from __future__ import annotations

import difflib
import hashlib
import os
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.model import (
    Aircraft,
    CompletionRecord,
    DeclaredEffect,
    Derivative,
    FuelTable,
    LogOfCompletion,
)
from aerosid.effects import KINDS
from aerosid.effects.inertia import INERTIA
from aerosid.errors import AircraftError
from aerosid.flight_model.axes import COEFFICIENTS, LATERAL, LONGITUDINAL, SIX, Axes, loads_of
from aerosid.flight_model.terms import VARIABLES, Term, check_lift, parse_term
from aerosid.nomenclature import CHANNELS, is_surface

if TYPE_CHECKING:  # pydantic is imported when a file has been read that is TOML
    from aerosid.aircraft.schema import (
        AircraftFile,
        CandidatesTable,
        CompletedTable,
        DerivativesTable,
        EffectTable,
        FuelUsedTable,
        LimitsTable,
    )

_LARGEST_FILE = 1_000_000
"""Numerical: bytes; more is no aircraft file."""

_MISSPELT = 0.66
"""Display: likeness, 1, from which a name is told as another one misspelt: alfa, thetha, but not gear."""


def load_aircraft(path: str | Path) -> Aircraft:
    """The aircraft of a file, or of a bundled name such as `light_transport`.

    Raises
    ------
    AircraftError
        Where the file cannot be read or says something wrong: one sentence with file, key, found, expected, to do.
    """
    found = _find(path)
    try:
        with found.open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except IsADirectoryError:
        raise AircraftError(f"{path} is a folder, expected an aircraft file; name the .toml file in it") from None
    except OSError as error:
        raise AircraftError(f"{path} cannot be read ({error.strerror}); check its name and its permissions") from None
    if len(content) > _LARGEST_FILE:
        raise AircraftError(
            f"{path} is larger than {_LARGEST_FILE} bytes, more than any aircraft file; "
            "is it a log? give the aircraft file"
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise AircraftError(
            f"{path} is no text: byte {error.start} is no UTF-8, expected an aircraft file in TOML; "
            "give the aircraft file, or save it as UTF-8"
        ) from None
    return aircraft_from_text(text, str(path), hashlib.sha256(content).hexdigest())


def bundled_aircraft() -> dict[str, Path]:
    """Names and files of the aircraft that travel with aerosid; templates, which start with `_`, are left out."""
    files = sorted(bundled_folder("aircraft_models").glob("*.toml"))
    return {file.stem: file for file in files if not file.name.startswith("_")}


def aircraft_from_text(text: str, path: str, sha256: str) -> Aircraft:
    """The aircraft that the text of a file says; `path` names the file in sentences and in the result.

    Raises
    ------
    AircraftError
        Where the text is no TOML or breaks a rule of the aircraft file.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise AircraftError(f"{path} is no valid TOML: {str(error)[:200]!r}; correct the file there") from None
    except RecursionError:
        raise AircraftError(f"{path} nests brackets too deeply for an aircraft file; remove them") from None
    from aerosid.aircraft.quantities import with_si_numbers
    from aerosid.aircraft.schema import read_tables

    tables = read_tables(with_si_numbers(document, path), path)
    derivatives = _read_derivatives(path, tables.derivatives)
    coefficients = [name for name in COEFFICIENTS if getattr(tables.derivatives, name) is not None]
    axes = _axes(coefficients)
    _check_lateral(path, tables, axes, derivatives)
    return Aircraft(
        name=tables.aircraft.name,
        source=tables.aircraft.source,
        wing_area=tables.reference.wing_area,
        mean_chord=tables.reference.mean_chord,
        airspeed=tables.reference.airspeed,
        length=tables.reference.length,
        mass=tables.mass.mass,
        I_yy=tables.mass.I_yy,
        density=None if tables.air is None else tables.air.density,
        thrust=tables.thrust.force,
        thrust_incidence=tables.thrust.incidence,
        thrust_z_arm=tables.thrust.z_arm,
        derivatives=derivatives,
        candidates=_read_candidates(path, tables.candidates, derivatives, coefficients),
        effects=tuple(
            _read_effect(path, number, table, coefficients) for number, table in enumerate(tables.effects, 1)
        ),
        path=path,
        sha256=sha256,
        text=text,
        flight_phase=tables.flying_qualities.category,
        aircraft_class=tables.flying_qualities.aircraft_class,
        limits=_read_limits(path, tables.limits),
        fuel=_read_fuel(path, tables.fuel),
        configuration={name: text for name, text in tables.configuration.model_dump().items() if text},
        noise=dict(tables.noise),
        resolution=dict(tables.resolution),
        span=tables.reference.span,
        I_xx=tables.mass.I_xx,
        I_zz=tables.mass.I_zz,
        I_xz=tables.mass.I_xz,
        axes=axes,
        completion=None if tables.completed is None else _read_record(tables.completed),
    )


def _read_record(table: CompletedTable) -> CompletionRecord:
    """What made a completed file's numbers."""
    return CompletionRecord(
        program=table.by,
        date=table.date,
        verdict=table.verdict,
        declared_file=table.declared.file,
        declared_sha256=table.declared.sha256,
        declared_source=table.declared.source,
        logs=tuple(LogOfCompletion(log.name, log.role, log.sha256, log.start, log.stop) for log in table.logs),
        settings=dict(table.settings),
        not_shown=tuple(table.not_shown),
        bounds=table.bounds,
    )


def _axes(coefficients: Sequence[str]) -> Axes:
    """The case of the equations of motion that the declared coefficients make."""
    if not set(coefficients) & set(LATERAL.coefficients):
        return LONGITUDINAL
    return SIX if set(coefficients) & set(loads_of(LONGITUDINAL)) else LATERAL


def _check_lateral(path: str, tables: AircraftFile, axes: Axes, derivatives: Sequence[Derivative]) -> None:
    """Span and inertia are there where rolling and yawing motion needs them."""
    named = {name for derivative in derivatives for name in derivative.term.variables}
    if tables.reference.span is None and (named & {"p_hat", "r_hat"} or axes != LONGITUDINAL):
        raise AircraftError(
            f"{path}: the key reference.span [m] is missing, expected the whole span where a model has C_l or C_n, or "
            "a term names p_hat or r_hat; add it"
        )
    for name in ("I_xx", "I_zz"):
        if axes != LONGITUDINAL and getattr(tables.mass, name) is None:
            raise AircraftError(
                f"{path}: the key mass.{name} [kg m^2] is missing, expected it where a model has C_l or C_n; add it"
            )
    i_xx, i_zz, i_xz = (getattr(tables.mass, name) or 0.0 for name in ("I_xx", "I_zz", "I_xz"))
    if axes != LONGITUDINAL and i_xz**2 >= i_xx * i_zz:
        raise AircraftError(
            f"{path}: mass.I_xz is {i_xz:g}, expected I_xz^2 below I_xx I_zz, as of any body; correct it"
        )


def _read_limits(path: str, table: LimitsTable) -> Mapping[str, tuple[float, float]]:
    """The limits that are given; a rate counts both ways."""
    limits = {}
    for name in type(table).model_fields:
        given = getattr(table, name)
        if given is None:
            continue
        low, high = (-given, given) if isinstance(given, float) else given
        if not low < high:
            raise AircraftError(f"{path}: limits.{name} is [{low:g}, {high:g}], expected the lower number first")
        limits[name] = (low, high)
    return limits


def _read_fuel(path: str, table: FuelUsedTable | None) -> FuelTable | None:
    """The fuel table, its columns of one length and its fuel used increasing."""
    if table is None:
        return None
    if any(later <= earlier for earlier, later in pairwise(table.used)):
        raise AircraftError(f"{path}: fuel.used does not increase throughout, expected kg in rising order; sort it")
    for name in ("mass", "I_yy", "x_cg"):
        column = getattr(table, name)
        if column and len(column) != len(table.used):
            raise AircraftError(
                f"{path}: fuel.{name} holds {len(column)} numbers and fuel.used {len(table.used)}, expected one for "
                "each; complete it"
            )
    return FuelTable(tuple(table.used), tuple(table.mass), tuple(table.I_yy), tuple(table.x_cg))


def _find(path: str | Path) -> Path:
    """The file itself, or the bundled one where a bare name is given."""
    file = Path(path)
    text = str(path)
    if "\0" in text:
        raise AircraftError(f"{ascii(text)[:80]} is no file name; give the path of an aircraft file")
    is_name = file.suffix == "" and os.sep not in text and "/" not in text
    try:
        exists = file.exists()
    except OSError as error:
        raise AircraftError(f"{text[:80]} cannot be read ({error.strerror}); check the file name") from None
    if exists and not (is_name and file.is_dir()):
        return file
    bundled = bundled_aircraft()
    if is_name and text in bundled:
        return bundled[text]
    if is_name:
        raise AircraftError(
            f"aircraft {text[:80]} is neither a file nor one of the bundled "
            f"{', '.join(bundled)}; give the path of a .toml file"
        )
    raise AircraftError(
        f"{text} was not found; give the path of an aircraft file, or a bundled name ({', '.join(bundled)})"
    )


def _read_derivatives(path: str, tables: DerivativesTable) -> tuple[Derivative, ...]:
    """The declared derivatives, after the rules that concern several of them."""
    given = {name: table for name in COEFFICIENTS if (table := getattr(tables, name)) is not None}
    for body, wind in (("C_X", "C_D"), ("C_Z", "C_L")):
        if body in given and wind in given:
            raise AircraftError(
                f"{path}: derivatives holds both {body} and {wind}, expected one of them, since {wind} replaces "
                f"{body}; remove one"
            )
    symmetric = ("C_D", "C_L", "C_m") if "C_D" in given or "C_L" in given else LONGITUDINAL.coefficients
    axes = _axes(tuple(given))
    wanted = tuple(name for name in (*symmetric, *LATERAL.coefficients) if name in loads_of(axes))
    for name in wanted:
        if name not in given:
            pair = ", where C_L and C_D together replace C_Z and C_X" if wanted[0] == "C_D" else ""
            raise AircraftError(
                f"{path}: the table derivatives.{name} is missing, expected {', '.join(wanted)}{pair}; "
                f"add [derivatives.{name}], empty where nothing is known"
            )
    if wanted[0] == "C_D" and not given["C_D"] and not given["C_L"]:
        # an Aircraft knows by its derivatives which coefficients it is written in
        raise AircraftError(
            f"{path}: derivatives.C_L and derivatives.C_D are both empty, expected a term in one of them; "
            'add "1" = { value = 0.0 }'
        )
    derivatives = []
    for coefficient in wanted:
        entries = given[coefficient]
        texts = _distinct_terms(path, f"derivatives.{coefficient}", list(entries))
        _check_lift(path, f"derivatives.{coefficient}", coefficient, texts.values(), wanted)
        derivatives += [
            Derivative(
                coefficient, term, entries[text].value, entries[text].sigma, entries[text].fixed, entries[text].shown
            )
            for text, term in texts.items()
        ]
    return tuple(derivatives)


def _distinct_terms(path: str, key: str, texts: Sequence[str]) -> dict[str, Term]:
    """The terms by their text as given; two spellings of one term are refused."""
    terms: dict[str, Term] = {}
    spelling: dict[Term, str] = {}
    for text in texts:
        try:
            term = parse_term(text)
        except AircraftError as error:
            raise AircraftError(f"{path}: {key}: {error}") from None
        _refuse_misspelt(path, key, text, term)
        if term in spelling:
            raise AircraftError(
                f'{path}: {key} holds the term {term} twice, as "{spelling[term]}" and "{text}", expected it once; '
                "remove one of them"
            )
        terms[text] = term
        spelling[term] = text
    return terms


def _check_lift(path: str, key: str, coefficient: str, terms: Iterable[Term], coefficients: Sequence[str]) -> None:
    """Refuse terms in a lift that the file does not declare, or that lift would depend on."""
    for term in terms:
        try:
            check_lift(coefficient, term, coefficients)
        except AircraftError as error:
            raise AircraftError(f"{path}: {key}: {error}") from None


def _refuse_misspelt(path: str, key: str, text: str, term: Term) -> None:
    """Refuse a term that names no channel known here and all but one that is: it would only be missed in the log.

    Raises
    ------
    AircraftError
        With the known name that is nearest.
    """
    known = {*VARIABLES, *CHANNELS, "C_T"}
    plain = {name.replace("_", "").lower(): name for name in known}
    for name in sorted(term.variables - known):
        bare = name.replace("_", "").lower()
        # A second vane is alpha2, a tab delta_e_tab: channels of their own.
        close = difflib.get_close_matches(bare, list(plain), 1, _MISSPELT) if name.isalpha() else [bare]
        near = plain.get(close[0]) if close else None
        if near is not None:
            raise AircraftError(
                f'{path}: {key} holds the term "{text}", which names {name}; expected a channel or a variable of '
                f"terms; did you mean {near}?"
            )


def _read_candidates(
    path: str, table: CandidatesTable, derivatives: Sequence[Derivative], coefficients: Sequence[str]
) -> Mapping[str, tuple[Term, ...]]:
    """The candidates that are not declared already (in a completed model the found ones are)."""
    declared = {(entry.coefficient, entry.term) for entry in derivatives}
    candidates: dict[str, tuple[Term, ...]] = {}
    for coefficient in COEFFICIENTS:
        texts: list[str] = getattr(table, coefficient)
        if texts and coefficient not in coefficients:
            raise AircraftError(
                f"{path}: candidates.{coefficient} does not fit this model, whose coefficients are "
                f"{', '.join(coefficients)}; state the candidates for one of these"
            )
        terms = _distinct_terms(path, f"candidates.{coefficient}", texts).values()
        _check_lift(path, f"candidates.{coefficient}", coefficient, terms, coefficients)
        kept = tuple(term for term in terms if (coefficient, term) not in declared)
        if kept:
            candidates[coefficient] = kept
    return candidates


def _read_effect(path: str, number: int, table: EffectTable, coefficients: Sequence[str]) -> DeclaredEffect:
    """One declared effect; `number` counts from 1 as a reader of the file does."""
    from aerosid.aircraft.schema import meant, shown

    key = f"{path}: effects[{number}]"
    if table.kind == "aero_term":
        raise AircraftError(f"{key}.kind is aero_term, which is a term; write it as an entry of [derivatives.C_...]")
    if table.kind not in KINDS:
        raise AircraftError(
            f"{key}.kind is {shown(table.kind)}, "
            f"expected one of {', '.join(KINDS)}{meant(table.kind, KINDS) or '; correct it'}"
        )
    kind = KINDS[table.kind]
    inputs = [name for name in CHANNELS if is_surface(name)]
    expected = {
        "input": f"an input channel such as {', '.join(inputs)}",
        "channel": "the name of a measured channel such as alpha",
        "coefficient": f"one of {', '.join(coefficients)}",
        "axis": "x (forward), y (right) or z (down)",
        "inertia": f"one of {', '.join(INERTIA)}",
        "nothing": "an empty text",
    }[kind.place]
    output = table.where in CHANNELS and CHANNELS[table.where].kind == "output"
    fits = {
        "input": table.where.isidentifier() and not output,
        "channel": table.where.isidentifier(),
        "coefficient": table.where in coefficients,
        "axis": table.where in ("x", "y", "z"),
        "inertia": table.where in INERTIA,
        "nothing": table.where == "",
    }[kind.place]
    if not fits:
        raise AircraftError(f"{key}.where is {shown(table.where)}, expected {expected} for {table.kind}; correct it")
    if table.value is None and not table.parameters and kind.place != "nothing":
        raise AircraftError(
            f"{key} has neither value nor parameters, expected a number for {table.kind}; add value = ..."
        )
    if table.value is not None and table.value < 0.0 and not kind.negative:
        raise AircraftError(f"{key}.value is {table.value:g}, expected no negative number for {table.kind}; correct it")
    try:
        term = str(parse_term(table.term)) if table.term else ""
    except AircraftError as error:
        raise AircraftError(f"{key}.term: {error}") from None
    parameters = {name: parameter.value for name, parameter in table.parameters.items()}
    return DeclaredEffect(
        table.kind, table.where, table.value, term, table.time, parameters, table.std_error, table.log
    )
