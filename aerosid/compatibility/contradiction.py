"""Gross contradictions: a wrong sign, unit, clock or channel, which no instrument error explains.

Over windows of a few seconds small biases and drifts matter little, and the shape of the integrated motion is compared
with the measured one. Where they differ, signs, units and clocks of one channel are tried; a single channel without
which the others agree is named; else those that contradict each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from aerosid.compatibility.agreement import Contradiction
from aerosid.compatibility.altered_channels import (
    Alteration,
    moved_in_time,
    other_signs_and_units,
    source_of,
    still_compared,
    with_channel,
)
from aerosid.compatibility.flight_path import DRIVING
from aerosid.compatibility.gross_errors import (
    AIR,
    DRIVEN_BY,
    fits_with_instrument_errors,
    gross_error,
    unit_of_longitudinal_acceleration,
)
from aerosid.compatibility.misfits import (
    Misfits,
    contradicting_outputs,
    misfits_if_near,
    misfits_of,
    suspect_outputs,
)
from aerosid.compatibility.noise_levels import with_plausible_noise
from aerosid.compatibility.recording import STRETCHES, Recording, compacted, most_excited, shows_motion
from aerosid.compatibility.remedies import unit_remedies
from aerosid.compatibility.settings import ContradictionSettings
from aerosid.compatibility.spikes import spikes_of, spikes_told, without_spikes

USUAL = ContradictionSettings()
"""The default limits."""


def contradictions(
    recordings: Sequence[Recording], settings: ContradictionSettings = USUAL
) -> tuple[Contradiction, ...]:
    """Contradictions that no instrument error, gust or noise explains."""
    found = []
    for recording in recordings:
        contradiction = _contradiction(recording, settings)
        if contradiction is not None and (single := spikes_of(recording)):
            # Single samples are no motion: what contradicts without them is told, and else they are.
            others = _contradiction(without_spikes(recording, single), settings)
            remedy = f"once the spikes of {spikes_told(recording, single)} are left empty"
            contradiction = others or replace(contradiction, channels=tuple(single), remedy=remedy)
        if contradiction is not None:
            found.append(contradiction)
    return tuple(found)


def _contradiction(recording: Recording, settings: ContradictionSettings) -> Contradiction | None:
    """The contradiction of one recording; None where there is none."""
    windows = _windows(with_plausible_noise(recording, settings), settings)
    if windows is None:
        return None
    misfits = misfits_of(windows, settings)
    contradicting, suspect = (
        contradicting_outputs(windows, settings, misfits),
        suspect_outputs(windows, settings, misfits),
    )
    first = contradicting or suspect
    if not first:
        return unit_of_longitudinal_acceleration(windows, settings, misfits)
    unit = _airspeed_unit(windows, settings, misfits) if {*contradicting, *suspect} & AIR else None
    if unit is not None:
        told, altered = unit
        # With another airspeed a flow angle that is none may seem to turn as a_z asks.
        return gross_error(windows, settings, misfits, first, rival=altered) or told
    if "h" in (*contradicting, *suspect):
        height = _height_unit(windows, settings, misfits)
        if height is not None:
            return height
    gross = gross_error(windows, settings, misfits, first)
    if gross is not None:
        return gross
    # A time delay, lag or scale factor error of an instrument is no contradiction.
    contradicting, suspect = _left_by_instrument_errors(windows, settings, misfits, first)
    if not (contradicting or suspect):
        return None
    # Told is what is unexplained as recorded: of a channel that is believed too much others show it.
    misfit = max(misfits[name][0] for name in {*first, *contradicting, *suspect})
    return _diagnosed(windows, settings, misfit, contradicting, suspect)


def _airspeed_unit(
    windows: Recording, settings: ContradictionSettings, misfits: Misfits
) -> tuple[Contradiction, Recording] | None:
    """The unit of airspeed with which every misfit vanishes, or falls to that of moving air, and the recording with it.

    Tried before instrument errors: two free scale factors and delays, which are tolerated, can do as well as a factor
    of 0.51, but a ratio of two units leaves nothing free.
    """
    before = {name: fraction for name, (fraction, _) in misfits.items()}
    in_air_before = _mean_in_air(misfits)

    def of_air(factor: float) -> tuple[float, bool]:
        """Misfit of alpha and V, their geometric mean, with another airspeed, and whether all channels agree then."""
        changed = with_channel(windows, "V", factor * windows.channel("V"))
        found = misfits_if_near(
            changed, settings, lambda first: _mean_in_air(first) * settings.falls_first <= in_air_before
        )
        if found is None:
            return np.inf, False
        after = {name: fraction for name, (fraction, _) in found.items()}
        in_air = _mean_in_air(found)
        is_worse = any(after[name] > max((1.0 + settings.beside) * before[name], settings.doubtful) for name in before)
        enough = in_air * settings.falls < in_air_before or max(after.values()) < settings.vanishes
        return in_air, enough and not is_worse and not contradicting_outputs(changed, settings, found)

    tried = [(*of_air(factor), factor, remedy) for factor, remedy in unit_remedies("m/s", source_of(windows, "V"))]
    agreeing = sorted((in_air, factor, remedy) for in_air, agrees, factor, remedy in tried if agrees)
    if not agreeing:
        return None
    least, likeliest, _ = agreeing[0]
    beside = (likeliest * (1.0 + settings.beside), likeliest / (1.0 + settings.beside))
    if min(of_air(factor)[0] for factor in beside) < settings.clearly * least:
        return None  # a scale factor error, which is near a ratio of units by chance
    remedies = [remedy for in_air, _, remedy in agreeing if settings.clearly * in_air < least]
    told = Contradiction(
        windows.log.name, ("V",), ", or ".join(remedies), max(before[name] for name in AIR if name in before)
    )
    return told, with_channel(windows, "V", likeliest * windows.channel("V"))


def _height_unit(windows: Recording, settings: ContradictionSettings, misfits: Misfits) -> Contradiction | None:
    """The unit of height with which its misfit vanishes and no other grows; None where there is none.

    Tried before instrument errors, as that of airspeed: free scale factors and delays of airspeed and height, which are
    tolerated, bend the path as far as a factor of 3.28 asks.
    """
    before = {name: fraction for name, (fraction, _) in misfits.items()}
    for factor, remedy in unit_remedies("m", source_of(windows, "h")):
        changed = with_channel(windows, "h", factor * windows.channel("h"))
        after = misfits_if_near(changed, settings, lambda first: first["h"][0] < settings.doubtful)
        if after is None or after["h"][0] >= settings.vanishes or contradicting_outputs(changed, settings, after):
            continue
        if all(after[name][0] <= max((1.0 + settings.beside) * before[name], settings.doubtful) for name in before):
            return Contradiction(windows.log.name, ("h",), remedy, before["h"])
    return None


def _mean_in_air(misfits: Misfits) -> float:
    """Geometric mean of the misfits of alpha and V: gusts may leave one of them large with any unit of airspeed."""
    return float(np.exp(np.mean([np.log(max(misfits[name][0], 1e-12)) for name in AIR if name in misfits])))


def _windows(recording: Recording, settings: ContradictionSettings) -> Recording | None:
    """The recording in short stretches, those with most pitching."""
    pieces: list[slice] = []
    interval = float(np.median(np.diff(recording.time)))
    length = max(STRETCHES.fewest, round(settings.window / interval))
    for stretch in recording.stretches:
        size = stretch.stop - stretch.start
        count = max(1, size // length)
        edges = np.linspace(stretch.start, stretch.stop, count + 1).round().astype(int)
        pieces += [slice(int(a), int(b)) for a, b in itertools.pairwise(edges)]
    excited = most_excited(recording.inputs, [piece for piece in pieces if shows_motion(recording, piece)])
    chosen = tuple(sorted(excited[: settings.most_windows], key=lambda piece: piece.start))
    return compacted(replace(recording, stretches=chosen)) if chosen else None


def _left_by_instrument_errors(
    windows: Recording, settings: ContradictionSettings, misfits: Misfits, suspects: Sequence[str]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs that contradict, and suspect ones, with time delay, lag and scale factor error free.

    Those of the suspects or of their driving inputs; the misfits are the least of the suspects, or the first that leave
    nothing. `misfits`: without these errors.
    """

    def left_by(found: Misfits) -> tuple[tuple[str, ...], tuple[str, ...]]:
        return contradicting_outputs(windows, settings, found), suspect_outputs(windows, settings, found)

    fits = fits_with_instrument_errors(
        windows, settings, suspects, settings.latest, until=lambda found: not any(left_by(found))
    )
    if not any(left := left_by(fits[-1])):
        return left
    return left_by(min((misfits, *fits), key=lambda found: max(found[name][0] for name in suspects)))


