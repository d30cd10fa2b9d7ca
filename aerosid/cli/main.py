"""Command-line interface: parse, call, print, exit code. Each verb is a short function that imports what it needs."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Annotated

import typer

from aerosid import __version__
from aerosid.cli.batch import batch_command
from aerosid.cli.channels import channels_command
from aerosid.cli.check import check_command
from aerosid.cli.cross_check import cross_check_command
from aerosid.cli.export import export_command
from aerosid.cli.find import find_command
from aerosid.cli.fly import fly_command
from aerosid.cli.options import ChannelsOption, FromOption, LogsArgument, ToOption, console, out_folder
from aerosid.cli.output import headed, loudly, read_no_more, taken_out, tell, verb_of, written
from aerosid.cli.replay import replay_command
from aerosid.cli.schema import schema_command
from aerosid.cli.stop_signals import INTERRUPTED, Termination, unless_ended
from aerosid.cli.study import study_command
from aerosid.cli.warm_up import warm_up_command
from aerosid.errors import AerosidError
from aerosid.loop.report_date import today

app = typer.Typer(
    name="aerosid",
    help="Identifies the effects that an aircraft's declared flight-mechanics model lacks, from measured manoeuvres.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Any verb also takes --json (one JSON document in place of tables), --quiet (neither tables nor progress) "
    "and --debug (a traceback in place of the one-sentence error). Exit codes: 0 done, 1 only with --strict, 2 wrong "
    "usage or a wrong aircraft or map file, 3 an unusable log, 4 the estimation broke down.",
)

_command_of = cache(typer.main.get_command)  # read from annotations once for all calls in a process

_DEBUG = "--debug"

_CYCLES_SOUGHT_AFTER = 500_000
"""Numerical: allocations minus deallocations of objects after which Python's garbage collector looks for cycles. A run
imports about two thousand modules and keeps what it creates; with Python's default of 700 the collector takes a tenth
of its time. With this value a short run ends before the first collection (0.1 s per 100 000 objects, nearly all of
modules)."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        The arguments after `aerosid`; those of the process where absent.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    debug = _DEBUG in words
    # Matrices are small here. A second BLAS thread has to wait where another process occupies the core, which has made
    # products of 20 us take 8 ms and a whole loop twice as long.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(_CYCLES_SOUGHT_AFTER)
    # The final garbage collection frees only what the end of the process frees anyway.
    atexit.register(gc.freeze)
    code, ended = unless_ended(lambda told: _run(words, debug, told), is_last=arguments is None)
    return _failed(ended, code, debug) if ended else code


def _run(words: Sequence[str], debug: bool, termination: Termination) -> int:
    """The exit code of one command."""
    try:
        # Removed here so that it is accepted before and after the verb without every verb declaring it.
        arguments = [word for word in words if word != _DEBUG]
        # numpy reads SOURCE_DATE_EPOCH on import and its error does not name the variable.
        today()
        result = _command_of(app)(taken_out(arguments), standalone_mode=False, obj=arguments)
    except AerosidError as error:
        return INTERRUPTED if termination.explains(error) else _failed(str(error), error.exit_code, debug)
    except typer.Abort:
        return _failed("aborted.", 2, debug)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of a JSON document has closed the pipe: nothing is left to write or flush.
        read_no_more()
        return 0
    except Exception as error:  # noqa: BLE001  the user gets one sentence for every failure
        if termination.explains(error):
            return INTERRUPTED
        if hasattr(error, "format_message"):
            return _failed(f"{error.format_message().rstrip('.')}. See `{verb_of(error)} --help`.", 2, debug)
        detail = " ".join(str(error).split())[:200] or type(error).__name__
        return _failed(
            f"an unexpected {type(error).__name__} stopped the run ({detail}); run again with --debug and report it.",
            4,
            debug,
        )
    finally:
        loudly()
    return result if isinstance(result, int) else 0


def _failed(sentence: str, code: int, debug: bool) -> int:
    if debug:
        import traceback

        traceback.print_exc()
    sys.stderr.write(f"aerosid: {' '.join(sentence.split())}\n")
    return code


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"aerosid {__version__}")
        raise typer.Exit


