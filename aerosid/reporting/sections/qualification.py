"""Simulator qualification by 14 CFR Part 60, for flights with a manoeuvre of its tests."""

from __future__ import annotations

from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.roles import label_of
from aerosid.reporting.simulator_tolerances import (
    PHUGOID,
    ROLL_RESPONSE,
    RUDDER_RESPONSE,
    SHORT_PERIOD,
    Comparison,
    comparisons,
)


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any] | None:
    """The comparisons, flight by flight and paragraph by paragraph; None where no tolerance applies."""
    groups: dict[tuple[str, str, str], list[Comparison]] = {}
    for row in comparisons(result):
        groups.setdefault((row.log, row.role, row.source), []).append(row)
    labels = {role: label_of(role, result) for _, role, _ in groups}
    sources = list(dict.fromkeys(source for _, _, source in groups))
    pitching = any(source in (SHORT_PERIOD, PHUGOID) for source in sources)
    sideways = any(source in (ROLL_RESPONSE, RUDDER_RESPONSE) for source in sources)
    taken = [sentence for shown, sentence in ((pitching, _PITCHING), (sideways, _SIDEWAYS)) if shown]
    if not groups:
        return None
    return {"groups": groups, "sources": sources, "labels": labels, "taken": taken, "explained": _EXPLAINED}


_PITCHING = (
    "A flight counts as a short-period test where a brief movement of the elevator is followed by free response at "
    "nearly constant airspeed, and as a phugoid test where the elevator rests for a period or more while the airspeed "
    "swings."
)
_SIDEWAYS = (
    "It counts as a test of the roll or rudder response where aileron or rudder moves briefly and the other one rests."
)
_SAMPLES = (
    "the largest difference of any sample from one second before the {} begins to move to five after it ends, in every "
    "such manoeuvre, measurement noise included. The strips show the tolerance as a corridor around the measured points"
)
_EXPLAINED = {
    SHORT_PERIOD: f"pitch angle or pitch rate, and acceleration; {_SAMPLES.format('elevator')}",
    PHUGOID: "period, and time to half or double amplitude or damping ratio, from a damped oscillation fitted to the "
    "airspeed while the elevator rests",
    ROLL_RESPONSE: f"roll rate and bank angle; {_SAMPLES.format('aileron')}",
    RUDDER_RESPONSE: f"yaw rate; {_SAMPLES.format('rudder')}",
}
