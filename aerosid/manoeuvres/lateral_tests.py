"""Aileron and rudder manoeuvres: standard input shapes, rolls at held aileron, and Dutch rolls."""

from __future__ import annotations

import numpy as np

from aerosid.manoeuvres.found import Rejected, Stretch
from aerosid.manoeuvres.input_shape import InputShape, input_shape
from aerosid.manoeuvres.inputs import ROLL, YAW, Excursion, excursions
from aerosid.manoeuvres.longitudinal_tests import STANDARD_SHAPES, answer_end, even_steps, not_a_test, shape_detail
from aerosid.manoeuvres.oscillations import count_half_cycles, decayed
from aerosid.manoeuvres.record import FlightRecord, FloatArray, runs
from aerosid.manoeuvres.settings import FinderSettings

__all__ = ["aileron_tests", "rudder_tests"]


def rudder_tests(record: FlightRecord, settings: FinderSettings) -> tuple[list[Stretch], list[Rejected]]:
    """Rudder inputs: a Dutch roll where the oscillation after them is seen, else the shape of the input."""
    found: list[Stretch] = []
    rejected: list[Rejected] = []
    others = _deliberate_starts(record, settings)
    for excursion in excursions(record, YAW, settings):
        shape = input_shape(excursion.deviation, record.interval, float(record.unit[excursion.first]), settings)
        reason = not_a_test(record, excursion, shape, settings)
        if reason is None and excursion.answer < settings.clear_yaw:
            reason = f"the yaw response of {excursion.answer:.2f} rad per V/g is too weak to determine a derivative"
        stretch = None if reason else _yaw_kind(record, excursion, shape, others, settings)
        if stretch is not None:
            found.append(stretch)
        else:
            reason = reason or "the rudder input is neither steps nor a known test input"
            rejected.append(Rejected(excursion.first, max(excursion.last, excursion.answer_last), "delta_r", reason))
    return found, rejected


def _deliberate_starts(record: FlightRecord, settings: FinderSettings) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """First samples of the aileron's and elevator's own excursions, a fifth of their largest at least."""
    starts = []
    for name in ("delta_a", "delta_e"):
        surface = record.surfaces.get(name)
        if surface is not None:
            clear = surface.travel > max(settings.deliberate * surface.largest, surface.rest)
            half = record.samples(settings.still_window) // 2
            starts += [first + half for first, _ in runs(clear & record.airborne)]
    return np.sort(np.array(starts, dtype=np.intp))


def _yaw_kind(
    record: FlightRecord,
    excursion: Excursion,
    shape: InputShape,
    others: np.ndarray[tuple[int], np.dtype[np.intp]],
    settings: FinderSettings,
) -> Stretch | None:
    detail = shape_detail(shape)
    strength = excursion.answer / settings.clear_yaw
    # Where a yaw damper moves the rudder, the input ends with the last of its large lobes.
    input_last = excursion.first + (shape.lobes[-1].last if shape.lobes else 0)
    latest = min(record.time.size - 1, excursion.first + record.samples(settings.dutch_roll_longest, excursion.first))
    following = others[others > input_last + record.samples(0.1, input_last)]
    if following.size:
        latest = min(latest, int(following[0]) - 1)
    rate = record.averaged(record.yaw, 0.02)
    last = max(input_last, decayed(record, rate, excursion.first, max(latest, input_last), settings.decayed))
    part = rate[excursion.first : last + 1]
    cycles = count_half_cycles(part, settings.half_cycle)
    period = _period(part, record.interval)
    unit = float(record.unit[excursion.first])
    low, high = (limit * unit for limit in settings.dutch_roll_period)
    # The input itself makes as many half cycles of yaw as it has lobes: what goes on after it is free.
    free = cycles - len(shape.lobes)
    if cycles >= settings.dutch_roll_lobes and free >= 1 and low <= period <= high:
        return Stretch("dutch_roll", excursion.first, last, "delta_r", detail | {"period": period}, strength)
    if shape.name in STANDARD_SHAPES:
        return Stretch(shape.name, excursion.first, last, "delta_r", detail, strength)
    if even_steps(shape, settings) and strength >= settings.clear_train:
        return Stretch("steps", excursion.first, last, "delta_r", detail, strength)
    return None


def _period(values: FloatArray, interval: float) -> float:
    """Twice the median distance of zero crossings about the median, s."""
    about = values - np.median(values)
    crossing = np.flatnonzero(np.diff(np.signbit(about)))
    return 2.0 * float(np.median(np.diff(crossing))) * interval if crossing.size > 1 else float("inf")


