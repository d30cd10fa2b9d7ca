"""How often what was planted is named: single effects, two at once, gross ones, and kinds outside the catalogue.

    python benchmarks/detection.py --flights 40 --plant one|two|gross|withheld --seed 0

The aircraft and manoeuvres of benchmarks/false_alarms.py, white noise of one to two times good sensors', declared
derivatives off by up to 10 %. A planted effect is large enough to be seen: several times the noise in some channel.
Withheld kinds are right if the verdict is other than `explained`, or if what was named predicts a second manoeuvre of
the same aircraft no worse than the declared structure does.
"""

from __future__ import annotations

import argparse
import time as clock
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from false_alarms import BODIES, INTERVAL, NOISE, Body, declared, flies, progress, share
from false_alarms import Trial as Flight
from numpy.typing import NDArray
from plants import backlash, rate_limited
from scipy.signal import lfilter

from aerosid.aircraft.declared_model import declared_model
from aerosid.errors import AerosidError
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.simulation import doublet, fly, three_two_one_one, trim
from aerosid.flight_model.terms import parse_term
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings

Array = NDArray[np.float64]
SAMPLES = 470


@dataclass(frozen=True)
class Plant:
    """What is wrong with a flight.

    `kind`, `where`, `term` as result.json names it; empty kind: nothing in the catalogue. `terms` flown and not
    declared; `control` from the recorded to the acting elevator's deviation; `driven` a term of an input that nobody
    records, with its history; `sensor` what becomes of a channel.
    """

    kind: str
    where: str = ""
    term: str = ""
    terms: tuple[tuple[str, str, float], ...] = ()
    control: Callable[[Array, Array], Array] | None = None
    driven: tuple[str, Callable[[Array], Array]] | None = None
    sensor: tuple[str, Callable[[Array, Array], Array]] | None = None


def lagged(time: Array, values: Array, constant: float) -> Array:
    """First-order lag of a ramp-wise linear signal, by fine steps."""
    fine = np.arange(time[0], time[-1] + 1e-9, 0.002)
    x = np.interp(fine, time, values)
    keep = np.exp(-0.002 / constant)
    start = [keep * x[0]]
    return np.interp(time, fine, lfilter([1.0 - keep], [1.0, -keep], x, zi=start)[0])


def in_catalogue(generator: np.random.Generator) -> Plant:
    """One effect that the catalogue holds."""
    sign = float(generator.choice([-1.0, 1.0]))
    size = float(generator.uniform(0.7, 1.5))
    return (
        lambda: Plant("aero_term", "C_m", "alpha^2", terms=(("C_m", "alpha^2", -1.5 * size),)),
        lambda: Plant("aero_term", "C_X", "alpha^2", terms=(("C_X", "alpha^2", 3.0 * size),)),
        lambda: Plant("aero_term", "C_Z", "alpha^3", terms=(("C_Z", "alpha^3", 40.0 * size),)),
        lambda: Plant("aero_term", "C_m", "alpha*delta_e", terms=(("C_m", "alpha*delta_e", 3.0 * sign * size),)),
        lambda: Plant("control_lag", "delta_e", control=lambda t, x: lagged(t, x, 0.12 * size)),
        lambda: Plant("control_delay", "delta_e", control=lambda t, x: np.interp(t - 0.1 * size, t, x)),
        lambda: Plant("control_rate_limit", "delta_e", control=lambda t, x: rate_limited(t, x, 0.25 / size)),
        lambda: Plant("sensor_bias", "alpha", sensor=("alpha", lambda _t, y: y + 0.02 * sign * size)),
        lambda: Plant("sensor_scale", "q", sensor=("q", lambda _t, y: y * (1.0 + 0.08 * sign * size))),
        lambda: Plant("sensor_delay", "alpha", sensor=("alpha", lambda t, y: np.interp(t - 0.1 * size, t, y))),
        lambda: Plant("sensor_lag", "q", sensor=("q", lambda t, y: lagged(t, y, 0.1 * size))),
        lambda: Plant(
            "step_change", "C_m", driven=("C_m", lambda t: 0.015 * sign * size * (t > generator_time(t, size)))
        ),
    )[int(generator.integers(12))]()


