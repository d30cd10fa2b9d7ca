"""Every kind of the catalogue by its own example: sensitivities against differences, search, completed file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from problems import LIGHT, NOISE, Problem, with_channels

from aerosid.aircraft.reading import aircraft_from_text
from aerosid.effects import KINDS, ActiveEffect, Planted, PositionEffect, frozen
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre, initial_state
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.verdict import Verdict

Array = NDArray[np.float64]
SPREAD = np.array([NOISE.get(name, 1.0) for name in LONGITUDINAL.outputs])
EXAMPLES = [
    pytest.param(name, planted, id=f"{name} {planted.where}")
    for name, kind in KINDS.items()
    for planted in kind.planted
    # A sensor position shown by pitching is estimated by equation error; the likelihood holds it.
    if planted.axes == LONGITUDINAL and not isinstance(kind.made(planted.where, planted.numbers, 0.05), PositionEffect)
]


def active(name: str, planted: Planted, interval: float, log: str = "") -> ActiveEffect:
    effect = KINDS[name].made(planted.where, planted.numbers, interval)
    return ActiveEffect(effect, tuple(planted.numbers[parameter.name] for parameter in effect.parameters), log)


def prepared(problem: Problem, planted: Planted, effect: ActiveEffect) -> tuple[AerodynamicModel, Manoeuvre]:
    model, manoeuvre = problem.prepared(driven(problem, planted, problem.fly(seed=1)))
    return with_columns_of(model, [effect]), manoeuvre


def driven(problem: Problem, planted: Planted, log: FlightLog) -> FlightLog:
    """The log at the example's altitude, with its thrust."""
    swing = 1.0 + planted.thrust_swing * np.sin(2.0 * np.pi * problem.time / 9.0)
    return with_channels(log, h=log["h"] - 1500.0 + planted.altitude, thrust=log["thrust"] * swing)


def answered(model: AerodynamicModel, manoeuvre: Manoeuvre, effect: ActiveEffect, state: Array) -> Array:
    """The outputs (N, 8) that a recorder would hold without noise."""
    likelihood = Likelihood(model, (manoeuvre,), (), False)
    (part,) = likelihood.stretches(model.values, [state], [effect], SPREAD**2)
    return part.predicted


@pytest.mark.parametrize(("name", "planted"), EXAMPLES)
def test_columns_are_the_sensitivities_of_the_outputs(name: str, planted: Planted) -> None:
    """With respect to the effect's parameters, and of ten terms and the initial state through the effect."""
    problem = Problem(duration=7.0, interval=0.05, elevator="3211", amplitude=-0.05)
    effect = active(name, planted, 0.05)
    model, manoeuvre = prepared(problem, planted, effect)
    state = initial_state(manoeuvre.flight)
    likelihood = Likelihood(model, (manoeuvre,), model.entries[:10], False)
    (part,) = likelihood.stretches(model.values, [state], [effect], SPREAD**2)
    held = np.isfinite(manoeuvre.flight.measured)

    def slope(move: Callable[[float], Array], step: float) -> Array:
        difference = (move(step) - move(-step)) / (2.0 * step)
        return np.where(held, difference / SPREAD, 0.0)

    wanted = []
    for n in range(10):
        step = 1e-3 * np.eye(model.values.size)[n] * (1.0 + abs(model.values[n]))
        moved = [model.with_values(model.values + step), model.with_values(model.values - step)]
        pair = [answered(m, manoeuvre, effect, state) for m in moved]
        wanted.append(np.where(held, (pair[0] - pair[1]) / (2.0 * step[n]) / SPREAD, 0.0))
    for n, size in enumerate((1e-2, 1e-2, 1e-4, 1e-4, 1e-1)):
        row = np.eye(5)[n]
        wanted.append(slope(lambda s, row=row: answered(model, manoeuvre, effect, state + s * row), size))
    for n in range(effect.slopes):
        size = effect.effect.parameters[n].step
        wanted.append(slope(lambda s, n=n: answered(model, manoeuvre, effect.perturbed(n, s), state), size))
    assert part.columns.shape[2] == len(wanted)
    for n, column in enumerate(wanted):
        size = np.abs(column).max()
        assert size > 0.0
        assert_allclose(part.columns[:, :, n], column, rtol=0.0, atol=2e-3 * size, err_msg=str(n))


@pytest.mark.parametrize(("name", "planted"), EXAMPLES)
def test_a_frozen_effect_acts_as_before(name: str, planted: Planted) -> None:
    problem = Problem(duration=7.0, interval=0.05, elevator="3211", amplitude=-0.05)
    effect = active(name, planted, 0.05)
    model, manoeuvre = prepared(problem, planted, effect)
    state = initial_state(manoeuvre.flight)
    still = frozen(effect)
    assert (still.values, still.held, still.slopes) == ((), effect.values, 0)
    assert (answered(model, manoeuvre, still, state) == answered(model, manoeuvre, effect, state)).all()


def flown(name: str, planted: Planted) -> FlightLog:
    """A flight of 470 samples in which the effect acts, with the usual noise."""
    problem = Problem(duration=14.1, elevator="levels" if name == "control_deadband" else "3211", amplitude=-0.045)
    quiet = driven(problem, planted, replace(problem, noise=dict.fromkeys(NOISE, 0.0)).fly())
    effect = active(name, planted, problem.interval)
    model, manoeuvre = problem.prepared(quiet)
    model = with_columns_of(model, [effect])
    outputs = answered(model, manoeuvre, effect, initial_state(manoeuvre.flight))
    generator = np.random.default_rng(7)
    truth = {
        **{channel: outputs[:, LONGITUDINAL.outputs.index(channel)] for channel in LONGITUDINAL.outputs},
        "delta_e": quiet["delta_e"],
    }
    noisy = {c: truth[c] + deviation * generator.standard_normal(problem.time.size) for c, deviation in NOISE.items()}
    return with_channels(quiet, **noisy)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "planted"), [p for p in EXAMPLES if p.values[0] != "gust"])
def test_the_loop_names_it_and_its_completed_file_is_complete(name: str, planted: Planted) -> None:
    """Except a gust, which does not change the mean: tests/test_effects_found.py flies through one.

    Through the centre of gravity and along x, another factor of thrust is another C_X C_T, the commoner name: it is the
    alternative then.
    """
    log = flown(name, planted)
    result = close_loop([log], LIGHT)
    assert len(result.effects) == 1
    twin = name == "thrust_scale" and result.effects[0].term == "C_T"
    first = (result.alternatives if twin else result.effects)[0]
    assert (first.kind, first.where) == (name, planted.where)
    value = planted.numbers[KINDS[name].leading]
    assert abs(first.value - value) < 4.0 * first.std_error
    completed = aircraft_from_text(result.completed_aircraft.text, "completed.toml", "0" * 64)
    again = close_loop([log], completed)
    assert not again.effects
    assert again.verdict is (Verdict.NOTHING_MISSING if result.verdict is Verdict.EXPLAINED else Verdict.UNEXPLAINED)
