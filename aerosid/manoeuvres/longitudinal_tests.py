"""Elevator manoeuvres: standard input shapes, short period, phugoid pulse, push-over and approach to the stall."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.manoeuvres.found import Rejected, Stretch
from aerosid.manoeuvres.input_shape import InputShape, input_shape
from aerosid.manoeuvres.inputs import PITCH, Excursion, excursions
from aerosid.manoeuvres.record import FlightRecord, FloatArray, longest_run, runs
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["elevator_pulse_before", "elevator_tests", "stall_approaches"]

STANDARD_SHAPES = ("doublet", "211", "3211", "sweep", "multisine")
"""Names of an `InputShape` that are kinds of manoeuvre by themselves."""

_SHORT_SHAPES = ("doublet", "211", "3211")

LONG_SHAPES = ("sweep", "multisine")
"""Those that continuous activity of a pilot or an autopilot may be taken for."""

_SURFACES = {"delta_e": "the elevator", "delta_a": "the aileron", "delta_r": "the rudder"}


def elevator_tests(record: FlightRecord, settings: FinderSettings) -> tuple[list[Stretch], list[Rejected]]:
    """Elevator inputs of a recognised shape with their answers, and why others are none."""
    found: list[Stretch] = []
    rejected: list[Rejected] = []
    for excursion in excursions(record, PITCH, settings):
        shape = input_shape(excursion.deviation, record.interval, float(record.unit[excursion.first]), settings)
        result = _judged(record, excursion, shape, settings)
        if isinstance(result, Stretch):
            found.append(result)
        else:
            rejected.append(Rejected(excursion.first, max(excursion.last, excursion.answer_last), "delta_e", result))
    return found, rejected


def _judged(record: FlightRecord, excursion: Excursion, shape: InputShape, settings: FinderSettings) -> Stretch | str:
    """The manoeuvre that an excursion is, or why it is none."""
    reason = not_a_test(record, excursion, shape, settings)
    last = answer_end(record, excursion, shape, record.pitch, settings)
    span = slice(excursion.first, last + 1)
    load = record.averaged(record.load_factor, 0.05)[span]
    change = float(np.max(np.abs(load - load[0])))
    detail = shape_detail(shape) | {"load_factor_change": change}
    strength = excursion.answer / settings.clear_answer

    def found(kind: str, end: int = last) -> Stretch:
        return Stretch(kind, excursion.first, end, "delta_e", detail, strength)

    standard = shape.name in STANDARD_SHAPES
    # Pull-up, push-over and pull-out are three movements; more of one size are a designed train.
    designed = len(shape.lobes) > settings.push_over_movements and even_steps(shape, settings)
    if not (standard or designed) and _pushes_over(record, excursion, settings):
        detail["load_factor_least"] = float(load.min())
        return found("parabola")
    if reason is not None:
        return reason
    if standard and strength >= 1.0:
        return found(shape.name)
    sharp = _onset(record, excursion, shape) <= settings.onset
    if not sharp:
        return "the elevator moves slowly: no test input"
    if (slope := _speed_change_before(record, excursion)) > settings.steady_speed:
        return f"the airspeed changes by {slope:.3f} g before it"
    flat = held_share(record, excursion, settings)
    train = len(shape.lobes) >= 3 and even_steps(shape, settings) and strength >= 1.0
    train = train and not _outlasted(record, excursion, shape, settings)
    if not train and len(shape.lobes) <= 3 and shape.square >= settings.plain and change >= settings.clear_step:
        if (turned := _path_change(record, excursion)) > 1.5 * settings.path_change:
            return f"the flight path changes by {turned:.2f} rad over it: a level-off or a climb"
        pulse = len(shape.lobes) == 1 and excursion.answer >= settings.clear_pulse
        if flat >= settings.held or pulse:
            return found("short_period")
    if strength < 1.0:
        return f"the response of {excursion.answer:.2f} g is too weak to determine a derivative"
    if len(shape.lobes) == 1 and flat >= settings.flat_pulse:
        if not _released(record, excursion, settings):
            return "the elevator does not rest after it: a correction"
        if (turned := _path_change(record, excursion)) > 1.5 * settings.path_change:
            return f"the flight path changes by {turned:.2f} rad over it: a level-off or a climb"
        return found("elevator_pulse", excursion.last)
    if even_steps(shape, settings):
        if (turned := _path_change(record, excursion)) > settings.path_change:
            return f"the flight path changes by {turned:.2f} rad over it: a level-off or a climb"
        return found("steps" if train else "short_period")
    return "the elevator input is neither steps nor a known test input"


def _outlasted(record: FlightRecord, excursion: Excursion, shape: InputShape, settings: FinderSettings) -> bool:
    """Whether the first of few steps is held until its answer is over: what follows is the recovery from it."""
    longest = settings.step_held * float(record.unit[excursion.first])
    return len(shape.lobes) <= settings.recovered and shape.widths[0] > longest


def _released(record: FlightRecord, excursion: Excursion, settings: FinderSettings) -> bool:
    """Whether the surface rests over V/g after an excursion, so that what it set off is free."""
    first = excursion.last + record.samples(settings.lead_in, excursion.last) // 2
    after = record.surfaces[excursion.axis.surface].deflection[first : first + record.samples(1.0, excursion.last)]
    return after.size == 0 or float(np.ptp(after)) <= settings.comes_back * excursion.amplitude


def not_a_test(record: FlightRecord, excursion: Excursion, shape: InputShape, settings: FinderSettings) -> str | None:
    """Why an excursion, whatever its shape, is no test; None where nothing speaks against it."""
    name = _SURFACES.get(excursion.axis.surface, excursion.axis.surface)
    if not record.airborne[excursion.first : excursion.last + 1].all():
        return "it is flown too close to the ground"
    if excursion.lead_travel > settings.lead_share * excursion.amplitude:
        return f"{name} does not rest before it"
    if shape.name in LONG_SHAPES and _busy_around(record, excursion, settings):
        return f"{name} moves as much before or after it"
    shaped = shape.name in STANDARD_SHAPES
    quiet = settings.lead_answer_shaped if shaped else settings.lead_answer
    if excursion.lead_answer > quiet * excursion.answer:
        return "the aircraft is not steady before it"
    # Where the recording ends first, nobody knows whether it comes back.
    ended = excursion.last + record.samples(settings.lead_in, excursion.last) // 2 >= record.time.size - 1
    if not ended and excursion.left_over > settings.comes_back:
        return f"{name} does not return: a change of trim or flight path"
    if excursion.axis is PITCH:
        bank = np.abs(record.get("phi")[excursion.first : excursion.last + 1])
        if float(bank.max(initial=0.0)) > settings.level_bank:
            return "the aircraft banks during it"
    return None


def _busy_around(record: FlightRecord, excursion: Excursion, settings: FinderSettings) -> bool:
    """Whether the surface moves before or after a long input as much as in it: from rest to rest is designed."""
    surface = record.surfaces[excursion.axis.surface].deflection
    span = record.samples(1.0, excursion.first)
    settle = record.samples(settings.lead_in, excursion.last)
    sides = (
        surface[max(0, excursion.first - span) : excursion.first],
        surface[excursion.last + settle : excursion.last + settle + span],
    )
    most = settings.busy * float(np.ptp(excursion.deflection))
    return any(side.size > 2 and float(np.ptp(side)) > most for side in sides)


def answer_end(
    record: FlightRecord, excursion: Excursion, shape: InputShape, answer: FloatArray, settings: FinderSettings
) -> int:
    """Last sample of the answer: where it falls below a tenth of its peak after the input."""
    input_last = excursion.last
    # A design ends with its last pulse: what moves the surface after it trims the aircraft again.
    if shape.name in _SHORT_SHAPES:
        input_last = min(input_last, excursion.first + shape.lobes[-1].last)
    latest = min(record.time.size - 1, input_last + record.samples(settings.answer_longest, input_last))
    after = np.abs(record.averaged(answer, 0.03)[input_last : latest + 1])
    # In moving air an answer ends in what the air does.
    level = max(settings.decayed * excursion.answer, 0.5 * getattr(settings, excursion.axis.lively))
    lively = np.flatnonzero(after > level)
    settle = record.samples(settings.lead_in, input_last) // 2
    return min(input_last + (int(lively[-1]) if lively.size else 0) + settle, latest)


def shape_detail(shape: InputShape) -> dict[str, float | str | tuple[float, ...]]:
    """What the input looks like, for the find's detail."""
    return {"shape": shape.name, "widths": shape.widths, "amplitude": shape.amplitude}


