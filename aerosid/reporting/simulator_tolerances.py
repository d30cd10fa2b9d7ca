"""Simulator qualification: differences of simulated from measured flights against the tolerances of 14 CFR Part 60.

The tolerances are those of Appendix A to Part 60 (Qualification Performance Standards for Airplane Full Flight
Simulators), Attachment 2, Table A2A, entries 2.c.9, 2.c.10, 2.d.2, 2.d.3 and 2.d.6. They are applied as a yardstick:
whether a flight meets the other conditions of a qualification test (configuration, control states) is not known here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.constants import GRAVITY
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.settings import SIMULATOR_TESTS

FloatArray = NDArray[np.float64]

SHORT_PERIOD = "14 CFR Part 60, Appendix A, Attachment 2, Table A2A, entry 2.c.10 (short period dynamics)"
PHUGOID = "14 CFR Part 60, Appendix A, Attachment 2, Table A2A, entry 2.c.9 (phugoid dynamics)"

SHORT_PERIOD_TOLERANCES = {"theta": math.radians(1.5), "q": math.radians(2.0), "a_z": 0.10 * GRAVITY}
"""SI. The paragraph requires the pitch angle or the pitch rate, and the acceleration."""

ROLL_RESPONSE = "14 CFR Part 60, Appendix A, Attachment 2, Table A2A, entries 2.d.2 and 2.d.3 (roll response)"
RUDDER_RESPONSE = "14 CFR Part 60, Appendix A, Attachment 2, Table A2A, entry 2.d.6 (rudder response)"


class BriefResponse(NamedTuple):
    """A test of a brief movement of one control and the free response to it.

    Attributes
    ----------
    source : str
        The paragraph.
    control : str
        The channel that moves.
    resting : tuple of str
        Controls that must rest: the test ends when one of them moves.
    tolerances : mapping of str to float
        Of each channel, SI.
    responding : tuple of str
        One of these must respond by more than twice its tolerance, or the response proves nothing.
    """

    source: str
    control: str
    resting: tuple[str, ...]
    tolerances: Mapping[str, float]
    responding: tuple[str, ...]


STARTS = 12
"""Numerical: frequencies, a fifth apart, from which the likeliest is the start of an oscillation's fit."""

SHORT_PERIOD_TEST = BriefResponse(SHORT_PERIOD, "delta_e", (), SHORT_PERIOD_TOLERANCES, ("theta", "q"))
BRIEF_RESPONSES = (
    SHORT_PERIOD_TEST,
    BriefResponse(
        ROLL_RESPONSE, "delta_a", ("delta_r",), {"p": math.radians(2.0), "phi": math.radians(2.0)}, ("p", "phi")
    ),
    BriefResponse(RUDDER_RESPONSE, "delta_r", ("delta_a",), {"r": math.radians(2.0)}, ("r",)),
)
"""For roll and yaw the paragraphs permit 10 % where that is more; this is not used."""

PERIOD, TIME_TO_HALF, DAMPING_RATIO = 0.10, 0.10, 0.02
"""Standard: of the phugoid, 1: fractions of the measured period and time to half or double amplitude; or of the damping
ratio. 14 CFR Part 60, entry 2.c.9."""


@dataclass(frozen=True)
class Comparison:
    """One quantity of a manoeuvre against its tolerance; `before` and `after` are the largest differences, or None."""

    log: str
    role: str
    source: str
    quantity: str
    unit: str
    measured: float | None
    tolerance: float
    before: float | None
    after: float | None


@dataclass(frozen=True)
class Stretch:
    """The part of a log, s, that is such a test."""

    start: float
    stop: float


class Oscillation(NamedTuple):
    """A damped oscillation: its period, s, its damping ratio, and the time to half (negative: double) amplitude, s."""

    period: float
    damping_ratio: float
    time_to_half: float


def brief_responses(log: FlightLog, test: BriefResponse = SHORT_PERIOD_TEST) -> tuple[Stretch, ...]:
    """The tests of one kind in a log: brief movements of the control, free response, nearly constant airspeed.

    Notes
    -----
    A response that is no larger than twice the tolerance proves nothing and is left out.
    """
    movements = _movements(log, test.control)
    others = [movement for name in test.resting for movement in _movements(log, name)]
    found = []
    for i, (first, last) in enumerate(movements):
        end = movements[i + 1][0] if i + 1 < len(movements) else float(log.time[-1])
        end = min([end, *(begin for begin, _ in others if begin >= last)])
        start, stop = max(first - SIMULATOR_TESTS.before, float(log.time[0])), min(last + SIMULATOR_TESTS.free, end)
        inside = (log.time >= start) & (log.time <= stop)
        alone = not any(begin < last and over > first for begin, over in others)
        if (
            last - first <= SIMULATOR_TESTS.longest_input
            and alone
            and _steady(log, inside)
            and _answered(log, inside, test)
        ):
            found.append(Stretch(start, stop))
    return tuple(found)


