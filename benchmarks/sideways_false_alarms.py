"""How often something is named on pairs of lateral flights from which nothing is missing, in side gusts and calm air.

    python -m benchmarks.sideways_false_alarms --flights 200 --seed 0

Three aircraft fly random steps of aileron and rudder, one flight to fit and one to validate, by equations that share no
code with the package (benchmarks/sideways_flights.py). Derivatives are declared 8 % off at random; every second pair
flies in wind from the side. Two pairs in two hundred may be given an effect other than the gusts that are there.
"""

from __future__ import annotations

import argparse
import sys
import time as clock
from collections import Counter

import numpy as np
from scipy.stats import binomtest

from aerosid.errors import AerosidError
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import METHODS, LoopSettings
from benchmarks.sideways_flights import BODIES, aircraft_of, flown

OFF = 0.08
"""Standard deviation of the declared derivatives' relative errors."""

GUSTS = (0.0, 0.005, 0.0, 0.01, 0.0, 0.02)
"""Standard deviation of the gusts over the airspeed, 1, of one pair after another."""

INTERVALS = (0.02, 0.04)
"""s."""

FIRST = 20_000_000
"""Where the seeds of these flights begin; those of tests and trials lie below."""


def main() -> None:
    """Fly, close the loop, count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--flights", type=int, default=200, help="pairs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    arguments = parser.parse_args()
    # Pictures, plans and second opinions take time and name nothing.
    settings = LoopSettings(
        method=arguments.method, paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False
    )
    begun = clock.perf_counter()
    tried: Counter[str] = Counter()
    named: Counter[str] = Counter()
    lines = []
    for n in range(arguments.flights):
        generator = np.random.default_rng([FIRST, arguments.seed, n])
        body = BODIES[int(generator.integers(len(BODIES)))]
        gust, interval = GUSTS[n % len(GUSTS)] * body.airspeed, float(generator.choice(INTERVALS))
        seconds, first = float(generator.uniform(18.0, 30.0)), FIRST + 100_000 * arguments.seed + 2 * n
        logs = [
            flown(name, body, first + i, gust=gust, interval=interval, seconds=seconds)
            for i, name in enumerate(("fitted", "unseen"))
        ]
        kind = "calm air" if gust == 0.0 else "side gusts"
        tried[kind] += 1
        try:
            result = close_loop(logs[:1], aircraft_of(body, OFF, generator), logs[1:], settings=settings)
        except AerosidError as error:
            lines.append(f"  {n}: {type(error).__name__}: {error}")
            continue
        wrong = [effect for effect in result.effects if effect.kind != "side_gust" or gust == 0.0]
        if wrong:
            named[kind] += 1
            effects = ", ".join(f"{e.kind} {e.where} {e.term} {e.value:.3g} +- {e.std_error:.2g}" for e in wrong)
            lines.append(f"  {n} ({body.name}, {gust:.2g} m/s, {interval} s): {effects}")
        print(f"\r{n + 1} of {arguments.flights}, {sum(named.values())} named", end="", file=sys.stderr)  # noqa: T201
    print(file=sys.stderr)  # noqa: T201
    print(f"{arguments.method}, seed {arguments.seed}: {clock.perf_counter() - begun:.0f} s")  # noqa: T201
    for kind, count in tried.items():
        interval_ = binomtest(named[kind], count).proportion_ci(method="wilson")
        print(f"{kind}: {named[kind]} of {count} named ({interval_.low:.1%} to {interval_.high:.1%})")  # noqa: T201
    print("\n".join(lines))  # noqa: T201


if __name__ == "__main__":
    main()