@app.callback()
def _global_options(
    debug: Annotated[bool, typer.Option(_DEBUG, help="Show a traceback with an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Show the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Global options; `main` acts on --debug itself."""


app.command("check")(check_command)
app.command("find")(find_command)


@app.command("close-loop")
def close_loop_command(
    context: typer.Context,
    logs: LogsArgument,
    aircraft: Annotated[
        str, typer.Option("--aircraft", metavar="FILE", help="Aircraft file, or a bundled name.", show_default=False)
    ],
    validate: Annotated[
        list[str] | None,
        typer.Option(
            "--validate",
            metavar="LOG",
            help="Validation record, LOG or LOG@FROM:TO: predicted, not fitted; may refute effects; repeatable.",
            show_default=False,
        ),
    ] = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(
            "--hold-out",
            metavar="LOG",
            help="Hold-out record, LOG or LOG@FROM:TO: predicted, used in no decision; repeatable.",
            show_default=False,
        ),
    ] = None,
    channels: ChannelsOption = None,
    out: Annotated[
        Path | None,
        out_folder("Output folder; default reports/<log name>/.", show_default=False),
    ] = None,
    start: FromOption = None,
    stop: ToOption = None,
    find: Annotated[
        bool, typer.Option("--find", help="Identify from the elevator manoeuvres found in each log.")
    ] = False,
    method: Annotated[
        str,
        typer.Option(
            help="Method of structure determination: evidence (likelihood in calm air, equations elsewhere), "
            "likelihood, equations, or iebmee (d(t) alone)."
        ),
    ] = "evidence",
    prefilter: Annotated[
        str, typer.Option(help="Low-pass filter before the model-error estimator: zero-phase, causal or off.")
    ] = "zero-phase",
    error_density: Annotated[
        str | None,
        typer.Option(
            "--error-density",
            metavar="U,W,Q,THETA",
            help="Diagonal of Q2^-1: two in (m/s^2)^2 s, then (rad/s^2)^2 s and (rad/s)^2 s; from the log by default.",
            show_default=False,
        ),
    ] = None,
    priors: Annotated[
        bool, typer.Option("--priors", help="Use the aircraft file's sigma as prior in the estimate.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of every random draw.", min=0)] = 0,
    static: Annotated[
        bool, typer.Option("--static", help="Static figures only: report.html of half a megabyte, not five.")
    ] = False,
    flight_phase: Annotated[
        str | None,
        typer.Option(
            "--flight-phase",
            metavar="A|B|C",
            help="Flight-phase category for the levels of MIL-F-8785C; default the aircraft file's, else B.",
            show_default=False,
        ),
    ] = None,
    aircraft_class: Annotated[
        str | None,
        typer.Option(
            "--class",
            metavar="I|II|II-C|III|IV",
            help="Aircraft class for MIL-F-8785C; default II.",
            show_default=False,
        ),
    ] = None,
    no_next_flight: Annotated[
        bool, typer.Option("--no-next-flight", help="Do not design an input for the next flight.")
    ] = False,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            "--limit",
            metavar="NAME=LOW:HIGH",
            help="Limit of the next flight: alpha, n_z, V, theta, beta, phi, delta_e, delta_a, delta_r or a surface's "
            "delta_e_rate, as in alpha=-2:12deg; repeatable.",
            show_default=False,
        ),
    ] = None,
    analyst: Annotated[
        str,
        typer.Option("--analyst", metavar="NAME", help="Name of the analyst for the title block.", show_default=False),
    ] = "",
    remarks: Annotated[
        str, typer.Option("--remarks", metavar="TEXT", help="Remarks for the title block.", show_default=False)
    ] = "",
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit code 1 unless the verdict is explained or nothing_missing.")
    ] = False,
) -> int:
    """Identifies the effects missing from the declared model, completes it, and reports the errors before and after."""
    from aerosid.cli.close_loop import loop_settings, provenance, read_roles, report_folder, with_progress

    roled = read_roles(logs, validate or [], channels, start, stop, hold_out=hold_out or [], find=find)
    from aerosid.aircraft import load_aircraft
    from aerosid.manoeuvres import require_manoeuvre

    declared = load_aircraft(aircraft)
    for log in roled.every:
        require_manoeuvre(log)
    records = (*logs, *(validate or ()), *(hold_out or ()))
    directory = report_folder(out or Path("reports") / roled.identification[0].name, records, aircraft, channels)
    settings = loop_settings(
        prefilter,
        error_density,
        priors,
        seed,
        flight_phase,
        aircraft_class,
        not no_next_flight,
        limit or [],
        method,
    )
    made = provenance(context.obj or (), settings, analyst, remarks)
    from aerosid.compiled.cores import available, on_cores
    from aerosid.loop.verdict import Verdict
    from aerosid.reporting import print_consequences, print_summary
    from aerosid.reporting.printing import printing

    output = console()
    with on_cores(available()), printing() as printer:
        result = with_progress(
            roled.identification,
            declared,
            roled.validation,
            settings,
            lambda known: print_summary(known, output),
            roled.hold_out,
            made,
        )
        paper = printer(result)
        print_consequences(result, output)
        from aerosid.reporting.result_json import result_text
        from aerosid.reporting.writing import write_report

        files = write_report(result, directory, interactive=not static, paper=paper)
    written("close-loop", files, lambda: result_text(result))
    return int(strict and result.verdict not in (Verdict.EXPLAINED, Verdict.NOTHING_MISSING))


