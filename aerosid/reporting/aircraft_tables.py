"""Tables of an aircraft file as interpreted, and of the bundled aircraft, for the terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table

from aerosid.aircraft import Aircraft, warnings_about
from aerosid.notation import plain


def print_aircraft(aircraft: Aircraft, console: Console) -> None:
    """Print reference values, the declared model, candidates, effects and warnings of one aircraft."""
    console.print(f"{aircraft.path}: {aircraft.name}")
    if aircraft.source:
        console.print(f"  source: {' '.join(aircraft.source.split())}")
    for words, value, unit in _reference(aircraft):
        console.print(f"  {words}: {value} {unit}".rstrip())
    table = Table(title="Declared model: coefficient = sum of value * term")
    for heading in ("coefficient", "term"):
        table.add_column(heading)
    for heading in ("value", "sigma"):
        table.add_column(heading, justify="right")
    table.add_column("estimated")
    for entry in aircraft.derivatives:
        sigma = "" if entry.sigma is None else plain(entry.sigma, 4)
        estimated = "no, fixed" if entry.fixed else "yes"
        table.add_row(entry.coefficient, str(entry.term), plain(entry.value), sigma, estimated)
    console.print(table)
    for effect in aircraft.effects:
        numbers = [] if effect.value is None else [plain(effect.value)]
        numbers += [f"{name} = {plain(number)}" for name, number in effect.parameters.items()]
        place = f" {effect.where}" if effect.where else ""
        console.print(f"  declared effect: {effect.kind.replace('_', ' ')}{place} {', '.join(numbers)}".rstrip())
    for coefficient, terms in aircraft.candidates.items():
        console.print(f"  candidates for {coefficient}: {', '.join(str(term) for term in terms)}")
    warnings = warnings_about(aircraft)
    for warning in warnings:
        console.print(f"  check: {warning}")
    if not warnings:
        console.print("  nothing unusual")


def print_aircraft_list(craft: Iterable[Aircraft], console: Console) -> None:
    """Print one row for each aircraft, by the name that --aircraft takes."""
    table = Table(title="Bundled aircraft")
    for heading in ("--aircraft", "name", "coefficients"):
        table.add_column(heading)
    for heading in ("mass, kg", "wing area, m^2", "mean chord, m"):
        table.add_column(heading, justify="right")
    for aircraft in craft:
        coefficients = " ".join(aircraft.coefficients)
        sizes = (plain(size) for size in (aircraft.mass, aircraft.wing_area, aircraft.mean_chord))
        table.add_row(aircraft.path, aircraft.name, coefficients, *sizes)
    console.print(table)


def _reference(aircraft: Aircraft) -> list[tuple[str, str, str]]:
    """Reference values with their units, and the substitutes for those not given."""

    def given(value: float | None, otherwise: str) -> str:
        return otherwise if value is None else plain(value)

    return [
        ("wing area", plain(aircraft.wing_area), "m^2"),
        ("mean chord", plain(aircraft.mean_chord), "m"),
        ("mass", plain(aircraft.mass), "kg (a mass channel wins)"),
        ("I_yy", plain(aircraft.I_yy), "kg m^2"),
        ("airspeed U0", given(aircraft.airspeed, "the log's"), "m/s" if aircraft.airspeed is not None else ""),
        ("air density", given(aircraft.density, "from the log"), "kg/m^3" if aircraft.density is not None else ""),
        ("thrust", given(aircraft.thrust, "from the log"), "N" if aircraft.thrust is not None else ""),
        ("thrust incidence", plain(aircraft.thrust_incidence), "rad"),
        ("thrust line below the centre of gravity", plain(aircraft.thrust_z_arm), "m"),
    ]
