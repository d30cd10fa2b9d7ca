"""The paper's recursion beside the same in plain C, from 500 samples on."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import prepare
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.model_error.aircraft_error.forward_estimate import (
    AircraftErrorHistory,
    estimate_aircraft_error,
    prepared_recursion,
)
from aerosid.model_error.aircraft_error.recursion import run
from aerosid.model_error.paper_chain.chain import ChainSettings, Fed, choose_error_density, feed
from benchmarks.flights import light_transport, long_flight
from benchmarks.plain_c import PlainC, PreparedRun, compile_recursion
from benchmarks.sections import Section, Table
from benchmarks.timing import best_in_turn, growth

AGREEMENT = 1e-9
"""Relative difference of d(t) between the two languages above which a time would mean nothing."""

UNFILTERED = ChainSettings(filtering="off")
SHORT = 500

_WHAT = (
    "IEBMEE on the aircraft's equations: states, d(t), Riccati matrix; both get the same prepared arrays. With "
    "preparation: `estimate_aircraft_error`, which first makes states and weights of the channels as well."
)


@dataclass(frozen=True)
class KernelTime:
    """The recursion on one flight: seconds in both languages and the largest relative difference of d(t).

    `whole`: with what Python makes of the flight before, which C is given.
    """

    samples: int
    compiled: float
    whole: float
    plain_c: float | None
    difference: float | None


def kernel_section(sizes: Sequence[int], folder: Path) -> Section:
    """Times and agreement of both languages; `folder` is where C is compiled."""
    plain_c = compile_recursion(folder)
    limit = (
        "No C compiler was found on this machine (CC, cc, gcc, clang): the comparison with plain C is left out."
        if plain_c is None
        else f"Limit: the same recursion in plain C, {plain_c.compiler}, {' '.join(plain_c.flags)}."
    )
    times = [_time_kernel(size, plain_c) for size in sizes]
    headings = (
        "samples",
        "numba, samples/s",
        "numba, µs a sample",
        "C, samples/s",
        "time numba / C",
        "with preparation / C",
        "difference of d",
    )
    rows = tuple(_row(row) for row in times)
    return Section(
        "kernel",
        "The paper's recursion beside plain C",
        (
            _WHAT,
            limit,
            Table(headings, rows),
            growth([(row.samples, row.compiled) for row in times]),
        ),
    )


def _row(row: KernelTime) -> tuple[str, ...]:
    in_c, ratio, whole, difference = "", "", "", ""
    if row.plain_c is not None and row.difference is not None:
        in_c, ratio = f"{row.samples / row.plain_c:,.0f}", f"{row.compiled / row.plain_c:.2f}"
        whole = f"{row.whole / row.plain_c:.2f}"
        difference = f"{row.difference:.0e}"
    each = f"{1e6 * row.compiled / row.samples:.2f}"
    return f"{row.samples:,}", f"{row.samples / row.compiled:,.0f}", each, in_c, ratio, whole, difference


def _time_kernel(samples: int, plain_c: PlainC | None) -> KernelTime:
    """Both languages in turn on a flight of that length."""
    model, fed, density = _estimation_problem(samples)

    recursion = prepared_recursion(model, fed.flight, fed.variance, density, respond=False, likelihood=False)

    def compiled() -> float:
        began = time.perf_counter()
        run(*recursion)
        return time.perf_counter() - began

    def whole() -> float:
        began = time.perf_counter()
        estimate_aircraft_error(model, fed.flight, fed.variance, density, respond=False)
        return time.perf_counter() - began

    rounds = max(5, min(200, 200_000 // samples))
    in_python = estimate_aircraft_error(model, fed.flight, fed.variance, density, respond=False)
    if plain_c is None:
        return KernelTime(samples, *best_in_turn([compiled, whole], rounds), None, None)
    in_c = plain_c.prepare(model, fed.flight, fed.variance, density)
    in_c()
    difference = relative_difference(in_python, in_c)
    if not difference < AGREEMENT:
        raise SystemExit(f"d(t) differs by {difference:.1e} between the languages: nothing to compare")
    best = best_in_turn([compiled, whole, in_c], rounds)
    return KernelTime(samples, *best, difference)


def relative_difference(in_python: AircraftErrorHistory, in_c: PreparedRun) -> float:
    """The largest difference of d(t) relative to the largest d of its equation."""
    size = np.nanmax(np.abs(in_python.d), axis=0)
    return float(np.nanmax(np.abs(in_python.d - in_c.d) / np.where(size > 0.0, size, 1.0)))


def _estimation_problem(samples: int) -> tuple[AerodynamicModel, Fed, NDArray[np.float64]]:
    """The declared model, a flight as the recursion takes it, and Q2^-1 as the loop chooses it on a short one."""
    aircraft = light_transport()
    model = declared_model(aircraft, 100.0)
    short = prepare(long_flight(SHORT), aircraft, model.columns)
    density = choose_error_density(model, [short], UNFILTERED)
    return model, feed(prepare(long_flight(samples), aircraft, model.columns), UNFILTERED), density
