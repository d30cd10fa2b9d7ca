"""Mass, moment of inertia and centre of gravity as fuel is burnt: each manoeuvre at its own loading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft.model import Aircraft, DeclaredEffect
from aerosid.logs.flight_log import ChannelSource, FlightLog
from aerosid.notation import plain

__all__ = ["at_own_loading", "fuel_at", "with_mass"]

_LEAST_SHIFT = 1e-4
"""Numerical: m; a tenth of a millimetre moves nothing."""

_SPREAD_TOLD = 0.01
"""Display: share of I_yy, or of the mean chord, by which logs of one estimate may differ without a note."""


def fuel_at(log: FlightLog) -> NDArray[np.float64] | None:
    """Fuel used at every sample, kg, without gaps; None where the log does not hold it."""
    if "fuel_used" not in log:
        return None
    present = np.isfinite(log["fuel_used"])
    if np.count_nonzero(present) < 2:
        return None
    return np.interp(log.time, log.time[present], log["fuel_used"][present])


def with_mass(log: FlightLog, aircraft: Aircraft) -> FlightLog:
    """The log with the mass that the aircraft's fuel table gives; as it is where it holds one, or no fuel used."""
    used = fuel_at(log)
    if aircraft.fuel is None or used is None or "mass" in log:
        return log
    mass = aircraft.fuel.mass_at(used, aircraft.mass)
    return replace(
        log,
        channels={**log.channels, "mass": mass},
        units={**log.units, "mass": "kg"},
        sources={**log.sources, "mass": ChannelSource(("fuel_used",), "kg")},
        notes=(
            *log.notes,
            f"mass: {plain(mass[0])} to {plain(mass[-1])} kg from fuel used and the aircraft file",
        ),
    )


def at_own_loading(
    aircraft: Aircraft, identification: Sequence[FlightLog], validation: Sequence[FlightLog] = ()
) -> tuple[Aircraft, list[FlightLog], list[FlightLog]]:
    """The aircraft and logs of one estimate at the loading that was flown.

    Mass follows every sample; the moment of inertia and the centre of gravity are those of the mean fuel used on the
    identification logs, the latter as a declared shift, so that derivatives stay those about the declared centre.

    Parameters
    ----------
    aircraft : Aircraft
        As read; it is returned as it is where it holds no fuel table, or no log holds fuel used.
    identification, validation : sequence of FlightLog
    """
    known = [used for log in identification if (used := fuel_at(log)) is not None]
    if aircraft.fuel is None or not known:
        return aircraft, list(identification), list(validation)
    table = aircraft.fuel
    means = np.array([float(used.mean()) for used in known])
    inertia, ahead = table.inertia_at(means, aircraft.I_yy), table.centre_at(means)
    note = f"I_yy {plain(inertia.mean())} kg m^2 and centre of gravity {ahead.mean():+.4g} m ahead, at the fuel used"
    if float(np.ptp(inertia)) > _SPREAD_TOLD * float(inertia.mean()):
        note += f"; one for all logs, whose own are {plain(inertia.min())} to {plain(inertia.max())} kg m^2"
    if float(np.ptp(ahead)) > _SPREAD_TOLD * aircraft.mean_chord:
        note += f"; one centre for all logs, whose own are {ahead.min():+.4g} to {ahead.max():+.4g} m ahead"
    shift = float(ahead.mean())
    effects = aircraft.effects
    if abs(shift) > _LEAST_SHIFT:
        effects = (*effects, DeclaredEffect("cg_shift", "x", shift))
    loaded = replace(aircraft, I_yy=float(inertia.mean()), effects=effects)
    logs = [[with_mass(log, aircraft) for log in part] for part in (identification, validation)]
    return loaded, [replace(log, notes=(*log.notes, note)) for log in logs[0]], logs[1]
