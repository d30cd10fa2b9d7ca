"""Command `fly`: flights simulated with JSBSim, with effects that the aircraft file does not declare."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aerosid.cli.options import out_file
from aerosid.cli.output import written
from aerosid.cli.quantity_option import in_unit


def fly_command(
    aircraft: Annotated[
        str,
        typer.Argument(
            metavar="AIRCRAFT",
            help="Aircraft file, bundled name, or an aircraft of the installed JSBSim.",
            show_default=False,
        ),
    ],
    out: Annotated[Path, out_file("Native log, NAME.csv; the other files go to the same folder.", "LOG")],
    shapes: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="INPUT",
            help="[CONTROL:]SHAPE[:RAD[:S]][@S]: doublet, 3211, sweep, multisine or 211 of one control or of each in "
            "turn, with amplitude, unit and start; or a log whose controls are flown as deviations from their first "
            "samples; repeatable.",
            show_default="doublet",
        ),
    ] = None,
    amplitude: Annotated[
        float, typer.Option(parser=in_unit("rad"), metavar="RAD", help="Deflection, rad, in the positive sense.")
    ] = 0.03,
    unit: Annotated[
        float | None,
        typer.Option(
            parser=in_unit("s"),
            metavar="S",
            help="Unit time, s: half a doublet, the 1 of a 3211 or 211, half the shortest period of the others.",
            show_default="1, 0.6, 0.5, 0.5, 0.8",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            parser=in_unit("s"), metavar="S", help="Duration, s.", show_default="14, or as long as several inputs take"
        ),
    ] = None,
    interval: Annotated[float, typer.Option(parser=in_unit("s"), metavar="S", help="Sampling interval, s.")] = 0.02,
    airspeed: Annotated[
        float | None,
        typer.Option(parser=in_unit("m/s"), metavar="M/S", help="Trim airspeed, m/s.", show_default="the aircraft's"),
    ] = None,
    altitude: Annotated[
        float | None,
        typer.Option(
            parser=in_unit("m"), metavar="M", help="Trim altitude, m.", show_default="the aircraft's, or 1500"
        ),
    ] = None,
    noise: Annotated[float, typer.Option(help="Factor on the usual sensor noise.")] = 1.0,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND[:WHERE[:TERM]]=NUMBERS[@S]",
            help="Effect that is flown but not declared in the aircraft file (README); repeatable.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of noise and turbulence.")] = 0,
) -> None:
    """Simulates a flight with JSBSim: a log, the declared aircraft file, and the true parameters for comparison."""
    from aerosid.file_set import require_apart
    from aerosid.studies.jsbsim.command import companions, control_inputs, find_aircraft, flight_plan, write_flight
    from aerosid.studies.jsbsim.flight import fly_jsbsim
    from aerosid.studies.jsbsim.process import require_jsbsim

    require_jsbsim()
    require_apart([out.with_name(name) for name in companions(out)], [aircraft, *(shapes or [])])
    found = find_aircraft(aircraft)
    flown = control_inputs(shapes or ["doublet"], found, amplitude, unit, duration, interval)
    plan = flight_plan(
        found, flown, airspeed=airspeed, altitude=altitude,
        noise=noise, effects=effect or [], seed=seed,
    )  # fmt: skip
    files = write_flight(fly_jsbsim(plan), plan, out)
    written("fly", files)
