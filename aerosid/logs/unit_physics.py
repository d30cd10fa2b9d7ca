"""Units and signs of channels from physics: theta' = q, one g in level flight, h' = V sin gamma."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats.units import UnitProblem, conversion
from aerosid.logs.log_consistency import answer_to_elevator, integral_and_recorded, pitch_factor
from aerosid.logs.settings import COURSES, QUALITY
from aerosid.nomenclature import CHANNELS


@dataclass(frozen=True)
class ProposalSettings:
    """Limits of the physical relations.

    Attributes
    ----------
    likeness : float
        A slope or mean equals a value within this fraction of it. Scale errors of sensors are smaller; the units to be
        distinguished differ by a factor of 1.6 and more.
    level_bank : float
        rad; samples with more bank are not level flight.
    flying : float
        Fraction of the greatest airspeed; slower samples are on the ground.
    right_answer : float
        Correlation of the elevator's and the pitch acceleration's changes that determines the elevator's sign; -0.4 to
        -0.85 on doublets and 3-2-1-1 of five aircraft (`QualitySettings.wrong_answer`).
    """

    likeness: float = 0.12
    level_bank: float = 0.17
    flying: float = 0.5
    right_answer: float = 0.3


@dataclass
class ProposedChannel:
    """One line of a proposed map.

    Attributes
    ----------
    column : str
        Its column.
    unit : str
        Of its numbers; empty where neither file nor physics determines it.
    sign : int
        By physics, or 1.
    offset : float
        By physics, in the unit.
    scale : float
        From a ready map: factors to the unit.
    reasons : list of str
        The reason for the choice.
    asked : bool
        Whether a person has to confirm it before use.
    """

    column: str
    unit: str
    sign: int = 1
    offset: float = 0.0
    scale: float = 1.0
    reasons: list[str] = field(default_factory=list)
    asked: bool = False


def apply_physics(channels: dict[str, ProposedChannel], log: FlightLog | None, settings: ProposalSettings) -> None:
    """Fills in units, signs and offsets from the physical relations between channels, each with its reason.

    Parameters
    ----------
    channels : dict of str to ProposedChannel
        By the glossary's name; changed in place.
    log : FlightLog or None
        The raw numbers of these channels on one time base, in unknown units; None where there is no time.
    settings : ProposalSettings
        Limits of the relations.
    """
    for name, proposed in channels.items():
        try:
            if proposed.unit:
                conversion(proposed.unit, CHANNELS[name].unit)
        except UnitProblem:
            proposed.reasons.append(f"the file's unit {proposed.unit!r} is not a unit of this channel")
            proposed.unit = ""
        if not proposed.unit and CHANNELS[name].unit == "1":
            proposed.unit = "1"
    if log is None:
        return
    _judge_angles(channels, log, settings)
    judge_load_factor(channels, log, settings)
    _judge_altitude(channels, log, settings)
    _judge_elevator(channels, log, settings)


# Units of an angle and its rate, and the number of the file's angle units per one of its rate and second.
_PAIRS = (
    ("rad", "rad/s", 1.0),
    ("deg", "deg/s", 1.0),
    ("deg", "rad/s", float(np.degrees(1.0))),
    ("rad", "deg/s", float(np.radians(1.0))),
)
# Angles and rates of one instrument usually have the same unit.
_ALIKE = (("phi", "theta"), ("psi", "theta"), ("alpha", "theta"), ("beta", "theta"), ("p", "q"), ("r", "q"))


def _judge_angles(channels: dict[str, ProposedChannel], log: FlightLog, settings: ProposalSettings) -> None:
    """Theta' = q: which of the two is in degrees, and whether one has the opposite sign."""
    slope = pitch_factor(FlightLog("proposal", log.time, {k: log[k] for k in ("theta", "q") if k in log}))
    if slope is None:
        return
    if slope < 0.0:
        channels["q"].sign, channels["q"].asked = -1, True
        channels["q"].reasons.append(f"theta' = {slope:.3g} q: one of the two has the wrong sign, q in this proposal")
    size = float(np.nanmax(np.abs(log["theta"])))
    for angle, rate, expected in _PAIRS:
        like = abs(abs(slope) / expected - 1.0) < 2.0 * settings.likeness
        by_size = expected != 1.0 or (size > QUALITY.most_radians["theta"]) == (angle == "deg")
        if like and by_size:
            for name, unit in (("theta", angle), ("q", rate)):
                if not channels[name].unit:
                    channels[name].unit = unit
                    channels[name].reasons.append(f"theta' = {slope:.3g} q, theta up to {size:.3g}")
    for name, parent in _ALIKE:
        if name in channels and not channels[name].unit and channels[parent].unit:
            channels[name].unit, channels[name].asked = channels[parent].unit, True
            channels[name].reasons.append(f"as {parent}")