def gross(generator: np.random.Generator) -> list[Plant]:
    """An effect several times as large as `in_catalogue` draws it; at times a usual one beside it."""
    sign, size = float(generator.choice([-1.0, 1.0])), float(generator.uniform(0.7, 1.5))
    late = float(generator.uniform(0.2, 1.5))
    large = (
        lambda: Plant("control_lag", "delta_e", control=lambda t, x: lagged(t, x, late)),
        lambda: Plant("control_delay", "delta_e", control=lambda t, x: np.interp(t - late, t, x)),
        lambda: Plant("control_rate_limit", "delta_e", control=lambda t, x: rate_limited(t, x, 0.08 / late)),
        lambda: Plant("aero_term", "C_m", "alpha^2", terms=(("C_m", "alpha^2", -3.0 * size),)),
        lambda: Plant("aero_term", "C_m", "alpha*delta_e", terms=(("C_m", "alpha*delta_e", 6.0 * sign * size),)),
        lambda: Plant("aero_term", "C_X", "alpha^2", terms=(("C_X", "alpha^2", 6.0 * size),)),
        lambda: Plant(
            "step_change", "C_m", driven=("C_m", lambda t: 0.05 * sign * size * (t > generator_time(t, size)))
        ),
    )[int(generator.integers(7))]()
    return [large, in_catalogue(generator)] if generator.random() < 0.3 else [large]


def told_apart(plant: Plant) -> tuple[str, str, str]:
    """What two plants must differ in to be two."""
    return plant.kind, plant.where, plant.term


def generator_time(time: Array, size: float) -> float:
    """A moment in the middle of the record."""
    return float(time[0] + (0.35 + 0.2 * (size - 0.7)) * np.ptp(time))


def withheld(n: int, generator: np.random.Generator) -> Plant:
    """The n-th of ten kinds that the catalogue does not hold."""
    size = float(generator.uniform(0.7, 1.5))
    return (
        Plant("", control=lambda t, x: backlash(t, x, 0.012 * size)),
        Plant("", driven=("C_m", lambda t: 0.006 * size * np.sin(2.0 * np.pi * 0.45 * t))),
        Plant("", driven=("C_Z", lambda t: 0.06 * size * np.exp(-(((t - 7.0) / 0.4) ** 2)))),
        Plant("", sensor=("alpha", lambda t, y: y + 0.002 * size * (t - t[0]))),
        Plant("", sensor=("q", lambda _t, y: y + 2.5 * size * y * np.abs(y))),
        Plant("", sensor=("theta", lambda t, y: y + 0.012 * size * np.sin(2.0 * np.pi * 0.8 * t))),
        Plant("", driven=("C_X", lambda t: -0.002 * size * (t - t[0]))),
        Plant("", control=lambda t, x: x + 0.006 * size * np.sin(2.0 * np.pi * 0.9 * t)),
        Plant("", sensor=("a_z", lambda _t, y: y + 0.25 * size * np.round(y - y.mean()))),
        Plant("", driven=("C_m", lambda t: 0.02 * size * np.clip((t - 4.0) / 5.0, 0.0, 1.0))),
    )[n % 10]


def flown(
    body: Body, manoeuvre: str, plants: Sequence[Plant], noise: float, seed: Sequence[int], name: str
) -> FlightLog:
    """The log of a flight with what was planted; nothing in it says so."""
    aircraft = flies(body)
    assert aircraft.density is not None
    terms = {(c, parse_term(t)): value for plant in plants for c, t, value in plant.terms}
    driven = [plant.driven for plant in plants if plant.driven is not None]
    names = {(c, parse_term(f"unseen_{k}")): 1.0 for k, (c, _) in enumerate(driven)}
    base = declared_model(aircraft, body.airspeed, [term for _, term in (*terms, *names)])
    model: AerodynamicModel = base.extended([*terms, *names])
    values = model.values.copy()
    for entry, value in {**terms, **names}.items():
        values[model.index(entry)] = value
    model = model.with_values(values)
    level = trim(model, body.airspeed, aircraft.density, aircraft.mass)
    time = np.asarray(INTERVAL * np.arange(SAMPLES))
    asked = three_two_one_one(time, 1.02, 0.6, 0.045) if manoeuvre == "3-2-1-1" else doublet(time, 1.02, 1.02, 0.06)
    acting = asked
    for plant in plants:
        if plant.control is not None:
            acting = plant.control(time, acting)
    log = fly(
        model,
        level,
        time,
        acting,
        noise=dict.fromkeys(NOISE, 0.0),
        seed=0,
        name=name,
        density=aircraft.density,
        mass=aircraft.mass,
        further_inputs={f"unseen_{k}": history(time) for k, (_, history) in enumerate(driven)},
    )
    channels = {channel: log[channel] for channel in NOISE} | {"delta_e": level.delta_e + asked}
    for plant in plants:
        if plant.sensor is not None:
            channel, change = plant.sensor
            channels[channel] = change(time, channels[channel])
    generator = np.random.default_rng([*seed, 1])
    channels = {
        channel: values + noise * NOISE[channel] * generator.standard_normal(SAMPLES)
        for channel, values in channels.items()
    }
    channels["thrust"] = np.full(SAMPLES, level.thrust)
    return FlightLog(name, time, channels, {**{c: log.units[c] for c in NOISE}, "thrust": "N"})


