"""What the verb fly does around a flight: a plan from words, files from a flight."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from aerosid.aircraft import Aircraft, bundled_aircraft, load_aircraft
from aerosid.errors import UsageError
from aerosid.file_set import text, write_files
from aerosid.logs.log_writing import native_csv
from aerosid.studies.jsbsim.elevator_inputs import SHAPES, Manoeuvre, manoeuvre, recorded
from aerosid.studies.jsbsim.flight import jsbsim_version
from aerosid.studies.jsbsim.injected import parse_effect
from aerosid.studies.jsbsim.plan import FlightPlan, JsbsimFlight
from aerosid.studies.jsbsim.stock import CONDITIONS, stock_aircraft

_UNITS = {"doublet": 1.0, "3211": 0.6, "sweep": 0.5, "multisine": 0.5}
_DIGITS = 10


def flight_plan(
    aircraft: str,
    flown: Manoeuvre,
    *,
    airspeed: float | None,
    altitude: float | None,
    noise: float,
    effects: Sequence[str],
    seed: int,
) -> FlightPlan:
    """The plan that the words of the command line ask for.

    Raises
    ------
    UsageError
        Where a word or number makes no flight.
    AircraftError
        Where the aircraft file is wrong.
    LogError
        Where the input's file cannot be used.
    """
    found = find_aircraft(aircraft)
    cruise = CONDITIONS.get(found) if isinstance(found, str) else None
    if airspeed is None:
        airspeed = found.airspeed if isinstance(found, Aircraft) else cruise[0] if cruise else None
    if airspeed is None:
        raise UsageError(f"{aircraft} has no airspeed of its own; give --airspeed in m/s.")
    if altitude is None:
        altitude = cruise[1] if cruise else 1500.0
    injected = tuple(map(parse_effect, effects))
    return FlightPlan(found, flown, airspeed, altitude, injected, noise, seed)


def find_aircraft(name: str) -> Aircraft | str:
    """An aircraft file, a bundled aircraft, or the name of one of JSBSim's.

    Raises
    ------
    UsageError
        Where it is none of them.
    AircraftError
        Where the aircraft file is wrong.
    """
    if name.endswith(".toml") or Path(name).is_file() or name in bundled_aircraft():
        aircraft = load_aircraft(name)
        aircraft.require_longitudinal("fly")
        return aircraft
    if name not in stock_aircraft():
        raise UsageError(
            f"{name!r} is neither an aircraft file, nor a bundled aircraft ({', '.join(bundled_aircraft())}), nor one "
            f"of the installed JSBSim (for example {', '.join(CONDITIONS)}); give one of these."
        )
    return name


def elevator(shape: str, amplitude: float, unit: float | None, duration: float, interval: float) -> Manoeuvre:
    """One of the usual manoeuvres, or the elevator of a file."""
    if shape not in SHAPES and (Path(shape).exists() or "." in shape):
        return recorded(Path(shape), interval)
    return manoeuvre(shape, amplitude, _UNITS.get(shape, 1.0) if unit is None else unit, duration, interval)


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
    # Nothing about injected effects here: whoever gets the log is to find them.
    remark = f"Flown by JSBSim {jsbsim_version()}: {flight.log.name}, seed {plan.seed}"
    contents = {
        log: native_csv(flight.log, remark, _DIGITS),
        aircraft: flight.aircraft.text,
        truth: json.dumps(flight.truth, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
    }
    return write_files(out.parent, {name: text(content) for name, content in contents.items()})
