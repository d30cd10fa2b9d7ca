"""What the loop says of lateral and six-axis flights with one thing of the catalogue wrong, kind by kind, or nothing.

    python -m benchmarks.sideways_detection --case lateral|six --air calm|gusts --seed 0 [--only PART,...] [--clean 20]
        [--recorder filtered|smoothed] [--method iebmee]

Three aircraft fly random steps, one flight to fit and one to validate, by equations that share no code with the package
(benchmarks/six_axis_flights.py). Found: what was planted is named first; near: what hardly differs from it is; offered:
it is among the alternatives; wrong, missed; extra names. Beside gusts, which are there, the wind does not count as a
name. Residual: of a pair from which nothing is missing, or whose structure was found, the verdict says that more than
noise is left. In the end the share of the true derivatives that lies within two standard deviations of the estimates,
on all flights of which the structure was found.
"""

from __future__ import annotations

import argparse
import time as clock
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.errors import AerosidError
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import METHODS, LoopSettings, Method
from aerosid.loop.verdict import Verdict
from benchmarks.sideways_plants import NO_PLANT, SidePlant, catalogue
from benchmarks.six_axis_flights import RECORDERS, Circumstances, aircraft_of, drawn, flown
from benchmarks.wide_detection import matches

FIRST = 30_000_000
"""Where the seeds of these flights begin."""

GUST = 0.01
"""Standard deviation of the side wind over the airspeed, 1."""

SIZES = (0.7, 1.4)
"""Sizes between which those of the plants are drawn, 1."""

LEAVING = (Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED)
WIND = ("gust", "side_gust", "turbulence")
QUICK = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)


def planted(n: int, seed: int, gust: float, recorder: str = "none") -> tuple[Circumstances, SidePlant, int]:
    """How the n-th pair flies and what is wrong with it; beyond the last kind nothing is."""
    generator = np.random.default_rng([FIRST, seed, n])
    at = drawn(gust, generator, recorder)
    size, sign = float(generator.uniform(*SIZES)), float(generator.choice([-1.0, 1.0]))
    kinds = catalogue(size, sign, at.seconds, at.body.span)
    return at, kinds[n] if n < len(kinds) else NO_PLANT, FIRST + 100_000 * seed + 2 * n


def closed(at: Circumstances, plant: SidePlant, case: str, first: int, method: Method = METHODS[0]) -> ClosedLoop:
    """The loop on a pair."""
    generator = np.random.default_rng([FIRST, first])
    fitted, unseen = (flown(name, at, plant, first + i) for i, name in enumerate(("fitted", "unseen")))
    return close_loop(
        [fitted], aircraft_of(at, plant, case, generator), [unseen], settings=replace(QUICK, method=method)
    )


def judged(plant: SidePlant, result: ClosedLoop) -> list[str]:
    """What became of a pair, in words that are counted."""
    names = [(e.kind, e.where, e.term) for e in result.effects if e.kind not in WIND]
    others = [(e.kind, e.where, e.term) for e in result.alternatives]
    extra = ["extra"] * sum(not any(matches(name, w) for w in (*plant.accept, *plant.near)) for name in names)
    if not plant.accept:
        return ["alarm" if names else "clean"]
    if not names:
        return [f"missed ({result.verdict.name.lower()})"]
    if any(matches(names[0], wanted) for wanted in plant.accept):
        return ["found", *extra]
    if any(matches(name, wanted) for name in (*names, *others) for wanted in plant.accept):
        return ["offered", *extra]
    return ["near" if any(matches(names[0], wanted) for wanted in plant.near) else "wrong", *extra]


def deviations(at: Circumstances, plant: SidePlant, result: ClosedLoop) -> dict[tuple[str, str], float]:
    """Standard deviations of each estimated derivative from the truth."""
    truth = {**at.body.terms, **plant.terms}
    return {
        (row.coefficient, row.term): (row.value - truth[row.coefficient, row.term]) / row.std_error
        for row in result.derivatives
        if row.term != "1" and row.std_error and (row.coefficient, row.term) in truth and row.value is not None
    }


def told(result: ClosedLoop) -> str:
    """The result in words."""
    ratios = [r.before / r.noise for r in result.errors if r.role == "validation" and r.before and r.noise]
    after = [r.after / r.noise for r in result.errors if r.role == "validation" and r.after and r.noise]
    names = "; ".join(
        " ".join(f"{e.kind} {e.where} {e.term} {e.value:.3g}+-{e.std_error:.1g}".split()) for e in result.effects
    )
    others = ", ".join(" ".join(f"{e.kind} {e.where} {e.term}".split()) for e in result.alternatives)
    before = max(ratios, default=0.0)
    return (
        f"{result.verdict.name.lower()}: {names or '-'} (or {others or '-'}); before/noise {before:.2f} "
        f"after/noise {np.median(after or [0]):.2f} worst {max(after, default=0):.2f}"
    )


def _wanted(plant: SidePlant, case: str, only: Sequence[str]) -> bool:
    return case in plant.cases and (not only or any(part in plant.label for part in only))


def main() -> None:
    """Plant, fly, close the loop, count."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--case", choices=("lateral", "six"), default="lateral")
    parser.add_argument("--air", choices=("calm", "gusts"), default="calm")
    parser.add_argument("--recorder", choices=RECORDERS, default="none")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="parts of labels, by commas")
    parser.add_argument("--clean", type=int, default=0, help="pairs from which nothing is missing, in place of others")
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    arguments = parser.parse_args()
    gust = GUST if arguments.air == "gusts" else 0.0
    count = len(catalogue(1.0, 1.0, 20.0, 10.0))
    only = [part for part in arguments.only.split(",") if part]
    counts: Counter[str] = Counter()
    apart: list[float] = []
    for n in range(count, count + arguments.clean) if arguments.clean else range(count):
        at, plant, first = planted(n, arguments.seed, gust, arguments.recorder)
        if not arguments.clean and not _wanted(plant, arguments.case, only):
            continue
        started = clock.perf_counter()
        try:
            result = closed(at, plant, arguments.case, first, arguments.method)
        except AerosidError as error:
            outcome, said = ["crashed"], str(error)
        else:
            outcome, said = judged(plant, result), told(result)
            if outcome in (["found"], ["clean"]):
                outcome += ["residual"] * (result.verdict in LEAVING)
                off = deviations(at, plant, result)
                apart += off.values()
                far = max(off, key=lambda entry: abs(off[entry]))
                said += f"; furthest {' '.join(far)} {off[far]:.1f} deviations"
        counts.update(outcome)
        print(  # noqa: T201
            f"{n:3d} {' '.join(outcome):16} [{plant.label}] {at.body.name}, {at.interval:g} s, {at.seconds:.0f} s: "
            f"{said}; "
            f"{clock.perf_counter() - started:.1f} s",
            flush=True,
        )
    said = ", ".join(f"{kind} {count}" for kind, count in counts.most_common())
    print(f"{arguments.case}, {arguments.air}, seed {arguments.seed}: {said}")  # noqa: T201
    if apart:
        inside = np.abs(apart) < 2.0
        print(f"{inside.mean():.1%} of {inside.size} derivatives within two deviations, rms {np.std(apart):.2f}")  # noqa: T201


if __name__ == "__main__":
    main()
