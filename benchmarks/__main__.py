"""Measure the estimator against plain C and the whole loop against its own growth.

    python -m benchmarks [--most SAMPLES] [--report FILE]

Times are the best of several runs, those that are compared taken in turn. Machines differ, ratios less.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from aerosid.aerodynamics import AerodynamicModel, declared_model
from aerosid.aircraft_error import AircraftError, estimate_aircraft_error
from aerosid.bundled import bundled_folder
from aerosid.closed_loop import close_loop
from aerosid.manoeuvre import prepare
from aerosid.paper_chain import ChainSettings, Fed, choose_error_density, feed
from aerosid.readers import read_log
from benchmarks.flights import light_transport, long_flight
from benchmarks.plain_c import PlainC, PreparedRun, compile_recursion

SIZES = (500, 5_000, 50_000, 500_000)
AGREEMENT = 1e-9
"""Relative difference of d(t) between the two languages above which a time would mean nothing."""
UNFILTERED = ChainSettings(filtering="off")


@dataclass(frozen=True)
class KernelTime:
    """The recursion on one flight: seconds in both languages and the largest relative difference of d(t)."""

    samples: int
    compiled: float
    plain_c: float | None
    difference: float | None


@dataclass(frozen=True)
class LoopTime:
    """One whole close_loop: seconds, and the process's largest memory until then [MB]."""

    samples: int
    seconds: float
    memory: float


