"""What the loop says of flights in turbulence, as recorders give them, with one to four things wrong or none.

    python -m benchmarks.field_detection --flights 40 --seed 0 [--only 3,7] [--keep DIR]

The aircraft, kinds of things wrong and equations of benchmarks/planted_flights.py, flown in gusts across the path and
recorded through instruments' bandwidth, coloured noise and a resolution at the rate of a research recorder, an
airliner's, an autopilot's, or low-passed without phase after the flight. Every tenth pair has nothing wrong; of the
others half one thing, the rest two to four. Printed: what was planted, what is named, the derivatives' errors over
their deviations.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt, sosfiltfilt

from aerosid.errors import AerosidError
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.result import ClosedLoop
from benchmarks.planted_aircraft import Body
from benchmarks.planted_flights import (
    UNITS,
    Circumstances,
    aircraft_text,
    csv_text,
    drawn,
    shape,
    simulated,
)
from benchmarks.plants import KINDS, Plant, in_catalogue
from benchmarks.wide_detection import HIGHEST, flown_and_closed, matches, numbers_of, print_kinds, sized, with_flights

Array = NDArray[np.float64]

FIRST = 20_000_000
"""Where the seeds of these flights begin."""

FINE = 0.01
"""s, between the samples that the instruments filter."""

WARM_UP = 400
"""Samples of noise thrown away."""

GUST_KIND = 10
"""Place of the gust among the kinds: here every flight has one."""

LATE_KINDS = {"lag": 1, "delay": 2}
"""Places of the late elevators among the kinds."""


@dataclass(frozen=True)
class Recorder:
    """Sampling time, s; bandwidth, Hz; standard deviations and resolutions, SI; `smoothed`: after the flight, Hz."""

    name: str
    interval: float
    bandwidth: float
    noise: Mapping[str, float]
    resolution: Mapping[str, float]
    smoothed: float = 0.0


def _of(values: Sequence[float]) -> dict[str, float]:
    return dict(zip(("V", "alpha", "q", "theta", "a_x", "a_z", "h", "delta_e"), values, strict=True))


RECORDERS = (
    Recorder(
        "research",
        0.04,
        8.0,
        _of((0.08, 8e-4, 6e-4, 5e-4, 0.012, 0.03, 0.3, 1e-4)),
        _of((0.02, 2e-4, 1e-4, 1e-4, 2e-3, 5e-3, 0.1, 5e-5)),
    ),
    Recorder(
        "airliner",
        0.1,
        3.0,
        _of((0.15, 1.5e-3, 8e-4, 1e-3, 0.02, 0.05, 0.5, 3e-4)),
        _of((0.05, 8e-4, 3e-4, 8e-4, 5e-3, 1e-2, 0.3, 4e-4)),
    ),
    Recorder(
        "autopilot",
        0.02,
        12.0,
        _of((0.25, 3e-3, 1e-3, 2e-3, 0.04, 0.08, 0.3, 5e-4)),
        _of((0.01, 1e-4, 1e-5, 1e-5, 1e-3, 1e-3, 0.01, 1e-4)),
    ),
    Recorder(
        "smoothed",
        0.05,
        8.0,
        _of((0.08, 8e-4, 6e-4, 5e-4, 0.012, 0.03, 0.3, 1e-4)),
        _of((0.002, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 0.01, 1e-5)),
        smoothed=2.0,
    ),
)


def main() -> None:
    """Plant, fly, record, close the loop, score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--late", choices=LATE_KINDS, help="a late elevator alone, in calm air, in place of all else")
    arguments = with_flights(parser).parse_args()
    numbers = numbers_of(arguments)

    def write(folder: Path, n: int) -> tuple[Circumstances, list[Plant], str]:
        return written(folder, [FIRST, arguments.seed, n], n, late=arguments.late)

    counts: Counter[str] = Counter()
    by_kind: dict[str, Counter[str]] = defaultdict(Counter)
    errors: list[tuple[float, float]] = []
    seconds = []
    with tempfile.TemporaryDirectory() as scratch:
        named = Path(arguments.keep or scratch) / f"field{arguments.seed}"
        for pair in scored(numbers, named, write, counts):
            for plant, word in zip(pair.plants, pair.words, strict=True):
                by_kind[" ".join(plant.label.split()[:2])][word] += 1
            errors += pair.errors
            seconds.append(pair.seconds)
    print(f"{len(numbers)} pairs: " + ", ".join(f"{k} {v}" for k, v in counts.most_common()))  # noqa: T201
    print_kinds(by_kind)
    share, t = np.abs(np.array(errors)).T
    print(  # noqa: T201
        f"{t.size} derivatives: median {100 * np.median(share):.2f} % off, {100 * np.mean(t <= 2):.0f} % within 2 and "
        f"{100 * np.mean(t <= 3):.0f} % within 3 of their standard errors; median {np.median(seconds):.1f} s, longest "
        f"{max(seconds):.1f} s"
    )


