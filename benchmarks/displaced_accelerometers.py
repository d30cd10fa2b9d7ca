"""What the loop says of flights in pitch whose accelerometers are not where they are declared, one or both in a unit.

    python -m benchmarks.displaced_accelerometers --air gusts|calm --flights 30 --seed 8700 [--only 3,7] [--keep DIR]

The pairs of benchmarks/field_detection.py in gusts, or of benchmarks/wide_detection.py in calm air, with the
accelerometers of a_x and a_z half a chord to one and a half ahead of or behind the centre of gravity, where they are
declared, and up to three tenths below or above it: of three pairs two in one unit, of the third that of a_z alone.
Printed: what was planted, what is named, terms that are not there, the derivatives' errors over their deviations.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.field_detection import FIRST, scored
from benchmarks.field_detection import written as written_in_gusts
from benchmarks.planted_aircraft import Body
from benchmarks.planted_flights import Circumstances
from benchmarks.plants import Plant
from benchmarks.wide_detection import numbers_of, with_flights
from benchmarks.wide_detection import written as written_in_calm_air

NEAREST, FURTHEST, HIGHEST = 0.5, 1.5, 0.3
"""Chords, 1: distances ahead or behind, and largest height."""


def main() -> None:
    """Plant, fly, record, close the loop, score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--air", choices=("gusts", "calm"), default="gusts")
    arguments = with_flights(parser).parse_args()
    counts: Counter[str] = Counter()
    of_place: Counter[str] = Counter()
    errors: list[float] = []
    with tempfile.TemporaryDirectory() as scratch:
        named = Path(arguments.keep or scratch) / f"unit_{arguments.air}{arguments.seed}"

        def write(folder: Path, n: int) -> tuple[Circumstances, list[Plant], str]:
            return written(folder, arguments.air, arguments.seed, n)

        for pair in scored(numbers_of(arguments), named, write, counts):
            of_place[f"{' '.join(pair.plants[-1].label.split()[:2])} {pair.words[-1]}"] += 1
            errors += [t for _, t in pair.errors]
    print(", ".join(f"{k} {v}" for k, v in counts.most_common()))  # noqa: T201
    print("places: " + ", ".join(f"{k} {v}" for k, v in sorted(of_place.items())))  # noqa: T201
    within = [100.0 * float(np.mean(np.abs(errors) <= most)) for most in (2.0, 3.0)] if errors else [math.nan] * 2
    print(f"{len(errors)} derivatives: {within[0]:.0f} % within 2, {within[1]:.0f} % within 3")  # noqa: T201


def written(folder: Path, air: str, seed: int, n: int) -> tuple[Circumstances, list[Plant], str]:
    """A case folder of a pair of flights, what was planted, the accelerometers last, and how it was flown."""

    def displaced(body: Body) -> tuple[Plant, ...]:
        return (_displaced(body, np.random.default_rng([FIRST, seed, n, 3]), in_one_unit=n % 3 != 2),)

    if air == "gusts":
        return written_in_gusts(folder, [FIRST, seed, n], n, displaced)
    # In calm air of every four pairs three have one more thing wrong with them.
    at, plants = written_in_calm_air(folder, "none" if n % 4 == 0 else "one", [FIRST, seed, n], n, displaced)
    return at, plants, f"{at.body.name}, {at.interval:g} s, {at.duration:.0f} s, {at.excursion:.3f} rad"


def _displaced(body: Body, generator: np.random.Generator, *, in_one_unit: bool) -> Plant:
    """Accelerometers off their place: that of a_z, or both."""
    ahead = float(generator.choice([-1.0, 1.0]) * generator.uniform(NEAREST, FURTHEST)) * body.mean_chord
    below = float(generator.uniform(-HIGHEST, HIGHEST)) * body.mean_chord
    near = tuple(("sensor_position", channel, "") for channel in ("a_x", "alpha", "V"))
    if in_one_unit:
        accept = ("sensor_position", "accelerometers", ""), ("sensor_position", "a_z", "")
        places = dict.fromkeys(("a_x", "a_z"), (ahead, below))
        return Plant(f"unit displaced x {ahead:.2f} z {below:.2f}", accept, near, places=places)
    near = (*near, ("sensor_position", "accelerometers", ""))
    return Plant(f"a_z displaced x {ahead:.2f}", (("sensor_position", "a_z", ""),), near, places={"a_z": (ahead, 0.0)})


if __name__ == "__main__":
    main()
