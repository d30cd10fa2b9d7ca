"""Derivatives of lateral and six-axis models from simulated flights whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lateral_problems import NOISE, PITCH, SIDE, commuter, flown

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import prepare
from aerosid.estimation.maximum_likelihood import refine
from aerosid.estimation.open_loop import respond


@pytest.mark.parametrize(
    "values", [SIDE, pytest.param(PITCH | SIDE, marks=pytest.mark.slow)], ids=["lateral", "six degrees of freedom"]
)
def test_derivatives_come_back_within_their_bounds(values: dict[str, dict[str, float]]) -> None:
    truth, declared = commuter(values), commuter(values, 0.85)
    log, other = flown(truth, 1), replace(flown(truth, 2), name="other")
    model = declared_model(declared, 72.0)
    manoeuvre, unseen = (prepare(flight, declared, model.columns) for flight in (log, other))
    found = refine(model, [manoeuvre], model.entries)
    wanted = np.array([values[coefficient][str(term)] for coefficient, term in model.entries])
    deviations = np.sqrt(np.diag(found.covariance))[: wanted.size]
    assert np.max(np.abs(found.model.values - wanted) / deviations) < 4.5  # 27 numbers: 2 in 10,000 by chance
    assert np.max(deviations / np.abs(wanted)) < 0.5
    for flight in (manoeuvre, unseen):
        for channel, error in respond(found.model, flight, found.variance).rms.items():
            assert error is not None
            assert error < 1.15 * NOISE[channel]


def test_a_vane_on_a_boom_is_corrected_for_where_alpha_is_an_input() -> None:
    aircraft = commuter(SIDE)
    log = flown(aircraft, 1)
    x, y, z = place_of_vane = (5.0, 0.4, -0.5)
    u, w = log["V"] * np.cos(log["alpha"]), log["V"] * np.sin(log["alpha"])
    turned = np.arctan2(w + log["p"] * y - log["q"] * x, u + log["q"] * z - log["r"] * y)
    moved = replace(log, channels={**log.channels, "alpha": turned}, positions={"alpha": place_of_vane})
    columns = declared_model(aircraft, 72.0).columns
    plain, corrected = (prepare(flight, aircraft, columns).flight.inputs for flight in (log, moved))
    place = columns.index("alpha")
    np.testing.assert_allclose(corrected[:, place], plain[:, place], rtol=0.0, atol=1e-5)
    assert np.abs(turned - log["alpha"]).max() > 1e-3