def aileron_tests(record: FlightRecord, settings: FinderSettings) -> tuple[list[Stretch], list[Rejected]]:
    """Rolls at held aileron, and aileron inputs of a recognised shape."""
    found = _rolls(record, settings)
    rejected: list[Rejected] = []
    for excursion in excursions(record, ROLL, settings):
        if any(roll.first <= excursion.last and excursion.first <= roll.last for roll in found):
            continue
        shape = input_shape(excursion.deviation, record.interval, float(record.unit[excursion.first]), settings)
        reason = not_a_test(record, excursion, shape, settings)
        if reason is None and excursion.answer < settings.clear_roll:
            reason = f"the roll response of {excursion.answer:.2f} rad per V/g is that of a turn entry"
        train = even_steps(shape, settings) and excursion.answer >= settings.clear_train * settings.clear_roll
        known = shape.name in STANDARD_SHAPES or train
        if reason is None and known:
            strength = excursion.answer / settings.clear_roll
            kind = shape.name if shape.name in STANDARD_SHAPES else "steps"
            last = answer_end(record, excursion, shape, record.roll, settings)
            found.append(Stretch(kind, excursion.first, last, "delta_a", shape_detail(shape), strength))
        else:
            reason = reason or "the aileron input is neither steps nor a known test input"
            rejected.append(Rejected(excursion.first, max(excursion.last, excursion.answer_last), "delta_a", reason))
    return found, rejected


def _rolls(record: FlightRecord, settings: FinderSettings) -> list[Stretch]:
    """Changes of bank at held aileron that are neither the entry of a turn nor the way out of one."""
    surface = record.surfaces.get("delta_a")
    if surface is None or "phi" not in record:
        return []
    rate = record.averaged(record.roll, 0.03)
    bank = record["phi"]
    found = []
    for sign in (1.0, -1.0):
        for first, last in runs((sign * rate > settings.lively_roll) & record.airborne):
            change = abs(float(bank[last] - bank[first]))
            peak = float(np.max(sign * rate[first : last + 1]))
            if change < settings.roll_change or peak < settings.clear_roll:
                continue
            begin, end, held = _held_aileron(record, surface.deflection, first, last, settings)
            if held < settings.roll_held or not _reversed(record, bank, first, last, settings):
                continue
            detail = {"bank_from": float(bank[begin]), "bank_to": float(bank[end]), "roll_rate": sign * peak}
            detail["roll_rate"] /= float(record.unit[first])
            found.append(Stretch("aperiodic_roll", begin, end, "delta_a", detail, peak / settings.clear_roll))
    return sorted(found, key=lambda stretch: stretch.first)


def _held_aileron(
    record: FlightRecord, deflection: FloatArray, first: int, last: int, settings: FinderSettings
) -> tuple[int, int, float]:
    """First and last sample of the aileron step that makes a roll, and for how many V/g it is held."""
    lead = record.samples(settings.lead_in, first)
    begin = max(0, first - lead)
    before = float(np.median(deflection[max(0, begin - lead) : begin + 1]))
    step = deflection[begin : last + 1] - before
    middle = step[(first - begin) : (first - begin) + max(1, (last - first) * 2 // 3)]
    level = float(np.median(middle))
    on = np.abs(step - level) <= settings.flat_aileron * abs(level)
    spans = list(runs(on))
    if not spans or level == 0.0:
        return begin, last, 0.0
    held_first, held_last = max(spans, key=lambda span: span[1] - span[0])
    started = np.flatnonzero(np.abs(step[: held_first + 1]) <= 0.1 * abs(level))
    start = begin + (int(started[-1]) + 1 if started.size else held_first)
    units = (held_last - held_first + 1) * record.interval / float(record.unit[first])
    return start, begin + held_last, units


def _reversed(record: FlightRecord, bank: FloatArray, first: int, last: int, settings: FinderSettings) -> bool:
    """Whether a roll is a test: it goes through level, or its bank is not kept but taken back at once."""
    through = bank[first] * bank[last] < 0.0 and min(abs(bank[first]), abs(bank[last])) > settings.turn_bank
    if through:
        return True
    if abs(float(bank[last])) < settings.level_bank:
        return False  # a roll out of a turn
    later = min(bank.size - 1, last + record.samples(1.0, last))
    return abs(float(bank[later])) < 0.5 * abs(float(bank[last])) or bank[later] * bank[last] < 0.0
