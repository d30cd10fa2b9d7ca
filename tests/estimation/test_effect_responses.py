"""Sensitivities of inputs to the parameters of effects in series, against differences of the whole chain."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from problems import Problem

from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_deadband, control_lag, control_rate_limit
from aerosid.effects.kinds import InputEffect
from aerosid.effects.step_change import step_change
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.effect_responses import input_directions
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import initial_state

PROBLEM = Problem(duration=5.0, interval=0.05, elevator="3211", amplitude=-0.03)


def first(effect: InputEffect) -> InputEffect:
    """The effect before others on the same control."""
    return replace(effect, comes_first=True)


LAG, BAND = ActiveEffect(control_lag("delta_e"), (0.1,)), ActiveEffect(control_deadband("delta_e", 0.02), (0.005,))
LIMIT = ActiveEffect(first(control_rate_limit("delta_e", 0.3, 1.0)), (0.15,))
STEP = ActiveEffect(step_change("C_m", 2.0, 0.05), (0.01, 2.0))
CHAINS = {
    "lag": [LAG],
    "band behind a lag": [LAG, BAND, STEP],
    "lag behind a band": [STEP, BAND, LAG],
    "limit in front of both": [BAND, LAG, LIMIT],
    "step of another flight": [LAG, replace(STEP, log="elsewhere"), BAND],
}


@pytest.mark.parametrize("effects", CHAINS.values(), ids=CHAINS)
def test_directions_are_differences_of_the_whole_chain(effects: Sequence[ActiveEffect]) -> None:
    model, manoeuvre = PROBLEM.prepared(PROBLEM.fly(1))
    model = with_columns_of(model, effects)
    flight, _ = acting_flight(model, manoeuvre, effects)
    state = initial_state(manoeuvre.flight)
    found = input_directions(model, manoeuvre, np.array(model.values), state, effects, flight, ())
    extra, wanted = len(model.extra_columns), []
    for place, active in enumerate(effects):
        for n, parameter in enumerate(active.effect.parameters):
            sides = [active.perturbed(n, sign * parameter.step) for sign in (1.0, -1.0)]
            ends = [
                acting_flight(model, manoeuvre, [*effects[:place], side, *effects[place + 1 :]])[0].inputs
                for side in sides
            ]
            wanted.append((ends[0] - ends[1])[:, -extra:] / (sides[0].values[n] - sides[1].values[n]))
    assert np.any(wanted[0] != 0.0)
    for moved, change in zip(found, wanted, strict=True):
        for j in range(extra):
            np.testing.assert_array_equal(moved.get(j, np.zeros(len(change))), change[:, j])
