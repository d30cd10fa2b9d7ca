"""How often something is named on pairs of lateral flights from which nothing is missing, in side gusts and calm air.

    python -m benchmarks.sideways_false_alarms --flights 200 --seed 0

Three aircraft fly random steps of aileron and rudder, one flight to fit and one to validate, by equations that share no
code with the package (benchmarks/sideways_flights.py). Derivatives are declared 8 % off at random; every second pair
flies in wind from the side. Two pairs in two hundred may be given an effect other than the gusts that are there.
"""

from __future__ import annotations

import numpy as np

from benchmarks.clean_pairs import OFF, Pair, count_named
from benchmarks.sideways_flights import BODIES, aircraft_of, flown

GUSTS = (0.0, 0.005, 0.0, 0.01, 0.0, 0.02)
"""Standard deviation of the gusts over the airspeed, 1, of one pair after another."""

INTERVALS = (0.02, 0.04)
"""s."""

FIRST = 20_000_000
"""Where the seeds of these flights begin; those of tests and trials lie below."""


def pair(seed: int, n: int) -> Pair:
    """The n-th pair of a seed."""
    generator = np.random.default_rng([FIRST, seed, n])
    body = BODIES[int(generator.integers(len(BODIES)))]
    gust, interval = GUSTS[n % len(GUSTS)] * body.airspeed, float(generator.choice(INTERVALS))
    seconds, first = float(generator.uniform(18.0, 30.0)), FIRST + 100_000 * seed + 2 * n
    fitted, unseen = (
        flown(name, body, first + i, gust=gust, interval=interval, seconds=seconds)
        for i, name in enumerate(("fitted", "unseen"))
    )
    return Pair(body.name, gust, interval, (fitted, unseen), aircraft_of(body, OFF, generator))


if __name__ == "__main__":
    count_named((__doc__ or "").splitlines()[0], pair, pairs=200, wind="side_gust", moving="side gusts")
