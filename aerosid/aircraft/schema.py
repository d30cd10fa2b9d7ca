"""Schema of the aircraft file, and sentences for a file that breaks it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from aerosid.errors import AircraftError

UNITS = {
    "reference.wing_area": "m^2",
    "reference.mean_chord": "m",
    "reference.span": "m",
    "reference.airspeed": "m/s",
    "reference.length": "m",
    "mass.mass": "kg",
    "mass.I_xx": "kg m^2",
    "mass.I_yy": "kg m^2",
    "mass.I_zz": "kg m^2",
    "mass.I_xz": "kg m^2",
    "air.density": "kg/m^3",
    "thrust.force": "N",
    "thrust.incidence": "rad",
    "thrust.z_arm": "m",
    "fuel.used": "kg",
    "fuel.mass": "kg",
    "fuel.I_yy": "kg m^2",
    "fuel.x_cg": "m",
    "limits.alpha": "rad",
    "limits.V": "m/s",
    "limits.theta": "rad",
    "limits.beta": "rad",
    "limits.phi": "rad",
    "limits.delta_e": "rad",
    "limits.delta_a": "rad",
    "limits.delta_r": "rad",
    "limits.delta_e_rate": "rad/s",
    "limits.delta_a_rate": "rad/s",
    "limits.delta_r_rate": "rad/s",
}
"""SI unit of each key that has one."""

# Far outside of anything that flies, near enough to keep every product of two of them finite.
_Positive = Annotated[float, Field(ge=1e-6, le=1e12)]
_Number = Annotated[float, Field(ge=-1e12, le=1e12)]
_Sigma = Annotated[float, Field(ge=1e-12, le=1e12)]
_Angle = Annotated[float, Field(ge=-1.5, le=1.5)]
_Name = Annotated[str, Field(min_length=1, max_length=200)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


_Small = Annotated[float, Field(gt=0.0, le=1e12)]


class _AircraftTable(_Table):
    name: _Name
    source: Annotated[str, Field(max_length=5000)] = ""


class _ReferenceTable(_Table):
    wing_area: _Positive
    mean_chord: _Positive
    span: _Positive | None = None
    airspeed: _Positive | None = None
    length: _Positive | None = None


class _MassTable(_Table):
    mass: _Positive
    I_xx: _Positive | None = None
    I_yy: _Positive
    I_zz: _Positive | None = None
    I_xz: _Number | None = None


class _AirTable(_Table):
    density: _Positive


class _ThrustTable(_Table):
    force: _Number | None = None
    incidence: _Angle = 0.0
    z_arm: _Number = 0.0


class _FlyingQualitiesTable(_Table):
    category: Literal["A", "B", "C"] | None = None
    aircraft_class: Annotated[Literal["I", "II", "II-C", "III", "IV"] | None, Field(alias="class")] = None


_Range = Annotated[list[_Number], Field(min_length=2, max_length=2)]


class LimitsTable(_Table):
    """[limits]: of a flight to come; ranges from low to high."""

    alpha: _Range | None = None
    n_z: _Range | None = None
    V: _Range | None = None
    theta: _Range | None = None
    beta: _Range | None = None
    phi: _Range | None = None
    delta_e: _Range | None = None
    delta_a: _Range | None = None
    delta_r: _Range | None = None
    delta_e_rate: _Positive | None = None
    delta_a_rate: _Positive | None = None
    delta_r_rate: _Positive | None = None


class ConfigurationTable(_Table):
    """[configuration]: what the report's title block says of the aircraft as flown; nothing is computed from it."""

    centre_of_gravity: Annotated[str, Field(max_length=200)] = ""
    flaps: Annotated[str, Field(max_length=200)] = ""
    gear: Annotated[str, Field(max_length=200)] = ""


class FuelUsedTable(_Table):
    """[fuel]: columns of equal length by fuel used."""

    used: Annotated[list[Annotated[float, Field(ge=0.0, le=1e12)]], Field(min_length=2, max_length=1000)]
    mass: list[_Positive] = []
    I_yy: list[_Positive] = []
    x_cg: list[Annotated[float, Field(ge=-100.0, le=100.0)]] = []


class _DerivativeTable(_Table):
    value: _Number
    sigma: _Sigma | None = None
    fixed: bool = False
    shown: bool = True


class DerivativesTable(_Table):
    """[derivatives]: entries by coefficient and term text."""

    C_X: dict[str, _DerivativeTable] | None = None
    C_Z: dict[str, _DerivativeTable] | None = None
    C_m: dict[str, _DerivativeTable] | None = None
    C_L: dict[str, _DerivativeTable] | None = None
    C_D: dict[str, _DerivativeTable] | None = None
    C_Y: dict[str, _DerivativeTable] | None = None
    C_l: dict[str, _DerivativeTable] | None = None
    C_n: dict[str, _DerivativeTable] | None = None


class CandidatesTable(_Table):
    """[candidates]: term texts by coefficient."""

    C_X: list[str] = []
    C_Z: list[str] = []
    C_m: list[str] = []
    C_L: list[str] = []
    C_D: list[str] = []
    C_Y: list[str] = []
    C_l: list[str] = []
    C_n: list[str] = []


class _ParameterTable(_Table):
    value: _Number
    std_error: Annotated[float, Field(ge=0.0, le=1e12)] | None = None
    unit: str = "1"


