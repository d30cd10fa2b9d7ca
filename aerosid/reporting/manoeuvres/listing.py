"""manoeuvres.json: contents of a recording, on its own clock."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from aerosid import __version__
from aerosid.logs.flight_log import FlightLog
from aerosid.manoeuvres import FlightSegmentation, FoundManoeuvre
from aerosid.notation import finite

__all__ = ["SCHEMA", "segmentation_json"]

SCHEMA = 1
"""Format: version of the listing."""

_CLOCK_DIGITS = 6
"""Display: decimals of a time in s: a microsecond."""

_DIGITS = 7
"""Display: significant digits of all else, as in a native log."""


def segmentation_json(segmentation: FlightSegmentation, log: FlightLog) -> dict[str, Any]:
    """The JSON document of `aerosid find --json`; times in s on the recording's own clock, all else SI and radians."""
    return {
        "schema": SCHEMA,
        "aerosid": __version__,
        "log": {
            "path": log.path,
            "sha256": log.sha256,
            "start": _clock(segmentation.start),
            "stop": _clock(segmentation.stop),
            "airborne": [[_clock(first), _clock(last)] for first, last in segmentation.airborne],
            "holes": [[_clock(at), _clock(length)] for at, length in segmentation.holes],
        },
        "manoeuvres": [_entry(manoeuvre) for manoeuvre in segmentation],
        "lacking": list(segmentation.lacking),
        "rejected": [
            {
                "start": _clock(entry.start),
                "stop": _clock(entry.stop),
                "surface": entry.surface,
                "reason": entry.reason,
            }
            for entry in segmentation.rejected
        ],
    }


def _entry(manoeuvre: FoundManoeuvre) -> dict[str, Any]:
    return {
        "kind": manoeuvre.kind,
        "start": _clock(manoeuvre.start),
        "stop": _clock(manoeuvre.stop),
        "cut": {"from": _clock(manoeuvre.cut_from), "to": _clock(manoeuvre.cut_to)},
        "surface": manoeuvre.surface,
        "moved": [
            {
                "channel": entry.channel,
                "least": finite(entry.least, _DIGITS),
                "greatest": finite(entry.greatest, _DIGITS),
                "unit": entry.unit,
            }
            for entry in manoeuvre.moved
        ],
        "condition": {name: finite(value, _DIGITS) for name, value in manoeuvre.condition.items()},
        "turbulence": finite(manoeuvre.turbulence, _DIGITS),
        "expected": [
            {
                "coefficient": entry.coefficient,
                "term": entry.term,
                "value": finite(entry.value, _DIGITS),
                "deviation": finite(entry.deviation, _DIGITS),
                "unit": entry.unit,
            }
            for entry in manoeuvre.expected
        ],
        "detail": _detail(manoeuvre.detail),
    }


def _detail(detail: Mapping[str, float | str | tuple[float, ...]]) -> dict[str, Any]:
    plain: dict[str, Any] = {}
    for name, value in detail.items():
        if isinstance(value, tuple):
            plain[name] = [finite(entry, _DIGITS) for entry in value]
        else:
            plain[name] = value if isinstance(value, str) else finite(value, _DIGITS)
    return plain


def _clock(seconds: float) -> float:
    return round(float(seconds), _CLOCK_DIGITS)