def held_share(record: FlightRecord, excursion: Excursion, settings: FinderSettings) -> float:
    """Share of an excursion in which its surface is held: travels little in a tenth of V/g."""
    window = max(3, record.samples(0.1, excursion.first))
    if excursion.deflection.size <= window:
        return 0.0
    views = np.lib.stride_tricks.sliding_window_view(excursion.deflection, window)
    travel: NDArray[np.float64] = views.max(axis=1) - views.min(axis=1)
    return float(np.count_nonzero(travel <= settings.held_travel * excursion.amplitude) / excursion.deflection.size)


def even_steps(shape: InputShape, settings: FinderSettings) -> bool:
    """Whether the lobes are steps of like size that change sign at least once."""
    levels = np.array([lobe.level for lobe in shape.lobes])
    like = float(np.abs(levels).min()) >= settings.like_level * float(np.abs(levels).max())
    turns = bool(np.any(levels[1:] * levels[:-1] < 0.0))
    return levels.size >= 2 and like and turns and shape.held >= settings.stepwise


def _speed_change_before(record: FlightRecord, excursion: Excursion) -> float:
    """Change of airspeed over the V/g before, g."""
    begin = max(0, excursion.first - record.samples(1.0, excursion.first))
    before = record["V"][begin : excursion.first + 1]
    if before.size < 3:
        return 0.0
    time = record.time[begin : excursion.first + 1]
    return abs(float(np.polyfit(time - time[0], before, 1)[0])) / 9.80665