class EffectTable(_Table):
    """One [[effects]]."""

    kind: _Name
    where: str = ""
    value: _Number | None = None
    std_error: Annotated[float, Field(ge=0.0, le=1e12)] | None = None
    unit: str | None = None
    term: str = ""
    time: _Number | None = None
    log: str = ""
    parameters: dict[str, _ParameterTable] = {}


class _CompletedLogTable(_Table):
    name: str
    role: str
    sha256: str = ""
    start: Annotated[_Number, Field(alias="from")]
    stop: Annotated[_Number, Field(alias="to")]


class _DeclaredTable(_Table):
    file: str = ""
    sha256: str = ""
    source: str = ""


class CompletedTable(_Table):
    """[completed]: what made the numbers of a file that close-loop wrote."""

    by: _Name
    date: str = ""
    verdict: str = ""
    bounds: str = ""
    not_shown: list[str] = []
    settings: dict[str, str] = {}
    declared: _DeclaredTable = _DeclaredTable()
    logs: list[_CompletedLogTable] = []


class AircraftFile(_Table):
    """The whole file."""

    schema_: Annotated[int, Field(alias="schema", ge=1, le=1)]
    aircraft: _AircraftTable
    reference: _ReferenceTable
    mass: _MassTable
    air: _AirTable | None = None
    thrust: _ThrustTable = _ThrustTable()
    flying_qualities: _FlyingQualitiesTable = _FlyingQualitiesTable()
    limits: LimitsTable = LimitsTable()
    derivatives: DerivativesTable
    effects: list[EffectTable] = []
    candidates: CandidatesTable = CandidatesTable()
    completed: CompletedTable | None = None
    configuration: ConfigurationTable = ConfigurationTable()
    fuel: FuelUsedTable | None = None
    noise: dict[_Name, _Small] = {}
    resolution: dict[_Name, _Small] = {}


def read_tables(document: Mapping[str, Any], path: str) -> AircraftFile:
    """The tables of a parsed aircraft file; `path` names the file in sentences.

    Raises
    ------
    AircraftError
        Where a key is unknown, missing, of the wrong type or out of range.
    """
    try:
        return AircraftFile.model_validate(document)
    except ValidationError as error:
        raise AircraftError(_sentence(path, error)) from None


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
            f"the key {key} is unknown, expected {', '.join(known)}{meant(str(location[-1]), known) or '; remove it'}"
        )
    elif kind == "missing":
        whole = "table" if len(location) == 1 and location[0] != "schema" else "key"
        unit = f" [{UNITS[key]}]" if key in UNITS else ""
        said = f"the {whole} {key}{unit} is missing; add it (aircraft_models/_template.toml shows how)"
    else:
        said = f"{key} is {shown(detail['input'])}, expected {_expected(key, kind, detail.get('ctx', {}))}"
    more = (
        f" ({len(details) - 1} more of this kind follow)"
        if len(details) > 1 and kind not in ("missing", "extra_forbidden")
        else ""
    )
    return f"{path}: {said}{more}"


_BOUNDS = {
    "greater_than_equal": "of at least",
    "less_than_equal": "of at most",
    "greater_than": "greater than",
    "less_than": "less than",
}


def _expected(key: str, kind: str, context: Mapping[str, Any]) -> str:
    """What should have stood there, and what to do."""
    unit = f" in {UNITS[key]}" if key in UNITS else ""
    if key == "schema":
        return "1, the only version that this aerosid reads; write schema = 1"
    if kind == "finite_number":
        return f"a finite number{unit}; correct it"
    if kind in _BOUNDS:
        limit = next(iter(context.values()))
        if kind == "greater_than_equal" and 0.0 < limit <= 1e-6:
            return f"a positive number{unit} (at least {limit:g}); correct it"
        return f"a number{unit} {_BOUNDS[kind]} {limit:g}; correct it"
    if kind.startswith("float"):
        return f"a number{unit}; write it without quotes or brackets"
    if kind == "literal_error":
        return f"one of {context['expected']}; correct it"
    if kind.startswith("bool"):
        return "true or false"
    if kind.startswith("string"):
        return "a text of sensible length in quotes"
    if kind.startswith("list") or kind in ("too_short", "too_long"):
        if key.startswith("limits."):
            return f"a range [low, high]{unit}; write both numbers"
        if "min_length" in context:
            return f"a list of at least {context['min_length']} entries, not {context['actual_length']}"
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
        "flying_qualities": _FlyingQualitiesTable,
        "limits": LimitsTable,
        "configuration": ConfigurationTable,
        "fuel": FuelUsedTable,
        "derivatives": DerivativesTable,
        "candidates": CandidatesTable,
        "effects": EffectTable,
        "completed": CompletedTable,
    }
    if not location:
        return [field.alias or name for name, field in AircraftFile.model_fields.items()]
    table = tables[str(location[0])]
    if location[0] == "derivatives" and len(location) > 1:
        table = _DerivativeTable
    if location[0] == "completed" and len(location) > 1:
        table = _CompletedLogTable if location[1] == "logs" else _DeclaredTable
    if location[0] == "effects" and len(location) > 2:
        table = _ParameterTable
    return [field.alias or name for name, field in table.model_fields.items()]


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


def shown(found: object) -> str:
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


def meant(name: str, known: Iterable[str]) -> str:
    """`; did you mean NAME?` where a known name is close; nearest is one that differs in capitals alone."""
    known = list(known)
    close = [each for each in known if each.lower() == name.lower()] or difflib.get_close_matches(name, known, 1)
    return f"; did you mean {close[0]}?" if close else ""
