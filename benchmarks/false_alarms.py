"""How often something is named on flights from which nothing is missing.

    python benchmarks/false_alarms.py --flights 60 --seed 0

Four aircraft (the light transport and three scaled from it) fly doublets and 3-2-1-1s. The declared structure is the
one that flies; its derivatives are off by up to 15 %, noise is one to four times that of good sensors, and in half of
the flights it is coloured. By design one flight in a thousand may be given an effect.
"""

from __future__ import annotations

import argparse
import sys
import time as clock
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import binomtest

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.errors import AerosidError
from aerosid.flight_model.simulation import doublet, fly, three_two_one_one, trim
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop

NOISE = {
    "V": 0.15,
    "alpha": 0.0015,
    "q": 0.0012,
    "theta": 0.0012,
    "a_x": 0.02,
    "a_z": 0.05,
    "h": 0.3,
    "delta_e": 0.0002,
}
"""Standard deviations of good flight-test sensors, SI; as those of the sample flights."""

INTERVAL = 0.03
SAMPLES = 470


@dataclass(frozen=True)
class Body:
    """An aircraft as multiples of the light transport, and the airspeed [m/s] at which it is flown."""

    name: str
    mass: float
    I_yy: float
    wing_area: float
    mean_chord: float
    airspeed: float


BODIES = (
    Body("light transport", 1.0, 1.0, 1.0, 1.0, 100.0),
    Body("trainer", 0.4, 0.27, 0.6, 0.8, 65.0),
    Body("airliner", 14.0, 90.0, 4.5, 2.4, 140.0),
    Body("glider", 0.2, 0.13, 0.75, 0.5, 35.0),
)


@dataclass(frozen=True)
class Trial:
    """One simulated flight from which nothing is missing.

    `noise` its factor on `NOISE`; `memory` the correlation of neighbouring samples of an output's noise, 0: white;
    `off` the largest relative error of a declared derivative.
    """

    body: Body
    manoeuvre: str
    noise: float
    memory: float
    off: float
    flight: int
    seed: int


def main() -> None:
    """Fly, close the loop, count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--flights", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    begun = clock.perf_counter()
    alarms: list[tuple[Trial, ClosedLoop]] = []
    verdicts: Counter[str] = Counter()
    tried = [drawn(n, arguments.seed) for n in range(arguments.flights)]
    for n, trial in enumerate(tried):
        progress(f"{n} of {len(tried)} flights, {len(alarms)} alarms")
        try:
            result = close_loop([flown(trial)], declared(trial))
        except AerosidError as error:
            verdicts[f"{type(error).__name__}: {error}"] += 1
            continue
        noise = "coloured" if trial.memory > 0.0 else "white"
        verdicts[f"{result.verdict.name.lower()} ({noise} noise)"] += 1
        if result.effects:
            alarms.append((trial, result))
    progress("")
    lines = [f"{len(tried)} flights, seed {arguments.seed}, {clock.perf_counter() - begun:.0f} s"]
    lines += shares(tried, alarms)
    lines.append("verdicts: " + ", ".join(f"{name} {count}" for name, count in verdicts.most_common()))
    lines += [f"  {described(trial, result)}" for trial, result in alarms]
    print("\n".join(lines))  # noqa: T201


def drawn(n: int, seed: int) -> Trial:
    """The n-th flight of a seed; aircraft, manoeuvre and colour of the noise go through all combinations."""
    generator = np.random.default_rng([seed, n])
    return Trial(
        body=BODIES[n % len(BODIES)],
        manoeuvre=("doublet", "3-2-1-1")[n // len(BODIES) % 2],
        noise=float(generator.uniform(1.0, 4.0)),
        memory=float(generator.uniform(0.3, 0.8)) if n // (2 * len(BODIES)) % 2 else 0.0,
        off=float(generator.uniform(0.0, 0.15)),
        flight=n,
        seed=seed,
    )


def flies(body: Body) -> Aircraft:
    """The aircraft with its true derivatives, those of the light transport."""
    light = load_aircraft("light_transport")
    return replace(
        light,
        name=body.name,
        mass=body.mass * light.mass,
        I_yy=body.I_yy * light.I_yy,
        wing_area=body.wing_area * light.wing_area,
        mean_chord=body.mean_chord * light.mean_chord,
        airspeed=body.airspeed,
    )


def declared(trial: Trial) -> Aircraft:
    """The same structure with wrong values."""
    aircraft = flies(trial.body)
    generator = np.random.default_rng([trial.seed, trial.flight, 2])
    rows = [replace(d, value=d.value * (1.0 + trial.off * generator.uniform(-1.0, 1.0))) for d in aircraft.derivatives]
    return replace(aircraft, derivatives=tuple(rows))


def flown(trial: Trial) -> FlightLog:
    """The recorded log, thrust included: the aircraft file's holds another trim."""
    aircraft = flies(trial.body)
    assert aircraft.density is not None  # the bundled file gives it
    model = declared_model(aircraft, trial.body.airspeed)
    level = trim(model, trial.body.airspeed, aircraft.density, aircraft.mass)
    time = np.asarray(INTERVAL * np.arange(SAMPLES), dtype=np.float64)
    elevator = doublet(time, 1.02, 1.02, 0.06)
    if trial.manoeuvre == "3-2-1-1":
        elevator = three_two_one_one(time, 1.02, 0.6, 0.045)
    silent = dict.fromkeys(NOISE, 0.0)
    log = fly(
        model,
        level,
        time,
        elevator,
        noise=silent,
        seed=0,
        name=f"flight {trial.flight}",
        density=aircraft.density,
        mass=aircraft.mass,
    )
    generator = np.random.default_rng([trial.seed, trial.flight, 1])
    channels = {
        name: log[name] + trial.noise * deviation * coloured(generator, trial.memory if name != "delta_e" else 0.0)
        for name, deviation in NOISE.items()
    }
    channels["thrust"] = np.full(SAMPLES, level.thrust)
    return FlightLog(log.name, time, channels, {**log.units, "thrust": "N"})