def _path_change(record: FlightRecord, excursion: Excursion) -> float:
    """Slope of the flight path over V/g after less that before, rad; 0 where no altitude is recorded."""
    if "h" not in record:
        return 0.0
    span = record.samples(1.0, excursion.first)
    after = min(record.time.size - 1, max(excursion.last, excursion.answer_last))
    ends = [(max(0, excursion.first - span), excursion.first), (after, min(record.time.size - 1, after + span))]
    slopes = [
        (record["h"][end] - record["h"][begin]) / max(float(np.sum(record["V"][begin:end])) * record.interval, 1e-9)
        for begin, end in ends
    ]
    return abs(float(slopes[1] - slopes[0]))


def _onset(record: FlightRecord, excursion: Excursion, shape: InputShape) -> float:
    """V/g from the first movement to 0.8 of the first lobe's level."""
    if not shape.lobes:
        return float("inf")
    away = np.abs(excursion.deviation) >= 0.8 * abs(shape.lobes[0].level)
    return float(np.argmax(away)) * record.interval / float(record.unit[excursion.first])


def _pushes_over(record: FlightRecord, excursion: Excursion, settings: FinderSettings) -> bool:
    """Whether a pull-up goes over into a push to low load factor while its load factor still stands."""
    load = record.averaged(record.load_factor, 0.05)
    last = min(record.time.size, max(excursion.last, excursion.answer_last) + 1)
    span = load[excursion.first : last]
    if span.size < 3 or float(span.min()) > settings.push_over:
        return False
    light = longest_run(span < settings.push_over + 0.1)
    if light < record.samples(settings.push_over_least, excursion.first):
        return False
    bottom = int(np.argmin(span))
    pull = span[: bottom + 1] - 1.0
    peak = float(pull.max())
    if peak < settings.clear_step:
        return False
    # The push begins where the elevator leaves its most nose-up level on the way to the bottom.
    moved = excursion.deflection[: bottom + 1] - excursion.before
    crest = int(np.argmax(pull))
    up = moved[min(crest, moved.size - 1)]
    left = np.flatnonzero(np.abs(moved[crest:] - up) > 0.5 * abs(up))
    start = crest + (int(left[0]) if left.size else 0)
    return float(pull[min(start, pull.size - 1)]) >= settings.pull_left * peak


def elevator_pulse_before(record: FlightRecord, phugoid: Stretch, settings: FinderSettings) -> Stretch | None:
    """The elevator pulse that set off a phugoid: away from the level that the phugoid flies at, held, and released."""
    surface = record.surfaces.get("delta_e")
    if surface is None:
        return None
    lead = record.samples(settings.lead_in, phugoid.first)
    after = float(np.median(surface.deflection[phugoid.first : phugoid.first + lead]))
    earliest = max(0, phugoid.first - record.samples(settings.longest_hold, phugoid.first))
    away = np.abs(surface.deflection[earliest : phugoid.first + lead] - after)
    amplitude = float(away.max())
    if amplitude <= surface.rest:
        return None
    out = np.flatnonzero(away > settings.lobe_level * amplitude)
    # Only the last time out, and only if it rested near its later level before.
    breaks = np.flatnonzero(np.diff(out) > lead)
    first = int(out[breaks[-1] + 1]) if breaks.size else int(out[0])
    rested = np.flatnonzero(away[: first + 1] <= settings.lead_share * amplitude)
    start = earliest + (int(rested[-1]) + 1 if rested.size else first)
    before = surface.deflection[max(0, start - lead) : start]
    if before.size < lead // 2 or abs(float(np.median(before)) - after) > settings.comes_back * amplitude:
        return None
    last = earliest + int(out[-1])
    detail = {"amplitude": amplitude, "held": (last - start) * record.interval}
    return Stretch("elevator_pulse", start, max(last, phugoid.first - 1), "delta_e", detail)


