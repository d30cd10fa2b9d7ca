"""Output error on a recorded flight against published results; skipped where it is absent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recordings import recording

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.deviations import deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.logs.formats import read_log

PUBLISHED = {"V": 0.571, "alpha": 0.00228, "theta": 0.01205, "q": 0.00263, "a_x": 0.0246, "a_z": 0.217}
"""Root-mean-square residuals of output error on the HFB-320, Jategaonkar 2015, initial state held."""

V, ALPHA, THETA, Q = 106.023, 0.111685, 0.104887, -0.00332659
DETERMINANT = 3.016e-24


@pytest.fixture(scope="module")
def hfb() -> tuple[AerodynamicModel, Manoeuvre]:
    """The published model: density constant, wings level, the elevator free of noise."""
    log = read_log(recording("hfb320/hfb320_1_10.asc"), bundled_folder("flight_data") / "channel_maps" / "hfb320.toml")
    aircraft = load_aircraft("hfb320")
    model = declared_model(aircraft, 104.67)
    manoeuvre = prepare(log, aircraft, model.columns)
    inputs = manoeuvre.flight.inputs.copy()
    inputs[:, model.columns.index("rho")] = 0.792
    for name in ("phi", "p", "r", "beta"):
        inputs[:, model.columns.index(name)] = 0.0
    return model, replace(manoeuvre, flight=manoeuvre.flight._replace(inputs=inputs))


START = np.array([V * np.cos(ALPHA), V * np.sin(ALPHA), Q, THETA, 0.0])


def test_residuals_are_the_published_ones(hfb: tuple[AerodynamicModel, Manoeuvre]) -> None:
    model, manoeuvre = hfb
    settings = RefinementSettings(hold_states=True, filtering=False)
    found = refine(model, [manoeuvre], model.entries, states=[START], settings=settings)
    assert found.converged
    assert (found.states[0] == START).all()
    level = dict(zip(LONGITUDINAL.outputs, np.sqrt(found.variance), strict=True))
    for channel, wanted in PUBLISHED.items():
        # Published to three digits.
        assert level[channel] == pytest.approx(wanted, rel=0.003)
    assert np.prod(found.variance[:7]) == pytest.approx(DETERMINANT, rel=1e-3)


def test_a_free_initial_state_fits_better_and_bounds_grow(hfb: tuple[AerodynamicModel, Manoeuvre]) -> None:
    model, manoeuvre = hfb
    found = refine(model, [manoeuvre], model.entries, states=[START], settings=RefinementSettings(filtering=False))
    assert np.prod(found.variance[:7]) < 2.5e-24
    spread = deviations(found, [manoeuvre])
    # A study of this flight found Cramer-Rao bounds 2.3 to 4.8 times too small.
    assert 2.3 < float(np.median(spread.corrected / spread.white)) < 4.8