def coloured(generator: np.random.Generator, memory: float) -> NDArray[np.float64]:
    """Stationary first-order noise of unit variance, (SAMPLES,)."""
    shocks = np.sqrt(1.0 - memory**2) * generator.standard_normal(SAMPLES)
    shocks[0] /= np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], shocks))


def shares(tried: Sequence[Trial], alarms: Sequence[tuple[Trial, ClosedLoop]]) -> list[str]:
    """Shares of flights that were given an effect: of all, by noise and by aircraft; then of all, by kind."""
    groups: dict[str, Callable[[Trial], bool]] = {
        "given an effect": lambda _trial: True,
        "  white noise": lambda trial: trial.memory == 0.0,
        "  coloured noise": lambda trial: trial.memory > 0.0,
        **{f"  {body.name}": partial(flies_as, body) for body in BODIES},
    }
    lines = [
        share(label, sum(map(belongs, (trial for trial, _ in alarms))), sum(map(belongs, tried)))
        for label, belongs in groups.items()
    ]
    kinds = Counter(kind for _, result in alarms for kind in {effect.kind for effect in result.effects})
    return lines + [share(f"  {kind}", count, len(tried)) for kind, count in kinds.most_common()]


def flies_as(body: Body, trial: Trial) -> bool:
    """Whether a trial flies that aircraft."""
    return trial.body is body


def share(label: str, count: int, total: int) -> str:
    """A share with its 95 % interval (Clopper and Pearson)."""
    if total == 0:
        return f"{label:24} no flight"
    interval = binomtest(count, total).proportion_ci(0.95, method="exact")
    low, high = 100.0 * interval.low, 100.0 * interval.high
    return f"{label:24} {count:4d} of {total:4d}   {100.0 * count / total:5.1f} %   ({low:.1f} to {high:.1f} %)"


def described(trial: Trial, result: ClosedLoop) -> str:
    """A false alarm: the flight, and what was named."""
    named = "; ".join(
        " ".join(f"{e.kind} {e.where} {e.term} {e.value:.4g} +- {e.std_error:.2g}".split()) for e in result.effects
    )
    return (
        f"flight {trial.flight}: {trial.body.name}, {trial.manoeuvre}, noise x{trial.noise:.2f}, memory "
        f"{trial.memory:.2f}, declared off by up to {100.0 * trial.off:.0f} %: {named}"
    )


def progress(text: str) -> None:
    """One line that is written over; nothing where the output is no terminal."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\033[K{text}")
        sys.stderr.flush()


if __name__ == "__main__":
    main()