def _diagnosed(
    windows: Recording,
    settings: ContradictionSettings,
    misfit: float,
    contradicting: tuple[str, ...],
    suspect: tuple[str, ...],
) -> Contradiction | None:
    """The contradiction with the inconsistent channel and its remedy, where these can be identified."""
    suspects = contradicting or suspect
    inconsistent = _single_inconsistent_output(windows, settings)
    if inconsistent is None:
        channels: tuple[str, ...] = DRIVING
    else:
        channels = (inconsistent, DRIVEN_BY[inconsistent]) if inconsistent in DRIVEN_BY else (inconsistent,)
    enough = settings.agrees if contradicting else settings.vanishes
    best: tuple[float, Alteration] | None = None
    for alteration in _remedies(windows, channels, settings):
        changed = alteration.recording
        after = misfits_if_near(
            changed, settings, lambda first: max(fraction for fraction, _ in first.values()) < settings.hopeless
        )
        if after is None:
            continue
        remaining = max(after[name][0] for name in (*suspects, inconsistent or suspects[0]) if name in after)
        if (
            remaining < enough
            and not contradicting_outputs(changed, settings, after)
            and (best is None or remaining < best[0])
        ):
            best = (remaining, alteration)
    if best is not None:
        return Contradiction(windows.log.name, best[1].channels, best[1].remedy, misfit)
    if not contradicting:
        return None
    return Contradiction(windows.log.name, contradicting if inconsistent is None else (inconsistent,), "", misfit)


def _single_inconsistent_output(windows: Recording, settings: ContradictionSettings) -> str | None:
    """The single output without which the others agree best; None where there is none."""
    best: tuple[float, str] | None = None
    for name in windows.outputs:
        others = [other for other in windows.outputs if other != name]
        if len(others) < 2:
            continue
        after = misfits_of(windows, settings, outputs=others)
        remaining = max(fraction for fraction, _ in after.values())
        if not contradicting_outputs(windows, settings, after) and (best is None or remaining < best[0]):
            best = (remaining, name)
    return None if best is None else best[1]


def _remedies(windows: Recording, channels: Sequence[str], settings: ContradictionSettings) -> Iterator[Alteration]:
    """These channels with another sign, unit, offset or clock."""
    for channel in channels:
        yield from other_signs_and_units(windows, (channel,))
        for late in (sign * seconds for seconds in settings.shifts for sign in (1.0, -1.0)):
            moved = moved_in_time(windows, channel, late)
            if still_compared(windows, moved.recording) > settings.least_compared:
                yield moved
