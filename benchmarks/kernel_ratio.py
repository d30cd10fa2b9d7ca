"""Time this tree's flight-model kernels against those of another tree of aerosid, in turn on the same flight.

    python -m benchmarks.kernel_ratio --reference FOLDER [--rounds N]

FOLDER holds another revision, as `git archive REVISION | tar x -C FOLDER` unpacks it; both must have the functions that
are timed. Processor time of a process of its own for each tree, the least of all rounds: other load on the machine
then counts little. The first round compiles what is not yet on the disk and is not counted.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

MEASUREMENT = "--measure"


def main() -> int:
    """Print the least time of each kernel in both trees and their ratio; 1 where one is above the limit."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.kernel_ratio", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--reference", type=Path, help="folder of the other tree")
    parser.add_argument("--rounds", type=int, default=5, help="processes for each tree (%(default)s)")
    parser.add_argument("--limit", type=float, default=1.1, help="greatest ratio that is no failure (%(default)s)")
    parser.add_argument(MEASUREMENT, action="store_true", help="time the tree of the working folder; print JSON")
    arguments = parser.parse_args()
    if arguments.measure:
        sys.stdout.write(json.dumps(measure()))
        return 0
    trees = {"here": Path(__file__).parents[1], "reference": arguments.reference}
    best: dict[str, dict[str, float]] = {name: {} for name in trees}
    for turn in range(arguments.rounds + 1):
        for name, folder in trees.items():
            for kernel, seconds in measured_in(folder).items():
                if turn > 0:
                    best[name][kernel] = min(seconds, best[name].get(kernel, seconds))
    worst = 0.0
    for kernel, seconds in best["here"].items():
        ratio = seconds / best["reference"][kernel]
        worst = max(worst, ratio)
        sys.stdout.write(
            f"{kernel}: {1e3 * seconds:.3f} ms, {1e3 * best['reference'][kernel]:.3f} ms, ratio {ratio:.3f}\n"
        )
    return int(worst > arguments.limit)


def measured_in(folder: Path) -> dict[str, float]:
    """The times that a process finds which imports aerosid from `folder`."""
    environment = os.environ | {"PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    command = [sys.executable, str(Path(__file__).resolve()), MEASUREMENT]
    run = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return {str(kernel): float(seconds) for kernel, seconds in json.loads(run.stdout).items()}


def measure() -> dict[str, float]:
    """Least processor time of each kernel on one flight, s."""
    import numpy as np

    from aerosid.aircraft.declared_model import declared_model
    from aerosid.estimation.likelihood import Likelihood
    from aerosid.estimation.manoeuvre import initial_state, prepare
    from aerosid.flight_model.flight import simulate_outputs
    from aerosid.flight_model.terms import parse_term
    from aerosid.model_error.aircraft_error.forward_estimate import estimate_aircraft_error
    from benchmarks.flights import light_transport, long_flight

    aircraft = light_transport()
    model = declared_model(aircraft, 100.0)
    terms = [parse_term(text) for text in ("alpha^2", "alpha*q_hat", "alpha*delta_e", "V_hat*alpha", "q_hat^2")]
    model = model.extended([(coefficient, term) for coefficient in ("C_X", "C_Z", "C_m") for term in terms])
    manoeuvre = prepare(long_flight(2_000), aircraft, model.columns)
    flight, values, state = manoeuvre.flight, np.array(model.values), initial_state(manoeuvre.flight)
    likelihood = Likelihood(model, (manoeuvre,), model.entries)
    variance = likelihood.starting_variance()
    fed = np.array([0.02, 2e-6, 2e-6, 2e-6])
    density = np.array([1e-2, 1e-2, 1e-4, 0.0])
    runs: dict[str, Callable[[], object]] = {
        "simulation": lambda: simulate_outputs(state, flight, values, model.table, model.constants),
        "likelihood with sensitivities": lambda: likelihood.evaluate(values, [state], (), variance),
        "model error with responses": lambda: estimate_aircraft_error(model, flight, fed, density),
        "model error": lambda: estimate_aircraft_error(model, flight, fed, density, respond=False, likelihood=True),
    }
    found = {}
    for name, run in runs.items():
        run()
        times = []
        for _ in range(100):
            began = time.process_time()
            run()
            times.append(time.process_time() - began)
        found[name] = min(times)
    return found


if __name__ == "__main__":
    sys.exit(main())
