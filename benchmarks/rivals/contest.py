"""Every tool on the same flights: time on the sample flight, errors against their bound, structure, intervals."""

from __future__ import annotations

import importlib
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.rivals.task import Answer, Record, Task, names_of, sample_task

Tool = Callable[[Task, Record], Answer]

FLIGHTS = 20
"""Flights on which errors are counted: the sample flight, and 19 with other noise."""

MOST_ROUNDS, FEWEST_ROUNDS, PATIENCE = 10, 3, 10.0
"""Times are the best of so many rounds, all tools taken in turn; fewer of what has taken so many s."""

HALF_WIDTH = 1.959963984540054


@dataclass(frozen=True)
class Rival:
    """A tool as a user sets it.

    Attributes
    ----------
    name : str
    told : bool
        Whether it is told which derivatives there are; else it has to find out.
    given : str
        What it is given and how it is set, for the page.
    make : callable
        The tool; from a folder for what it needs to compile. None where the machine lacks something.
    lacking : str
        What is said then.
    flights : int
        On how many flights it is judged.
    """

    name: str
    told: bool
    given: str
    make: Callable[[Path], Tool | None]
    lacking: str = ""
    flights: int = FLIGHTS


@dataclass(frozen=True)
class Score:
    """What a tool made of the flights; None where there is no number.

    Attributes
    ----------
    name, told, given : as of the `Rival`
    missing : str
        Why there are no numbers; empty where there are.
    seconds : float or None
        On the sample flight.
    error, error_deviation : float or None
        Root mean square over flights and derivatives of error over Cramer-Rao bound, and how well the flights tell it;
        None of one flight.
    worst : float or None
        The same of the worst derivative.
    covered : float or None
        Share of the 95 % intervals that hold the truth; None where no intervals are given.
    right : int or None
        Flights on which both missing terms were named and nothing else; None where the structure was told.
    flights : int
    """

    name: str
    told: bool
    given: str
    missing: str = ""
    seconds: float | None = None
    error: float | None = None
    error_deviation: float | None = None
    worst: float | None = None
    covered: float | None = None
    right: int | None = None
    flights: int = 0


def _lazily(module: str, attribute: str) -> Callable[[Path], Tool | None]:
    """A tool whose package may be absent."""

    def make(_folder: Path) -> Tool | None:
        try:
            found: Tool = getattr(importlib.import_module(f"benchmarks.rivals.{module}"), attribute)
        except ModuleNotFoundError:
            return None
        return found

    return make


def _whole_loop(_folder: Path) -> Tool:
    from benchmarks.rivals.aerosid_loop import WholeLoop

    return WholeLoop()


def _terms_alone(_folder: Path) -> Tool:
    from benchmarks.rivals.aerosid_loop import TERMS, WholeLoop

    return WholeLoop(TERMS)


def _scipy_library(_folder: Path) -> Tool:
    from benchmarks.rivals.output_error import OutputError

    return OutputError(library=True)


def _scipy(_folder: Path) -> Tool:
    from benchmarks.rivals.output_error import OutputError

    return OutputError()


def _scipy_integrator(_folder: Path) -> Tool:
    from benchmarks.rivals.output_error import OutputError, by_solve_ivp

    return OutputError(by_solve_ivp)


def _octave(_folder: Path) -> Tool | None:
    from benchmarks.rivals.octave import OctaveOutputError, find_octave

    command = find_octave()
    return None if command is None else OctaveOutputError(command)


def _plain_c(folder: Path) -> Tool | None:
    from benchmarks.rivals.plain_c_output_error import compiled

    return compiled(folder)


_EXTRA = "not installed; pip install 'aerosid[compare]' brings it"

