"""Time and memory against the length of the log: a whole loop at the paper's sampling, an hour at 100 Hz."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from aerosid.aircraft.bundled import bundled_folder
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.reporting.figures.chart import Line, Points
from aerosid.reporting.figures.layout import Tile, tiled
from aerosid.reporting.figures.numbered import Figure, FigureBook
from benchmarks.flights import light_transport
from benchmarks.long_logs import INTERVAL, LongTime, measure
from benchmarks.sections import Section, Table
from benchmarks.timing import exponent, growth

MINUTES = (6, 15, 30, 45, 60)
_NAMES = {
    "check": "aerosid check, file reading included",
    "estimator": "prefilter and IEBMEE of the aircraft, responses of the declared terms",
    "any_model": "estimate_continuous, two states given as functions",
}


_LOOPS = (
    "Longer flights are doublets every 14 s, 30 ms sampling; each in a fresh process, memory above what the process "
    "held before."
)
_HOUR = (
    "Flights of doublets every 14 s, eight channels at 100 Hz. Every number is from a process of its own that did the "
    "same on a short log before; memory is the peak above what it held then."
)


def loop_section(sizes: Sequence[int]) -> Section:
    """A whole close_loop, without interpreter start."""
    seconds = _time_sample_flight()
    times = [measure("sampled_loop", size, 3 if size < 10_000 else 1) for size in sizes]
    rows = tuple(
        (f"{row.samples:,}", f"{row.seconds:.2f}", f"{1e3 * row.seconds / row.samples:.3f}", f"{row.memory:,.0f}")
        for row in times
    )
    headings = ("samples", "s", "ms a sample", "memory, MB")
    return Section(
        "loop",
        "One whole close_loop",
        (
            f"Sample flight with its validation flight, 470 samples each: {seconds:.2f} s.",
            _LOOPS,
            Table(headings, rows),
            growth([(row.samples, row.seconds) for row in times]),
        ),
    )


def hour_section(minutes: Sequence[int], book: FigureBook, loop_minutes: int | None = None) -> Section:
    """Logs at 100 Hz up to an hour; of a whole loop one length only."""
    samples = [round(60 * count / INTERVAL) for count in minutes]
    found = {job: [measure(job, size, 2) for size in samples] for job in _NAMES}
    parts: list[str | Table | Figure] = [
        _HOUR,
    ]
    for job, times in found.items():
        rows = tuple(
            (f"{count}", f"{row.samples:,}", f"{row.seconds:.2f}", f"{1e6 * row.seconds / row.samples:.1f}",
             f"{row.memory:,.0f}", f"{1e3 * row.memory / row.samples:.2f}")
            for count, row in zip(minutes, times, strict=True)
        )  # fmt: skip
        parts.append(Table(("minutes", "samples", "s", "µs a sample", "MB", "kB a sample"), rows, caption=_NAMES[job]))
        if len(times) > 1:
            parts.append(_straightness(times))
    if len(minutes) > 1:
        figure = book.add(
            tiled(_tiles(found, minutes), columns=3, tile_height=90.0),
            "Seconds (upper row) and megabytes (lower row) against minutes at 100 Hz: check, IEBMEE of the aircraft, "
            "estimate_continuous. Lines are straight lines through the points.",
            "Time and memory of three jobs grow in proportion to the length of the log.",
        )
        parts.append(figure)
    if loop_minutes is not None:
        row = measure("loop", round(60 * loop_minutes / INTERVAL))
        parts.append(
            f"A whole close_loop on {loop_minutes} minutes at 100 Hz ({row.samples:,} samples): {row.seconds:.0f} s, "
            f"{row.memory:,.0f} MB."
        )
    return Section("hour", "An hour at 100 Hz", tuple(parts))


def _straightness(times: Sequence[LongTime]) -> str:
    first, last = times[0], times[-1]
    longer = last.samples / first.samples
    return (
        f"{longer:.3g} times the samples: {last.seconds / first.seconds:.3g} times the time, "
        f"{last.memory / max(first.memory, 1e-9):.3g} times the memory. Time as "
        f"samples^{exponent([(row.samples, row.seconds) for row in times]):.2f}, memory as "
        f"samples^{exponent([(row.samples, max(row.memory, 1e-3)) for row in times]):.2f}."
    )


def _tiles(found: dict[str, list[LongTime]], minutes: Sequence[int]) -> list[Tile]:
    x = np.array(minutes, dtype=np.float64)
    tiles = []
    for label, attribute in (("time [s]", "seconds"), ("memory [MB]", "memory")):
        for times in found.values():
            y = np.array([getattr(row, attribute) for row in times])
            slope, level = np.polyfit(x, y, 1)
            line = Line(x, slope * x + level, "after")
            limits = (0.0, 1.15 * float(y.max()) or 1.0)
            tiles.append(Tile("log [min]", label, (0.0, 1.05 * float(x.max())), limits, (line, Points(x, y))))
    return tiles


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
