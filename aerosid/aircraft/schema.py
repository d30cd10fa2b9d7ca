"""From the text of an aircraft file to an `Aircraft`, or to one sentence about what is wrong in it."""

from __future__ import annotations

import difflib
import hashlib
import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from aerosid.aircraft.model import Aircraft, DeclaredEffect, Derivative
from aerosid.bundled import bundled_folder
from aerosid.errors import AircraftError
from aerosid.nomenclature import CHANNELS
from aerosid.terms import COEFFICIENTS, Term, parse_term

EFFECT_KINDS = {
    "control_lag": "input",
    "control_delay": "input",
    "control_rate_limit": "input",
    "control_deadband": "input",
    "sensor_bias": "channel",
    "sensor_scale": "channel",
    "sensor_delay": "channel",
    "sensor_lag": "channel",
    "step_change": "coefficient",
    "gust": "nothing",
    "flow_separation": "coefficient",
    "ground_effect": "coefficient",
}
"""Kinds of effect that are no term, and what stands in their `where`."""

_NOT_NEGATIVE = {"control_lag", "control_delay", "control_rate_limit", "control_deadband", "sensor_scale", "sensor_lag"}
_LARGEST_FILE = 1_000_000
_UNITS = {
    "reference.wing_area": "m^2",
    "reference.mean_chord": "m",
    "reference.airspeed": "m/s",
    "mass.mass": "kg",
    "mass.I_yy": "kg m^2",
    "air.density": "kg/m^3",
    "thrust.force": "N",
    "thrust.incidence": "rad",
    "thrust.z_arm": "m",
}

