"""Logs at 100 Hz, from six minutes to an hour: time and memory of `check`, of the estimators and of a whole loop.

Each measurement has a process of its own, which first does the same on a short log, so that neither imports nor the
loading of compiled code count; memory is the peak above what the process then holds.
"""

from __future__ import annotations

import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass
from pathlib import Path

import numba
import numpy as np

from aerosid.aircraft.declared_model import declared_model
from aerosid.cli.check import UNUSABLE
from aerosid.cli.main import main as command_line
from aerosid.estimation.manoeuvre import prepare
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.log_writing import native_csv
from aerosid.loop.closed_loop import close_loop
from aerosid.model_error.aircraft_error.forward_estimate import estimate_aircraft_error
from aerosid.model_error.estimators.continuous import estimate_continuous
from aerosid.model_error.estimators.weights import continuous_weights
from aerosid.model_error.paper_chain.chain import ChainSettings, feed
from benchmarks.flights import light_transport, long_flight

INTERVAL = 0.01
"""s."""

WARM = 500
"""Samples of the log on which the process warms up."""


@dataclass(frozen=True)
class LongTime:
    """One job on one log: samples, seconds, and megabytes above what the process held before."""

    samples: int
    seconds: float
    memory: float


def check(samples: int, folder: Path) -> Callable[[], None]:
    """`aerosid check` on a log file."""
    path = folder / f"{samples}.csv"
    path.write_text(native_csv(long_flight(samples, interval=INTERVAL), "for timing"), encoding="utf-8")

    def job() -> None:
        with redirect_stdout(io.StringIO()):
            code = command_line(["check", str(path)])
        if code not in (0, UNUSABLE):  # an hour is a whole flight, which `check` judges and refuses to fit
            raise SystemExit(f"check returned {code}")

    return job


def estimator(samples: int, _folder: Path) -> Callable[[], None]:
    """The paper's chain on arrays: choice of the cut-off, prefilter, d(t) and the response of every declared term."""
    aircraft = light_transport()
    model = declared_model(aircraft, 100.0)
    manoeuvre = prepare(long_flight(samples, interval=INTERVAL), aircraft, model.columns)
    density = np.array([1e-2, 1.0, 1e-3, 0.0])

    def job() -> None:
        fed = feed(manoeuvre, ChainSettings())
        estimate_aircraft_error(model, fed.flight, fed.variance, density, likelihood=True)

    return job


def any_model(samples: int, _folder: Path) -> Callable[[], None]:
    """`estimate_continuous` on the oscillator (30), (31) of the paper, given as compiled functions."""
    vector = "float64[::1](float64[::1], float64[::1], float64)"

    @numba.njit(vector)
    def rates(x, _u, t):  # type: ignore[no-untyped-def]
        return np.array([(2.5 * np.cos(t) - 0.32 * x[0] - x[1]) / 2.56, x[0]])

    @numba.njit(vector)
    def outputs(x, _u, _t):  # type: ignore[no-untyped-def]
        return x.copy()

    instants = np.arange(samples) * INTERVAL
    motion = np.column_stack([np.cos(0.5 * instants), 2.0 * np.sin(0.5 * instants)])
    measured = motion + 0.01 * np.random.default_rng(0).standard_normal(motion.shape)
    weights = continuous_weights(1e-4 * np.eye(2), INTERVAL, np.eye(2), np.eye(2))

    def job() -> None:
        estimate_continuous(rates, outputs, instants, measured, np.array([1.0, 0.0]), weights)

    return job


def loop(samples: int, _folder: Path) -> Callable[[], None]:
    """A whole close_loop, without its report."""
    return _loop_on(long_flight(samples, interval=INTERVAL))


def sampled_loop(samples: int, _folder: Path) -> Callable[[], None]:
    """The same at the paper's sampling, 30 ms."""
    return _loop_on(long_flight(samples))


def _loop_on(log: FlightLog) -> Callable[[], None]:
    aircraft = light_transport()

    def job() -> None:
        close_loop([log], aircraft)

    return job


JOBS = {"check": check, "estimator": estimator, "any_model": any_model, "loop": loop, "sampled_loop": sampled_loop}


def measure(job: str, samples: int, rounds: int = 1) -> LongTime:
    """The job in a process of its own, the fastest of `rounds`."""
    words = [sys.executable, "-m", "benchmarks.long_logs", job, str(samples), str(rounds)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(words[1:])}: {done.stderr.strip()[-2000:]}")
    return LongTime(**json.loads(done.stdout))


def main(arguments: Sequence[str]) -> None:
    """What the process of a measurement does: JSON on its output."""
    name, samples, rounds = arguments[0], int(arguments[1]), int(arguments[2])
    with tempfile.TemporaryDirectory() as folder:
        JOBS[name](WARM, Path(folder))()
        job = JOBS[name](samples, Path(folder))
        held = _memory("VmRSS")
        _forget_peak()
        times = []
        for _ in range(rounds):
            began = time.perf_counter()
            job()
            times.append(time.perf_counter() - began)
        peak = _memory("VmHWM") - held
    sys.stdout.write(json.dumps(asdict(LongTime(samples, min(times), peak))))


def _forget_peak() -> None:
    """Let the kernel count the largest memory anew; elsewhere than on Linux it counts from the process's begin."""
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:
        return


def _memory(field: str) -> float:
    """VmRSS, what the process holds, or VmHWM, the most that it held; MB."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith(field)) / 1024.0
    except OSError:
        scale = 1024.0 if os.uname().sysname == "Darwin" else 1.0
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / scale / 1024.0


if __name__ == "__main__":
    main(sys.argv[1:])
