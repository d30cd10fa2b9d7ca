"""What was understood of an aircraft file, and the list of bundled aircraft, as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table

from aerosid.aircraft import Aircraft, warnings_about


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
        sigma = "" if entry.sigma is None else f"{entry.sigma:.4g}"
        estimated = "no, fixed" if entry.fixed else "yes"
        table.add_row(entry.coefficient, str(entry.term), f"{entry.value:.6g}", sigma, estimated)
    console.print(table)
    for effect in aircraft.effects:
        numbers = [] if effect.value is None else [f"{effect.value:.6g}"]
        numbers += [f"{name} = {number:.6g}" for name, number in effect.parameters.items()]
        place = f" {effect.where}" if effect.where else ""
        console.print(f"  declared effect: {effect.kind}{place} {', '.join(numbers)}".rstrip())
    for coefficient, terms in aircraft.candidates.items():
        console.print(f"  candidates for {coefficient}: {', '.join(str(term) for term in terms)}")
    warnings = warnings_about(aircraft)
    for warning in warnings:
        console.print(f"  look again: {warning}")
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
        sizes = (f"{size:g}" for size in (aircraft.mass, aircraft.wing_area, aircraft.mean_chord))
        table.add_row(aircraft.path, aircraft.name, coefficients, *sizes)
    console.print(table)


def _reference(aircraft: Aircraft) -> list[tuple[str, str, str]]:
    """Reference values with their units, and what takes their place where they are not given."""

    def given(value: float | None, otherwise: str) -> str:
        return otherwise if value is None else f"{value:g}"

    return [
        ("wing area", f"{aircraft.wing_area:g}", "m^2"),
        ("mean chord", f"{aircraft.mean_chord:g}", "m"),
        ("mass", f"{aircraft.mass:g}", "kg (a mass channel wins)"),
        ("I_yy", f"{aircraft.I_yy:g}", "kg m^2"),
        ("airspeed U0", given(aircraft.airspeed, "the log's"), "m/s" if aircraft.airspeed is not None else ""),
        ("air density", given(aircraft.density, "from the log"), "kg/m^3" if aircraft.density is not None else ""),
        ("thrust", given(aircraft.thrust, "from the log"), "N" if aircraft.thrust is not None else ""),
        ("thrust incidence", f"{aircraft.thrust_incidence:g}", "rad"),
        ("thrust line below the centre of gravity", f"{aircraft.thrust_z_arm:g}", "m"),
    ]
