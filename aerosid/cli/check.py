"""Command `check`: data quality of logs, with a verdict sentence for each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aerosid.cli.options import ChannelsOption, FromOption, LogsArgument, ToOption, console
from aerosid.cli.output import headed, mode, tell

if TYPE_CHECKING:
    from rich.console import Console

    from aerosid.aircraft import Aircraft
    from aerosid.logs.flight_log import FlightLog
    from aerosid.logs.recording import Recording

UNUSABLE = 3
"""Format: exit code where a log cannot be used."""


def check_command(
    logs: LogsArgument,
    channels: ChannelsOption = None,
    start: FromOption = None,
    stop: ToOption = None,
    aircraft: Annotated[
        str | None,
        typer.Option(
            "--aircraft",
            metavar="FILE",
            help="Aircraft file: says also whether close-loop can use the logs with it; its size limits the sensor "
            "positions, default no limit.",
            show_default=False,
        ),
    ] = None,
) -> int:
    """Reports the quality of logs: sampling, gaps, spikes, noise, excitation, and data missing for close-loop.

    With --quiet only the verdict sentences are printed.
    """
    from aerosid.aircraft import load_aircraft
    from aerosid.cli.close_loop import spans_between
    from aerosid.logs.formats import FORMATS, format_of, read_log, read_recording
    from aerosid.logs.spans import read_span

    output = console()
    declared = load_aircraft(aircraft) if aircraft else None
    read_before: dict[Path, FlightLog] = {}
    closing = []
    silent = mode().silent
    for span in spans_between(logs, start, stop):
        if span.path not in read_before and span.path.exists() and FORMATS[format_of(span.path)].several_clocks:
            streams = read_recording(span.path)
            # Before the channels are read: the listing helps to write a channel map.
            if not silent:
                _print_streams(span.path, streams, output)
            read_before[span.path] = read_log(span.path, channels, across_holes=True, recording=streams)
        log = read_span(span, channels, read_before)
        closing.append(_checked(log, None if silent else output, declared))
    tell(lambda: headed("check", {"logs": closing}))
    if silent and not mode().json:
        for entry in closing:
            typer.echo(str(entry["sentence"]))
    return 0 if all(entry["usable"] for entry in closing) else UNUSABLE


def _print_streams(path: Path, recording: Recording, output: Console) -> None:
    """First and last time, rate and gaps of each stream of a recording of several clocks."""
    from aerosid.logs.channel_listing import list_channels
    from aerosid.reporting.channel_tables import print_notes, print_streams

    listing = list_channels(recording, with_columns=False)
    print_streams(listing, str(path), output)
    print_notes(listing, output)


def _length(aircraft: Aircraft | None) -> float | None:
    """Length of the aircraft, m, from its file or from its chord; None where there is no file."""
    from aerosid.effects.limits import OFFERED

    if aircraft is None:
        return None
    return aircraft.length or OFFERED.length_in_chords * aircraft.mean_chord


def _obstacle(log: FlightLog, aircraft: Aircraft | None) -> str:
    """Why close-loop cannot use a log with an aircraft file, in one sentence; empty where it can."""
    from aerosid.errors import AerosidError
    from aerosid.loop.identification import prepare_flights

    if aircraft is None:
        return ""
    try:
        prepare_flights([log], aircraft)
    except AerosidError as error:
        return f"The log cannot be used by close-loop with this aircraft: {error}"
    return ""


def _checked(recorded: FlightLog, output: Console | None, aircraft: Aircraft | None) -> dict[str, object]:
    """Quality of one log: printed where a console is given, and returned as a JSON object."""
    from aerosid.compatibility import check_kinematics
    from aerosid.logs.channel_noise import with_declared_noise
    from aerosid.logs.quality import NOT_COMPARABLE, check_log
    from aerosid.manoeuvres import find_manoeuvres, whole_flight_sentence
    from aerosid.reporting.quality_tables import (
        closing_sentence,
        dynamic_sentence,
        print_kinematics,
        print_quality,
        quality_json,
    )

    log = recorded
    if aircraft is not None:
        log = with_declared_noise(recorded, aircraft.noise, aircraft.resolution)
    quality = check_log(log)
    whole = whole_flight_sentence(log)
    # A whole flight passes several trim conditions and configurations: one flight path through it is no valid check.
    checkable = whole is None and all(finding.problem not in NOT_COMPARABLE for finding in quality.findings)
    agreement = check_kinematics([log], length=_length(aircraft)) if checkable else None
    dynamic = "" if whole is not None else dynamic_sentence(find_manoeuvres(log))
    sentence, usable = closing_sentence(quality, agreement, whole)
    if usable and (obstacle := _obstacle(recorded, aircraft)):
        sentence, usable = obstacle, False
    if output is not None:
        print_quality(quality, output)
        if agreement is not None:
            print_kinematics(agreement, output)
        for line in (dynamic, sentence):
            if line:
                output.print(line, soft_wrap=True)
        output.print()
    return quality_json(quality, agreement) | {"usable": usable, "sentence": sentence, "lively": dynamic}
