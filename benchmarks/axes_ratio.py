"""Processor time of the loop in six and in lateral axes over that in the longitudinal ones, on the same flights.

    python -m benchmarks.axes_ratio --pairs 6 --seed 0

Each pair (benchmarks/six_axis_flights.py; nothing missing, a lift that depends on sideslip, a gyro off zero, in turn)
is closed with the files of all three cases, one after another in one process; the least time of each counts, so that
kernels are warm. The loop is the default one, with second opinion and next flight.
"""

from __future__ import annotations

import argparse
import time as clock

import numpy as np

from aerosid.loop.closed_loop import close_loop
from benchmarks.sideways_plants import NO_PLANT, catalogue
from benchmarks.six_axis_flights import CASES, Circumstances, aircraft_of, drawn, flown
from benchmarks.timing import best_in_turn, machine

FIRST = 45_000_000
"""Where the seeds of these flights begin."""

PLANTED = ("C_Z beta^2", "bias p")
"""Labels of what is missing in two of three pairs: in the plane of symmetry, and beside it."""


def seconds_of(case: str, at: Circumstances, label: str, first: int) -> float:
    """Processor time of one loop, s."""
    plants = {plant.label: plant for plant in catalogue(1.0, 1.0, at.seconds, at.body.span)}
    plant = plants.get(label, NO_PLANT)
    fitted, unseen = (flown(name, at, plant, first + i) for i, name in enumerate(("fitted", "unseen")))
    aircraft = aircraft_of(at, plant, case, np.random.default_rng([FIRST, first]))
    begun = clock.process_time()
    close_loop([fitted], aircraft, [unseen])
    return clock.process_time() - begun


def main() -> None:
    """Print the least times of each pair and the ratios of their sums."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pairs", type=int, default=6)
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    print(machine())  # noqa: T201
    names = list(CASES)
    spent = np.zeros((arguments.pairs, len(names)))
    for n in range(arguments.pairs):
        at = drawn(0.0, np.random.default_rng([FIRST, arguments.seed, n]))
        label, first = ("", *PLANTED)[n % 3], FIRST + 100_000 * arguments.seed + 2 * n
        runs = [lambda case=case: seconds_of(case, at, label, first) for case in names]  # noqa: B023
        spent[n] = best_in_turn(runs, arguments.rounds)
        told = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in zip(names, spent[n], strict=True))
        print(f"{label or 'nothing'}: {at.time.size} samples, {at.body.name}: {told}", flush=True)  # noqa: T201
    least = dict(zip(names, spent.T, strict=True))
    for name in names[1:]:
        ratios = least[name] / least[names[0]]
        total = float(least[name].sum() / least[names[0]].sum())
        print(f"{name} over {names[0]}: {total:.2f}, median of pairs {np.median(ratios):.2f}")  # noqa: T201


if __name__ == "__main__":
    main()
