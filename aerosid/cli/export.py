"""Command `export`: the aerodynamic model for other programs."""

from __future__ import annotations

import datetime as dt
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aerosid.cli.options import out_file
from aerosid.cli.output import headed, mode, tell
from aerosid.cli.quantity_option import in_unit
from aerosid.errors import UsageError

if TYPE_CHECKING:
    from aerosid.aircraft import Aircraft

_FORMATS = "jsbsim, json, csv, latex or davem"


def export_command(
    aircraft: Annotated[
        str, typer.Argument(metavar="AIRCRAFT", help="Aircraft file, or a bundled name.", show_default=False)
    ],
    format_name: Annotated[str, typer.Option("--format", metavar="FORMAT", help=f"{_FORMATS}.", show_default=False)],
    out: Annotated[Path | None, out_file("Output file; default the terminal.")] = None,
    into: Annotated[
        Path | None,
        typer.Option(
            "--into",
            metavar="XML",
            help="jsbsim: the aircraft whose aerodynamics the model replaces, in the model's axes.",
            show_default=False,
        ),
    ] = None,
    aerorp: Annotated[
        str | None,
        typer.Option(
            "--aerorp",
            metavar="X,Z",
            help="jsbsim: AERORP from the centre of gravity, m, x forward, z down; by default at it.",
            show_default=False,
        ),
    ] = None,
    alpha_range: Annotated[
        str | None,
        typer.Option(
            "--alpha-range",
            metavar="LOW,HIGH",
            help="jsbsim, davem: tested range of alpha, deg; terms are held constant beyond its ends.",
            show_default=False,
        ),
    ] = None,
    airspeed: Annotated[
        float | None,
        typer.Option(
            "--airspeed",
            parser=in_unit("m/s"),
            metavar="M/S",
            help="jsbsim, davem: U0 of V_hat where the aircraft file gives none.",
            show_default=False,
        ),
    ] = None,
    folded_thrust: Annotated[
        float | None,
        typer.Option(
            "--folded-thrust",
            metavar="C_T",
            help="jsbsim: thrust/(q_bar S) included in C_X, subtracted for an aircraft with engines.",
            show_default=False,
        ),
    ] = None,
    properties: Annotated[
        list[str] | None,
        typer.Option(
            "--property",
            metavar="CHANNEL=NAME[,FACTOR]",
            help="jsbsim: the property of a channel and the factor from its unit to SI; repeatable.",
            show_default=False,
        ),
    ] = None,
    date: Annotated[
        str | None,
        typer.Option(
            "--date",
            metavar="YYYY-MM-DD",
            help="davem: date of creation; by default that of the aircraft file.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Writes the model of an aircraft file for JSBSim, as JSON, CSV, LaTeX or DAVE-ML 2.0."""
    from aerosid.aircraft import load_aircraft
    from aerosid.file_set import require_apart, text, write_files
    from aerosid.reporting.export import ExportOptions, export

    if out is not None:
        require_apart([out], [aircraft, into])
    loaded = load_aircraft(aircraft)
    options = ExportOptions(
        into=into,
        aero_reference=_pair("--aerorp", aerorp, "m", "0.5,0.3"),
        alpha_range=_in_radians(_pair("--alpha-range", alpha_range, "deg", "-2,12")),
        airspeed=_airspeed(airspeed),
        folded_thrust=folded_thrust,
        properties=dict(_property(words) for words in properties or ()),
        date=_date(loaded, date),
    )
    exported = export(loaded, format_name, options)
    if mode().json:
        names = [] if out is None else [str(out)]
        kept = {"format": format_name, "files": names, "notes": list(exported.notes)}
        tell(lambda: headed("export", kept if out else {**kept, "text": exported.text}))
    elif out is None:
        sys.stdout.write(exported.text)
    if out is not None:
        write_files(out.parent, {out.name: text(exported.text)})
    for note in exported.notes:
        sys.stderr.write(f"aerosid: {note}\n")


def _pair(option: str, words: str | None, unit: str, example: str) -> tuple[float, float] | None:
    """Two numbers, each in the unit of the option or with its own unit."""
    from aerosid.logs.formats.quantity import read_quantity
    from aerosid.logs.formats.units import UnitProblem

    if words is None:
        return None
    try:
        numbers = [read_quantity(word, unit) for word in words.split(",")]
    except UnitProblem:
        numbers = []
    if len(numbers) != 2 or max(map(abs, numbers)) >= 1e12:
        raise UsageError(
            f"{option} is {words!r}, expected two numbers in {unit}, or with units, with a comma between; write "
            f"{option} {example}"
        )
    return numbers[0], numbers[1]


def _number(word: str) -> float | None:
    try:
        number = float(word)
    except ValueError:
        return None
    return number if abs(number) < 1e12 else None


def _in_radians(pair: tuple[float, float] | None) -> tuple[float, float] | None:
    if pair is None:
        return None
    return math.radians(pair[0]), math.radians(pair[1])


def _airspeed(airspeed: float | None) -> float | None:
    if airspeed is not None and not 0.0 < airspeed < 1e6:
        raise UsageError(f"--airspeed is {airspeed:g}, expected a positive number in m/s; correct it.")
    return airspeed


def _property(words: str) -> tuple[str, tuple[str, float]]:
    channel, _, rest = words.partition("=")
    name, _, factor = rest.partition(",")
    scale = _number(factor) if factor else 1.0
    if not channel.isidentifier() or not name.strip() or scale is None:
        raise UsageError(
            f"--property is {words!r}, expected CHANNEL=NAME or CHANNEL=NAME,FACTOR; write "
            "--property delta_f=fcs/flap-pos-deg,0.0174533"
        )
    return channel, (name.strip(), scale)


def _date(aircraft: Aircraft, words: str | None) -> str:
    """The date given, else that of the model, else that of the file: the same file gives the same bytes."""
    from aerosid.aircraft import bundled_aircraft

    if words is not None:
        try:
            return dt.date.fromisoformat(words).isoformat()
        except ValueError:
            raise UsageError(f"--date is {words!r}, expected a day as YYYY-MM-DD; correct it.") from None
    if aircraft.completion is not None and aircraft.completion.date:
        return aircraft.completion.date
    file = Path(aircraft.path)
    file = file if file.is_file() else bundled_aircraft().get(aircraft.path, file)
    return dt.datetime.fromtimestamp(file.stat().st_mtime, dt.UTC).date().isoformat()