class Scored(NamedTuple):
    """A pair of flights: what was planted, a word on each, errors of the derivatives, seconds of the loop."""

    plants: Sequence[Plant]
    words: Sequence[str]
    errors: Sequence[tuple[float, float]]
    seconds: float


def scored(
    numbers: Sequence[int],
    named: Path,
    write: Callable[[Path, int], tuple[Circumstances, list[Plant], str]],
    counts: Counter[str],
) -> Iterator[Scored]:
    """Pairs that were flown and closed, each printed; outcomes are counted. The rest as of `flown_and_closed`."""
    for n, (at, plants, about), result, seconds in flown_and_closed(numbers, named, write, counts):
        if isinstance(result, AerosidError):
            counts["broke down"] += 1
            print(f"{n:3d} broke down: {result}")  # noqa: T201
            continue
        outcome, words = judged(plants, result)
        counts.update(outcome)
        off = derivative_errors(at, plants, result)
        far = [f"{t:.1f}" for _, t in off if abs(t) > 3.0]
        print(  # noqa: T201
            f"{n:3d} {' '.join(outcome):14} [{'; '.join(p.label for p in plants) or 'nothing'}] {about}: "
            f"{told(result)}{' deviations ' + ' '.join(far) if far else ''}; {seconds:.1f} s",
            flush=True,
        )
        yield Scored(plants, words, off, seconds)


def written(
    folder: Path,
    seed: Sequence[int],
    n: int,
    more: Callable[[Body], Sequence[Plant]] = lambda _body: (),
    late: str | None = None,
) -> tuple[Circumstances, list[Plant], str]:
    """A case folder of a pair of flights, what was planted, and how it was flown.

    `more` is planted besides; `late`: the elevator is, in calm air, in place of all else (`LATE_KINDS`).
    """
    generator = np.random.default_rng(list(seed))
    recorder = RECORDERS[int(generator.integers(len(RECORDERS)))]
    at = dataclasses.replace(
        drawn(generator), interval=FINE, duration=float(generator.uniform(24.0, 40.0)), noise=1.0, memory=0.0
    )
    air = Plant("air", gust=(float(generator.uniform(0.2, 1.0)), float(generator.uniform(80.0, 400.0))))
    time = at.interval * np.arange(int(at.duration / at.interval) + 1)
    unit = float(np.clip(1.0 / at.body.short_period * np.pi, 0.5, 2.0))
    inputs = [_manoeuvres(name, time, unit, generator) for name in at.shapes]
    amplitudes, scale = sized(at, inputs, time, seed)
    number = 0 if n % 10 == 9 else 1 if n % 2 == 0 else int(generator.integers(2, 5))
    kinds = generator.permutation([k for k in range(KINDS) if k != GUST_KIND])[:number]
    if late is not None:
        air, kinds = Plant("air"), np.array([LATE_KINDS[late]])
    plants = [in_catalogue(int(k), scale, generator) for k in kinds]
    if sum(p.stall is not None or p.shift is not None or p.ground is not None for p in plants) > 1:
        plants = plants[:1]
    plants.extend(more(at.body))
    folder.mkdir(parents=True, exist_ok=True)
    logged = any(name == "thrust" for p in plants for name, _ in p.logged)
    for k, role in enumerate(("identification", "validation")):
        asked = amplitudes[k] * inputs[k]
        motion, trimmed, thrust = simulated(at.body, at, asked, time, [*plants, air], [*seed, k])
        if np.abs(motion.outputs["alpha"]).max() > HIGHEST or motion.outputs["h"].min() < 0.0:
            raise ArithmeticError(f"{role}: nobody would have flown on")
        log = recorded(motion.time, motion.outputs, trimmed + asked, plants, recorder, [*seed, k], role)
        (folder / f"{role}.csv").write_text(csv_text(log))
    (folder / "aircraft.toml").write_text(aircraft_text(at, thrust, logged, seed))
    key = {"note": [p.label for p in plants], "accept": [list(map(list, p.accept)) for p in plants]}
    (folder / "key.json").write_text(json.dumps(key))
    gust = air.gust[0] if air.gust else 0.0
    about = f"{at.body.name}, {recorder.name}, {at.duration:.0f} s, {at.excursion:.3f} rad, gusts {gust:.2f} m/s"
    return at, plants, about


def _manoeuvres(name: str, time: Array, unit: float, generator: np.random.Generator) -> Array:
    """Two manoeuvres, one after the other."""
    first = shape(name, time, unit, generator)
    middle = int(0.5 * time.size)
    second = shape("multistep", time[: time.size - middle], 0.7 * unit, generator)
    values = first.copy()
    values[middle:] += second * (np.abs(first[middle:]).max(initial=0.0) == 0.0)
    return values


