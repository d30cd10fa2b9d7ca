"""What the loop says of flights whose longitudinal or lateral accelerometer is late, by a lag or a dead time.

    python -m benchmarks.late_accelerometers --channel a_x|a_y|none --pairs 48 --seed 1

Pairs of the flights of benchmarks/turbulent_flights.py (a_x) or, lateral and in six axes in turn, of
benchmarks/six_axis_flights.py (a_y), in calm and moving air: a lag of 0.05 or 0.1 s or a dead time of 0.04 or 0.08 s;
on two of three pairs a surface or a vane is late too. With `none` the accelerometers of both are not. Printed: pairs of
which not exactly the planted effects are named, turbulence aside, a lag told as a dead time or vice versa apart, and
the errors of the derivatives over their standard errors.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.compiled.cores import available, on_cores
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from benchmarks import six_axis_flights as sideways
from benchmarks import turbulent_flights as pitching
from benchmarks.late_vanes import BRIEF, errors_over_standard_errors
from benchmarks.plants import late, sensed_lagging, sensed_late
from benchmarks.sideways_plants import SidePlant

Array = NDArray[np.float64]
Name = tuple[str, str]
Planted = dict[Name, float]

FIRST = 610_000
"""Of these trials; tests and tuning begin elsewhere."""

LAGS, DELAYS, OTHERS = (0.05, 0.1), (0.04, 0.08), (0.06, 0.12)
"""s: of the accelerometer, and of what is late beside it."""

AIR, AIR_ASIDE = (0.0, 0.3, 1.0), (0.0, 0.004, 0.01)
"""Standard deviation of gusts, m/s, and of those from the side over the airspeed, 1."""


class Pair(NamedTuple):
    """Two flights of an aircraft, what is planted, and the true derivatives."""

    aircraft: Aircraft
    logs: list[FlightLog]
    planted: Planted
    truth: dict[tuple[str, str], float]


def main() -> None:
    """Plant, fly, record, close the loop, score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--channel", choices=("a_x", "a_y", "none"), default="a_x")
    parser.add_argument("--pairs", type=int, default=48)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    counts: Counter[str] = Counter()
    errors: list[float] = []
    for n in range(arguments.pairs):
        generator = np.random.default_rng([FIRST, arguments.seed, n])
        planted = _late(arguments.channel, generator)
        in_pitch = arguments.channel == "a_x" or (arguments.channel == "none" and n % 4 > 1)
        pair = (_pitching if in_pitch else _sideways)(n, FIRST + 1000 * arguments.seed + 10 * n, planted, generator)
        with on_cores(available()):
            result = close_loop(pair.logs[:1], pair.aircraft, pair.logs[1:], BRIEF)
        found = {(row.kind, row.where): row for row in result.effects if row.kind not in ("gust", "side_gust")}
        verdict = _judged(pair.planted, found)
        counts[verdict] += 1
        if verdict == "others":
            told = ", ".join(f"{row.kind} {row.where} {row.term} {row.value:.3g}" for row in found.values())
            true = ", ".join(f"{' '.join(name)} {value:.3g}" for name, value in pair.planted.items())
            print(f"{n:4} {pair.aircraft.name}: {true or 'nothing'}: {told or 'nothing'}", flush=True)  # noqa: T201
        errors += errors_over_standard_errors(pair.truth, result)
    print(", ".join(f"{name} {count}" for name, count in counts.most_common()))  # noqa: T201
    within = [100.0 * float(np.mean(np.abs(errors) < most)) for most in (2.0, 3.0)]
    print(  # noqa: T201
        f"{len(errors)} derivatives: {within[0]:.0f} % within 2, {within[1]:.0f} % within 3 standard errors, "
        f"worst {np.max(np.abs(errors)):.1f}"
    )


def _late(channel: str, generator: Generator) -> Planted:
    kind = str(generator.choice(["lag", "delay"]))
    value = float(generator.choice(LAGS if kind == "lag" else DELAYS))
    return {} if channel == "none" else {(f"sensor_{kind}", channel): value}


def _pitching(n: int, first: int, planted: Planted, generator: Generator) -> Pair:
    body = pitching.BODIES[n % len(pitching.BODIES)]
    planted = planted | _beside(("control_delay", "delta_e"), ("sensor_lag", "alpha"), generator)
    wrong = pitching.Wrong(
        delay={where: value for (kind, where), value in planted.items() if kind == "sensor_delay"},
        lag={where: value for (kind, where), value in planted.items() if kind == "sensor_lag"},
        elevator_delay=planted.get(("control_delay", "delta_e"), 0.0),
    )
    air, interval = float(generator.choice(AIR)), float(generator.choice([0.02, 0.04, 0.05]))
    logs = [
        pitching.flown(name, body, first + i, air=air, wrong=wrong, seconds=36.0, interval=interval)
        for i, name in enumerate("ab")
    ]
    return Pair(pitching.aircraft_of(body, 0.08, generator), logs, planted, dict(body.terms))


def _sideways(n: int, first: int, planted: Planted, generator: Generator) -> Pair:
    planted = planted | _beside(("control_delay", "delta_r"), ("sensor_lag", "beta"), generator)
    recorder = str(generator.choice(list(sideways.RECORDERS)))
    at = replace(sideways.drawn(float(generator.choice(AIR_ASIDE)), generator, recorder), seconds=30.0)
    changes: dict[str, Callable[..., Array]] = {
        "sensor_lag": sensed_lagging,
        "sensor_delay": sensed_late,
        "control_delay": late,
    }
    acting = {name: partial(_changed, changes[name[0]], value) for name, value in planted.items()}
    plant = SidePlant(
        "",
        surfaces={where: change for (kind, where), change in acting.items() if kind == "control_delay"},
        sensors={where: change for (kind, where), change in acting.items() if kind != "control_delay"},
    )
    aircraft = sideways.aircraft_of(at, plant, "six" if n % 2 else "lateral", generator)
    logs = [sideways.flown(name, at, plant, first + i) for i, name in enumerate("ab")]
    return Pair(aircraft, logs, planted, dict(at.body.terms))


def _beside(surface: Name, vane: Name, generator: Generator) -> Planted:
    """One of three: nothing, a late surface, a late vane."""
    chosen, value = int(generator.integers(3)), float(generator.choice(OTHERS))
    return [{}, {surface: value}, {vane: value}][chosen]


def _changed(change: Callable[..., Array], value: float, time: Array, signal: Array) -> Array:
    return change(time, signal, value)


def _judged(planted: Collection[Name], found: Collection[Name]) -> str:
    """Whether exactly the planted effects are named, or one's other kind of timing."""
    if set(found) == set(planted):
        return "exactly these"
    timings = [{(kind.replace("delay", "lag"), where) for kind, where in names} for names in (planted, found)]
    return "lag for dead time or vice versa" if timings[0] == timings[1] else "others"


if __name__ == "__main__":
    main()
