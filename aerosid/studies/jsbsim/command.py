"""Flights of the command `fly`: from its options to a plan, and from a flight to files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from aerosid.aircraft import Aircraft, bundled_aircraft, load_aircraft
from aerosid.errors import UsageError
from aerosid.file_set import text, write_files
from aerosid.logs.log_writing import native_csv
from aerosid.nomenclature import is_surface
from aerosid.studies.jsbsim.control_inputs import ELEVATOR, SHAPES, ControlInput, Manoeuvre, recorded, sequence
from aerosid.studies.jsbsim.flight import jsbsim_version
from aerosid.studies.jsbsim.injected import parse_effect
from aerosid.studies.jsbsim.plan import FlightPlan, JsbsimFlight
from aerosid.studies.jsbsim.polynomial import driven_by
from aerosid.studies.jsbsim.properties import SURFACES
from aerosid.studies.jsbsim.stock import CONDITIONS, stock_aircraft

_UNITS = {"doublet": 1.0, "3211": 0.6, "sweep": 0.5, "multisine": 0.5, "211": 0.8}
"""Design: s, unit of each input."""

_DIGITS = 10
"""Format: digits of the written log."""


def flight_plan(
    found: Aircraft | str,
    flown: Manoeuvre,
    *,
    airspeed: float | None,
    altitude: float | None,
    noise: float,
    effects: Sequence[str],
    seed: int,
) -> FlightPlan:
    """The plan for the options of the command line.

    Raises
    ------
    UsageError
        Where a text or number is not valid for a flight.
    """
    cruise = CONDITIONS.get(found) if isinstance(found, str) else None
    if airspeed is None:
        airspeed = found.airspeed if isinstance(found, Aircraft) else cruise[0] if cruise else None
    if airspeed is None:
        raise UsageError(
            f"{found if isinstance(found, str) else found.path} has no airspeed of its own; give --airspeed in m/s."
        )
    if altitude is None:
        altitude = cruise[1] if cruise else 1500.0
    if seed < 0:
        raise UsageError(f"--seed is {seed}; give a number that is not negative.")
    injected = tuple(map(parse_effect, effects))
    return FlightPlan(found, flown, airspeed, altitude, injected, noise, seed)


def find_aircraft(name: str) -> Aircraft | str:
    """An aircraft file, a bundled aircraft, or the name of one of JSBSim's.

    Raises
    ------
    UsageError
        Where it is none of these.
    AircraftError
        Where the aircraft file is invalid.
    """
    if name.endswith(".toml") or Path(name).is_file() or name in bundled_aircraft():
        return load_aircraft(name)
    if name not in stock_aircraft():
        raise UsageError(
            f"{name!r} is neither an aircraft file, nor a bundled aircraft ({', '.join(bundled_aircraft())}), nor one "
            f"of the installed JSBSim (for example {', '.join(CONDITIONS)}); give one of these."
        )
    return name


def control_inputs(
    words: Sequence[str],
    aircraft: Aircraft | str,
    amplitude: float,
    unit: float | None,
    duration: float | None,
    interval: float,
) -> Manoeuvre:
    """The manoeuvre for the options of the command line.

    Parameters
    ----------
    words : sequence of str
        [CONTROL:]SHAPE[:AMPLITUDE[:UNIT]][@START], rad and s, or one file; without CONTROL each control of the aircraft
        in turn.
    aircraft : Aircraft or str
        Names of the controls of the aircraft.
    amplitude : float
        rad, where a shape gives none.
    unit : float or None
        s, where a shape gives none; None: the shape's own.
    duration : float or None
        s; None: 14 s of a single input, else as long as they take.
    interval : float
        s.

    Raises
    ------
    UsageError
        Where a text or number is not valid for a manoeuvre, or the aircraft has no such control.
    LogError
        Where the input's file cannot be used.
    """
    stock = isinstance(aircraft, str)
    controls = (ELEVATOR,) if isinstance(aircraft, str) else driven_by(aircraft) or (ELEVATOR,)
    there = tuple(SURFACES) if stock else controls
    if len(words) == 1 and words[0] not in SHAPES and (Path(words[0]).exists() or words[0].endswith(".csv")):
        return recorded(Path(words[0]), interval, controls)
    inputs: list[ControlInput] = []
    for word in words:
        inputs.extend(_inputs(word, controls, there, amplitude, unit))
    if duration is None and len(inputs) == 1 and inputs[0].start is None:
        duration = _DURATION
    return sequence(inputs, duration, interval)


_DURATION = 14.0
"""Design: s, of one input."""


def _inputs(
    word: str, controls: Sequence[str], there: Sequence[str], amplitude: float, unit: float | None
) -> list[ControlInput]:
    """Inputs of one text: of its control, which must be one of `there`, or of each of `controls`."""
    text, _, began = word.partition("@")
    parts = text.split(":")
    named = [parts.pop(0)] if is_surface(parts[0]) else list(controls)
    shape, *numbers = parts or [""]
    try:
        start = float(began) if began else None
        size, width = [*(float(number) for number in numbers), None, None][:2]
    except ValueError:
        raise UsageError(
            f"--input {word!r} cannot be read; write [CONTROL:]SHAPE[:AMPLITUDE[:UNIT]][@START], as in "
            "delta_a:doublet:0.05:0.8@2."
        ) from None
    if unknown := [name for name in named if name not in there]:
        raise UsageError(f"--input {word!r} moves {unknown[0]}, but this aircraft is flown by {', '.join(there)}.")
    own = _UNITS.get(shape, 1.0) if unit is None else unit
    made = [
        ControlInput(name, shape, amplitude if size is None else size, own if width is None else width)
        for name in named
    ]
    made[0] = replace(made[0], start=start)
    return made


def companions(log: Path) -> tuple[str, str, str]:
    """File names of the log, the declared aircraft and the truth.

    Raises
    ------
    UsageError
        Where the log's name does not end in .csv.
    """
    if log.suffix != ".csv" or not log.stem:
        raise UsageError(f"--out is {str(log)!r}; give the log a name that ends in .csv.")
    return log.name, f"{log.stem}.aircraft.toml", f"{log.stem}.truth.json"


def write_flight(flight: JsbsimFlight, plan: FlightPlan, out: Path) -> tuple[Path, ...]:
    """The paths of log, declared aircraft and truth.

    Raises
    ------
    UsageError
        Where they cannot be written.
    """
    log, aircraft, truth = companions(out)
    # Nothing on injected effects in the log: its user is to find them.
    remark = f"Flown by JSBSim {jsbsim_version()}: {flight.log.name}, seed {plan.seed}"
    contents = {
        log: native_csv(flight.log, remark, _DIGITS),
        aircraft: flight.aircraft.text,
        truth: json.dumps(flight.truth, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
    }
    return write_files(out.parent, {name: text(content) for name, content in contents.items()})
