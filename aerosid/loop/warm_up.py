"""Ahead-of-time compilation: every kernel that close-loop needs called once on bundled flights, over all cores.

Each task calls the kernels of one part of the loop; whole loops come last, and find nearly all of them done. What the
sample flights need is complete without: there a whole loop would only be the wait for its own run. Kernels are compiled
for the axes of a case: those of lateral and six-axis models are others.
"""

from __future__ import annotations

import importlib
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.declared_model import declared_model
from aerosid.compatibility import check_kinematics
from aerosid.compiled.kernel_cache import compilation_announced
from aerosid.effects import at_first_trials
from aerosid.effects.flow_separation import flow_separation
from aerosid.estimation.competing_fits import evaluated_starts
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, Start, refine
from aerosid.estimation.motion_loop import added_along
from aerosid.estimation.open_loop import respond
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import LATERAL
from aerosid.flight_model.linear_model import linearise
from aerosid.flight_model.motion_laws import offsets_of_unit_size, rate_up_to_now
from aerosid.flight_model.restarted_simulation import predict_ahead
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.flying_qualities.linear_analysis import condition_of
from aerosid.loop.settings import USUAL
from aerosid.model_error.aircraft_error.force_history import smoothed_histories
from aerosid.model_error.paper_chain.chain import run_chain
from aerosid.model_error.paper_chain.coefficient_match import explained_shares
from aerosid.signals.delay_and_lag import deadbanded, rate_limited

_AIRCRAFT = "light_transport"
_FLIGHTS = ("light_transport_doublet.csv", "light_transport_3211.csv")
_SIX_AXES = "navion"
_SIX_AXIS_FLIGHTS = ("navion_identify.csv", "navion_validate.csv")
_ONCE = RefinementSettings(steps=2, rounds=1)


@dataclass(frozen=True)
class _Sample:
    """The sample flight as the estimators take it."""

    aircraft: Aircraft
    logs: tuple[FlightLog, ...]
    manoeuvre: Manoeuvre
    model: AerodynamicModel
    free: tuple[Entry, ...]


def _sample() -> _Sample:
    return _sample_of(load_aircraft(_AIRCRAFT), _FLIGHTS)


def _six_axes() -> _Sample:
    return _sample_of(load_aircraft(_SIX_AXES), _SIX_AXIS_FLIGHTS)


def _lateral() -> _Sample:
    whole = load_aircraft(_SIX_AXES)
    own = tuple(each for each in whole.derivatives if each.coefficient in LATERAL.coefficients)
    return _sample_of(replace(whole, axes=LATERAL, derivatives=own), _SIX_AXIS_FLIGHTS)


def _sample_of(aircraft: Aircraft, flights: Sequence[str]) -> _Sample:
    logs = tuple(read_log(bundled_folder("flight_data") / name) for name in flights)
    model = declared_model(aircraft, float(logs[0]["V"].mean()), [])
    free = tuple((d.coefficient, d.term) for d in aircraft.derivatives)
    return _Sample(aircraft, logs, prepare(logs[0], aircraft, model.columns), model, free)


def _fit(sample: _Sample) -> Refinement:
    return refine(sample.model, [sample.manoeuvre], sample.free, settings=_ONCE)


def _fit_and_smooth(sample: _Sample) -> None:
    smoothed_histories(_fit(sample), [sample.manoeuvre], sample.aircraft.coefficients, ())


def _model_error(sample: _Sample) -> None:
    run_chain(sample.model, [sample.manoeuvre], sample.free)


def _motion_feedback(sample: _Sample) -> None:
    effect = flow_separation(0.1, sample.aircraft.coefficients[1], ())
    (active,) = effects = [at_first_trials(effect)]
    model, manoeuvre = with_columns_of(sample.model, effects), sample.manoeuvre
    refine(model, [manoeuvre], sample.free, effects=effects, settings=_ONCE)
    states = np.tile(manoeuvre.first_state, (manoeuvre.flight.time.size, 1))
    added_along(active, model, manoeuvre.flight, model.values, states, manoeuvre.ground)
    time, numbers = manoeuvre.flight.time, effect.law_numbers(active.values)
    course = np.zeros(time.size), rate_up_to_now(time, np.zeros(time.size)), np.zeros(time.size)
    offsets_of_unit_size(effect.law, numbers, len(effect.columns), time, course)


