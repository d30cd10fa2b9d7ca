"""Command `cross-check`: close-loop tested on flights simulated with JSBSim."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aerosid.cli.options import console, out_folder
from aerosid.cli.output import written
from aerosid.cli.quantity_option import in_unit


def cross_check_command(
    aircraft: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[AIRCRAFT]...",
            help="Aircraft of JSBSim; by default L410, DHC6, c310, t6texan2, fokker50, 737.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, out_folder()] = Path("reports/jsbsim"),
    amplitude: Annotated[
        float, typer.Option(parser=in_unit("rad"), metavar="RAD", help="Amplitude of the manoeuvres, rad.")
    ] = 0.04,
    seeds: Annotated[int, typer.Option(help="Noise records per signal-to-noise ratio in table 4.", min=1)] = 50,
    seed: Annotated[int, typer.Option(help="Seed of the sensor noise.", min=0)] = 0,
) -> None:
    """Tests close-loop with JSBSim: the paper's flight, aircraft with known derivatives, and each undeclared effect."""
    from aerosid.cli.progress_bar import progress_bar
    from aerosid.studies.cross_check import cross_check, write_cross_check
    from aerosid.studies.cross_check.console import print_cross_check
    from aerosid.studies.cross_check.run import AIRCRAFT, require_possible, steps

    names = aircraft or list(AIRCRAFT)
    require_possible(names, seeds)
    with progress_bar("cross-check") as (announce, tick):
        announce(steps(names, seeds), 0)
        result = cross_check(names, amplitude=amplitude, seed=seed, seeds=seeds, tick=tick)
    files = write_cross_check(result, out)
    output = console()
    print_cross_check(result, output)
    written("cross-check", files)
