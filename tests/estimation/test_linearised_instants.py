"""Misfits of an event at several instants by one linearised response, against a simulation with each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.estimation import unseen_step_changes
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.linearised_instants import predicted_misfits
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.unseen_step_changes import fitted_step_changes
from aerosid.flight_model.aerodynamics import AerodynamicModel
from tests.estimation.test_open_loop import DRAG, JUMP, at, flown, found

INSTANTS = (2.0, 4.0, 4.5, 5.0, 8.0)


def predicted(model: AerodynamicModel, manoeuvre: Manoeuvre, events: list[tuple[ActiveEffect, ...]]) -> list[float]:
    likelihood = Likelihood(model, (manoeuvre,), (), filtering=False)
    misfits = predicted_misfits(likelihood, (), found(model, manoeuvre).variance, manoeuvre.first_state, events)
    assert misfits is not None
    return misfits.tolist()


def simulated(model: AerodynamicModel, manoeuvre: Manoeuvre, event: tuple[ActiveEffect, ...]) -> float:
    """The cost with an event, its initial state estimated until it rests."""
    settings = RefinementSettings(steps=20, step_tolerance=1e-4, hold_variance=True, filtering=False)
    variance = found(model, manoeuvre).variance
    effects = [frozen(active) for active in event]
    return refine(model, [manoeuvre], (), effects=effects, variance=variance, settings=settings).cost


def test_the_misfit_with_a_small_event_is_predicted_as_it_is_simulated() -> None:
    """Of two coefficients at once, at each instant; what is left is of second order in the event's size."""
    sizes = (-1e-4, -3e-4)
    model, manoeuvre = flown((at(JUMP, 4.5, sizes[0]), at(DRAG, 4.5, sizes[1])), 3)
    events = [(at(JUMP, time, sizes[0]), at(DRAG, time, sizes[1])) for time in INSTANTS]
    exact = [simulated(model, manoeuvre, event) for event in events]
    assert np.ptp(exact) > 20.0
    assert predicted(model, manoeuvre, events) == pytest.approx(exact, abs=0.01 * float(np.ptp(exact)))


def test_the_misfit_with_a_large_event_is_predicted_in_the_order_in_which_it_is_simulated() -> None:
    model, manoeuvre = flown((at(JUMP, 4.5),), 3)
    events = [(at(JUMP, time),) for time in INSTANTS]
    order = np.argsort([simulated(model, manoeuvre, event) for event in events])
    assert np.argsort(predicted(model, manoeuvre, events)).tolist()[:3] == order.tolist()[:3]


def test_nothing_is_predicted_where_the_log_cannot_be_simulated_without_the_event() -> None:
    model, manoeuvre = flown((), 3)
    likelihood = Likelihood(model, (manoeuvre,), (), filtering=False)
    away = manoeuvre.first_state + np.eye(5)[1] * 1e4
    assert predicted_misfits(likelihood, (), found(model, manoeuvre).variance, away, [(at(JUMP, 4.5),)]) is None


def placed(model: AerodynamicModel, manoeuvre: Manoeuvre, state: NDArray[np.float64]) -> tuple[ActiveEffect, ...]:
    completed: Refinement = found(model, manoeuvre, (JUMP, DRAG))
    return fitted_step_changes(completed, manoeuvre, (), (JUMP, DRAG), state)


@pytest.mark.parametrize("times", [(8.1, 2.6), (3.0, 3.9), (11.2, 6.0)])
def test_the_instants_are_those_of_a_search_that_simulates_every_one(
    times: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, manoeuvre = flown((at(JUMP, times[0]), at(DRAG, times[1])), 7)
    quick = placed(model, manoeuvre, manoeuvre.first_state)
    monkeypatch.setattr(unseen_step_changes, "FOLLOWED", 10**6)
    monkeypatch.setattr(unseen_step_changes, "_downhill", lambda instants, misfit: min(instants, key=misfit))
    every = placed(model, manoeuvre, manoeuvre.first_state)
    assert len(quick) == 2
    assert [replace(each, effect=JUMP.effect) for each in quick] == [
        replace(each, effect=JUMP.effect) for each in every
    ]


@pytest.mark.parametrize(("least", "simulations"), [(0, 6), (3, 4), (4, 3), (5, 5), (8, 7)])
def test_the_least_misfit_is_found_downhill_from_the_middle(least: int, simulations: int) -> None:
    asked = []

    def misfit(instant: float) -> float:
        asked.append(instant)
        return abs(instant - least)

    assert unseen_step_changes._downhill([float(n) for n in range(9)], misfit) == least
    assert len(set(asked)) <= simulations
