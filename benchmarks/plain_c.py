"""The same recursion in plain C, compiled by the machine's own compiler when it is wanted: the limit."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.estimation.manoeuvre import initial_state
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, coupled_of
from aerosid.flight_model.flight import Flight
from aerosid.model_error.aircraft_error.forward_estimate import initial_riccati
from aerosid.model_error.aircraft_error.measured_states import measured_states

SOURCE = Path(__file__).with_name("recursion.c")
FLAGS = ("-O3", "-std=c11")
NATIVE = "-march=native"
"""As the compiled Python: every optimisation that keeps the arithmetic, for this machine's own processor."""


@dataclass(frozen=True)
class PlainC:
    """A compiled `recursion.c`; `compiler` as it names itself, `flags` that were given."""

    library: ctypes.CDLL
    compiler: str
    flags: tuple[str, ...]

    def prepare(
        self, model: AerodynamicModel, flight: Flight, variance: NDArray[np.float64], density: NDArray[np.float64]
    ) -> PreparedRun:
        """The recursion on a flight, arrays ready, so that a run times nothing else.

        Parameters
        ----------
        model, flight
            As for `aerosid.model_error.aircraft_error.forward_estimate.estimate_aircraft_error`.
        variance : (4,) measurement variance of V, alpha, q, theta, SI squared.
        density : (4,) diagonal of Q2^-1.
        """
        fed, states = measured_states(flight, variance), len(coupled_of(LONGITUDINAL))
        start = initial_state(flight)
        table, samples = model.table, flight.time.size
        numbers = [
            flight.time, flight.inputs, fed.states, fed.weights, density, start, initial_riccati(start, variance),
            np.array(model.constants[:7], dtype=np.float64),
        ]  # fmt: skip
        whole = [table.coefficient, table.first, table.variable, table.shape, table.power]
        results = [np.empty((samples, states)), np.empty((samples, states)), np.empty((samples, states, states))]
        arrays = [np.ascontiguousarray(values, dtype=np.float64) for values in numbers]
        lists = [np.ascontiguousarray(values, dtype=np.int64) for values in whole]
        tail = [np.ascontiguousarray(values, dtype=np.float64) for values in (table.offset, model.values)]
        sizes = (samples, flight.inputs.shape[1], flight.substeps)
        arguments = (
            *(ctypes.c_int64(size) for size in sizes),
            *(pointer(values) for values in arrays),
            ctypes.c_int64(table.coefficient.size),
            *(pointer(values) for values in (*lists, *tail, *results)),
        )
        return PreparedRun(self.library, arguments, (*arrays, *lists, *tail), *results)


@dataclass(frozen=True)
class PreparedRun:
    """A run with its arguments; `states`, `d` (N, 4) and `riccati` (N, 4, 4) hold the results after it."""

    library: ctypes.CDLL
    arguments: tuple[object, ...]
    kept: tuple[NDArray[Any], ...]
    states: NDArray[np.float64]
    d: NDArray[np.float64]
    riccati: NDArray[np.float64]

    def __call__(self) -> float:
        """Run once; the seconds it took.

        Raises
        ------
        RuntimeError
            Where the recursion left the model's range.
        """
        began = time.perf_counter()
        reached = self.library.run_recursion(*self.arguments)
        seconds = time.perf_counter() - began
        if reached != self.states.shape[0]:
            raise RuntimeError(f"the recursion in C stopped at sample {reached} of {self.states.shape[0]}")
        return seconds


def find_compiler() -> str | None:
    """The machine's C compiler: that of the variable CC, cc, gcc or clang; None where there is none."""
    names = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    return next((found for name in names if name and (found := shutil.which(name))), None)


def compile_recursion(folder: Path) -> PlainC | None:
    """`recursion.c` compiled into `folder`; None where the machine has no C compiler.

    Raises
    ------
    RuntimeError
        Where the compiler refuses it.
    """
    made = compile_library(SOURCE, folder)
    if made is None:
        return None
    made[0].run_recursion.restype = ctypes.c_int64
    return PlainC(*made)


def compile_library(source: Path, folder: Path) -> tuple[ctypes.CDLL, str, tuple[str, ...]] | None:
    """A source as a library in `folder`, the compiler as it names itself, its flags; None where there is no compiler.

    Raises
    ------
    RuntimeError
        Where the compiler refuses it.
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    made = folder / f"{source.stem}.so"
    for flags in ((*FLAGS, NATIVE), FLAGS):  # not every compiler knows the second
        command = [compiler, *flags, "-shared", "-fPIC", str(source), "-o", str(made), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            break
    else:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    version = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
    return ctypes.CDLL(str(made)), version.splitlines()[0] if version else compiler, flags


def pointer(values: NDArray[Any]) -> ctypes.c_void_p:
    """Where an array begins, as a C function takes it."""
    return values.ctypes.data_as(ctypes.c_void_p)
