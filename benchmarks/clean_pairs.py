"""Pairs of flights from which nothing is missing, one to fit and one to validate: how many are given an effect."""

from __future__ import annotations

import argparse
import sys
import time as clock
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

from scipy.stats import binomtest

from aerosid.aircraft import Aircraft
from aerosid.errors import AerosidError
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import METHODS, LoopSettings

OFF = 0.08
"""Standard deviation of the declared derivatives' relative errors."""


@dataclass(frozen=True)
class Pair:
    """The fitted flight and the unseen one with their declared aircraft; `gust`: standard deviation of wind, m/s."""

    body: str
    gust: float
    interval: float
    logs: tuple[FlightLog, FlightLog]
    aircraft: Aircraft


def _without(log: FlightLog, channels: Collection[str]) -> FlightLog:
    held = {name: values for name, values in log.channels.items() if name not in channels}
    return replace(log, channels=held, units={name: log.units[name] for name in held})


def count_named(description: str, flown: Callable[[int, int], Pair], *, pairs: int, wind: str, moving: str) -> None:
    """Fly the pairs that the command line asks for, close the loop on each, and print how many are given an effect.

    Parameters
    ----------
    description : str
        Of the command.
    flown : callable
        The n-th pair of a seed.
    pairs : int
        How many without an option.
    wind : str
        The kind of effect that names the wind, which is there.
    moving : str
        What the wind is called.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--flights", type=int, default=pairs, help="pairs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    parser.add_argument("--without", nargs="*", default=[], metavar="CHANNEL", help="channels that are not recorded")
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
        pair = flown(arguments.seed, n)
        kind = "calm air" if pair.gust == 0.0 else moving
        tried[kind] += 1
        try:
            first, second = (_without(log, arguments.without) for log in pair.logs)
            result = close_loop([first], pair.aircraft, [second], settings=settings)
        except AerosidError as error:
            lines.append(f"  {n}: {type(error).__name__}: {error}")
            continue
        wrong = [effect for effect in result.effects if effect.kind != wind or pair.gust == 0.0]
        if wrong:
            named[kind] += 1
            effects = ", ".join(f"{e.kind} {e.where} {e.term} {e.value:.3g} +- {e.std_error:.2g}" for e in wrong)
            lines.append(f"  {n} ({pair.body}, {pair.gust:.2g} m/s, {pair.interval} s): {effects}")
        print(f"\r{n + 1} of {arguments.flights}, {sum(named.values())} named", end="", file=sys.stderr)  # noqa: T201
    print(file=sys.stderr)  # noqa: T201
    print(f"{arguments.method}, seed {arguments.seed}: {clock.perf_counter() - begun:.0f} s")  # noqa: T201
    for kind, count in tried.items():
        share = binomtest(named[kind], count).proportion_ci(method="wilson")
        print(f"{kind}: {named[kind]} of {count} named ({share.low:.1%} to {share.high:.1%})")  # noqa: T201
    print("\n".join(lines))  # noqa: T201