def main() -> int:
    """Measure, print, and write the report where one is wanted."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=int, default=SIZES[-1], help="samples of the longest flight (%(default)s)")
    parser.add_argument("--report", type=Path, help="write the measurements to this file too, as Markdown")
    arguments = parser.parse_args()
    sizes = tuple(size for size in SIZES if size <= arguments.most)
    lines: list[str] = []
    for line in _measure(sizes):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
        lines.append(line)
    if arguments.report is not None:
        arguments.report.parent.mkdir(parents=True, exist_ok=True)
        arguments.report.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


def _measure(sizes: tuple[int, ...]) -> Iterator[str]:
    """The report, line by line as it comes about."""
    yield "# Benchmark"
    yield ""
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}"
    yield f"{_processor()}, {os.cpu_count()} processors; {versions}."
    with tempfile.TemporaryDirectory() as folder:
        plain_c = compile_recursion(Path(folder))
        yield from _kernel_section(sizes, plain_c)
    yield from _loop_section(sizes)


def _kernel_section(sizes: tuple[int, ...], plain_c: PlainC | None) -> Iterator[str]:
    yield ""
    yield "## IEBMEE on the aircraft's equations: states, d(t), Riccati matrix"
    yield ""
    if plain_c is None:
        yield "No C compiler was found on this machine (CC, cc, gcc, clang): the comparison with plain C is left out."
    else:
        yield f"Limit: the same recursion in plain C, {plain_c.compiler}, {' '.join(plain_c.flags)}."
    yield ""
    yield "| samples | numba, samples/s | numba, us a sample | C, samples/s | time numba / C | difference of d |"
    yield "|---:|---:|---:|---:|---:|---:|"
    times = []
    for size in sizes:
        row = _time_kernel(size, plain_c)
        times.append(row)
        in_c, ratio, difference = "", "", ""
        if row.plain_c is not None and row.difference is not None:
            in_c, ratio = f"{size / row.plain_c:,.0f}", f"{row.compiled / row.plain_c:.2f}"
            difference = f"{row.difference:.0e}"
        yield (
            f"| {size:,} | {size / row.compiled:,.0f} | {1e6 * row.compiled / size:.2f} | {in_c} | {ratio} "
            f"| {difference} |"
        )
    yield ""
    yield _growth([(row.samples, row.compiled) for row in times])


def _loop_section(sizes: tuple[int, ...]) -> Iterator[str]:
    yield ""
    yield "## One whole close_loop, without interpreter start"
    yield ""
    seconds = _time_sample_flight()
    yield f"Sample flight with its validation flight, 470 samples each: {seconds:.2f} s."
    yield ""
    yield "| samples | s | ms a sample | largest memory, MB |"
    yield "|---:|---:|---:|---:|"
    times = []
    for size in sizes:
        row = _time_loop(size)
        times.append(row)
        yield f"| {size:,} | {row.seconds:.2f} | {1e3 * row.seconds / size:.3f} | {row.memory:,.0f} |"
    yield ""
    yield _growth([(row.samples, row.seconds) for row in times])


def _time_kernel(samples: int, plain_c: PlainC | None) -> KernelTime:
    """Both languages in turn on a flight of that length."""
    model, fed, density = _estimation_problem(samples)

    def compiled() -> float:
        began = time.perf_counter()
        estimate_aircraft_error(model, fed.flight, fed.variance, density, respond=False)
        return time.perf_counter() - began

    rounds = max(5, min(200, 200_000 // samples))
    in_python = estimate_aircraft_error(model, fed.flight, fed.variance, density, respond=False)
    if plain_c is None:
        return KernelTime(samples, min(compiled() for _ in range(rounds)), None, None)
    in_c = plain_c.prepare(model, fed.flight, fed.variance, density)
    in_c()
    difference = relative_difference(in_python, in_c)
    if not difference < AGREEMENT:
        raise SystemExit(f"d(t) differs by {difference:.1e} between the languages: nothing to compare")
    best = _best_in_turn([compiled, in_c], rounds)
    return KernelTime(samples, best[0], best[1], difference)


def relative_difference(in_python: AircraftError, in_c: PreparedRun) -> float:
    """The largest difference of d(t) relative to the largest d of its equation."""
    size = np.nanmax(np.abs(in_python.d), axis=0)
    return float(np.nanmax(np.abs(in_python.d - in_c.d) / np.where(size > 0.0, size, 1.0)))


def _estimation_problem(samples: int) -> tuple[AerodynamicModel, Fed, NDArray[np.float64]]:
    """The declared model, a flight as the recursion takes it, and Q2^-1 as the loop chooses it on a short one."""
    aircraft = light_transport()
    model = declared_model(aircraft, 100.0)
    short = prepare(long_flight(SIZES[0]), aircraft, model.columns)
    density = choose_error_density(model, [short], UNFILTERED)
    return model, feed(prepare(long_flight(samples), aircraft, model.columns), UNFILTERED), density


def _time_sample_flight() -> float:
    """What `make demo` computes."""
    aircraft = light_transport()
    doublet, validation = (
        read_log(str(bundled_folder("flight_data") / f"light_transport_{name}.csv")) for name in ("doublet", "3211")
    )

    def loop() -> float:
        began = time.perf_counter()
        close_loop([doublet], aircraft, [validation])
        return time.perf_counter() - began

    loop()  # loads the compiled kernels
    return min(loop() for _ in range(5))


def _time_loop(samples: int) -> LoopTime:
    aircraft, log = light_transport(), long_flight(samples)
    rounds = 3 if samples < 10_000 else 1
    times = []
    for _ in range(rounds):
        began = time.perf_counter()
        close_loop([log], aircraft)
        times.append(time.perf_counter() - began)
    return LoopTime(samples, min(times), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


def _best_in_turn(runs: list[Callable[[], float]], rounds: int) -> list[float]:
    """The shortest time of each, taken in turn so that all meet the same load."""
    best = [float("inf")] * len(runs)
    for _ in range(rounds):
        best = [min(shortest, run()) for shortest, run in zip(best, runs, strict=True)]
    return best


def _growth(points: list[tuple[int, float]]) -> str:
    """How time grows with samples: the slope of log time over log samples, 1 where it is linear."""
    if len(points) < 2:
        return "One length only: no growth to tell."
    samples, seconds = np.log(np.array(points, dtype=np.float64)).T
    return f"Growth: time as samples^{np.polyfit(samples, seconds, 1)[0]:.3f}."


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")]
    return names[0] if names else platform.machine()


if __name__ == "__main__":
    sys.exit(main())
