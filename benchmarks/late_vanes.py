"""What the loop says of flights whose angle of attack is late: by a lag, a dead time, or both.

    python -m benchmarks.late_vanes --late both|lag|delay [--elevator] --pairs 32 --seed 1

Pairs of the flights of benchmarks/turbulent_flights.py, eight aircraft in turn, in air calm or moving by 0.3 or 1 m/s:
alpha with a lag of 0.1, 0.2 or 0.3 s, a dead time of 0.05, 0.1 or 0.2 s, or both; with `--elevator` that is late by
0.06 s too. Printed: pairs of which not exactly the planted effects are named (turbulence aside), and the errors of
timings and derivatives over their standard errors.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Collection, Mapping

import numpy as np
from numpy.random import Generator

from aerosid.compiled.cores import available, on_cores
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from benchmarks.turbulent_flights import BODIES, Body, Wrong, aircraft_of, flown

FIRST = 530_000
"""Of these trials; tests and tuning begin elsewhere."""

LAGS, DELAYS, AIR = (0.1, 0.2, 0.3), (0.05, 0.1, 0.2), (0.0, 0.3, 1.0)
"""s, s and m/s."""

ELEVATOR = 0.06
"""s."""

BRIEF = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)


def main() -> None:
    """Plant, fly, record, close the loop, score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--late", choices=("both", "lag", "delay"), default="both")
    parser.add_argument("--elevator", action="store_true")
    parser.add_argument("--pairs", type=int, default=32)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    counts: Counter[str] = Counter()
    timings: list[float] = []
    derivatives: list[float] = []
    for n in range(arguments.pairs):
        generator = np.random.default_rng([FIRST, arguments.seed, n])
        body, air = BODIES[n % len(BODIES)], float(generator.choice(AIR))
        planted = _planted(arguments.late, generator)
        if arguments.elevator:
            planted["control_delay", "delta_e"] = ELEVATOR
        result = _closed(body, air, planted, FIRST + 1000 * arguments.seed + 10 * n, generator)
        found = {(row.kind, row.where): row for row in result.effects if row.kind != "gust"}
        verdict = _judged(planted, found.keys())
        counts[verdict] += 1
        if verdict != "exactly these":
            told = ", ".join(f"{row.kind} {row.where} {row.term} {row.value:.3g}" for row in found.values())
            true = ", ".join(f"{' '.join(name)} {value:.3g}" for name, value in planted.items())
            print(f"{n:4} {body.name}, {air:g} m/s: {true}: {told}", flush=True)  # noqa: T201
        else:
            timings += [(row.value - planted[name]) / (row.std_error or np.inf) for name, row in found.items()]
        derivatives += errors_over_standard_errors(body.terms, result)
    print(", ".join(f"{name} {count}" for name, count in counts.most_common()))  # noqa: T201
    within = [100.0 * float(np.mean(np.abs(derivatives) < most)) for most in (2.0, 3.0)]
    print(  # noqa: T201
        f"{len(derivatives)} derivatives: {within[0]:.0f} % within 2, {within[1]:.0f} % within 3 standard errors, "
        f"worst {np.max(np.abs(derivatives)):.1f}; timings off by {np.sqrt(np.mean(np.square(timings or [0.0]))):.1f} "
        "(root mean square)"
    )


def _planted(late: str, generator: Generator) -> dict[tuple[str, str], float]:
    lag, delay = float(generator.choice(LAGS)), float(generator.choice(DELAYS))
    both = {("sensor_lag", "alpha"): lag, ("sensor_delay", "alpha"): delay}
    return {name: value for name, value in both.items() if late == "both" or name[0] == f"sensor_{late}"}


def _closed(
    body: Body, air: float, planted: dict[tuple[str, str], float], seed: int, generator: Generator
) -> ClosedLoop:
    wrong = Wrong(
        delay={"alpha": planted.get(("sensor_delay", "alpha"), 0.0)},
        lag={where: value for (kind, where), value in planted.items() if kind == "sensor_lag"},
        elevator_delay=planted.get(("control_delay", "delta_e"), 0.0),
    )
    logs = [flown(name, body, seed + n, air=air, wrong=wrong, seconds=40.0) for n, name in enumerate("ab")]
    with on_cores(available()):
        return close_loop(logs[:1], aircraft_of(body, 0.08, generator), logs[1:], BRIEF)


def _judged(planted: Mapping[tuple[str, str], float], found: Collection[tuple[str, str]]) -> str:
    names = set(found)
    if names == planted.keys():
        return "exactly these"
    return "fewer, none wrong" if names < planted.keys() else "more" if names > planted.keys() else "others"


def errors_over_standard_errors(truth: Mapping[tuple[str, str], float], result: ClosedLoop) -> list[float]:
    """Those of the declared derivatives, constants aside."""
    return [
        (row.value - truth[row.coefficient, row.term]) / row.std_error
        for row in result.derivatives
        if row.term != "1" and (row.coefficient, row.term) in truth and row.std_error
    ]


if __name__ == "__main__":
    main()
