"""Selection of instrument faults by score tests, with those that cannot be told apart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import chdtri, ndtr, ndtri

from aerosid.compatibility.contradiction import ContradictionSettings
from aerosid.compatibility.estimate import STEP, TRIAL, Fit, deviations, fit, normal_equations, score
from aerosid.compatibility.faults import Fault, catalogue
from aerosid.compatibility.likelihood import Structure
from aerosid.compatibility.recording import Recording


@dataclass(frozen=True)
class SearchSettings:
    """Settings of the search, each with the reason for its value.

    Attributes
    ----------
    false_alarm : float
        Share of flights with nothing wrong in which something may be named, by design.
    shortlist : int
        Faults that are fitted in each round: the score's ranking is exact only for small ones.
    rounds : int
        How many explanations may enter; beyond, the channels do not belong together.
    price : float
        What each further number must bring in -2 ln L for one explanation to be preferred to a simpler one.
    reach : float
        Difference of -2 ln L, for white residuals, within which another fault counts as not told apart (20:1).
    collinear : float
        Squared cosine between the effects of two faults from which they count as not told apart, other instruments'
        biases being unknown: a model that is not exact can then favour the wrong one.
    first_sigma : float
        m/s; standard deviation of the air's velocity at which the search of gusts begins. Chosen.
    coloured : float
        Probability of white noise, 1, from which a residual is called coloured. Chosen.
    above_the_vane : float
        Times the vane's noise, 1, that gusts must be for other effects to be sought beside them. Found on the Twin
        Otter and Citation recordings.
    gusts_last : float
        s; how long such gusts last at least: a vane whose noise keeps 0.8 of each sample looks, sampled at 40 Hz, like
        gusts of 0.4 s. Found on the same.
    contradiction : ContradictionSettings
        Limits of what counts as a contradiction.
    """

    false_alarm: float = 0.002
    shortlist: int = 3
    rounds: int = 8
    price: float = 8.0
    reach: float = 6.0
    collinear: float = 0.75
    first_sigma: float = 0.3
    coloured: float = 1e-4
    above_the_vane: float = 1.5
    gusts_last: float = 0.5
    contradiction: ContradictionSettings = field(default_factory=ContradictionSettings)


DEFAULT = SearchSettings()

AXES = ("w", "u")
"""Body axes along which air may move, and where a search of its standard deviation begins."""


@dataclass(frozen=True)
class Named:
    """One fault with its number, the deviation of that, corrected, and how certain it is.

    `gain` is the rise of -2 ln L when it is struck out again, `p_value` that of its being none, the number of faults
    that were asked after counted.
    """

    fault: Fault
    value: float
    std_error: float
    gain: float
    p_value: float


@dataclass(frozen=True)
class Searched:
    """What was found: `null` without any fault or gust, `final` with all, and what could stand instead."""

    null: Fit
    final: Fit
    named: tuple[Named, ...]
    instead: tuple[tuple[Named, ...], ...]
    """For each named fault, those that these flights cannot tell from it, with the numbers they would have."""


def search(recordings: Sequence[Recording], settings: SearchSettings = DEFAULT) -> Searched:
    """The faults that the kinematics of these recordings show for certain.

    Parameters
    ----------
    recordings : sequence of Recording
        One set of instruments: one joint estimate.

    Notes
    -----
    In each round the faults with the best scores, and gusts and further noise of the driving channels, are fitted; the
    most likely explanation enters, a fault only where its corrected deviation leaves no doubt. What the others make
    unnecessary is struck out at the end.
    """
    asked = catalogue(recordings)
    certain = -float(ndtri(0.5 * settings.false_alarm / len(asked)))
    worth = float(chdtri(1.0, settings.false_alarm / len(asked)))
    null = current = fit(recordings, Structure())
    entered = False
    # What entered early for want of the right explanation leaves in between; then only what is certain may enter.
    for doubt in (0.0, certain):
        for _ in range(settings.rounds):
            trials = [*_with_faults(recordings, current, asked, worth, settings)]
            trials += _with_gusts(recordings, current, settings)
            trials = [trial for trial in trials if current.cost - trial.cost > worth]
            if doubt > 0.0:
                trials = [trial for trial in trials if _moves_air(trial, current) or _ratio(recordings, trial) > doubt]
            if not trials:
                break
            best = min(trials, key=lambda trial: trial.cost + settings.price * _numbers(trial))
            current, entered = fit(recordings, best.structure, best, STEP), True
        if not entered:
            break
        current = _pruned(recordings, fit(recordings, current.structure, current), certain, worth)
    without = [_without(recordings, current, place) for place in range(len(current.structure.faults))]
    named = _named(recordings, current, without, len(asked))
    instead = tuple(
        tuple(_instead(recordings, current, without[current.structure.faults.index(each.fault)], each, asked, settings))
        for each in named
    )
    return Searched(null, current, named, instead)


def _numbers(at: Fit) -> int:
    gust = at.structure.gust
    return len(at.structure.faults) + 2 * (gust.sigma_w > 0.0) + 2 * (gust.sigma_u > 0.0)


def _with_gusts(recordings: Sequence[Recording], current: Fit, settings: SearchSettings) -> Iterator[Fit]:
    """The present structure with moving air along each axis along which it rests."""
    for axis in AXES:
        if getattr(current.structure.gust, f"sigma_{axis}") == 0.0:
            gust = replace(current.structure.gust, **{f"sigma_{axis}": settings.first_sigma})
            yield fit(recordings, replace(current.structure, gust=gust), current, TRIAL)


def _with_faults(
    recordings: Sequence[Recording], current: Fit, asked: Sequence[Fault], worth: float, settings: SearchSettings
) -> Iterator[Fit]:
    """The present structure with one more fault, for each that is worth a fit."""
    structure = current.structure
    for found in score(recordings, current, _left(structure, asked))[: settings.shortlist]:
        if found.gain > 0.5 * worth:
            faults, values = (*structure.faults, found.fault), (*structure.values, found.value)
            trial = fit(recordings, replace(structure, faults=faults, values=values), current, TRIAL, gusts=False)
            if not _at_limit(trial):
                yield trial


LATE = ("sensor_delay", "sensor_lag")


def _left(structure: Structure, asked: Sequence[Fault]) -> list[Fault]:
    """The faults that may enter beside those that are in: an instrument is late in one way."""
    late = {fault.channel for fault in structure.faults if fault.kind in LATE}
    return [
        fault for fault in asked if fault not in structure.faults and not (fault.kind in LATE and fault.channel in late)
    ]


def _at_limit(at: Fit) -> bool:
    """Whether the fault that entered last is at a limit, where it means something else."""
    fault, value = at.structure.faults[-1], at.structure.values[-1]
    return not fault.lowest < value < fault.highest


def _moves_air(trial: Fit, current: Fit) -> bool:
    return trial.structure.gust != current.structure.gust


def _ratio(recordings: Sequence[Recording], at: Fit) -> float:
    """How many deviations the fault that entered last is from none."""
    corrected, _ = deviations(recordings, at, quick=True)
    return abs(at.structure.values[-1] - at.structure.faults[-1].null) / float(corrected[-1])


def _without(recordings: Sequence[Recording], at: Fit, place: int) -> Fit:
    structure = at.structure
    faults = (*structure.faults[:place], *structure.faults[place + 1 :])
    values = (*structure.values[:place], *structure.values[place + 1 :])
    return fit(recordings, replace(structure, faults=faults, values=values), at, STEP)


def _pruned(recordings: Sequence[Recording], current: Fit, certain: float, worth: float) -> Fit:
    """Without gusts and faults that the others have made unnecessary or doubtful."""
    for axis in AXES:
        if getattr(current.structure.gust, f"sigma_{axis}") > 0.0:
            gust = replace(current.structure.gust, **{f"sigma_{axis}": 0.0})
            trial = fit(recordings, replace(current.structure, gust=gust), current, STEP)
            if trial.cost - current.cost < worth:
                current = trial
    while current.structure.faults:
        corrected, _ = deviations(recordings, current)
        ratios = [
            abs(value - fault.null) / error if fault.lowest < value < fault.highest else 0.0
            for fault, value, error in zip(current.structure.faults, current.structure.values, corrected, strict=True)
        ]
        least = int(np.argmin(ratios))
        if ratios[least] > certain:
            break
        current = _without(recordings, current, least)
    return current


def _named(recordings: Sequence[Recording], at: Fit, without: Sequence[Fit], asked: int) -> tuple[Named, ...]:
    """The faults of a fit with their evidence, most certain first."""
    corrected, _ = deviations(recordings, at)
    named = []
    for n, (fault, value) in enumerate(zip(at.structure.faults, at.structure.values, strict=True)):
        gain = without[n].cost - at.cost
        p_value = min(1.0, 2.0 * float(ndtr(-abs(value - fault.null) / corrected[n])) * asked)
        named.append(Named(fault, value, float(corrected[n]), gain, p_value))
    return tuple(sorted(named, key=lambda each: -abs(each.value - each.fault.null) / each.std_error))


def _instead(
    recordings: Sequence[Recording],
    at: Fit,
    rest: Fit,
    named: Named,
    asked: Sequence[Fault],
    settings: SearchSettings,
) -> Iterator[Named]:
    """The faults that could stand in place of a named one, with the numbers they would have."""
    structure = at.structure
    place = structure.faults.index(named.fault)
    corrected, white = deviations(recordings, at)
    reach = settings.reach * float(corrected[place] / white[place]) ** 2
    others = [fault for fault in asked if fault not in structure.faults]
    likeness = _likeness(recordings, rest, named.fault, others)
    for found in score(recordings, rest, others):
        like = likeness[found.fault]
        # What imitates little of the effect cannot come near.
        if like < 0.5 * settings.collinear:
            continue
        swapped = replace(
            rest.structure, faults=(*rest.structure.faults, found.fault), values=(*rest.structure.values, found.value)
        )
        other = fit(recordings, swapped, rest, TRIAL, gusts=False)
        value = other.structure.values[-1]
        gain, lost = rest.cost - other.cost, other.cost - at.cost
        alike = like > settings.collinear and gain > lost
        if found.fault.lowest < value < found.fault.highest and gain > settings.price and (lost < reach or alike):
            error, _ = deviations(recordings, other)
            ratio = abs(value - found.fault.null) / float(error[-1])
            p_value = min(1.0, 2.0 * float(ndtr(-ratio)) * len(asked))
            yield Named(found.fault, value, float(error[-1]), gain, p_value)


def _likeness(recordings: Sequence[Recording], rest: Fit, fault: Fault, others: Sequence[Fault]) -> dict[Fault, float]:
    """Squared cosine between the effect of a fault and that of each other, the rest taken out of both.

    The rest is what the fit holds and the biases of all other instruments: a difference that is one only while
    another instrument has no bias tells nothing apart.
    """
    held = len(rest.structure.faults)
    biases = [other for other in others if other.kind == "sensor_bias"]
    tested = [(each, each.trials[-1] if each.kind in ("sensor_delay", "sensor_lag") else each.trials[0])
              for each in (fault, *others)]  # fmt: skip
    normal, _ = normal_equations(recordings, rest, tested)
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    normal = normal / np.outer(scale, scale)
    result = {}
    for n, other in enumerate(others, start=held + 1):
        taken = [
            *range(held),
            *(held + 1 + others.index(b) for b in biases if b is not other and b.channel != fault.channel),
        ]
        pair = [held, n]
        inner = np.linalg.pinv(normal[np.ix_(taken, taken)], rcond=1e-10, hermitian=True)
        cross = normal[np.ix_(pair, taken)]
        left = normal[np.ix_(pair, pair)] - cross @ inner @ cross.T
        size = left[0, 0] * left[1, 1]
        result[other] = float(left[0, 1] ** 2 / size) if size > 1e-16 else 0.0
    return result