@app.command("reproduce")
def reproduce_command(
    out: Annotated[Path, out_folder()] = Path("reports/paper"),
    seeds: Annotated[int, typer.Option(help="Noise records per signal-to-noise ratio in table 4.", min=1)] = 200,
) -> None:
    """Recomputes every table and figure of Parameswaran & Raol 1994 for comparison with the printed ones."""
    from aerosid.studies.paper import write_reproduction
    from aerosid.studies.paper.console import print_reproduction, reproduce_with_progress

    result = reproduce_with_progress(seeds)
    files = write_reproduction(result, out)
    output = console()
    print_reproduction(result, output)
    written("reproduce", files)


app.command("study")(study_command)
app.command("fly")(fly_command)
app.command("export")(export_command)
app.command("batch")(batch_command)
app.command("cross-check")(cross_check_command)
app.command("channels")(channels_command)
app.command("replay")(replay_command)
app.command("warm-up")(warm_up_command)
app.command("schema")(schema_command)


@app.command()
def formats() -> None:
    """Lists the formats of logs that can be read."""
    from rich.table import Table

    from aerosid.logs.formats import FORMATS

    table = Table(title="Log formats (each may be compressed with gzip)")
    for heading in ("format", "suffixes", "map", "extra", "content"):
        table.add_column(heading)
    for name, entry in FORMATS.items():
        need = "none" if entry.self_describing else entry.ready_map or "needed"
        table.add_row(name, " ".join(entry.suffixes), need, entry.extra or "", entry.description)
    console().print(table)
    rows = [
        {
            "name": name,
            "suffixes": list(entry.suffixes),
            "needs_channel_map": not entry.self_describing and entry.ready_map is None,
            "ready_map": entry.ready_map,
            "extra": entry.extra,
            "content": entry.description,
        }
        for name, entry in FORMATS.items()
    ]
    tell(lambda: headed("formats", {"formats": rows}))


aircraft_app = typer.Typer(help="Lists the bundled aircraft, and checks aircraft files.", no_args_is_help=True)
app.add_typer(aircraft_app, name="aircraft")


@aircraft_app.command("list")
def list_aircraft() -> None:
    """Lists the bundled aircraft by the name that --aircraft takes."""
    from aerosid.aircraft import bundled_aircraft, load_aircraft
    from aerosid.reporting.aircraft_tables import print_aircraft_list

    bundled = {name: load_aircraft(name) for name in bundled_aircraft()}
    print_aircraft_list(list(bundled.values()), console())
    rows = [{"name": name, "title": each.name, "source": each.source} for name, each in bundled.items()]
    tell(lambda: headed("aircraft list", {"aircraft": rows}))


@aircraft_app.command("check")
def check_aircraft(
    files: Annotated[
        list[str], typer.Argument(metavar="FILE...", help="Aircraft files, or bundled names.", show_default=False)
    ],
) -> None:
    """Prints aircraft files as they are read, and warns of unusual numbers."""
    from aerosid.aircraft import load_aircraft, warnings_about
    from aerosid.reporting.aircraft_tables import print_aircraft

    output = console()
    loaded = [load_aircraft(file) for file in files]
    for aircraft in loaded:
        print_aircraft(aircraft, output)
    rows = [
        {
            "file": aircraft.path,
            "sha256": aircraft.sha256,
            "name": aircraft.name,
            "coefficients": list(aircraft.coefficients),
            "derivatives": len(aircraft.derivatives),
            "effects": len(aircraft.effects),
            "warnings": list(warnings_about(aircraft)),
        }
        for aircraft in loaded
    ]
    tell(lambda: headed("aircraft check", {"aircraft": rows}))


for _verb in (*app.registered_commands, *aircraft_app.registered_commands):
    _verb.epilog = "Also, as every verb: --json, --quiet and --debug; see `aerosid --help`."
