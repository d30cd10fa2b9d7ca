"""Sensitivities to sensor positions: the closed form against differences of whole simulations."""

from __future__ import annotations

import numpy as np
import pytest
from lateral_problems import PITCH, SIDE, commuter, flown

from aerosid.aircraft.declared_model import declared_model
from aerosid.effects.family import at_null
from aerosid.effects.kinds import UNIT
from aerosid.effects.sensor_position import sensor_place
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.lever_slopes import LEVERS
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import prepare
from aerosid.flight_model.flight import simulate_outputs

STEP = 0.5
"""m; any, of what is linear."""


@pytest.mark.parametrize("values", [SIDE, PITCH | SIDE], ids=["lateral", "six degrees of freedom"])
def test_sensitivities_to_a_position_are_those_of_whole_simulations(values: dict[str, dict[str, float]]) -> None:
    aircraft = commuter(values)
    manoeuvre = prepare(flown(aircraft, 1), aircraft, declared_model(aircraft, 72.0).columns)
    model = declared_model(aircraft, 72.0)
    channels = [name for name in LEVERS if name in aircraft.axes.outputs]
    tested = [at_null(sensor_place(where, "xyz")) for where in (*channels, UNIT)]
    likelihood = Likelihood(model, (manoeuvre,), model.entries)
    numbers = np.array(model.values)
    state = manoeuvre.first_state
    (part,) = likelihood.traced(0, numbers, state, (), tested, whole=True)
    found = part.block[:, :, -3 * len(tested) :]

    assert {"a_y", "beta"} <= set(channels)
    for n, active in enumerate(tested):
        for axis in range(3):
            sides = []
            for step in (STEP, -STEP):
                flight, _ = acting_flight(model, manoeuvre, [active.perturbed(axis, step)])
                sides.append(simulate_outputs(state, flight, numbers, model.table, model.constants)[0])
            expected = (sides[0] - sides[1]) / (2.0 * STEP)
            np.testing.assert_allclose(found[:, :, 3 * n + axis], expected, atol=1e-9)
        for row, channel in enumerate(aircraft.axes.outputs):
            shown = np.abs(found[:, row, 3 * n]).max()
            assert shown > 1e-4 if active.effect.moves(channel) else shown == 0.0
