"""A strip chart of each manoeuvre: the inputs and the response of the aircraft."""

from __future__ import annotations

import math

import numpy as np

from aerosid.logs.flight_log import FlightLog
from aerosid.manoeuvres import FlightSegmentation, FoundManoeuvre
from aerosid.reporting.figures.chart import Chart, Corridor, Line, Mark
from aerosid.reporting.figures.layout import Row, limits_around, stacked
from aerosid.reporting.words import shown_unit, subscripted

__all__ = ["manoeuvre_chart", "overview_chart"]

_LATERAL = ("dutch_roll", "aperiodic_roll", "spiral", "turn", "steady_turn")
_CHANNELS = ("q", "alpha", "a_z", "theta", "V")
_LATERAL_CHANNELS = ("p", "r", "phi", "a_y", "beta")
_HEIGHT, _GAP = 46.0, 10.0
"""Display: pt, of a strip and between strips."""

_MOST_POINTS = 1500
"""Display: maximum number of points of one strip."""

_LEAST_SHARE = 0.1
"""Display: least fraction of a channel's range in the recording that a strip spans, or rest would look like motion."""

_PADDING = 1.5
"""Display: shown time before and after a cut, in lead-in times."""


def manoeuvre_chart(log: FlightLog, manoeuvre: FoundManoeuvre) -> Chart | None:
    """Its surfaces and responses over the cut, with the manoeuvre's limits; None where nothing is recorded."""
    pad = _PADDING * max(manoeuvre.start - manoeuvre.cut_from, 0.02 * (manoeuvre.stop - manoeuvre.start))
    part = log.between(max(log.time[0], manoeuvre.cut_from - pad), min(log.time[-1], manoeuvre.cut_to + pad))
    lateral = manoeuvre.kind in _LATERAL or manoeuvre.surface in ("delta_a", "delta_r")
    surfaces = [name for name in ("delta_e", "delta_a", "delta_r") if name in log]
    wanted = [*surfaces, *(_LATERAL_CHANNELS if lateral else _CHANNELS)]
    return _strips(part, wanted, [(manoeuvre.start, manoeuvre.stop)], _least_ranges(log, wanted))


def overview_chart(log: FlightLog, segmentation: FlightSegmentation) -> Chart | None:
    """Speed, height, bank and load factor over the whole recording, with every motion marked."""
    spans = [(entry.start, entry.stop) for entry in segmentation.dynamic]
    return _strips(log, ["V", "h", "phi", "a_z", "delta_e"], spans, {})


def _least_ranges(log: FlightLog, names: list[str]) -> dict[str, float]:
    """Least span of the strip of each channel, SI."""
    present = [name for name in names if name in log and np.isfinite(log[name]).any()]
    return {name: _LEAST_SHARE * float(np.ptp(np.nanpercentile(log[name], (0.5, 99.5)))) for name in present}


def _strips(
    log: FlightLog, names: list[str], spans: list[tuple[float, float]], least: dict[str, float]
) -> Chart | None:
    rows = []
    every = max(1, math.ceil(log.samples / _MOST_POINTS))
    for name in names:
        if name not in log or not np.isfinite(log[name]).any():
            continue
        unit = shown_unit(log.units.get(name, "1"))
        values = unit.factor * log[name][::every]
        middle = 0.5 * (np.nanmin(values) + np.nanmax(values))
        half = 0.5 * unit.factor * least.get(name, 0.0)
        limits = limits_around(np.append(values, (middle - half, middle + half)))
        low, high = (np.full(2, limit) for limit in limits)
        marks: list[Mark] = [Corridor(np.array(span), low, high) for span in spans]
        marks.append(Line(log.time[::every], values, "ink"))
        label = f"{subscripted(name)} [{unit.text}]" if unit.text not in ("", "1") else subscripted(name)
        rows.append(Row(_HEIGHT, _GAP, label, limits, tuple(marks)))
    if not rows:
        return None
    return stacked(rows, (float(log.time[0]), float(log.time[-1])), "")