def recorded(
    time: Array,
    outputs: Mapping[str, Array],
    asked: Array,
    plants: Sequence[Plant],
    recorder: Recorder,
    seed: Sequence[int],
    name: str,
) -> FlightLog:
    """What a recorder holds of a motion: `asked` [rad] is what it takes the elevator for."""
    generator = np.random.default_rng([*seed, 1])
    channels = {channel: values.copy() for channel, values in outputs.items()} | {"delta_e": asked.copy()}
    for plant in plants:
        for channel, change in plant.sensors:
            channels[channel] = change(time, channels[channel], outputs)
    for channel, values in channels.items():
        shocks = generator.standard_normal((2, time.size + WARM_UP))
        keep = math.exp(-FINE / 0.15)
        coloured = math.sqrt(1.0 - keep**2) * lfilter([1.0], [1.0, -keep], shocks[0])[WARM_UP:]
        white = shocks[1][WARM_UP:]
        kept = _kept(recorder, values, recorder.noise[channel] * (0.6 * coloured + 0.8 * white))
        channels[channel] = recorder.resolution[channel] * np.round(kept / recorder.resolution[channel])
    samples = time[:: _stride(recorder)]
    for plant in plants:
        for channel, disturb in plant.recorders:
            channels[channel] = disturb(samples, channels[channel], generator)
        for channel, history in plant.logged:
            # Through the filters that the motion goes through: as it was it would lead by what they are late.
            channels[channel] = _kept(recorder, history(time))
    return FlightLog(name, samples, channels, {channel: UNITS.get(channel, "rad") for channel in channels})


def _stride(recorder: Recorder) -> int:
    """Steps of the simulation from sample to sample."""
    return round(recorder.interval / FINE)


def _kept(recorder: Recorder, values: Array, noise: Array | float = 0.0) -> Array:
    """What a recorder keeps of a channel at each of its samples, before rounding: filtered, and smoothed afterwards."""
    instrument = butter(2, recorder.bandwidth, fs=1.0 / FINE, output="sos")
    kept: Array = (values[0] + sosfilt(instrument, values - values[0]) + noise)[:: _stride(recorder)]
    if recorder.smoothed:
        after = butter(3, recorder.smoothed, fs=1.0 / recorder.interval, output="sos")
        kept = kept[0] + sosfiltfilt(after, kept - kept[0])
    return kept


def judged(plants: Sequence[Plant], result: ClosedLoop) -> tuple[list[str], list[str]]:
    """What became of a pair, and of each thing planted in it; a gust that is named is neither right nor wrong."""
    named = [(e.kind, e.where, e.term) for e in result.effects if e.kind != "gust"]
    others = [(e.kind, e.where, e.term) for e in result.alternatives]
    each = []
    for plant in plants:
        if any(matches(n, w) for w in plant.accept for n in named):
            each.append("found")
        elif any(matches(n, w) for w in plant.accept for n in others):
            each.append("offered")
        else:
            each.append("near" if any(matches(n, w) for w in plant.near for n in named) else "missed")
    known = [w for p in plants for w in (*p.accept, *p.near)]
    extra = ["extra"] * sum(not any(matches(n, w) for w in known) for n in named)
    if not plants:
        return (["clean"] if not named else ["alarm"]), []
    hits = sum(word in ("found", "offered") for word in each)
    close = hits + sum(word == "near" for word in each)
    whole = "whole" if hits == len(each) else "near" if close == len(each) else "part" if close else ""
    whole = whole or ("wrong" if named else "missed")
    return [whole, *extra], each


def derivative_errors(at: Circumstances, plants: Sequence[Plant], result: ClosedLoop) -> list[tuple[float, float]]:
    """Share of the true value and standard errors by which each declared derivative of motion is off."""
    flown = dict(at.body.terms)
    for plant in plants:
        for coefficient, term, number in plant.terms:
            flown[coefficient, term] = flown.get((coefficient, term), 0.0) + number
    return [
        (
            (d.value - flown[d.coefficient, d.term]) / flown[d.coefficient, d.term],
            (d.value - flown[d.coefficient, d.term]) / d.std_error,
        )
        for d in result.derivatives
        if d.term != "1" and d.std_error and d.value is not None and (d.coefficient, d.term) in at.body.terms
    ]


def told(result: ClosedLoop) -> str:
    """The result in words."""
    names = "; ".join(
        " ".join(f"{e.kind} {e.where} {e.term} {e.value:.3g}".split()) + f" +- {e.std_error or math.nan:.1g}"
        for e in result.effects
    )
    others = ", ".join(" ".join(f"{e.kind} {e.where} {e.term}".split()) for e in result.alternatives)
    return f"{result.verdict.name.lower()}: {names or '-'} (or {others or '-'})"


if __name__ == "__main__":
    main()
