"""Open-loop comparison: the instant of a step change of one flight on another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from problems import NOISE, Problem

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.step_change import step_change
from aerosid.effects.step_input import instant_of
from aerosid.estimation import open_loop
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.open_loop import on_log, prediction_errors, respond, simulate
from aerosid.flight_model.aerodynamics import AerodynamicModel

JUMP = ActiveEffect(step_change("C_m", 3.0, 0.03), (-0.01, 3.0), "first")
DRAG = ActiveEffect(step_change("C_X", 7.0, 0.03), (-0.03, 7.0), "first")


def found(
    model: AerodynamicModel, manoeuvre: Manoeuvre, changes: tuple[ActiveEffect, ...] = (JUMP,), **seen: Any
) -> Refinement:
    """A true model, with step changes that were found on another flight."""
    variance = np.array([NOISE.get(name, 1.0) ** 2 for name in manoeuvre.axes.outputs])
    return Refinement(model, (), (), changes, variance, 0.0, np.zeros((0, 0)), converged=True, **seen)


def flown(changes: tuple[ActiveEffect, ...], seed: int) -> tuple[AerodynamicModel, Manoeuvre]:
    """The model and its second flight, with some step changes."""
    problem = Problem(elevator="3211")
    model, manoeuvre = problem.prepared(problem.fly(seed, "second"))
    model = with_columns_of(model, [JUMP, DRAG])
    outputs, _ = simulate(model, manoeuvre, manoeuvre.first_state, changes)
    sizes = np.array([NOISE.get(name, 0.0) for name in manoeuvre.axes.outputs])
    measured = outputs + sizes * np.random.default_rng(seed).standard_normal(outputs.shape)
    held = np.isfinite(manoeuvre.flight.measured)
    flight = manoeuvre.flight._replace(measured=np.where(held, measured, np.nan))
    return model, replace(manoeuvre, flight=flight)


def test_errors_of_a_prediction_are_those_of_the_response_and_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = (replace(JUMP, values=(-0.01, 4.52), log="second"),)
    model, manoeuvre = flown(changes, 3)
    at = found(model, manoeuvre)
    wanted = respond(model, manoeuvre, at.variance, effects=on_log(at, manoeuvre)).rms
    assert prediction_errors(at, manoeuvre) == wanted
    monkeypatch.setattr(open_loop, "respond", lambda *_arguments, **_named: pytest.fail("simulated again"))
    assert prediction_errors(at, manoeuvre) == wanted


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


def at(active: ActiveEffect, time: float, size: float | None = None) -> ActiveEffect:
    """A step change on the second flight."""
    return replace(active, values=(active.values[0] if size is None else size, time), log="second")


def test_two_events_are_placed_each_at_its_instant() -> None:
    """In the other order and farther apart than on the flight that was fitted: one instant for both fits neither."""
    changes = (at(JUMP, 8.1), at(DRAG, 2.6))
    model, manoeuvre = flown(changes, 7)
    placed = on_log(found(model, manoeuvre, (JUMP, DRAG)), manoeuvre)
    assert {each.name: instant_of(each) for each in placed} == {
        each.name: pytest.approx(instant_of(each), abs=0.1) for each in changes
    }


def test_an_event_that_did_not_recur_is_left_out_beside_one_that_did() -> None:
    model, manoeuvre = flown((at(DRAG, 5.0),), 8)
    (placed,) = on_log(found(model, manoeuvre, (JUMP, DRAG)), manoeuvre)
    assert placed.name == DRAG.name
    assert instant_of(placed) == pytest.approx(5.0, abs=0.1)


def test_held_step_changes_are_placed_as_free_ones_are() -> None:
    model, manoeuvre = flown((at(JUMP, 8.1), at(DRAG, 2.6)), 7)
    free = on_log(found(model, manoeuvre, (JUMP, DRAG)), manoeuvre)
    held = on_log(found(model, manoeuvre, (frozen(JUMP), frozen(DRAG))), manoeuvre)
    assert [(each.name, instant_of(each)) for each in held] == [(each.name, instant_of(each)) for each in free]


def test_the_steps_that_the_coefficients_show_on_a_log_give_the_instants_and_none_of_the_sizes() -> None:
    """A flight whose simulation would place them elsewhere: it is flown without any."""
    model, manoeuvre = flown((), 9)
    # A step of C_m of the other sign is another one. What changed at different times may change at the same time.
    seen = (at(JUMP, 2.0, 0.011), at(JUMP, 9.0, -0.012), at(DRAG, 9.04, -0.028))
    both = found(model, manoeuvre, (JUMP, DRAG), seen_on_others={"second": seen})
    placed = {(each.name, each.values) for each in on_log(both, manoeuvre)}
    assert placed == {(JUMP.name, (-0.01, 9.0)), (DRAG.name, (-0.03, 9.04))}
    none = found(model, manoeuvre, (JUMP, DRAG), seen_on_others={"second": ()})
    assert on_log(none, manoeuvre) == ()
    other = found(model, manoeuvre, (JUMP, DRAG), seen_on_others={"second": seen[:1]})
    assert on_log(other, manoeuvre) == ()


def test_what_changed_with_a_step_that_is_seen_again_recurs_with_it() -> None:
    """A coefficient's own step may be too small to be seen on the other log."""
    model, manoeuvre = flown((), 10)
    together = (JUMP, replace(DRAG, values=(-0.03, 3.1)))
    again = found(model, manoeuvre, together, seen_on_others={"second": (at(DRAG, 6.0),)})
    assert {(each.name, each.values) for each in on_log(again, manoeuvre)} == {
        (JUMP.name, (-0.01, 6.0)),
        (DRAG.name, (-0.03, 6.0)),
    }