def _instruments(sample: _Sample) -> None:
    check_kinematics(sample.logs[:1])


def _simulation(sample: _Sample) -> None:
    model, manoeuvre = sample.model, sample.manoeuvre
    linearise(model, condition_of(manoeuvre))
    respond(model, manoeuvre, manoeuvre.spread**2)
    explained_shares((model, ()), (model, ()), manoeuvre)
    states = np.tile(manoeuvre.first_state, (manoeuvre.flight.time.size, 1))
    values = np.array(model.values)
    predict_ahead(np.zeros(1, np.int64), 1, states, manoeuvre.flight, values, model.table, model.constants)


def _search(sample: _Sample) -> None:
    evaluated_starts([Start(sample.model, sample.free)], [sample.manoeuvre])
    clock, still = sample.manoeuvre.flight.time, np.zeros(sample.manoeuvre.flight.time.size)
    rate_limited(clock, still, 1.0)
    deadbanded(still, 0.01)


def _whole_loop(sample: _Sample) -> None:
    close_loop(sample.logs[:1], sample.aircraft, sample.logs[1:])


def _equations(sample: _Sample) -> None:
    close_loop(sample.logs[:1], sample.aircraft, sample.logs[1:], replace(USUAL, method="equations"))


@dataclass(frozen=True)
class _Task:
    """One part of the loop, and the flight that it is called on."""

    call: Callable[[_Sample], None]
    sample: Callable[[], _Sample] = _sample


SAMPLE_TASKS: dict[str, _Task] = {
    "maximum likelihood": _Task(_fit_and_smooth),
    "model error d(t)": _Task(_model_error),
    "instruments": _Task(_instruments),
    "effects with a state": _Task(_motion_feedback),
    "simulation": _Task(_simulation),
    "search": _Task(_search),
}
"""Parts of the loop on the longitudinal sample flights, in the order in which they are begun: those that compile
longest come first."""

TASKS: dict[str, _Task] = {
    "six axes, maximum likelihood": _Task(_fit_and_smooth, _six_axes),
    "lateral axes, maximum likelihood": _Task(_fit_and_smooth, _lateral),
    **SAMPLE_TASKS,
    "six axes, effects with a state": _Task(_motion_feedback, _six_axes),
    "six axes, model error d(t)": _Task(_model_error, _six_axes),
    "lateral axes, model error d(t)": _Task(_model_error, _lateral),
    "kinematic and coefficient equations": _Task(_equations),
    "the whole loop": _Task(_whole_loop),
    "six axes, the whole loop": _Task(_whole_loop, _six_axes),
    "lateral axes, the whole loop": _Task(_whole_loop, _lateral),
}
"""All parts, in the order in which they are begun."""


@dataclass(frozen=True)
class Prepared:
    """What one part of the loop had to compile.

    Attributes
    ----------
    part : str
        A key of `TASKS`.
    kernels : tuple of str
        Those that this part compiled; empty where all of them were there.
    seconds : float
        Wall time of the part.
    """

    part: str
    kernels: tuple[str, ...]
    seconds: float


def prepare_part(part: str) -> Prepared:
    """Calls the kernels of one part of the loop, so that those which are not on disk are compiled."""
    kernels: list[str] = []
    task, start = TASKS[part], time.perf_counter()
    with compilation_announced(kernels.append):
        task.call(task.sample())
    return Prepared(part, tuple(kernels), time.perf_counter() - start)


def prepare_kernels(workers: int | None = None, parts: Iterable[str] = TASKS) -> Iterator[Prepared]:
    """Compiles what close-loop calls, one part of the loop after the other, as they are done.

    Where a process can be copied the workers begin with all that is imported here.

    Parameters
    ----------
    workers : int, optional
        Processes; by default one for each core. Two of them never compile the same kernel.
    parts : iterable of str
        Keys of `TASKS`.
    """
    importlib.import_module("numba")
    way = "fork" if sys.platform == "linux" else "spawn"
    with ProcessPoolExecutor(workers or os.cpu_count(), mp_context=get_context(way)) as pool:
        try:
            for done in as_completed([pool.submit(prepare_part, part) for part in parts]):
                yield done.result()
        except BaseException:
            # Where this process is interrupted alone, its workers would compile on, and it would wait for them.
            for process in list((pool._processes or {}).values()):
                process.terminate()
            raise
