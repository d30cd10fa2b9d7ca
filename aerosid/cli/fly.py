"""The verb fly: its words, and what it does with them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Optional

import typer

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
    out: Annotated[Path, typer.Option("--out", metavar="LOG", help="Native log, NAME.csv; the rest goes beside it.")],
    shape: Annotated[
        str,
        typer.Option(
            "--input",
            metavar="INPUT",
            help="doublet, 3211, sweep, multisine, or a log whose delta_e is flown as deviation from its first sample.",
        ),
    ] = "doublet",
    amplitude: Annotated[
        float, typer.Option(parser=in_unit("rad"), metavar="RAD", help="Deflection, rad, positive trailing edge down.")
    ] = 0.03,
    unit: Annotated[
        Optional[float],
        typer.Option(
            parser=in_unit("s"),
            metavar="S",
            help="s: half a doublet, the 1 of a 3211, half the shortest period of sweep and multisine.",
            show_default="1, 0.6, 0.5",
        ),
    ] = None,
    duration: Annotated[float, typer.Option(parser=in_unit("s"), metavar="S", help="s.")] = 14.0,
    interval: Annotated[float, typer.Option(parser=in_unit("s"), metavar="S", help="Between samples, s.")] = 0.02,
    airspeed: Annotated[
        Optional[float],
        typer.Option(parser=in_unit("m/s"), metavar="M/S", help="Of the trim, m/s.", show_default="the aircraft's"),
    ] = None,
    altitude: Annotated[
        Optional[float],
        typer.Option(parser=in_unit("m"), metavar="M", help="Of the trim, m.", show_default="the aircraft's, or 1500"),
    ] = None,
    noise: Annotated[float, typer.Option(help="Factor on the noise of usual sensors.")] = 1.0,
    effect: Annotated[
        Optional[list[str]],
        typer.Option(
            metavar="KIND[:WHERE[:TERM]]=NUMBERS[@S]",
            help="An effect that the aircraft file keeps quiet about (README); repeatable.",
            show_default=False,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of noise and turbulence.")] = 0,
) -> None:
    """Flies an aircraft with JSBSim: a log, the declared aircraft file, and the truth to compare with."""
    from aerosid.studies.jsbsim.command import companions, elevator, flight_plan, write_flight
    from aerosid.studies.jsbsim.flight import fly_jsbsim
    from aerosid.studies.jsbsim.process import require_jsbsim

    require_jsbsim()
    companions(out)
    plan = flight_plan(
        aircraft, elevator(shape, amplitude, unit, duration, interval), airspeed=airspeed, altitude=altitude,
        noise=noise, effects=effect or [], seed=seed,
    )  # fmt: skip
    files = write_flight(fly_jsbsim(plan), plan, out)
    written("fly", files)
