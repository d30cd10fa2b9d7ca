"""Ahead-of-time compilation: every kernel that close-loop needs called once on a sample flight, over all cores.

Each task calls the kernels of one part of the loop; the whole loop, which comes last, finds nearly all of them done.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.declared_model import declared_model
from aerosid.compatibility import check_kinematics
from aerosid.compiled.kernel_cache import compilation_announced
from aerosid.effects import ActiveEffect
from aerosid.effects.flow_separation import flow_separation
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.open_loop import respond
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.linear_model import linearise
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.flying_qualities.linear_analysis import condition_of
from aerosid.model_error.aircraft_error.force_history import smoothed_histories
from aerosid.model_error.paper_chain.chain import run_chain
from aerosid.model_error.paper_chain.coefficient_match import explained_shares

_AIRCRAFT = "light_transport"
_FLIGHTS = ("light_transport_doublet.csv", "light_transport_3211.csv")
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
    aircraft = load_aircraft(_AIRCRAFT)
    logs = tuple(read_log(bundled_folder("flight_data") / name) for name in _FLIGHTS)
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
    _, lift, _ = sample.aircraft.coefficients
    effect = flow_separation(0.1, lift, ())
    effects = [ActiveEffect(effect, tuple(parameter.trials[0] for parameter in effect.parameters))]
    refine(with_columns_of(sample.model, effects), [sample.manoeuvre], sample.free, effects=effects, settings=_ONCE)


def _instruments(sample: _Sample) -> None:
    check_kinematics(sample.logs[:1])


def _simulation(sample: _Sample) -> None:
    model, manoeuvre = sample.model, sample.manoeuvre
    linearise(model, condition_of(manoeuvre))
    respond(model, manoeuvre, manoeuvre.spread**2)
    explained_shares((model, ()), (model, ()), manoeuvre)


def _whole_loop(sample: _Sample) -> None:
    close_loop(sample.logs[:1], sample.aircraft, sample.logs[1:])


TASKS: dict[str, Callable[[_Sample], None]] = {
    "maximum likelihood": _fit_and_smooth,
    "model error d(t)": _model_error,
    "effects with a state": _motion_feedback,
    "instruments": _instruments,
    "simulation": _simulation,
    "the whole loop": _whole_loop,
}
"""Parts of the loop, those that compile longest first; the order is that in which they are begun."""


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
    start = time.perf_counter()
    with compilation_announced(kernels.append):
        TASKS[part](_sample())
    return Prepared(part, tuple(kernels), time.perf_counter() - start)


def prepare_kernels(workers: int | None = None) -> Iterator[Prepared]:
    """Compiles what close-loop calls, one part of the loop after the other, as they are done.

    Parameters
    ----------
    workers : int, optional
        Processes; by default one for each core. Two of them never compile the same kernel.
    """
    with ProcessPoolExecutor(workers or os.cpu_count(), mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(prepare_part, part) for part in TASKS]):
            yield done.result()