def _level(channels: dict[str, ProposedChannel], log: FlightLog, settings: ProposalSettings) -> NDArray[np.bool_]:
    """Which samples are level flight, judged by bank and airspeed; shape (N,)."""
    level = np.ones(log.samples, dtype=bool)
    if "phi" in log:
        bank = np.abs(log["phi"]) * (float(np.radians(1.0)) if channels["phi"].unit == "deg" else 1.0)
        level &= ~(bank > settings.level_bank)
    if "V" in log:
        level &= ~(log["V"] < settings.flying * np.nanmax(log["V"]))
    return level


# Mean in level flight, and the unit, sign and offset that convert it to a_z = -9.81 m/s^2.
_CONVENTIONS = (
    (-9.80665, "m/s^2", 1, 0.0, "specific force, positive down"),
    (9.80665, "m/s^2", -1, 0.0, "specific force, positive up"),
    (-1.0, "g", 1, 0.0, "load factor, positive down"),
    (1.0, "g", -1, 0.0, "load factor, absolute (1 in level flight)"),
    (0.0, "g", -1, -1.0, "load factor, incremental (0 in level flight)"),
)


def judge_load_factor(channels: dict[str, ProposedChannel], log: FlightLog, settings: ProposalSettings) -> None:
    """The convention of a_z from its mean in level flight, to be confirmed where it is a load factor.

    Parameters
    ----------
    channels, log, settings
        As for `apply_physics`.
    """
    if "a_z" not in log:
        return
    level = _level(channels, log, settings)
    values = log["a_z"][level]
    mean = float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
    proposed = channels["a_z"]
    for expected, unit, sign, offset, words in _CONVENTIONS:
        if abs(mean - expected) < settings.likeness * max(abs(expected), 1.0):
            proposed.unit, proposed.sign, proposed.offset = unit, sign, offset
            proposed.reasons.append(f"mean {mean:.3g} in level flight: {words}")
            # Instruments of the same name use either convention: the user has to decide.
            proposed.asked = unit == "g"
            return
    proposed.asked = True
    found = (
        f"mean {mean:.3g} in level flight fits no convention"
        if np.isfinite(mean)
        else "no level flight shows its convention"
    )
    proposed.reasons.append(f"{found}: give unit, sign and offset")


def _judge_altitude(channels: dict[str, ProposedChannel], log: FlightLog, settings: ProposalSettings) -> None:
    """H' = V sin(theta - alpha): the altitude's unit from the airspeed's."""
    needed = ("h", "V", "theta")
    if any(name not in log or (name != "h" and not channels[name].unit) for name in needed) or channels["h"].unit:
        return
    angle = log["theta"] * conversion(channels["theta"].unit, "rad").factor
    if "alpha" in log and channels["alpha"].unit:
        angle = angle - log["alpha"] * conversion(channels["alpha"].unit, "rad").factor
    climb = log["V"] * conversion(channels["V"].unit, "m/s").factor * np.sin(angle)
    there = np.isfinite(climb) & np.isfinite(log["h"])
    time, climb, altitude = log.time[there], climb[there], log["h"][there]
    if time.size < COURSES.fewest:
        return
    left, right = integral_and_recorded(time, climb, altitude)
    power = float(left @ left)
    if power == 0.0 or float(right @ right) == 0.0 or np.corrcoef(left, right)[0, 1] < COURSES.agreeing:
        return
    slope = float(left @ right) / power
    for unit in ("m", "ft"):
        expected = 1.0 / conversion(unit, "m").factor
        if abs(slope / expected - 1.0) < 3.0 * settings.likeness:
            channels["h"].unit = unit
            channels["h"].reasons.append(f"altitude rate = {slope:.3g} V sin(gamma)")


def _judge_elevator(channels: dict[str, ProposedChannel], log: FlightLog, settings: ProposalSettings) -> None:
    answer = answer_to_elevator(log)
    if answer is None or abs(answer) < settings.right_answer:
        return
    answer *= channels["q"].sign
    channels["delta_e"].reasons.append(f"pitch acceleration responds with a correlation of {answer:.2g}")
    if answer > 0.0:
        channels["delta_e"].sign, channels["delta_e"].asked = -1, True
