"""Flight condition of a record for the title block: altitude, airspeed, Mach number, mass, centre of gravity, flaps."""

from __future__ import annotations

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.standard_atmosphere import calibrated_airspeed, density_altitude, mach_number
from aerosid.notation import number
from aerosid.reporting.settings import REMARKS
from aerosid.reporting.words import shown_unit

NOT_RECORDED = "not recorded"
FOOT, KNOT = 0.3048, 1852.0 / 3600.0
"""Standard: m, m/s."""


def flight_condition(log: FlightLog, aircraft: Aircraft) -> dict[str, str]:
    """Mean values over the record as texts by quantity, with their range where they vary.

    `not recorded` where neither file gives them.

    Parameters
    ----------
    log : FlightLog
        One recording, cut to the span used.
    aircraft : Aircraft
        Source of mass and air density where the log does not contain them.
    """
    return {
        "altitude": _altitude(log),
        "true airspeed": _shown(log, "V"),
        "calibrated airspeed": _calibrated(log, aircraft),
        "Mach number": _mach(log, aircraft),
        "mass": _shown(log, "mass") if _held(log, "mass") else f"{number(aircraft.mass, 4)} kg (aircraft file)",
        "centre of gravity": _centre_of_gravity(log, aircraft),
        "flaps": _shown(log, "delta_f") if _held(log, "delta_f") else _configured(aircraft, "flaps"),
        "gear": _configured(aircraft, "gear"),
    }


def _configured(aircraft: Aircraft, name: str) -> str:
    """Configuration as flown, from the aircraft file."""
    return aircraft.configuration.get(name, NOT_RECORDED)


def _centre_of_gravity(log: FlightLog, aircraft: Aircraft) -> str:
    """The centre of gravity in the file's words, and its shift due to the fuel used."""
    declared = _configured(aircraft, "centre_of_gravity")
    if aircraft.fuel is None or not aircraft.fuel.x_cg or not _held(log, "fuel_used"):
        return declared
    ahead = float(np.mean(aircraft.fuel.centre_at(log["fuel_used"][np.isfinite(log["fuel_used"])])))
    moved = f"{number(ahead, 2)} m ahead of the declared one, by fuel used"
    return moved if declared == NOT_RECORDED else f"{declared}; {moved}"


def _held(log: FlightLog, name: str) -> bool:
    return name in log and bool(np.isfinite(log[name]).any())


def _shown(log: FlightLog, name: str, digits: int = 4) -> str:
    """Mean, and range where it varies, in the unit shown."""
    if not _held(log, name):
        return NOT_RECORDED
    unit = shown_unit(log.units.get(name, "1"))
    values = unit.factor * log[name][np.isfinite(log[name])]
    mean, low, high = (float(value) for value in (values.mean(), values.min(), values.max()))
    text = number(mean, digits)
    if high - low > REMARKS.steady * max(abs(mean), 1e-9):
        text += f" ({number(low, digits)} to {number(high, digits)})"
    return f"{text} {unit.text}".rstrip()


def _altitude(log: FlightLog) -> str:
    if not _held(log, "h"):
        return NOT_RECORDED
    return f"{_shown(log, 'h')}, {number(float(np.nanmean(log['h'])) / FOOT, 4)} ft"


def _density(log: FlightLog, aircraft: Aircraft) -> float | None:
    if _held(log, "rho"):
        return float(np.nanmean(log["rho"]))
    if _held(log, "q_bar") and _held(log, "V"):
        return float(np.nanmean(2.0 * log["q_bar"] / log["V"] ** 2))
    return aircraft.density


def standard_altitude(log: FlightLog, aircraft: Aircraft) -> float | None:
    """The recorded altitude, m, or the density altitude where none is recorded; None where neither is known."""
    if _held(log, "h"):
        return float(np.nanmean(log["h"]))
    density = _density(log, aircraft)
    return None if density is None else density_altitude(density)


def _calibrated(log: FlightLog, aircraft: Aircraft) -> str:
    altitude = standard_altitude(log, aircraft)
    if altitude is None or not _held(log, "V"):
        return NOT_RECORDED
    speed = calibrated_airspeed(float(np.nanmean(log["V"])), altitude)
    return f"{number(speed / KNOT, 3)} kt (standard day)"


def _mach(log: FlightLog, aircraft: Aircraft) -> str:
    if _held(log, "mach"):
        return _shown(log, "mach", 3)
    altitude = standard_altitude(log, aircraft)
    if altitude is None or not _held(log, "V"):
        return NOT_RECORDED
    return f"{number(mach_number(float(np.nanmean(log['V'])), altitude), 3)} (standard day)"