RIVALS: tuple[Rival, ...] = (
    Rival(
        "aerosid, whole catalogue",
        False,
        "close_loop as the command runs it, without the report: instruments, every kind of effect, the paper's "
        "chain beside it, linear analysis, the second flight as validation",
        _whole_loop,
    ),
    Rival(
        "aerosid, aerodynamic terms",
        False,
        "the same with aerodynamic terms alone, and nothing beside the estimate",
        _terms_alone,
    ),
    Rival(
        "PySINDy",
        False,
        "C_X, C_Z, C_m computed from filtered measurements, library of degree 2, threshold chosen on the second "
        "flight; best of 36 settings tried on this flight",
        _lazily("sparse_regression", "sparse_regression"),
        _EXTRA,
    ),
    Rival(
        "scipy least_squares, whole library",
        False,
        "output error, equations compiled by numba, 30 derivatives of degree 2, sensors' deviations as weights; what "
        "stands out at 0.1 % counts as named, and could be estimated again alone, as below",
        _scipy_library,
    ),
    Rival(
        "aerosid",
        True,
        "refinement by maximum likelihood, elevator's noise counted, deviations of the noise estimated",
        _lazily("aerosid_loop", "structure_told"),
    ),
    Rival(
        "aerosid, paper's chain",
        True,
        "prefilter, IEBMEE, recursive least squares: the method of 1994",
        _lazily("aerosid_loop", "paper_chain"),
    ),
    Rival(
        "filterpy UKF",
        True,
        "states and derivatives in one unscented filter, equations compiled by numba, sensors' deviations and the "
        "elevator's noise given",
        _lazily("unscented_filter", "unscented_filter"),
        _EXTRA,
    ),
    Rival(
        "scipy least_squares, numba",
        True,
        "output error, one fourth-order Runge-Kutta step a sample compiled by numba, sensors' deviations as weights",
        _scipy,
    ),
    Rival(
        "scipy least_squares, solve_ivp",
        True,
        "output error, DOP853 to 1e-8, right-hand side compiled by numba; RK45 and LSODA take three to six times as "
        "long",
        _scipy_integrator,
        flights=1,
    ),
    Rival(
        "GNU Octave",
        True,
        "output error, Gauss-Newton, the flights of a Jacobian side by side in one matrix; start of Octave not counted",
        _octave,
        "not installed on this machine; plain C below is the same algorithm",
        flights=1,
    ),
    Rival(
        "plain C",
        True,
        "output error, Gauss-Newton, everything in C: the limit of what simulating the flight can cost",
        _plain_c,
        "no C compiler on this machine",
    ),
)
"""In the order of the page: those that have to find out what is missing, then those that are told."""


def compete(folder: Path, flights: int = FLIGHTS, rivals: Sequence[Rival] = RIVALS) -> list[Score]:
    """The score of every tool.

    Parameters
    ----------
    folder : Path
        Where tools may compile.
    flights : int
        Most flights on which errors are counted.
    rivals : sequence of Rival
    """
    task = sample_task()
    records = list(task.flights(flights))
    tools = {rival.name: rival.make(folder) for rival in rivals}
    there = {name: tool for name, tool in tools.items() if tool is not None}
    best, first = _best_times(task, records[0], there)
    bound = task.bound()
    scores = []
    for rival in rivals:
        tool = tools[rival.name]
        if tool is None:
            scores.append(Score(rival.name, rival.told, rival.given, rival.lacking))
            continue
        answers = [first[rival.name], *(tool(task, record) for record in records[1 : rival.flights])]
        scores.append(_score(rival, answers, task, bound, best[rival.name]))
    return scores


def _best_times(task: Task, record: Record, tools: dict[str, Tool]) -> tuple[dict[str, float], dict[str, Answer]]:
    """Shortest time of each tool on one flight, all taken in turn so that they meet the same load; their answers."""
    answers: dict[str, Answer] = {}
    best, spent = dict.fromkeys(tools, math.inf), dict.fromkeys(tools, 0.0)
    for name, tool in tools.items():
        began = time.perf_counter()
        answers[name] = tool(task, record)  # loads compiled code; counts only as time spent
        spent[name] = time.perf_counter() - began
    for round_ in range(MOST_ROUNDS):
        for name, tool in tools.items():
            if round_ >= FEWEST_ROUNDS and spent[name] > PATIENCE:
                continue
            began = time.perf_counter()
            tool(task, record)
            seconds = time.perf_counter() - began
            spent[name] += seconds
            # Octave tells its own time, without its start.
            best[name] = min(best[name], float(getattr(tool, "seconds", seconds)))
    return best, answers


def _score(rival: Rival, answers: list[Answer], task: Task, bound: np.ndarray, seconds: float) -> Score:
    errors = np.array([(answer.values - task.true)[task.structure] for answer in answers]) / bound
    inside = [
        np.abs(answer.values - task.true)[task.structure]
        <= HALF_WIDTH * np.nan_to_num(answer.std_errors[task.structure], nan=-1.0)
        for answer in answers
        if answer.std_errors is not None
    ]
    missing = task.structure & (task.declared == 0.0)
    squares = np.mean(errors**2, axis=1)
    size = float(np.sqrt(np.mean(squares)))
    return Score(
        rival.name,
        rival.told,
        rival.given,
        seconds=seconds,
        error=size,
        error_deviation=float(np.std(squares, ddof=1) / np.sqrt(squares.size) / (2.0 * size))
        if len(answers) > 1
        else None,
        worst=float(np.max(np.sqrt(np.mean(errors**2, axis=0)))),
        covered=float(np.mean(inside)) if inside else None,
        right=None if rival.told else sum(answer.named == names_of(missing) for answer in answers),
        flights=len(answers),
    )
