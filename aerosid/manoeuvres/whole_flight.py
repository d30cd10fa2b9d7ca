"""Whole flights given as one manoeuvre: one sentence with the spans that look useful, and those spans themselves."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from aerosid.errors import LogError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.quality import degrees_findings
from aerosid.manoeuvres.settings import FinderSettings

if TYPE_CHECKING:
    from aerosid.manoeuvres.segmentation import FlightSegmentation, FoundManoeuvre

__all__ = [
    "LONGITUDINAL",
    "elevator_manoeuvres",
    "is_whole_flight",
    "longitudinal_manoeuvres",
    "require_manoeuvre",
    "whole_flight_sentence",
]

LONGITUDINAL = ("doublet", "211", "3211", "steps", "sweep", "multisine", "short_period")
"""Kinds that identify longitudinal derivatives about one trim, if the elevator was moved."""

_NAMED = 8
"""Display: spans in a sentence at most."""

USUAL = FinderSettings()


def is_whole_flight(log: FlightLog, settings: FinderSettings = USUAL) -> bool:
    """Whether a log is longer than any one manoeuvre, or holds time on the ground as well as in the air."""
    if "V" not in log:
        return False
    speed = log["V"]
    if not np.isfinite(speed).any():
        return False
    fast = float(np.nanpercentile(speed, 95.0))
    seconds = float(log.time[-1] - log.time[0])
    if seconds > max(settings.one_record, settings.one_record_units * fast / 9.80665):
        return True
    stands = np.nan_to_num(speed, nan=settings.standing) < settings.standing
    return fast > 3.0 * settings.standing and bool(np.mean(stands) > settings.standing_share)


def elevator_manoeuvres(log: FlightLog, settings: FinderSettings = USUAL) -> tuple[FlightLog, ...]:
    """The cuts of a log that identify longitudinal derivatives, each named for its kind and beginning.

    Raises
    ------
    LogError
        Where it holds none, with the kinds that it holds.
    """
    from aerosid.manoeuvres.segmentation import find_manoeuvres  # late: most logs are no whole flight

    found = find_manoeuvres(log, settings=settings)
    cuts = tuple(
        replace(log.between(entry.cut_from, entry.cut_to), name=f"{log.name}_{entry.start:.0f}_{entry.kind}")
        for entry in longitudinal_manoeuvres(found)
    )
    if not cuts:
        kinds = ", ".join(sorted({entry.kind for entry in found})) or "nothing"
        raise LogError(
            f"{log.path or log.name}: no elevator manoeuvre was found in it (found: {kinds}); see what `aerosid find` "
            "lists with --rejected, and give a span as LOG@FROM:TO."
        )
    return cuts


def require_manoeuvre(log: FlightLog, settings: FinderSettings = USUAL) -> None:
    """Refuse a whole flight given as one manoeuvre, and angles recorded in degrees under a unit of radians.

    Raises
    ------
    LogError
        With the suitable spans, or the channel and its unit.
    """
    if wrong := degrees_findings(log):
        raise LogError(f"{log.path or log.name}: {wrong[0]}")
    if (sentence := whole_flight_sentence(log, settings)) is not None:
        raise LogError(sentence)


def longitudinal_manoeuvres(found: FlightSegmentation) -> tuple[FoundManoeuvre, ...]:
    """The elevator manoeuvres that identify longitudinal derivatives about one trim."""
    return tuple(entry for entry in found if _is_longitudinal(entry))


def _is_longitudinal(entry: FoundManoeuvre) -> bool:
    return entry.kind in LONGITUDINAL and entry.surface == "delta_e"


def whole_flight_sentence(log: FlightLog, settings: FinderSettings = USUAL) -> str | None:
    """Advice on a whole flight: its length, time in the air, and suitable spans; None for a manoeuvre."""
    if not is_whole_flight(log, settings):
        return None
    from aerosid.manoeuvres.segmentation import find_manoeuvres  # late: most logs are no whole flight

    found = find_manoeuvres(log, settings=settings)
    useful = longitudinal_manoeuvres(found)
    others = [entry for entry in found.dynamic if entry not in useful]
    ordered = sorted([*useful, *others][:_NAMED], key=lambda entry: entry.start)
    spans = ", ".join(f"{entry.cut_from:.1f}:{entry.cut_to:.1f} ({entry.kind.replace('_', ' ')})" for entry in ordered)
    seconds = log.time[-1] - log.time[0]
    ground = ""
    if found.lacking:
        ground = f", and manoeuvres cannot be found without {' and '.join(found.lacking)}"
    elif not found.airborne:
        ground = ", and never clear of the ground"
    elif found.airborne[0][0] > found.start + 1.0:
        ground = f", on the ground until {found.airborne[0][0]:.0f} s"
    looks = f"suitable spans: {spans}" if spans else "no manoeuvre was found in it"
    name = log.path or log.name
    return (
        f"{name}: this log is {seconds:.0f} s long{ground}; choose a span as {name}@FROM:TO, with --from and --to, or "
        f"all of them with --find; {looks}."
    )
