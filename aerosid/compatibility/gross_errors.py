"""The one gross error of a recording that explains its misfits: a sign, unit or clock, or two channels exchanged.

Every hypothesis alters the recording and leaves nothing free, so that those can be compared which a fit with free scale
factors and delays confuses. One is named where it does clearly better than the recording as it is, than ordinary
instrument errors and than every other hypothesis.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from aerosid.compatibility.agreement import Contradiction
from aerosid.compatibility.altered_channels import (
    Alteration,
    exchanged_channels,
    moved_in_time,
    other_signs_and_units,
    other_units,
    other_units_of_both_accelerations,
    still_compared,
)
from aerosid.compatibility.flight_path import DRIVING
from aerosid.compatibility.misfits import Misfits, contradicting_outputs, limited, misfits_of, suspect_outputs
from aerosid.compatibility.recording import Recording
from aerosid.compatibility.settings import ContradictionSettings
from aerosid.compatibility.window_fit import FIRST_ROUND, GRID
from aerosid.compiled.cores import mapped
from aerosid.effects import OutputEffect
from aerosid.effects.sensor import sensor_delay, sensor_lag, sensor_scale
from aerosid.notation import listed

AIR = frozenset({"V", "alpha"})
"""The outputs that gusts change, and that contradict where the airspeed is in a wrong unit: alpha turns by a_z/V."""

DRIVEN_BY = {"V": "a_x", "alpha": "a_z", "theta": "q"}
"""The input that mainly drives an output: a contradiction of the output may be due to this input."""

CLOCKS = {"V": ("V", "a_x"), "alpha": ("alpha", "a_z", "q"), "theta": ("theta", "q", "phi", "r"), "h": ("h",)}
"""The channels whose clock is in question where an output contradicts."""


def gross_error(
    windows: Recording,
    settings: ContradictionSettings,
    before: Misfits,
    suspects: Sequence[str],
    rival: Recording | None = None,
) -> Contradiction | None:
    """The single gross error with which the misfits vanish, or those that cannot be told apart; None where none does.

    Parameters
    ----------
    windows : Recording
        Its stretches are the windows.
    settings : ContradictionSettings
        Limits.
    before : Misfits
        As recorded.
    suspects : sequence of str
        The outputs that contradict the path, or may.
    rival : Recording, optional
        Altered by another remedy, than which a gross error must do clearly better; clocks are not tried then.
    """
    fits = fits_with_instrument_errors(windows, settings, suspects, settings.ordinary_delay)
    totals = [_total(windows, found) for found in fits]
    if rival is not None:
        totals.append(_total(rival, misfits_of(rival, settings)))
    as_recorded = _total(windows, before)
    # No hypothesis can do clearly better than what leaves the noise alone.
    most = min(as_recorded - float(np.log(settings.gross_falls)), min(totals) - settings.clearly_less(0.0))
    if most < 0.0:
        return None
    clocks = _clocks(windows, settings, suspects) if rival is None else ()
    alterations = [*_discrete(windows, settings), *clocks]
    scores = mapped(lambda alteration: _score(windows, settings, alteration, as_recorded), alterations)
    tried = [(score, each) for score, each in zip(scores, alterations, strict=True) if score is not None]
    least = min((score for score, _ in tried), default=np.inf)
    beside = settings.clearly_less(least)
    if least > most or least + beside > min(totals):
        return None
    alike = [alteration for score, alteration in sorted(tried, key=lambda each: each[0]) if score < least + beside]
    channels, remedy = _told(alike)
    late = tuple((each.channels[0], each.late) for each in alike) if all(each.late for each in alike) else ()
    return Contradiction(windows.log.name, channels, remedy, max(before[name][0] for name in suspects), late)


def unit_of_longitudinal_acceleration(
    windows: Recording, settings: ContradictionSettings, before: Misfits
) -> Contradiction | None:
    """The gross error where another unit of a_x leaves much less of a small misfit of the airspeed; None elsewhere.

    The airspeed hardly shows a_x, whose bias is free: what a unit leaves of it is seldom as much as gusts do, which is
    why no misfit of the airspeed is suspect for it alone.

    Parameters
    ----------
    windows, settings, before
        As those of `gross_error`.
    """
    if "V" not in before or before["V"][1] < settings.doubtful_noise * settings.above_noise * windows.noise["V"]:
        return None
    as_recorded = _total(windows, before)
    for alteration in other_units(windows, "a_x"):
        score = _score(windows, settings, alteration, as_recorded)
        falls = np.log(settings.gross_falls)
        if score is not None and score + max(settings.clearly_less(score), falls) < as_recorded:
            return gross_error(windows, settings, before, ("V",))
    return None


def _score(
    windows: Recording, settings: ContradictionSettings, alteration: Alteration, as_recorded: float
) -> float | None:
    """The total misfit with an alteration; None where it is hardly less than as recorded, or channels contradict."""
    changed = alteration.recording
    first = _total(changed, misfits_of(changed, settings, fit=FIRST_ROUND))
    if first > as_recorded - np.log(settings.falls_first):
        return None
    after = misfits_of(changed, settings)
    # Gusts may leave the flow angle and the airspeed unexplained, but neither attitude nor height.
    if contradicting_outputs(changed, settings, after) or {*suspect_outputs(changed, settings, after)} - AIR:
        return None
    score = _total(changed, after)
    if alteration.late:
        # Samples that another clock leaves out may be those that the misfit was in.
        on_same = replace(windows, compared=changed.compared)
        score = max(score + as_recorded - _total(on_same, misfits_of(on_same, settings)), score)
    return score


def fits_with_instrument_errors(
    windows: Recording,
    settings: ContradictionSettings,
    suspects: Sequence[str],
    latest: float,
    until: Callable[[Misfits], bool] = lambda _misfits: False,
) -> list[Misfits]:
    """Misfits with time delay, lag and scale factor error free, of the suspects or of their driving inputs.

    `latest`: largest delay and lag, s; `until`: whether misfits end it.
    """
    driving = [DRIVEN_BY[name] for name in suspects if name in DRIVEN_BY]
    starts = ((sensor_delay, 0.1), (sensor_delay, 0.4), (sensor_lag, 0.2))

    def fitted(tried: tuple[tuple[Callable[[str], OutputEffect], float], Sequence[str]]) -> Misfits:
        (made, start), channels = tried
        free = [
            active
            for name in channels
            for active in (
                limited(made(name), latest, min(start, latest)),
                limited(sensor_scale(name), settings.largest_scale),
            )
        ]
        return misfits_of(windows, settings, free)

    return mapped(fitted, [*itertools.product(starts, (suspects, driving))], until=until)


def _total(recording: Recording, misfits: Misfits) -> float:
    """Sum of ln(misfit/noise) over the outputs: of misfits as small as the noise nothing is left to explain."""
    ratios = [max(misfit / max(recording.noise[name], 1e-12), 1.0) for name, (_, misfit) in misfits.items()]
    return float(np.sum(np.log(ratios)))


def _discrete(windows: Recording, settings: ContradictionSettings) -> Iterator[Alteration]:
    """Other signs, units and offsets, and exchanged channels.

    Units of airspeed and height are left out: a scale factor error is near one of their ratios by chance.
    """
    yield from other_signs_and_units(windows, (*DRIVING, *(name for name in windows.outputs if name not in ("V", "h"))))
    yield from other_units_of_both_accelerations(windows)
    yield from exchanged_channels(windows, settings)


def _clocks(windows: Recording, settings: ContradictionSettings, suspects: Sequence[str]) -> Iterator[Alteration]:
    """Each channel whose clock is in question, moved by the time that leaves the least misfit."""
    for channel in dict.fromkeys(name for output in suspects for name in CLOCKS[output]):
        if channel in windows.log and float(np.nanstd(windows.channel(channel))) > 0.0:
            alteration = _best_clock(windows, settings, channel)
            if alteration is not None and abs(alteration.late) >= settings.ordinary_delay:
                yield alteration


def _best_clock(windows: Recording, settings: ContradictionSettings, channel: str) -> Alteration | None:
    """The channel moved by the time of least misfit: the lowest minima of a grid, then halfway to their neighbours.

    None where too little would be left to compare with any time of the grid.
    """

    def total(late: float) -> float:
        changed = moved_in_time(windows, channel, late).recording
        enough = still_compared(windows, changed) > settings.least_compared
        return _total(changed, misfits_of(changed, settings, fit=GRID)) if enough else np.inf

    count = round(settings.longest_shift / settings.shift_step)
    grid = [settings.shift_step * n for n in range(-count, count + 1)]
    on_grid = mapped(total, grid)
    falls = [before >= after for before, after in itertools.pairwise([np.inf, *on_grid, np.inf])]
    lows = [
        (misfit, late)
        for misfit, late, fell, falls_on in zip(on_grid, grid, falls, falls[1:], strict=False)
        if fell and not falls_on
    ]

    def refined(low: tuple[float, float]) -> tuple[float, float]:
        misfit, best = low
        found, step = {best: misfit}, settings.shift_step
        while step > settings.shift_resolution:
            step *= 0.5
            found |= {late: total(late) for late in (best - step, best + step) if late not in found}
            best = min((best - step, best, best + step), key=lambda late: found[late])
        return found[best], best

    chosen = sorted(lows, key=lambda low: low[0])[: settings.shifts_refined]
    misfit, best = min(mapped(refined, chosen), key=lambda low: low[0], default=(np.inf, 0.0))
    return moved_in_time(windows, channel, best) if np.isfinite(misfit) else None


def _told(alike: Sequence[Alteration]) -> tuple[tuple[str, ...], str]:
    """The channels and the remedy in words, of the best hypothesis and those that do about as well."""
    if len(alike) == 1:
        return alike[0].channels, alike[0].remedy
    channels = tuple(dict.fromkeys(name for alteration in alike for name in alteration.channels))
    each = [f"{listed(alteration.channels)} {alteration.remedy}" for alteration in alike]
    return channels, f"with one of these corrections, which this recording does not distinguish: {'; '.join(each)}"
