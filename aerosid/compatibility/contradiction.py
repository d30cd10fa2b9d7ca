"""Gross contradictions: a sign, a unit, a clock or a whole channel that no instrument fault mends.

Over windows of a few seconds small biases and drifts matter little, and whether the integrated motion is the measured
one shows in its shape. Where it is not, signs, units and clocks of one channel are tried; a channel without which the
others agree is named; else those that contradict each other.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.flight_path import DRIVING, GIVEN, SEEN
from aerosid.compatibility.recording import STRETCHES, Recording, compacted, liveliest, shows_motion
from aerosid.compatibility.window_fit import fit_windows
from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.effects.limits import OFFERED
from aerosid.effects.sensor import sensor_bias, sensor_delay, sensor_lag, sensor_scale
from aerosid.flight_model.constants import GRAVITY
from aerosid.nomenclature import CHANNELS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContradictionSettings:
    """Limits of what counts as a contradiction; found on recorded flights where not chosen.

    Those are the HFB-320, Twin Otter and Citation recordings, which are no evidence for them.

    Attributes
    ----------
    window : float
        s; length of the windows in which the shape of the motion is compared: a bias of 0.005 rad/s, which is large,
        moves theta by 0.02 rad about its mean within it. Chosen.
    most_windows : int
        The liveliest so many are looked at. Chosen for time.
    least_theta, least_h : float
        rad, m; a misfit below this contradicts nothing.
    air_alpha, air_V : float
        m/s; so much may be gusts. Moderate turbulence is 2 m/s (MIL-F-8785C); V sees that of some seconds only.
    misfit : float
        Share, 1, of a channel's variation that is not explained, from which it contradicts.
    misfit_h : float
        The same of altitude: pressure altitude is slow.
    small_bias : float
        rad; so much may theta and alpha be biased: more would turn any climb into a descent.
    agrees : float
        Share, 1, below which a channel agrees.
    doubtful, vanishes : float
        Share, 1, from which a channel is wrong if one of the remedies brings it below the other.
    above_noise : float
        Times its noise, 1, that a misfit must be.
    doubtful_air, doubtful_noise : float
        Shares, 1, of what gusts may do and of `above_noise` that the misfit of a doubtful channel must be.
    latest : float
        s; by so much a channel may be late, and follow a lag, without being another one. Chosen.
    largest_scale : float
        Share, 1, by which a channel may be wrongly scaled without being another one. Chosen.
    shifts : tuple of float
        s; how late or early a channel may be stamped, roughly. Chosen.
    """

    window: float = 8.0
    most_windows: int = 12
    least_theta: float = 0.02
    least_h: float = 10.0
    air_alpha: float = 3.0
    air_V: float = 2.0
    misfit: float = 0.5
    misfit_h: float = 1.0
    small_bias: float = 0.03
    agrees: float = 0.3
    doubtful: float = 0.4
    vanishes: float = 0.12
    above_noise: float = 8.0
    doubtful_air: float = 0.3
    doubtful_noise: float = 0.5
    latest: float = 1.0
    largest_scale: float = 0.5
    shifts: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0)

    def worst_share(self, output: str) -> float:
        """Share of an output's variation that is not explained, from which it contradicts."""
        return self.misfit_h if output == "h" else self.misfit

    def least(self, output: str, airspeed: float) -> float:
        """What gusts and drift may do to an output, SI, at an airspeed, m/s."""
        limits = {
            "alpha": self.air_alpha / max(airspeed, 1.0),
            "V": self.air_V,
            "theta": self.least_theta,
            "h": self.least_h,
        }
        return limits[output]


USUAL = ContradictionSettings()
"""The limits unless told otherwise."""

