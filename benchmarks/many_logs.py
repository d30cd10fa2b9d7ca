"""A folder of many flights, five of them broken, and how long `aerosid batch` takes over them.

python -m benchmarks.many_logs [--logs 200] [--workers 1 2]
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from aerosid.flight_model.simulation import fly, trim
from aerosid.logs.log_writing import native_csv
from aerosid.studies.monte_carlo.elevator import deflection
from benchmarks.flights import NOISE, flown_model, light_transport
from benchmarks.sections import Section, Table

LOGS = 200
INTERVAL = 0.04
SHAPES = ("doublet", "3211", "2-1-1", "staircase", "doublets-of-two-sizes", "multisine")
SPEEDS = (85.0, 95.0, 105.0, 115.0, 125.0)
"""m/s, and a little beside: repeats of five conditions."""


def _cut(text: str) -> bytes:
    """The recorder stopped within a row."""
    return text[: int(0.6 * len(text))].rpartition(",")[0].encode()


def _backwards(text: str) -> bytes:
    """Time runs backwards."""
    remark, header, *rows = text.splitlines()
    return "\n".join([remark, header, *reversed(rows)]).encode()


def _without_alpha(text: str) -> bytes:
    """A channel that nothing can be estimated without is not there."""
    return text.replace("alpha [rad]", "vane [rad]").encode()


BROKEN: Mapping[str, Callable[[str], bytes]] = {
    "nothing in it": lambda _text: b"",
    "cut within a row": _cut,
    "time backwards": _backwards,
    "no alpha": _without_alpha,
    "binary": lambda _text: bytes(range(256)) * 40,
}
"""What a flight becomes: one way each."""


def write_logs(folder: Path, count: int = LOGS, seed: int = 0) -> dict[str, str]:
    """Fill a folder with flights of different inputs, speeds and noise; the names of the broken, and what is wrong.

    Five of the flights, spread over the folder, are broken in five ways. All are of the light transport with its
    undeclared alpha^2 terms.
    """
    aircraft = light_transport()
    model = flown_model(aircraft)
    assert aircraft.density is not None
    generator = np.random.default_rng(seed)
    places = np.sort(generator.choice(count, len(BROKEN), replace=False)).tolist()
    ways = dict(zip(places, BROKEN, strict=True))
    broken: dict[str, str] = {}
    for number in range(count):
        shape = SHAPES[number % len(SHAPES)]
        speed = SPEEDS[int(generator.integers(len(SPEEDS)))] + float(generator.uniform(-1.0, 1.0))
        instants = np.arange(int(generator.integers(200, 260))) * INTERVAL
        size = float(generator.uniform(0.8, 1.2)) * 0.06 * (100.0 / speed) ** 2 * float(generator.choice([-1.0, 1.0]))
        elevator = deflection(shape, instants, size, None)
        level = trim(model, speed, aircraft.density, aircraft.mass)
        flown = fly(
            model, level, instants, elevator, density=aircraft.density, mass=aircraft.mass, noise=NOISE,
            seed=int(generator.integers(2**31)), name=f"{shape} at {speed:.0f} m/s",
            further_inputs={"thrust": np.full(instants.size, level.thrust)},
        )  # fmt: skip
        text = native_csv(flown, flown.name)
        name = f"flight_{number:03d}"
        if number in ways:
            broken[name] = ways[number]
        content = BROKEN[ways[number]](text) if number in ways else text.encode()
        (folder / f"{name}.csv").write_bytes(content)
    return broken


def batch_command(folder: Path, out: Path, workers: int, *further: str) -> list[str]:
    """The words of `aerosid batch` over a folder."""
    words = ["--aircraft", "light_transport", "--no-reports", "--catalogue", "terms", "--workers", str(workers)]
    return [sys.executable, "-m", "aerosid", "batch", str(folder), *words, "--out", str(out), *further]


@dataclass(frozen=True)
class BatchTime:
    """One batch: seconds, seconds of processors, logs in its tables, and the logs that it named as unusable."""

    workers: int
    seconds: float
    processor: float
    tabulated: int
    named: frozenset[str]


def time_batch(folder: Path, out: Path, workers: int) -> BatchTime:
    """A batch over the folder, from nothing, as the command runs it.

    Raises
    ------
    SystemExit
        Where the command fails.
    """
    began, worked = time.perf_counter(), _children()
    done = subprocess.run(batch_command(folder, out, workers), capture_output=True, text=True, check=False)
    seconds, processor = time.perf_counter() - began, _children() - worked
    if done.returncode != 0:
        raise SystemExit(f"aerosid batch ended with {done.returncode}: {done.stderr.strip()[-500:]}")
    content = json.loads((out / "batch.json").read_text(encoding="utf-8"))
    return BatchTime(
        workers, seconds, processor, len(content["logs"]), frozenset(row["log"] for row in content["failures"])
    )


_LOAD = (
    "Where other work goes on beside, the seconds depend on what it leaves; the logs a processor second do not, and "
    "fall with the number of workers by what each needs to start."
)


def _children() -> float:
    """Processor time of all processes that this one has waited for, s."""
    times = os.times()
    return times.children_user + times.children_system


def batch_section(count: int = LOGS, workers: Sequence[int] = (1, 2)) -> Section:
    """One worker and two over the same folder, after each other."""
    with tempfile.TemporaryDirectory() as name:
        logs = Path(name) / "logs"
        logs.mkdir()
        broken = write_logs(logs, count)
        times = [time_batch(logs, Path(name) / f"out{n}", n) for n in workers]
    what = (
        f"aerosid batch, aerodynamic terms, no reports, start and page included: {count} flights of six inputs at five "
        f"speeds, 200 to 260 samples; broken are {', '.join(f'{n} ({how})' for n, how in broken.items())}."
    )
    rows = tuple(
        (
            f"{found.workers}",
            f"{found.seconds:.0f}",
            f"{times[0].seconds / found.seconds:.2f}",
            f"{found.processor:.0f}",
            f"{found.processor / found.seconds:.2f}",
            f"{count / found.processor:.2f}",
            f"{found.tabulated}",
            f"{len(found.named & set(broken))} of {len(broken)}",
        )
        for found in times
    )
    return Section(
        "batch",
        f"{count} logs, {len(broken)} of them broken",
        (
            what,
            Table(
                (
                    "workers",
                    "s",
                    "times as fast",
                    "processor s",
                    "processors had",
                    "logs a processor s",
                    "logs in the tables",
                    "broken named",
                ),
                rows,
            ),
            _LOAD,
        ),
    )


def main() -> None:
    """Measure and print."""
    from benchmarks.sections import markdown
    from benchmarks.timing import machine

    parser = argparse.ArgumentParser(prog="python -m benchmarks.many_logs", description=__doc__)
    parser.add_argument("--logs", type=int, default=LOGS, help="in the folder (%(default)s)")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="processes, one batch each")
    parser.add_argument("--write", type=Path, metavar="DIR", help="write the logs there and measure nothing")
    arguments = parser.parse_args()
    if arguments.write is not None:
        arguments.write.mkdir(parents=True, exist_ok=True)
        broken = write_logs(arguments.write, arguments.logs)
        sys.stdout.write("".join(f"{name}: {way}\n" for name, way in broken.items()))
        return
    sys.stdout.write(f"{machine()}.\n\n{markdown(batch_section(arguments.logs, arguments.workers))}")


if __name__ == "__main__":
    main()
