"""Command `study`: Monte Carlo of the whole chain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aerosid.cli.options import ChannelsOption, SchedulerOption, WorkersOption, console, out_folder
from aerosid.cli.output import written
from aerosid.cli.quantity_option import in_unit


def _option(*names: str, help: str, metavar: str | None = None, unit: str = "") -> typer.models.OptionInfo:  # noqa: A002
    """An option whose default is that of the preset or of the plan."""
    info: typer.models.OptionInfo = typer.Option(
        *names,
        help=help,
        metavar=unit.upper() if unit else metavar,
        show_default=False,
        parser=in_unit(unit) if unit else None,
    )
    return info


Text = str | None
Number = float | None
Count = int | None


def study_command(
    aircraft: Annotated[Text, _option("--aircraft", metavar="FILE", help="Aircraft file, or a bundled name.")] = None,
    flown: Annotated[
        Text,
        _option(
            "--input",
            metavar="INPUT",
            help="doublet (default), 3211, step, pulse, 2-1-1, doublets-of-two-sizes, staircase, multisine, sweep; "
            "steps as in 0.8@1,0.6@-1 (s at a level); or a log, or next_input.csv, whose delta_e is flown.",
        ),
    ] = None,
    amplitude: Annotated[
        Number, _option("--amplitude", unit="rad", help="Amplitude of the input, rad; default 0.06.")
    ] = None,
    unit: Annotated[
        Number,
        _option(
            "--unit",
            unit="s",
            help="Unit time, s: half a doublet, the 1 of a 3211, half the shortest period of a sweep.",
        ),
    ] = None,
    snr: Annotated[
        Text, _option("--snr", help="Signal-to-noise ratios, as in inf,50,20,10,5 (default); `recorded` with --base.")
    ] = None,
    noise_colour: Annotated[
        Text,
        _option("--noise-colour", metavar="RHO,...", help="AR(1) coefficient of the noise; 0, the default, is white."),
    ] = None,
    runs: Annotated[Count, _option("--runs", help="Runs at each level; default 1000.")] = None,
    effect: Annotated[
        list[str] | None,
        _option(
            "--effect",
            metavar="WHAT",
            help="Flown, not declared: C_m:alpha^2=-1.7, control_lag:delta_e=0.1, step_change:C_m=.01@6; repeatable.",
        ),
    ] = None,
    catalogue: Annotated[
        Text, _option("--catalogue", help="Candidate effects: known (none), terms or all; default terms.")
    ] = None,
    base: Annotated[
        Path | None,
        _option("--base", metavar="LOG", help="Fly this log's inputs, with noise resampled from its residuals."),
    ] = None,
    channels: ChannelsOption = None,
    validate: Annotated[
        Text, _option("--validate", metavar="INPUT|LOG", help="Input or log of the validation flight; default 3211.")
    ] = None,
    measure: Annotated[
        Text,
        _option(
            "--measure",
            help="Recorded outputs; default V,alpha,q,theta,a_x,a_z, and beta,p,r,phi,a_y of lateral models.",
        ),
    ] = None,
    elevator_noise: Annotated[
        Number, _option("--elevator-noise", unit="rad", help="Elevator noise, rad per sample; default 0.0002.")
    ] = None,
    airspeed: Annotated[
        Number, _option("--airspeed", unit="m/s", help="Airspeed, m/s; default the aircraft file's.")
    ] = None,
    density: Annotated[
        Number, _option("--density", unit="kg/m^3", help="Density, kg/m^3; default the aircraft file's.")
    ] = None,
    samples: Annotated[Count, _option("--samples", help="Number of samples; default 470.")] = None,
    interval: Annotated[Number, _option("--interval", unit="s", help="Sampling interval, s; default 0.03.")] = None,
    preset: Annotated[Text, _option("--preset", help="Settings of a ready-made study: accuracy or structure.")] = None,
    seed: Annotated[Count, _option("--seed", help="Seed of every random draw; default 0.")] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    out: Annotated[Path, out_folder()] = Path("reports/study"),
) -> None:
    """Monte Carlo study of simulated flights: errors against their bound, true coverage, detection, prediction."""
    from aerosid.cli.progress_bar import progress_bar
    from aerosid.file_set import require_apart
    from aerosid.studies.monte_carlo import run_study, write_study
    from aerosid.studies.monte_carlo.console import print_demands, print_study
    from aerosid.studies.monte_carlo.words import StudyWords, plan_of
    from aerosid.studies.monte_carlo.writing import FILES, study_json
    from aerosid.studies.workers import Workers

    words = StudyWords(
        aircraft=aircraft,
        input=flown,
        amplitude=amplitude,
        unit=unit,
        airspeed=airspeed,
        density=density,
        interval=interval,
        samples=samples,
        base=base,
        channels=channels,
        validate=validate,
        measure=measure,
        elevator_noise=elevator_noise,
        snr=snr,
        noise_colour=noise_colour,
        effects=tuple(effect or ()),
        runs=runs,
        seed=seed,
        catalogue=catalogue,
    )
    dealt = Workers(workers, scheduler)
    require_apart([out / name for name in FILES], [aircraft, flown, base, channels, validate])
    plan = plan_of(words, preset)
    with progress_bar("runs") as (announce, tick):
        study = run_study(plan, out, dealt, announce, tick)
    files = write_study(study, out)
    output = console()
    print_study(study, output)
    if preset == "accuracy":
        print_demands(study, output)
    written("study", files, lambda: study_json(study))