SIGN = (-1.0, "with its sign changed")
_ANGLE = (
    SIGN,
    (np.pi / 180.0, "if its numbers are degrees and not radians"),
    (180.0 / np.pi, "if its numbers are radians and not degrees"),
)
_ACCELERATION = (
    SIGN,
    (GRAVITY, "if its numbers are multiples of g and not m/s^2"),
    (1.0 / GRAVITY, "if its numbers are m/s^2 and not multiples of g"),
)
FACTORS = {
    "rad": _ANGLE,
    "rad/s": _ANGLE,
    "m/s^2": _ACCELERATION,
    "m/s": (
        (0.514444, "if its numbers are knots and not m/s"),
        (1.0 / 0.514444, "if its numbers are m/s and not knots"),
        (1.0 / 3.6, "if its numbers are km/h and not m/s"),
        (0.3048, "if its numbers are ft/s and not m/s"),
    ),
    "m": (
        SIGN,
        (0.3048, "if its numbers are feet and not metres"),
        (1.0 / 0.3048, "if its numbers are metres and not feet"),
    ),
}
"""What channel maps get wrong, by unit: by this the recorded numbers would have to be multiplied."""

OFFSETS = ((-GRAVITY, "with 9.81 m/s^2 taken off"), (GRAVITY, "with 9.81 m/s^2 added"))
"""An acceleration without the weight that specific force holds."""

DRIVEN_BY = {"V": "a_x", "alpha": "a_z", "theta": "q"}
"""The input that an output answers to first: where the output is wrong, it may be that one's fault."""


@dataclass(frozen=True)
class Contradiction:
    """Channels of one log that cannot belong to one motion.

    Attributes
    ----------
    log : str
        The log.
    channels : tuple of str
        The channel that is wrong, or those that contradict the integrated motion.
    remedy : str
        What would make them agree, as words after "it agrees"; empty where nothing was found.
    misfit : float
        Largest share of a channel's variation that the motion does not explain.
    """

    log: str
    channels: tuple[str, ...]
    remedy: str
    misfit: float

    @property
    def sentence(self) -> str:
        """The contradiction for a person."""
        share = f"{100.0 * min(self.misfit, 9.99):.0f} % of the variation is left"
        if self.remedy:
            return f"{self.log}: {self.channels[0]} contradicts the other channels ({share}); it agrees {self.remedy}."
        if len(self.channels) == 1:
            return (
                f"{self.log}: {self.channels[0]} contradicts the other channels, which agree without it ({share}); "
                "check that it belongs to this flight and to this clock."
            )
        return (
            f"{self.log}: {', '.join(self.channels)} contradict the motion that a_x, a_z and q give ({share}); check "
            "that all of them belong to this flight, and their signs, units and clocks."
        )


def contradictions(
    recordings: Sequence[Recording], settings: ContradictionSettings = USUAL
) -> tuple[Contradiction, ...]:
    """What no instrument fault, gust or noise reconciles."""
    found = []
    for recording in recordings:
        windows = _windows(recording, settings)
        if windows is None:
            continue
        misfits = _misfits(windows, settings)
        wrong, doubtful = _wrong(windows, settings, misfits), _doubtful(windows, settings, misfits)
        if wrong or doubtful:
            # An instrument may be late or wrongly scaled without being another one.
            tolerant = _tolerant(windows, settings, wrong or doubtful)
            wrong, doubtful = _wrong(windows, settings, tolerant), _doubtful(windows, settings, tolerant)
        if wrong or doubtful:
            explained = _explained(windows, settings, misfits, wrong, doubtful)
            if explained is not None:
                found.append(explained)
    return tuple(found)