def _steady(log: FlightLog, inside: NDArray[np.bool_]) -> bool:
    if "V" not in log:
        return True
    speed = log["V"][inside & np.isfinite(log["V"])]
    return bool(speed.size and np.ptp(speed) <= SIMULATOR_TESTS.steady_speed * float(np.mean(speed)))


def _answered(log: FlightLog, inside: NDArray[np.bool_], test: BriefResponse) -> bool:
    for channel in test.responding:
        if channel in log:
            values = log[channel][inside & np.isfinite(log[channel])]
            if values.size and np.ptp(values) > SIMULATOR_TESTS.answer * test.tolerances[channel]:
                return True
    return False


def free_phugoid(log: FlightLog) -> tuple[float, float] | None:
    """The longest rest of the elevator, s, if it lasts a phugoid's period or more and the airspeed oscillates in it.

    Notes
    -----
    The required period is Lanchester's, sqrt(2) pi V / g.
    """
    movements = _movements(log, SHORT_PERIOD_TEST.control)
    if not movements or "V" not in log:
        return None
    ends = [*(first for first, _ in movements[1:]), float(log.time[-1])]
    rests = [(last + SIMULATOR_TESTS.free, end) for (_, last), end in zip(movements, ends, strict=True)]
    start, stop = max(rests, key=lambda rest: rest[1] - rest[0])
    speed = log["V"][(log.time >= start) & (log.time <= stop)]
    speed = speed[np.isfinite(speed)]
    if speed.size < SIMULATOR_TESTS.fewest:
        return None
    mean = float(np.mean(speed))
    if stop - start < math.sqrt(2.0) * math.pi * mean / GRAVITY or float(np.std(speed)) < SIMULATOR_TESTS.swing * mean:
        return None
    return start, stop


def oscillation(time: FloatArray, values: FloatArray, period: float) -> Oscillation | None:
    """The damped oscillation about a mean that fits a history best; None where none does.

    Parameters
    ----------
    time, values : ndarray, shape (N,)
        s, any unit; NaN is a missing sample.
    period : float
        Start of the fit, s.

    Notes
    -----
    exp(-s t) (a cos(w t) + b sin(w t)) + c: a, b and c follow from s and w by linear least squares, so that only two
    parameters are searched for (variable projection).
    """
    present = np.isfinite(values)
    t, y = time[present] - time[0], values[present]
    if t.size < SIMULATOR_TESTS.fewest:
        return None

    def left(parameters: FloatArray) -> FloatArray:
        decay, rate = parameters
        envelope = np.exp(-decay * t)
        columns = np.column_stack([envelope * np.cos(rate * t), envelope * np.sin(rate * t), np.ones_like(t)])
        solution, *_ = np.linalg.lstsq(columns, y, rcond=None)
        return np.asarray(y - columns @ solution)

    from scipy.optimize import least_squares  # not at the top: few histories contain an oscillation

    rate = 2.0 * math.pi / period
    lowest, highest = 0.3 * rate, 3.0 * rate
    # The likeliest of some frequencies: over three periods the sum of squares has a minimum at others too.
    starts = np.geomspace(1.01 * lowest, 0.99 * highest, STARTS)
    start = min(starts, key=lambda tried: float(np.sum(left(np.array([0.02 * rate, tried])) ** 2)))
    bounds = ([-0.5 * rate, lowest], [2.0 * rate, highest])
    fitted = least_squares(left, [0.02 * rate, start], bounds=bounds, x_scale=[0.1 * rate, rate])
    decay, found = (float(number) for number in fitted.x)
    if 2.0 * float(fitted.cost) > SIMULATOR_TESTS.fitted * float(np.sum((y - y.mean()) ** 2)):
        return None
    return Oscillation(2.0 * math.pi / found, decay / math.hypot(decay, found), math.log(2.0) / decay)


def comparisons(result: ClosedLoop) -> tuple[Comparison, ...]:
    """Every tolerance that applies to a flight of the result, with the deviations of both models."""
    return tuple(row for simulated in result.simulated for row in (*_brief(simulated), *_long(simulated)))


