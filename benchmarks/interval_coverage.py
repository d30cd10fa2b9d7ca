"""How many true derivatives of flights with nothing missing lie within two of their deviations, by derivative and axis.

    python -m benchmarks.interval_coverage --case lateral|six --air calm|gusts --flights 40 --seed 0 [--method M]

Three aircraft fly random steps by equations that share no code with the package (benchmarks/six_axis_flights.py), one
flight to fit and one to validate; derivatives are declared up to 12 % off. Honest deviations hold 95.4 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.errors import AerosidError
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import METHODS
from benchmarks.sideways_detection import GUST, QUICK, WIND, deviations
from benchmarks.sideways_detection import told as told_of
from benchmarks.sideways_plants import NO_PLANT
from benchmarks.six_axis_flights import aircraft_of, drawn, flown

FIRST = 40_000_000
"""Where the seeds of these flights begin."""


def main() -> None:
    """Fly, close the loop, count."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--case", choices=("lateral", "six"), default="lateral")
    parser.add_argument("--air", choices=("calm", "gusts"), default="gusts")
    parser.add_argument("--flights", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    arguments = parser.parse_args()
    apart: dict[str, list[float]] = {}
    named = 0
    for n in range(arguments.flights):
        generator = np.random.default_rng([FIRST, arguments.seed, n])
        at = drawn(GUST if arguments.air == "gusts" else 0.0, generator)
        first = FIRST + 100_000 * arguments.seed + 2 * n
        logs = [flown(name, at, NO_PLANT, first + i) for i, name in enumerate(("fitted", "unseen"))]
        aircraft = aircraft_of(at, NO_PLANT, arguments.case, generator)
        try:
            result = close_loop(logs[:1], aircraft, logs[1:], settings=replace(QUICK, method=arguments.method))
        except AerosidError as error:
            print(f"{n}: {error}")  # noqa: T201
            continue
        wrong = [effect for effect in result.effects if effect.kind not in WIND]
        named += bool(wrong)
        if wrong:
            print(f"{n} ({at.body.name}, {at.interval:g} s): {told_of(result)}", flush=True)  # noqa: T201
        for (coefficient, term), off in deviations(at, NO_PLANT, result).items():
            for group in ("all", at.body.name, coefficient, f"{coefficient} {term}"):
                apart.setdefault(group, []).append(off)
    print(f"{arguments.case}, {arguments.air}, {arguments.flights} flights, seed {arguments.seed}: {named} named")  # noqa: T201
    print("\n".join(told(group, off) for group, off in sorted(apart.items())))  # noqa: T201


def told(group: str, apart: Sequence[float]) -> str:
    """Share within two deviations, root-mean-square and mean of the distances of one group, deviations."""
    off = np.array(apart)
    within = f"{np.mean(np.abs(off) < 2.0):6.1%} of {off.size:4d}"
    return f"{group:20} {within}, rms {np.sqrt(np.mean(off**2)):.2f}, mean {np.mean(off):+.2f}"


if __name__ == "__main__":
    main()