# Far outside of anything that flies, near enough to keep every product of two of them finite.
_Positive = Annotated[float, Field(ge=1e-6, le=1e12)]
_Number = Annotated[float, Field(ge=-1e12, le=1e12)]
_Sigma = Annotated[float, Field(ge=1e-12, le=1e12)]
_Angle = Annotated[float, Field(ge=-1.5, le=1.5)]
_Name = Annotated[str, Field(min_length=1, max_length=200)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _AircraftTable(_Table):
    name: _Name
    source: Annotated[str, Field(max_length=5000)] = ""


class _ReferenceTable(_Table):
    wing_area: _Positive
    mean_chord: _Positive
    airspeed: _Positive | None = None


class _MassTable(_Table):
    mass: _Positive
    I_yy: _Positive


class _AirTable(_Table):
    density: _Positive


class _ThrustTable(_Table):
    force: _Number | None = None
    incidence: _Angle = 0.0
    z_arm: _Number = 0.0


class _DerivativeTable(_Table):
    value: _Number
    sigma: _Sigma | None = None
    fixed: bool = False


class _DerivativesTable(_Table):
    C_X: dict[str, _DerivativeTable] | None = None
    C_Z: dict[str, _DerivativeTable] | None = None
    C_m: dict[str, _DerivativeTable] | None = None
    C_L: dict[str, _DerivativeTable] | None = None
    C_D: dict[str, _DerivativeTable] | None = None


class _CandidatesTable(_Table):
    C_X: list[str] = []
    C_Z: list[str] = []
    C_m: list[str] = []
    C_L: list[str] = []
    C_D: list[str] = []


class _ParameterTable(_Table):
    value: _Number
    std_error: Annotated[float, Field(ge=0.0, le=1e12)] | None = None
    unit: str = "1"


class _EffectTable(_Table):
    kind: _Name
    where: str = ""
    value: _Number | None = None
    std_error: Annotated[float, Field(ge=0.0, le=1e12)] | None = None
    unit: str | None = None
    term: str = ""
    time: _Number | None = None
    parameters: dict[str, _ParameterTable] = {}


class _AircraftFile(_Table):
    schema_: Annotated[Literal[1], Field(alias="schema")]
    aircraft: _AircraftTable
    reference: _ReferenceTable
    mass: _MassTable
    air: _AirTable | None = None
    thrust: _ThrustTable = _ThrustTable()
    derivatives: _DerivativesTable
    effects: list[_EffectTable] = []
    candidates: _CandidatesTable = _CandidatesTable()


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
    try:
        tables = _AircraftFile.model_validate(document)
    except ValidationError as error:
        raise AircraftError(_sentence(path, error)) from None
    derivatives = _read_derivatives(path, tables.derivatives)
    coefficients = [name for name in COEFFICIENTS if getattr(tables.derivatives, name) is not None]
    return Aircraft(
        name=tables.aircraft.name,
        source=tables.aircraft.source,
        wing_area=tables.reference.wing_area,
        mean_chord=tables.reference.mean_chord,
        airspeed=tables.reference.airspeed,
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
    )


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


def _read_derivatives(path: str, tables: _DerivativesTable) -> tuple[Derivative, ...]:
    """The declared derivatives, after the rules that concern several of them."""
    given = {name: table for name in COEFFICIENTS if (table := getattr(tables, name)) is not None}
    for body, wind in (("C_X", "C_D"), ("C_Z", "C_L")):
        if body in given and wind in given:
            raise AircraftError(
                f"{path}: derivatives holds both {body} and {wind}, expected one of them, since {wind} stands in place "
                f"of {body}; remove one"
            )
    wanted = ("C_D", "C_L", "C_m") if "C_D" in given or "C_L" in given else ("C_X", "C_Z", "C_m")
    for name in wanted:
        if name not in given:
            pair = ", C_L and C_D standing together in place of C_Z and C_X" if wanted[0] == "C_D" else ""
            raise AircraftError(
                f"{path}: the table derivatives.{name} is missing, expected {', '.join(wanted)}{pair}; "
                f"add [derivatives.{name}], empty where nothing is known"
            )
    derivatives = []
    for coefficient, entries in given.items():
        texts = _distinct_terms(path, f"derivatives.{coefficient}", list(entries))
        derivatives += [
            Derivative(coefficient, term, entries[text].value, entries[text].sigma, entries[text].fixed)
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
        if term in spelling:
            raise AircraftError(
                f'{path}: {key} holds the term {term} twice, as "{spelling[term]}" and "{text}", expected it once; '
                "remove one of them"
            )
        terms[text] = term
        spelling[term] = text
    return terms


def _read_candidates(
    path: str, table: _CandidatesTable, derivatives: Sequence[Derivative], coefficients: Sequence[str]
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
        kept = tuple(term for term in terms if (coefficient, term) not in declared)
        if kept:
            candidates[coefficient] = kept
    return candidates


def _read_effect(path: str, number: int, table: _EffectTable, coefficients: Sequence[str]) -> DeclaredEffect:
    """One declared effect; `number` counts from 1 as a reader of the file does."""
    key = f"{path}: effects[{number}]"
    if table.kind == "aero_term":
        raise AircraftError(f"{key}.kind is aero_term, which is a term; write it as an entry of [derivatives.C_...]")
    if table.kind not in EFFECT_KINDS:
        raise AircraftError(
            f"{key}.kind is {_shown(table.kind)}, "
            f"expected one of {', '.join(EFFECT_KINDS)}{_meant(table.kind, EFFECT_KINDS) or '; correct it'}"
        )
    place = EFFECT_KINDS[table.kind]
    inputs = [name for name in CHANNELS if name.startswith("delta_")]
    expected = {
        "input": f"an input channel such as {', '.join(inputs)}",
        "channel": "the name of a measured channel such as alpha",
        "coefficient": f"one of {', '.join(coefficients)}",
        "nothing": "an empty text",
    }[place]
    output = table.where in CHANNELS and CHANNELS[table.where].kind == "output"
    fits = {
        "input": table.where.isidentifier() and not output,
        "channel": table.where.isidentifier(),
        "coefficient": table.where in coefficients,
        "nothing": table.where == "",
    }[place]
    if not fits:
        raise AircraftError(f"{key}.where is {_shown(table.where)}, expected {expected} for {table.kind}; correct it")
    if table.value is None and not table.parameters and table.kind != "gust":
        raise AircraftError(
            f"{key} has neither value nor parameters, expected a number for {table.kind}; add value = ..."
        )
    if table.value is not None and table.value < 0.0 and table.kind in _NOT_NEGATIVE:
        raise AircraftError(f"{key}.value is {table.value:g}, expected no negative number for {table.kind}; correct it")
    try:
        term = str(parse_term(table.term)) if table.term else ""
    except AircraftError as error:
        raise AircraftError(f"{key}.term: {error}") from None
    parameters = {name: parameter.value for name, parameter in table.parameters.items()}
    return DeclaredEffect(table.kind, table.where, table.value, term, table.time, parameters, table.std_error)


def _sentence(path: str, error: ValidationError) -> str:
    """The most telling of the schema's complaints as one sentence."""
    # An unknown key first: where a key is misspelt, that it is missing is only the consequence.
    details = sorted(error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden")
    detail = details[0]
    location = [part for part in detail["loc"] if not (isinstance(part, str) and part.startswith("function"))]
    key = _dotted(location)
    kind = detail["type"]
    if kind == "extra_forbidden":
        known = _known_keys(location[:-1])
        said = (
            f"the key {key} is unknown, expected {', '.join(known)}{_meant(str(location[-1]), known) or '; remove it'}"
        )
    elif kind == "missing":
        whole = "table" if len(location) == 1 and location[0] != "schema" else "key"
        unit = f" [{_UNITS[key]}]" if key in _UNITS else ""
        said = f"the {whole} {key}{unit} is missing; add it (aircraft_models/_template.toml shows how)"
    else:
        said = f"{key} is {_shown(detail['input'])}, expected {_expected(key, kind, detail.get('ctx', {}))}"
    more = (
        f" ({len(details) - 1} more of this kind follow)"
        if len(details) > 1 and kind not in ("missing", "extra_forbidden")
        else ""
    )
    return f"{path}: {said}{more}"


def _expected(key: str, kind: str, context: Mapping[str, Any]) -> str:
    """What should have stood there, and what to do."""
    unit = f" in {_UNITS[key]}" if key in _UNITS else ""
    if key == "schema":
        return "1, the only version that this aerosid reads; write schema = 1"
    if kind == "finite_number":
        return f"a finite number{unit}; correct it"
    if kind in ("greater_than_equal", "less_than_equal"):
        limit = next(iter(context.values()))
        if kind == "greater_than_equal" and 0.0 < limit <= 1e-6:
            return f"a positive number{unit} (at least {limit:g}); correct it"
        return f"a number{unit} {'of at least' if kind == 'greater_than_equal' else 'of at most'} {limit:g}; correct it"
    if kind.startswith("float"):
        return f"a number{unit}; write it without quotes or brackets"
    if kind.startswith("bool"):
        return "true or false"
    if kind.startswith("string"):
        return "a text of sensible length in quotes"
    if kind.startswith("list"):
        return "a list in square brackets" if not key.startswith("effects") else "[[effects]] with double brackets"
    if key.startswith("derivatives.") and key.count(".") >= 2:
        return "a table such as { value = -0.72, sigma = 0.05 }"
    return "a table; write its keys below a [header]"


def _known_keys(location: Sequence[int | str]) -> list[str]:
    """Names that the table at a location may hold."""
    tables: dict[str, type[_Table]] = {
        "aircraft": _AircraftTable,
        "reference": _ReferenceTable,
        "mass": _MassTable,
        "air": _AirTable,
        "thrust": _ThrustTable,
        "derivatives": _DerivativesTable,
        "candidates": _CandidatesTable,
        "effects": _EffectTable,
    }
    if not location:
        return [field.alias or name for name, field in _AircraftFile.model_fields.items()]
    table = tables[str(location[0])]
    if location[0] == "derivatives" and len(location) > 1:
        table = _DerivativeTable
    if location[0] == "effects" and len(location) > 2:
        table = _ParameterTable
    return list(table.model_fields)


def _dotted(location: Sequence[int | str]) -> str:
    """`derivatives.C_m."alpha^2".value`, list positions from 1."""
    text = ""
    for part in location:
        if isinstance(part, int):
            text += f"[{part + 1}]"
        else:
            plain = part.isascii() and part.replace("_", "").replace("-", "").isalnum() and not part.isdigit()
            text += ("." if text else "") + (part[:40] if plain else f'"{ascii(part[:40])[1:-1]}"')
    return text


def _shown(found: object) -> str:
    """What was found, short enough for a sentence."""
    if isinstance(found, Mapping):
        return "a table"
    if isinstance(found, list):
        return "a list"
    if isinstance(found, bool):
        return "true" if found else "false"
    if isinstance(found, str):
        return f"the text '{ascii(found[:40])[1:-1]}'"
    return str(found)[:40] if not isinstance(found, int) or abs(found) < 10**40 else "a number of more than 40 digits"


def _meant(name: str, known: Sequence[str] | Mapping[str, str]) -> str:
    close = difflib.get_close_matches(name, list(known), 1)
    return f"; did you mean {close[0]}?" if close else ""