def within(simulated: Simulated, channel: str) -> tuple[FloatArray, FloatArray] | None:
    """Lower and upper edge of the tolerance around a measured channel, SI, NaN outside the manoeuvres."""
    test = next((test for test in BRIEF_RESPONSES if channel in test.tolerances), None)
    if test is None or channel not in simulated.measured:
        return None
    inside = _inside(simulated.log, test)
    if not inside.any():
        return None
    measured = np.where(inside, simulated.measured[channel], np.nan)
    tolerance = test.tolerances[channel]
    return measured - tolerance, measured + tolerance


_QUANTITIES = {
    "theta": ("pitch angle", "rad"),
    "q": ("pitch rate", "rad/s"),
    "a_z": ("normal acceleration", "m/s^2"),
    "p": ("roll rate", "rad/s"),
    "phi": ("bank angle", "rad"),
    "r": ("yaw rate", "rad/s"),
}


def _brief(simulated: Simulated) -> Iterator[Comparison]:
    for test in BRIEF_RESPONSES:
        inside = _inside(simulated.log, test)
        if not inside.any():
            continue
        for channel, tolerance in test.tolerances.items():
            if channel in simulated.measured:
                quantity, unit = _QUANTITIES[channel]
                largest = [_largest(simulated, role, channel, inside) for role in ("before", "after")]
                head = (simulated.log.name, simulated.role, test.source, quantity, unit)
                yield Comparison(*head, None, tolerance, *largest)


def _inside(log: FlightLog, test: BriefResponse) -> NDArray[np.bool_]:
    """Which samples belong to a test of this kind."""
    inside = np.zeros(log.time.size, dtype=np.bool_)
    for stretch in brief_responses(log, test):
        inside |= (log.time >= stretch.start) & (log.time <= stretch.stop)
    return inside


def _largest(simulated: Simulated, role: str, channel: str, inside: NDArray[np.bool_]) -> float | None:
    history = getattr(simulated, role).get(channel)
    if history is None:
        return None
    difference = np.abs(simulated.measured[channel] - history)[inside & np.isfinite(simulated.measured[channel])]
    return float(difference.max()) if difference.size and np.isfinite(difference).all() else None


def _long(simulated: Simulated) -> Iterator[Comparison]:
    stretch = free_phugoid(simulated.log)
    if stretch is None or "V" not in simulated.measured:
        return
    inside = (simulated.log.time >= stretch[0]) & (simulated.log.time <= stretch[1])
    time = simulated.log.time[inside]
    mean = float(np.nanmean(simulated.measured["V"][inside]))
    period = math.sqrt(2.0) * math.pi * mean / GRAVITY
    histories = [getattr(simulated, role).get("V") for role in ("measured", "before", "after")]
    measured, *models = [None if h is None else oscillation(time, h[inside], period) for h in histories]
    if measured is None:
        return
    limits = (
        ("period", "s", measured.period, PERIOD * measured.period),
        (
            "time to half (negative: double) amplitude",
            "s",
            measured.time_to_half,
            TIME_TO_HALF * abs(measured.time_to_half),
        ),
        ("damping ratio", "1", measured.damping_ratio, DAMPING_RATIO),
    )
    for i, name in enumerate(("period", "time_to_half", "damping_ratio")):
        quantity, unit, value, tolerance = limits[i]
        differences = [None if model is None else abs(getattr(model, name) - value) for model in models]
        yield Comparison(
            simulated.log.name,
            simulated.role,
            PHUGOID,
            quantity,
            unit,
            value,
            tolerance,
            differences[0],
            differences[1],
        )


def _movements(log: FlightLog, control: str) -> list[tuple[float, float]]:
    """Times at which a control begins and ends to move, s, for each movement separated from the next by a rest."""
    if control not in log:
        return []
    present = np.isfinite(log[control])
    time, surface = log.time[present], log[control][present]
    if time.size < SIMULATOR_TESTS.fewest or np.ptp(surface) <= 0.0:
        return []
    later = np.interp(time + SIMULATOR_TESTS.within, time, surface)
    moving = time[np.abs(later - surface) > SIMULATOR_TESTS.move * np.ptp(surface)]
    if not moving.size:
        return []
    breaks = np.flatnonzero(np.diff(moving) > SIMULATOR_TESTS.free)
    firsts, lasts = moving[np.r_[0, breaks + 1]], moving[np.r_[breaks, moving.size - 1]]
    return [(float(first), float(last) + SIMULATOR_TESTS.within) for first, last in zip(firsts, lasts, strict=True)]
