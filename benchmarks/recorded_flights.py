"""What the loop makes of recordings of real aircraft, before and after on data that were not used for the fit.

    AEROSID_FLIGHT_DATA=FOLDER python -m benchmarks.recorded_flights [--only NAME ...] [--write FILE]

The recordings are not part of the project. Where a flight has no repeat, its first 60 % are fitted and the rest is
predicted, the initial state estimated there.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.compiled.cores import available, on_cores
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.effect_rows import Effect
from aerosid.loop.result import ClosedLoop
from aerosid.notation import MISSING, number, si_unit, with_deviation
from aerosid.reporting.words import effect_sentence

FITTED = 0.6
"""Share of a single record that is fitted."""


@dataclass(frozen=True)
class Recorded:
    """A recorded flight: the aircraft file, the channel map, the log, its repeat and a remark, if there is one."""

    title: str
    aircraft: str
    channels: str
    log: str
    repeat: str = ""
    remark: str = ""


FLIGHTS = {
    "hfb320": Recorded("HFB-320, 3-2-1-1 and pulse", "hfb320", "hfb320.toml", "hfb320/hfb320_1_10.asc"),
    "citation": Recorded(
        "Cessna Citation II, two steps", "citation", "citation.toml", "citation/seg_ref_20180312_shortperiod.csv"
    ),
    "twin_otter": Recorded(
        "DHC-6 Twin Otter, 018 fitted, 017 predicted",
        "twin_otter",
        "twin_otter.toml",
        "twin_otter/totter_demo_018.csv",
        "twin_otter/totter_lon_020213f1_017.csv",
    ),
    "attas": Recorded("VFW-614 ATTAS, 3-2-1-1", "attas", "attas_mat.toml", "attas/fAttasElv1.mat"),
    "stall": Recorded(
        "VFW-614 ATTAS, quasi-steady stall",
        "attas",
        "attas_stall.toml",
        "attas/fAttas_qst01_withHeader.asc",
        remark="The fitted part ends before the stall: alpha reaches 12.0 degrees there, 15.7 in the rest. The "
        "published stall model of this flight separates at .309 rad, and its moment misses trim and thrust.",
    ),
}


def main() -> int:
    """Close the loop on every recording that is there, print a table each, and write them where wanted."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recorded_flights", description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=sorted(FLIGHTS), help="some of the flights")
    parser.add_argument("--write", type=Path, help="write the page to this file too, as Markdown")
    arguments = parser.parse_args()
    folder = Path(os.environ.get("AEROSID_FLIGHT_DATA", ""))
    parts = [HEAD]
    for name in arguments.only or FLIGHTS:
        flight = FLIGHTS[name]
        if not (folder / flight.log).is_file():
            sys.stderr.write(f"{flight.title}: {flight.log} is not there; set AEROSID_FLIGHT_DATA to its folder.\n")
            return 2
        parts.append(_section(flight, folder))
        sys.stdout.write(parts[-1] + "\n")
        sys.stdout.flush()
    if arguments.write is not None:
        arguments.write.parent.mkdir(parents=True, exist_ok=True)
        arguments.write.write_text("\n".join(parts), encoding="utf-8")
    return 0


HEAD = """# Recorded flights

Real aircraft, errors before and after on data that were not used for the fit. `before` is the declared structure with
its derivatives re-estimated, `after` the completed model, `trimmed` that with the constants of force and moment
re-estimated on the predicted part; the last column is the sensor's noise, where it can be estimated. Simulated open
loop, initial state estimated there. Alternatives stand behind what they could replace. Sources of the
recordings: the aircraft files. Times are those on a
machine of two cores. Made by `python -m benchmarks.recorded_flights`.
"""


def _section(flight: Recorded, folder: Path) -> str:
    """One flight's findings and errors, as Markdown."""
    channels = bundled_folder("flight_data") / "channel_maps" / flight.channels
    log = read_log(folder / flight.log, channels)
    fitted, predicted = _split(log) if not flight.repeat else (log, read_log(folder / flight.repeat, channels))
    aircraft, begun = load_aircraft(flight.aircraft), time.perf_counter()
    with on_cores(available()):
        result = close_loop([fitted], aircraft, [predicted])
    seconds = time.perf_counter() - begun
    how = "" if flight.repeat else f" The first {FITTED:.0%} of the record are fitted, the rest is predicted."
    lines = [
        f"## {flight.title}\n",
        f"{result.verdict.name.lower().replace('_', ' ')}, by the {result.decided_by}, {seconds:.0f} s.{how}\n",
        *_named("identified", result.effects),
        *_named("indistinguishable alternatives", result.alternatives),
        *_errors(result),
    ]
    if not flight.repeat:
        whole = close_loop([log], aircraft)
        lines += ["\nFitted to the whole record:\n", *_named("identified", whole.effects)]
        lines += [*_named("indistinguishable alternatives", whole.alternatives), *_shares(whole)]
    else:
        lines += _shares(result)
    lines += [f"\n{flight.remark}"] if flight.remark else []
    return "\n".join(lines) + "\n"


def _split(log: FlightLog) -> tuple[FlightLog, FlightLog]:
    middle = float(log.time[0] + FITTED * (log.time[-1] - log.time[0]))
    return log.between(None, middle), log.between(middle, None)


def _named(what: str, effects: Sequence[Effect]) -> list[str]:
    if not effects:
        return [f"- {what}: nothing"]
    shown = (
        f"{effect_sentence(effect)} {with_deviation(effect.value, effect.std_error)} {si_unit(effect.unit)}".rstrip()
        + (f" (for {effect.instead_of})" if effect.instead_of else "")
        for effect in effects
    )
    return [f"- {what}: {'; '.join(shown)}"]


def _errors(result: ClosedLoop) -> list[str]:
    lines = ["\n| predicted | before | after | trimmed | noise |", "|---|---|---|---|---|"]
    for row in result.errors:
        if row.role == "validation":
            cells = (row.before, row.after, row.trimmed)
            shown = " | ".join("left its range" if cell is None else number(cell) for cell in cells)
            noise = MISSING if row.noise_doubt else number(row.noise)
            lines.append(f"| {row.channel} [{row.unit}] | {shown} | {noise} |")
    return lines


def _shares(result: ClosedLoop) -> list[str]:
    logs = {log.name for log in result.identification}
    rows = [f"{r.coefficient} {r.r2_before:.3f} → {r.r2_after:.3f}" for r in result.coefficients if r.log in logs]
    theta = next((row for row in result.errors if row.channel == "theta" and row.role == "identification"), None)
    lines = [f"\nShare of the measured coefficients' variance explained, before → after: {', '.join(rows)}."]
    if theta is not None and theta.before is not None and theta.after is not None:
        lines.append(f"Pitch attitude on the fitted data: {theta.before:.5f} → {theta.after:.5f} rad.")
    return lines


if __name__ == "__main__":
    sys.exit(main())
