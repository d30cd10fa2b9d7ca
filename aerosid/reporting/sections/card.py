"""Pilot's card of the next flight: pressure altitude, calibrated airspeed, stick and load-factor cues, limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from aerosid.logs.standard_atmosphere import (
    DENSITY_ALTITUDE_PER_KELVIN,
    GRAVITY,
    calibrated_airspeed,
    density_altitude,
)
from aerosid.loop.next_flight.flight_limits import RANGES
from aerosid.loop.next_flight.planned_flight import PlannedInput, PlannedPeak, Question
from aerosid.loop.next_flight.predicted_flight import SURFACES
from aerosid.loop.result import ClosedLoop
from aerosid.notation import MISSING, decimals, number
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.flight_condition import FOOT, KNOT
from aerosid.reporting.words import shown_unit

GIVEN, FLOWN = "†", "‡"
"""Footnote signs: a given limit, and one taken from the flown range."""

_NAMES = {
    "alpha": "angle of attack",
    "n_z": "load factor",
    "V": "true airspeed",
    "theta": "pitch attitude",
    "beta": "sideslip",
    "phi": "bank",
    **SURFACES,
    "p": "roll rate",
    "q": "pitch rate",
    "r": "yaw rate",
}
"""Pilots' names of the limited quantities."""

_STICK = {"delta_e": ("push", "pull"), "delta_r": ("left pedal", "right pedal"), "delta_a": ("left", "right")}
"""A pilot's words for a positive and a negative deflection of a surface."""

_SENSES = {
    "delta_e": "Elevator positive trailing edge down, stick forward.",
    "delta_r": "Rudder positive trailing edge left, left pedal.",
    "delta_a": "Aileron positive right trailing edge down, stick left.",
}

_PLACES = {"n_z": 2}
"""Display: decimals on the card, as far as instruments can be read; 1 where not listed."""


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The card; None where there is no flight to fly."""
    ahead = result.next_flight
    if ahead is None or ahead.input is None:
        return None
    planned = ahead.input
    altitude = density_altitude(planned.density)
    limits = [_limit(peak, altitude) for peak in planned.peaks]
    return {
        "planned": planned,
        "altitude": number(round(altitude / FOOT, -1), 4),
        "metres": number(round(altitude, -1), 4),
        "per_kelvin": number(DENSITY_ALTITUDE_PER_KELVIN / FOOT, 2),
        "airspeed": number(calibrated_airspeed(planned.airspeed, altitude) / KNOT, 3),
        "steps": list(_steps(planned)),
        "end": f"{planned.steps[-1].start + planned.steps[-1].duration:.1f}" if planned.steps else "",
        "cued": "a_z" in planned.expected,
        "surfaces": [SURFACES[name] for name in planned.deflections],
        "senses": " ".join(_SENSES[name] for name in planned.deflections),
        "limits": limits,
        "signs": {limit["sign"] for limit in limits if limit["sign"]},
        "given": GIVEN,
        "flown": FLOWN,
        "percent": round(100 * RANGES.margin),
        "decides": [_decides(question) for question in ahead.questions if question.repeats is not None],
        "repeats": max((question.repeats or 1 for question in ahead.questions), default=1),
    }


def _steps(planned: PlannedInput) -> Iterator[dict[str, str]]:
    """Each step with the stick's direction and the expected load factor."""
    for step in planned.steps:
        end = step.start + step.duration
        positive, negative = _STICK[step.surface]
        stick = positive if step.deflection > 0.0 else negative if step.deflection < 0.0 else "neutral"
        yield {
            "start": f"{step.start:.1f}",
            "hold": f"{step.duration:.1f}",
            "surface": SURFACES[step.surface],
            "deflection": number(shown_unit("rad").factor * step.deflection, 3),
            "stick": stick,
            "cue": _load_factor(planned, step.start, end, stick),
        }


def _load_factor(planned: PlannedInput, start: float, end: float, stick: str) -> str:
    """The extreme of the expected load factor in a step, in the direction of the stick, to a tenth of g."""
    history = planned.expected.get("a_z")
    inside = (planned.time >= start) & (planned.time <= end)
    if history is None or not inside.any():
        return MISSING
    load = -history.chosen[inside] / GRAVITY
    extreme = float(np.min(load) if stick == "push" else np.max(load))
    return decimals(extreme, 1)


def _limit(peak: PlannedPeak, altitude: float) -> dict[str, str]:
    """A line of the card in the unit shown, airspeeds as calibrated in knots."""

    def shown(value: float | None) -> str:
        if value is None:
            return MISSING
        if peak.name == "V":
            return number(calibrated_airspeed(value, altitude) / KNOT, 3)
        places = _PLACES.get(peak.name, 1)
        return decimals(shown_unit(peak.unit).factor * value, places)

    speed = peak.name == "V"
    bounded = peak.limit_low is not None and peak.limit_high is not None
    return {
        "name": "calibrated airspeed" if speed else _NAMES.get(peak.name, peak.name),
        "unit": "kt" if speed else shown_unit(peak.unit).text or "1",
        "trim": shown(peak.trim),
        "expected": f"{shown(peak.lowest)} to {shown(peak.highest)}",
        "abort": f"{shown(peak.limit_low)} to {shown(peak.limit_high)}" if bounded else MISSING,
        "sign": "" if not bounded else GIVEN if peak.given else FLOWN,
    }


def _decides(question: Question) -> str:
    if question.kind == "derivative":
        return f"determine {question.subject}"
    return f"distinguish {question.subject} from {question.rival}"
