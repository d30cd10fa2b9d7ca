"""Open-loop comparison: the instant of a step change of one flight on another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import NOISE, Problem

from aerosid.effects import ActiveEffect
from aerosid.effects.step_change import step_change
from aerosid.effects.step_input import instant_of
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.open_loop import on_log, respond, simulate
from aerosid.flight_model.aerodynamics import AerodynamicModel

JUMP = ActiveEffect(step_change("C_m", 3.0, 0.03), (-0.01, 3.0), "first")


def found(model: AerodynamicModel, manoeuvre: Manoeuvre) -> Refinement:
    """A true model, with a step change that was found on another flight."""
    variance = np.array([NOISE.get(name, 1.0) ** 2 for name in manoeuvre.axes.outputs])
    return Refinement(model, (), (), (JUMP,), variance, 0.0, np.zeros((0, 0)), converged=True)


def flown(changes: tuple[ActiveEffect, ...], seed: int) -> tuple[AerodynamicModel, Manoeuvre]:
    """The model and its second flight, with some step changes."""
    problem = Problem(elevator="3211")
    model, manoeuvre = problem.prepared(problem.fly(seed, "second"))
    model = with_columns_of(model, [JUMP])
    outputs, _ = simulate(model, manoeuvre, manoeuvre.first_state, changes)
    sizes = np.array([NOISE.get(name, 0.0) for name in manoeuvre.axes.outputs])
    measured = outputs + sizes * np.random.default_rng(seed).standard_normal(outputs.shape)
    held = np.isfinite(manoeuvre.flight.measured)
    flight = manoeuvre.flight._replace(measured=np.where(held, measured, np.nan))
    return model, replace(manoeuvre, flight=flight)


@pytest.mark.parametrize("time", [1.7, 4.52, 9.3])
def test_the_instant_of_a_step_change_is_estimated_on_another_flight(time: float) -> None:
    model, manoeuvre = flown((replace(JUMP, values=(-0.01, time), log="second"),), 3)
    (placed,) = on_log(found(model, manoeuvre), manoeuvre)
    assert placed.log == "second"
    assert instant_of(placed) == pytest.approx(time, abs=0.1)
    # And no fit of the initial state with the step at another instant is better.
    errors = [
        squares(model, manoeuvre, replace(placed, values=(-0.01, instant_of(placed) + off))) for off in (0.0, -0.5, 0.5)
    ]
    assert errors[0] < min(errors[1:])


def test_a_flight_without_the_step_change_is_simulated_without_it() -> None:
    model, manoeuvre = flown((), 4)
    assert on_log(found(model, manoeuvre), manoeuvre) == ()


@pytest.mark.parametrize("time", [1.7, 9.3])
def test_a_reduced_model_s_instant_is_estimated_from_that_of_the_fuller_one(time: float) -> None:
    model, manoeuvre = flown((replace(JUMP, values=(-0.01, time), log="second"),), 5)
    fuller = found(model, manoeuvre)
    on_log(fuller, manoeuvre)
    poorer = model.with_values(np.array(model.values) * np.where(np.arange(model.values.size) == 3, 0.9, 1.0))
    (placed,) = on_log(found(poorer, manoeuvre), manoeuvre, fuller)
    (anywhere,) = on_log(found(poorer, manoeuvre), manoeuvre)
    span = float(np.ptp(manoeuvre.flight.time))
    assert instant_of(placed) == pytest.approx(instant_of(anywhere), abs=span / 400.0)


def test_a_reduced_model_leaves_out_the_step_change_that_the_fuller_one_leaves_out() -> None:
    model, manoeuvre = flown((), 6)
    without = found(model, manoeuvre)
    assert on_log(without, manoeuvre) == ()
    later = flown((replace(JUMP, values=(-0.01, 4.5), log="second"),), 6)[1]
    assert on_log(found(model, later), later, without) == ()
    assert on_log(found(model, later), later) != ()


def squares(model: AerodynamicModel, manoeuvre: Manoeuvre, jump: ActiveEffect) -> float:
    """Squared errors over their variances, the initial state fitted to convergence."""
    variance = found(model, manoeuvre).variance
    rms = respond(model, manoeuvre, variance, effects=(jump,)).rms
    return sum(value**2 / variance[manoeuvre.row(name)] for name, value in rms.items() if value is not None)
