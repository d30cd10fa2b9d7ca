"""How often something is named on pairs of flights from which nothing is missing, in turbulence and in calm air.

    python -m benchmarks.turbulent_false_alarms --flights 100 --seed 0

Eight aircraft fly random steps of the elevator, one flight to fit and one to validate, recorded by equations that share
no code with the package (benchmarks/turbulent_flights.py): coloured noise, a recorder's bandwidth, resolution and rate.
Derivatives are declared 8 % off at random. Every second pair flies in calm air. By design one pair in a hundred may be
given an effect other than the gusts that are there.
"""

from __future__ import annotations

import numpy as np

from benchmarks.clean_pairs import OFF, Pair, count_named
from benchmarks.turbulent_flights import BODIES, aircraft_of, flown

AIR = (0.0, 0.3, 0.0, 0.6, 0.0, 1.0)
"""Standard deviation of the gusts, m/s, of one pair after another."""

INTERVALS = (0.02, 0.04, 0.1)
"""s."""

FIRST = 10_000_000
"""Where the seeds of these flights begin; those of tests and trials lie below."""


def pair(seed: int, n: int) -> Pair:
    """The n-th pair of a seed."""
    generator = np.random.default_rng([FIRST, seed, n])
    body, air = BODIES[int(generator.integers(len(BODIES)))], AIR[n % len(AIR)]
    interval, seconds = float(generator.choice(INTERVALS)), float(generator.uniform(20.0, 40.0))
    first = FIRST + 100_000 * seed + 2 * n
    fitted, unseen = (
        flown(name, body, first + i, air=air, interval=interval, seconds=seconds)
        for i, name in enumerate(("fitted", "unseen"))
    )
    return Pair(body.name, air, interval, (fitted, unseen), aircraft_of(body, OFF, generator))


if __name__ == "__main__":
    count_named((__doc__ or "").splitlines()[0], pair, pairs=100, wind="gust", moving="turbulence")