def main() -> None:
    """Plant, fly, close the loop, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--flights", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--plant", choices=("one", "two", "gross", "withheld"), default="one")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    begun = clock.perf_counter()
    counts: Counter[str] = Counter()
    lines = []
    numbers = range(arguments.first, arguments.first + arguments.flights)
    for n in numbers:
        progress(f"{n} of {numbers.stop} flights, {dict(counts)}")
        generator = np.random.default_rng([arguments.seed, n])
        body = BODIES[n % len(BODIES)]
        manoeuvres = ("doublet", "3-2-1-1") if n // len(BODIES) % 2 else ("3-2-1-1", "doublet")
        if arguments.plant == "withheld":
            plants = [withheld(n, generator)]
        elif arguments.plant == "gross":
            plants = gross(generator)
        else:
            plants = [in_catalogue(generator)]
            while arguments.plant == "two" and len(plants) < 2:
                other = in_catalogue(generator)
                plants += [other] if (other.kind, other.where, other.term) != told_apart(plants[0]) else []
        noise = float(generator.uniform(1.0, 2.0))
        aircraft = declared(Flight(body, "", noise, 0.0, float(generator.uniform(0.0, 0.1)), n, arguments.seed))
        logs = [
            flown(body, manoeuvre, plants, noise, [arguments.seed, n, k], f"flight {n}{'ab'[k]}")
            for k, manoeuvre in enumerate(manoeuvres)
        ]
        started = clock.process_time()
        try:
            result = close_loop(logs[:1], aircraft, logs[1:], LoopSettings(paper_chain=False, next_flight=False))
        except AerosidError as error:
            counts["crashed"] += 1
            lines.append(f"{n}: {error}")
            continue
        outcome = judged(plants, result)
        counts.update(outcome)
        lines.append(
            f"{n} {body.name}, {manoeuvres[0]}: planted {' + '.join(told(plant) for plant in plants)}; "
            f"{result.verdict.name.lower()}: {named(result)}; {gain(result):.2f} before/after on the other flight; "
            f"{clock.process_time() - started:.1f} s cpu -> {', '.join(outcome)}"
        )
        print(lines[-1], flush=True)  # noqa: T201
    progress("")
    print(f"{len(numbers)} flights, seed {arguments.seed}, {clock.perf_counter() - begun:.0f} s")  # noqa: T201
    total = len(numbers)
    print("\n".join(share(label, count, total) for label, count in counts.most_common()))  # noqa: T201


def judged(plants: Sequence[Plant], result: ClosedLoop) -> list[str]:
    """What became of a flight, in words that are counted."""
    told_of = {(e.kind, e.where if e.kind != "step_change" else "", e.term) for e in result.effects}
    if not plants[0].kind:
        confident = result.verdict.name == "EXPLAINED" and gain(result) < 0.95
        return ["confidently wrong" if confident else "honest"]
    wanted = {(p.kind, p.where if p.kind != "step_change" else "", p.term) for p in plants}
    others = {(e.kind, e.where if e.kind != "step_change" else "", e.term) for e in result.alternatives}
    missed = wanted - told_of
    outcome = ["all found" if not missed else "as an alternative" if missed <= others else "missed"]
    if told_of - wanted:
        outcome.append("something else named")
    return outcome


def gain(result: ClosedLoop) -> float:
    """Median over channels of before/after on the second manoeuvre."""
    pairs = [(r.before, r.after) for r in result.errors if r.role == "validation"]
    return float(np.median([b / a for b, a in pairs if b is not None and a]))


def told(plant: Plant) -> str:
    """A plant in words."""
    if plant.kind:
        return " ".join(f"{plant.kind} {plant.where} {plant.term}".split())
    place = plant.driven or plant.sensor
    return f"withheld kind in {place[0] if place else 'the control'}"


def named(result: ClosedLoop) -> str:
    """The effects of a result in words."""
    return (
        "; ".join(" ".join(f"{e.kind} {e.where} {e.term} {e.value:.3g}".split()) for e in result.effects) or "nothing"
    )


if __name__ == "__main__":
    main()
