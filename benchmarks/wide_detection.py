"""What the loop says of flights with one thing wrong, two, none, or something that no catalogue holds.

    python -m benchmarks.wide_detection --plant one|two|none|outside --flights 40 --seed 0 [--only 3,7] [--keep DIR]

Judged as the practice suite is: found (what was planted is named first, of two things both), near (what hardly differs
from it is), offered (it is among the alternatives), partial, wrong, missed; extra names; clean. Of things that no
catalogue holds: honest unless something is named that predicts the other flight worse, or the verdict is `explained`
or `nothing_missing` although more is left than noise. `seen` is the largest residual of the re-estimated declared
structure over the noise: below about 1.1 there is nothing to find. With --keep, each pair of flights is written as a
case folder with its key.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time as clock
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from aerosid.aircraft import load_aircraft
from aerosid.errors import AerosidError
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from benchmarks.planted_aircraft import Body
from benchmarks.planted_flights import (
    NOISE,
    VARIABLES,
    Circumstances,
    aircraft_text,
    csv_text,
    drawn,
    parsed_term,
    recorded,
    shape,
    simulated,
)
from benchmarks.plants import KINDS, Plant, Scale, in_catalogue, outside

_Flown = TypeVar("_Flown")

HIGHEST = 0.5
"""rad; where what is planted drives alpha beyond, nobody would have flown on."""


def main() -> None:
    """Plant, fly, close the loop, score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--plant", choices=("one", "two", "none", "outside"), default="one")
    arguments = with_flights(parser).parse_args()
    numbers = numbers_of(arguments)
    counts: Counter[str] = Counter()
    by_kind: dict[str, Counter[str]] = defaultdict(Counter)
    with tempfile.TemporaryDirectory() as scratch:
        named = Path(arguments.keep or scratch) / f"{arguments.plant}{arguments.seed}"

        def write(folder: Path, n: int) -> tuple[Circumstances, list[Plant]]:
            return written(folder, arguments.plant, [arguments.seed, n], n)

        for n, (at, plants), result, seconds in flown_and_closed(numbers, named, write, counts):
            if isinstance(result, AerosidError):
                outcome, said = ["crashed"], str(result)
            else:
                noise = {channel: size * at.noise for channel, size in NOISE.items()}
                outcome, said = judged(plants, result, noise), told(result)
            counts.update(outcome)
            for plant in plants:
                by_kind[" ".join(plant.label.split()[:2])].update(outcome)
            print(  # noqa: T201
                f"{n:3d} {outcome[0]:9} {' '.join(outcome[1:]):8} [{' + '.join(p.label for p in plants) or 'nothing'}] "
                f"{at.body.name}, {at.shapes[0]}, {at.interval:g} s, {at.duration:.0f} s, {at.excursion:.3f} rad, "
                f"noise x{at.noise:.2f} e x{at.elevator_noise:g} memory {at.memory:.2f}: {said}; "
                f"{seconds:.1f} s",
                flush=True,
            )
    print(f"{len(numbers)} flights: " + ", ".join(f"{k} {v}" for k, v in counts.most_common()))  # noqa: T201
    print_kinds(by_kind)
    sys.stdout.flush()


def written(
    folder: Path,
    plant: str,
    seed: Sequence[int],
    n: int,
    more: Callable[[Body], Sequence[Plant]] = lambda _body: (),
) -> tuple[Circumstances, list[Plant]]:
    """A case folder: aircraft.toml, identification.csv, validation.csv, and what was planted, `more` besides."""
    generator = np.random.default_rng(list(seed))
    at = drawn(generator)
    time = at.interval * np.arange(int(at.duration / at.interval) + 1)
    unit = float(np.clip(1.0 / at.body.short_period * np.pi, 0.5, 2.5))
    inputs = [shape(name, time, unit, generator) for name in at.shapes]
    amplitudes, scale = sized(at, inputs, time, seed)
    plants: list[Plant] = []
    if plant == "one":
        plants = [in_catalogue(n, scale, generator)]
    elif plant == "two":
        first, second = generator.choice(KINDS, 2, replace=False)
        plants = [in_catalogue(int(first), scale, generator), in_catalogue(int(second), scale, generator)]
    elif plant == "outside":
        plants = [outside(n, scale, generator)]
    plants.extend(more(at.body))
    folder.mkdir(parents=True, exist_ok=True)
    logged = any(name == "thrust" for p in plants for name, _ in p.logged)
    for k, role in enumerate(("identification", "validation")):
        asked = amplitudes[k] * inputs[k]
        motion, trimmed, thrust = simulated(at.body, at, asked, time, plants, [*seed, k])
        if np.abs(motion.outputs["alpha"]).max() > HIGHEST:
            raise ArithmeticError(f"{role}: alpha leaves the range of any model")
        if motion.outputs["h"].min() < 0.0:
            raise ArithmeticError(f"{role}: into the ground")
        log = recorded(motion, at, trimmed + asked, plants, [*seed, k], role)
        (folder / f"{role}.csv").write_text(csv_text(log))
    (folder / "aircraft.toml").write_text(aircraft_text(at, thrust, logged, seed))
    accept = [list(a) for p in plants for a in p.accept]
    key = {
        "every": len(plants) > 1,
        "accept": accept,
        "near": [list(a) for p in plants for a in p.near],
        "noise": {c: v * at.noise for c, v in NOISE.items()},
        "note": " + ".join(p.label for p in plants),
        "effect": {"gust": True} if any(p.gust for p in plants) else {},
    }
    (folder / "key.json").write_text(json.dumps(key))
    return at, plants