def _windows(recording: Recording, settings: ContradictionSettings) -> Recording | None:
    """The recording in short stretches, the liveliest of them."""
    pieces: list[slice] = []
    interval = float(np.median(np.diff(recording.time)))
    length = max(STRETCHES.fewest, round(settings.window / interval))
    for stretch in recording.stretches:
        size = stretch.stop - stretch.start
        count = max(1, size // length)
        edges = np.linspace(stretch.start, stretch.stop, count + 1).round().astype(int)
        pieces += [slice(int(a), int(b)) for a, b in itertools.pairwise(edges)]
    lively = liveliest(recording.inputs, [piece for piece in pieces if shows_motion(recording, piece)])
    chosen = tuple(sorted(lively[: settings.most_windows], key=lambda piece: piece.start))
    return compacted(replace(recording, stretches=chosen)) if chosen else None


def _misfits(
    windows: Recording,
    settings: ContradictionSettings,
    faults: Sequence[ActiveEffect] = (),
    outputs: Sequence[str] = SEEN,
) -> dict[str, tuple[float, float]]:
    """Share of each output's variation that the motion leaves, and the misfit itself (SI), biases being free.

    `faults`: others that are free too, with the numbers to begin with.
    """
    left_out = [SEEN.index(name) for name in SEEN if name not in outputs]
    compared = windows.compared.copy()
    compared[:, left_out] = False
    windows = replace(windows, compared=compared)
    with np.errstate(all="ignore"):
        fitted = fit_windows(windows, [*faults, *_biases(windows, settings)])
    result = {}
    for name in windows.outputs:
        i = SEEN.index(name)
        squares, variation, count = 0.0, 0.0, 0
        for stretch, residual in zip(windows.stretches, fitted.residuals, strict=True):
            held = windows.compared[stretch, i]
            measured = windows.measured[stretch, i][held]
            if measured.size > 1:
                squares += float(np.sum(residual[held, i] ** 2))
                variation += float(np.sum((measured - measured.mean()) ** 2))
                count += measured.size
        misfit = float(np.sqrt(squares / max(count, 1)))
        misfit = misfit if np.isfinite(misfit) else np.inf
        result[name] = (misfit / float(np.sqrt(max(variation, 1e-300) / max(count, 1))), misfit)
    return result


def _biases(windows: Recording, settings: ContradictionSettings) -> list[ActiveEffect]:
    """Zeros of what drives the path, and of theta and alpha; those of the others go into the initial states."""
    seen = [name for name in ("theta", "alpha") if name in windows.outputs]
    return [
        _limited(
            sensor_bias(name, CHANNELS[name].unit, max(windows.noise[name], 1e-9)),
            settings.small_bias if name in seen else OFFERED.largest_bias[CHANNELS[name].unit],
        )
        for name in (*DRIVING, *seen)
    ]


def _limited(effect: OutputEffect, reach: float, start: float | None = None) -> ActiveEffect:
    """The effect from `start`, by default none, its number within a reach of none."""
    (parameter,) = effect.parameters
    lowest, highest = max(parameter.lowest, parameter.null - reach), min(parameter.highest, parameter.null + reach)
    bound = replace(parameter, lowest=lowest, highest=highest)
    return ActiveEffect(replace(effect, parameters=(bound,)), (parameter.null if start is None else start,))


def _tolerant(
    windows: Recording, settings: ContradictionSettings, suspects: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """The misfits that are left where the suspects and what drives them may be late and wrongly scaled, at best."""
    best = _misfits(windows, settings)
    driving = [DRIVEN_BY[name] for name in suspects if name in DRIVEN_BY]
    for made, start in ((sensor_delay, 0.1), (sensor_delay, 0.4), (sensor_lag, 0.2)):
        for channels in (suspects, driving):
            faults = [
                active
                for name in channels
                for active in (
                    _limited(made(name), settings.latest, start),
                    _limited(sensor_scale(name), settings.largest_scale),
                )
            ]
            found = _misfits(windows, settings, faults)
            if max(found[name][0] for name in suspects) < max(best[name][0] for name in suspects):
                best = found
    return best


def _wrong(
    windows: Recording, settings: ContradictionSettings, misfits: dict[str, tuple[float, float]]
) -> tuple[str, ...]:
    """The outputs whose misfit is more than noise, gusts and drift."""
    wrong = []
    for name, (share, misfit) in misfits.items():
        least = max(settings.least(name, windows.airspeed), settings.above_noise * windows.noise[name])
        if share > settings.worst_share(name) and misfit > least:
            wrong.append(name)
    return tuple(wrong)


def _doubtful(
    windows: Recording, settings: ContradictionSettings, misfits: dict[str, tuple[float, float]]
) -> tuple[str, ...]:
    """The outputs that are wrong if a change of sign, unit or clock makes their misfit vanish."""
    doubtful = []
    for name, (share, misfit) in misfits.items():
        air = settings.doubtful_air * settings.least(name, windows.airspeed)
        noise = settings.doubtful_noise * settings.above_noise * windows.noise[name]
        if share > settings.doubtful and misfit > max(air, noise):
            doubtful.append(name)
    return tuple(doubtful)


def _explained(
    windows: Recording,
    settings: ContradictionSettings,
    misfits: dict[str, tuple[float, float]],
    wrong: tuple[str, ...],
    doubtful: tuple[str, ...],
) -> Contradiction | None:
    """The contradiction with the channel that is to blame and what mends it, where that can be told."""
    suspects = wrong or doubtful
    misfit = max(misfits[name][0] for name in suspects)
    blamed = _without_which_the_others_agree(windows, settings)
    if blamed is None:
        channels: tuple[str, ...] = DRIVING
    else:
        channels = (blamed, DRIVEN_BY[blamed]) if blamed in DRIVEN_BY else (blamed,)
    enough = settings.agrees if wrong else settings.vanishes
    best: tuple[float, str, str] | None = None
    for channel, remedy, changed in _remedies(windows, channels, settings):
        after = _misfits(changed, settings)
        left = max(after[name][0] for name in {*suspects, blamed} if name in after)
        if left < enough and not _wrong(changed, settings, after) and (best is None or left < best[0]):
            best = (left, channel, remedy)
    if best is not None:
        return Contradiction(windows.log.name, (best[1],), best[2], misfit)
    if not wrong:
        return None
    return Contradiction(windows.log.name, wrong if blamed is None else (blamed,), "", misfit)


def _without_which_the_others_agree(windows: Recording, settings: ContradictionSettings) -> str | None:
    """The output without which the others agree best; None where they do not without any."""
    best: tuple[float, str] | None = None
    for name in windows.outputs:
        others = [other for other in windows.outputs if other != name]
        if len(others) < 2:
            continue
        after = _misfits(windows, settings, outputs=others)
        left = max(share for share, _ in after.values())
        if not _wrong(windows, settings, after) and (best is None or left < best[0]):
            best = (left, name)
    return None if best is None else best[1]


def _remedies(
    windows: Recording, channels: Sequence[str], settings: ContradictionSettings
) -> Iterator[tuple[str, str, Recording]]:
    """These channels with another sign, unit, zero or clock: the name, the words, the recording so changed."""
    for channel in channels:
        given = windows.channel(channel)
        for factor, words in FACTORS[CHANNELS[channel].unit]:
            yield channel, words, _with_channel(windows, channel, factor * given)
        if channel in ("a_x", "a_z"):
            for offset, words in OFFSETS:
                yield channel, words, _with_channel(windows, channel, given + offset)
        for shift in (sign * seconds for seconds in settings.shifts for sign in (1.0, -1.0)):
            moved = np.interp(windows.time + shift, windows.time, given)
            words = f"when moved about {abs(shift):g} s {'earlier' if shift > 0.0 else 'later'}"
            yield channel, words, _with_channel(windows, channel, moved)


def _with_channel(recording: Recording, name: str, values: Array) -> Recording:
    factor = float(np.nanstd(values)) / max(float(np.nanstd(recording.channel(name))), 1e-300)
    noise = {**recording.noise, name: recording.noise[name] * factor}
    if name in DRIVING:
        inputs = recording.inputs.copy()
        inputs[:, GIVEN.index(name)] = values
        return replace(recording, inputs=inputs, noise=noise)
    measured = recording.measured.copy()
    measured[:, SEEN.index(name)] = values
    return replace(recording, measured=measured, noise=noise)