def stall_approaches(record: FlightRecord, settings: FinderSettings) -> list[Stretch]:
    """Slow decelerations at 1 g to a high angle of attack that end with the nose going down and speed coming back."""
    speed = record.averaged(record["V"], 0.5)
    slope = np.gradient(speed, record.interval) / 9.80665
    level = np.abs(record.averaged(record.load_factor, 1.0) - 1.0) < settings.stall_load
    level &= np.abs(record.averaged(record.get("phi"), 1.0)) < settings.level_bank
    slowing = (slope < -settings.stall_slowing[0]) & (slope > -settings.stall_slowing[1]) & level & record.airborne
    least = _lift_demand(record)
    highest = _highest_demand(least, record, settings)
    found = []
    for first, last in _joined(slowing, record.samples(0.2)):
        if last - first + 1 < record.samples(settings.stall_least, first):
            continue
        latest = min(record.time.size - 1, last + record.samples(settings.stall_break, last))
        # The angle of attack at the end must be that of the flight's slowest: a level-off slows down too.
        if float(least[first : latest + 1].max()) < settings.stall_demand * highest:
            continue
        slowest = last + int(np.argmin(record["V"][last : latest + 1]))
        drop = _nose_drop(record, max(first, last - record.samples(0.3, last)), latest)
        if drop < settings.stall_drop:
            continue
        begin = _begin_of_slowing(speed, first)
        if record["V"][slowest] > (1.0 - settings.stall_loss) * speed[begin]:
            continue
        end = _recovered(record, speed, slowest, float(speed[begin]), settings)
        detail = {"slowest": float(record["V"][slowest]), "nose_drop": drop}
        detail["deceleration"] = float((speed[begin] - speed[slowest]) / max(1, slowest - begin) / record.interval)
        found.append(Stretch("stall_approach", begin, end, "delta_e", detail))
    return found


def _lift_demand(record: FlightRecord) -> FloatArray:
    """Angle of attack, or n_z/V^2 where it is not recorded, averaged over 0.3 V/g, (N,)."""
    if "alpha" in record:
        return record.averaged(record["alpha"], 0.3)
    return record.averaged(record.load_factor / np.maximum(record["V"], 1.0) ** 2, 0.3)


def _highest_demand(demand: FloatArray, record: FlightRecord, settings: FinderSettings) -> float:
    """The highest in flight near 1 g, where the wing cannot be asked for more by pulling."""
    near = record.airborne & (np.abs(record.averaged(record.load_factor, 0.5) - 1.0) < settings.stall_load)
    return float(demand[near].max()) if near.any() else float("inf")


def _joined(mask: NDArray[np.bool_], pause: int) -> Sequence[tuple[int, int]]:
    joined: list[tuple[int, int]] = []
    for first, last in runs(mask):
        if joined and first - joined[-1][1] <= pause:
            joined[-1] = joined[-1][0], last
        else:
            joined.append((first, last))
    return joined


def _nose_drop(record: FlightRecord, first: int, last: int) -> float:
    """Largest fall of the attitude, rad; of the integrated pitch rate where no attitude is recorded."""
    part = slice(first, last + 1)
    attitude = record["theta"][part] if "theta" in record else np.cumsum(record["q"][part]) * record.interval
    return float(np.max(np.maximum.accumulate(attitude) - attitude))


def _begin_of_slowing(speed: FloatArray, first: int) -> int:
    while first > 0 and speed[first - 1] > speed[first]:
        first -= 1
    return first


def _recovered(record: FlightRecord, speed: FloatArray, slowest: int, entry: float, settings: FinderSettings) -> int:
    """Where the speed of the entry is reached again, or no longer rises."""
    latest = min(record.time.size - 1, slowest + record.samples(settings.stall_recovery, slowest))
    k = slowest
    while k < latest and speed[k] < entry:
        k += 1
    return k