def sized(
    at: Circumstances, inputs: Sequence[np.ndarray], time: np.ndarray, seed: Sequence[int]
) -> tuple[list[float], Scale]:
    """How large each input is flown for the excursion of alpha that is wanted, rad, and what the first measures."""
    amplitudes = []
    for values in inputs:
        size = 0.02
        for _ in range(3):
            motion, _, _ = simulated(at.body, at, size * values, time, (), seed)
            alpha = motion.outputs["alpha"]
            size = float(np.clip(size * at.excursion / max(np.abs(alpha - alpha[0]).max(), 1e-6), 0.002, 0.3))
        amplitudes.append(size)
    motion, _, thrust = simulated(at.body, at, amplitudes[0] * inputs[0], time, (), seed)
    return amplitudes, measured(at, motion.outputs, amplitudes[0], time, thrust)


def with_flights(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    """The parser with which flights are asked, and where their cases are kept."""
    parser.add_argument("--flights", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--keep", default="")
    return parser


def numbers_of(arguments: argparse.Namespace) -> Sequence[int]:
    """The flights of a call: those of --only, or --flights of them from --first on."""
    only = [int(n) for n in arguments.only.split(",") if n]
    return only or range(arguments.first, arguments.first + arguments.flights)


def print_kinds(by_kind: Mapping[str, Counter[str]]) -> None:
    """A line for each kind that was planted."""
    for kind, row in sorted(by_kind.items()):
        print(f"  {kind:28} " + ", ".join(f"{k} {v}" for k, v in row.most_common()))  # noqa: T201


def measured(
    at: Circumstances, outputs: dict[str, np.ndarray], elevator: float, time: np.ndarray, thrust: float
) -> Scale:
    """What the sizes of plants are measured in, from a flight without any."""
    rate = at.body.mean_chord / (2.0 * at.body.airspeed)
    values = {
        "alpha": outputs["alpha"],
        "q_hat": outputs["q"] * rate,
        "delta_e": outputs["delta_e"],
        "V_hat": outputs["V"] / at.body.airspeed - 1.0,
        "alpha_dot_hat": np.gradient(outputs["alpha"], time) * rate,
    }

    def of(text: str) -> np.ndarray:
        return (
            np.prod([values[VARIABLES[i]] ** p for i, p in parsed_term(text)], axis=0)
            if text != "1"
            else np.zeros(time.size)
        )

    def share(coefficient: str, text: str) -> float:
        # of what alpha alone moves: the motion makes the parts of C_m cancel
        main = np.ptp(at.body.terms[coefficient, "alpha"] * values["alpha"])
        return float(np.ptp(of(text)) / main)

    fastest = float(np.quantile(np.abs(np.gradient(outputs["delta_e"], time)), 0.98))
    swing = {"alpha_highest": float(outputs["alpha"].max()), "elevator_rate": max(min(fastest, 2.5 * elevator), 0.05)}
    return Scale(
        float(np.ptp(outputs["alpha"])),
        elevator,
        share,
        float(time[-1]),
        at.body.mean_chord,
        thrust,
        at.body.airspeed,
        swing,
    )


def flown_and_closed(
    numbers: Sequence[int], named: Path, write: Callable[[Path, int], _Flown], counts: Counter[str]
) -> Iterator[tuple[int, _Flown, ClosedLoop | AerosidError, float]]:
    """Number, what `write` says of a pair, the loop's result or the error that ended it, and its seconds.

    `write` makes the case folder of a pair, which is `named` with the pair's number, or raises ArithmeticError where it
    could not be flown, which is counted.
    """
    for n in numbers:
        folder = named.with_name(f"{named.name}_{n:03d}")
        try:
            flown = write(folder, n)
        except ArithmeticError:
            counts["not flown"] += 1
            continue
        started = clock.perf_counter()
        result: ClosedLoop | AerosidError
        try:
            result = closed(folder)
        except AerosidError as error:
            result = error
        yield n, flown, result, clock.perf_counter() - started


def closed(folder: Path) -> ClosedLoop:
    """The loop on a case folder."""
    return close_loop(
        [read_log(folder / "identification.csv")],
        load_aircraft(folder / "aircraft.toml"),
        [read_log(folder / "validation.csv")],
        LoopSettings(paper_chain=False, next_flight=False, linear_analysis=False),
    )


def matches(got: tuple[str, str, str], wanted: tuple[str, str, str]) -> bool:
    """Whether a name is meant; an empty place or term of `wanted` stands for any, `pos` for any spline."""
    same_term = not wanted[2] or got[2] == wanted[2] or (wanted[2] == "pos" and got[2].startswith("pos"))
    return got[0] == wanted[0] and (not wanted[1] or got[1] == wanted[1]) and same_term


def judged(plants: Sequence[Plant], result: ClosedLoop, noise: Mapping[str, float]) -> list[str]:
    """What became of a flight, in words that are counted; `noise` the standard deviations that were planted."""
    names = [(e.kind, e.where, e.term) for e in result.effects]
    others = [(e.kind, e.where, e.term) for e in result.alternatives]
    known = [w for p in plants for w in (*p.accept, *p.near)]
    extra = ["extra"] * sum(not any(matches(n, w) for w in known) for n in names)
    outcome = []
    if not plants:
        return ["alarm" if names else f"clean ({result.verdict.name.lower()})"]
    if names and gain(result) < 0.98:
        outcome.append("worse")
    if not plants[0].accept:
        left = remaining(result, noise) > 1.15
        confident = result.verdict.name in ("EXPLAINED", "NOTHING_MISSING") and left
        named = "named" if names else "quiet"
        return [f"{'dishonest' if 'worse' in outcome or confident else 'honest'}", named, *outcome]
    if not names:
        said = result.verdict.name.lower()
        return [f"missed ({said})" if said != "unexplained" else "unexplained"]
    hits = [any(matches(n, w) for w in p.accept for n in (names if len(plants) > 1 else names[:1])) for p in plants]
    close = [any(matches(n, w) for w in p.near for n in (names if len(plants) > 1 else names[:1])) for p in plants]
    offered = [any(matches(n, w) for w in p.accept for n in (*others, *names)) for p in plants]
    if all(hits):
        first = "found"
    elif all(h or o for h, o in zip(hits, offered, strict=True)):
        first = "offered"
    elif all(h or c for h, c in zip(hits, close, strict=True)):
        first = "near"
    else:
        first = "partial" if any(hits) or any(close) else "wrong"
    return [first, *extra, *outcome]


def gain(result: ClosedLoop) -> float:
    """Median over channels of before/after on the second manoeuvre."""
    pairs = [(r.before, r.after) for r in result.errors if r.role == "validation"]
    return float(np.median([b / a for b, a in pairs if b is not None and a]))


def remaining(result: ClosedLoop, noise: Mapping[str, float]) -> float:
    """Largest of after over the noise that was planted, which coloured or not is known here, on the fitted flight."""
    ratios = [r.after / noise[r.channel] for r in result.errors if r.role == "identification" and r.after]
    return max(ratios, default=np.inf)


def told(result: ClosedLoop) -> str:
    """The result in words."""
    ratios = [r.before / r.noise for r in result.errors if r.role == "identification" and r.before and r.noise]
    seen = max(ratios, default=np.nan)
    after = [r.after / r.noise for r in result.errors if r.role == "validation" and r.after and r.noise] or [np.nan]
    names = "; ".join(" ".join(f"{e.kind} {e.where} {e.term} {e.value:.3g}".split()) for e in result.effects)
    others = ", ".join(" ".join(f"{e.kind} {e.where} {e.term}".split()) for e in result.alternatives)
    return (
        f"{result.verdict.name.lower()}: {names or '-'} (or {others or '-'}); seen {seen:.2f} after/noise "
        f"{np.median(after):.2f} worst {max(after):.2f} gain {gain(result):.2f}"
    )


if __name__ == "__main__":
    main()
