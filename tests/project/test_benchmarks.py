"""The recursion in plain C that the benchmark measures against computes what the compiled Python computes."""

from __future__ import annotations

import numpy as np
import pytest

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.manoeuvre import prepare
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.terms import parse_term
from aerosid.model_error.aircraft_error.forward_estimate import estimate_aircraft_error
from benchmarks.flights import light_transport, long_flight
from benchmarks.plain_c import PlainC, compile_recursion, find_compiler

VARIANCE = np.array([0.15, 1.5e-3, 1.2e-3, 1.2e-3]) ** 2
DENSITY = np.array([1e-2, 1.0, 1e-3, 0.0])

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler on this machine")


@pytest.fixture(scope="module")
def plain_c(tmp_path_factory: pytest.TempPathFactory) -> PlainC:
    made = compile_recursion(tmp_path_factory.mktemp("recursion"))
    assert made is not None
    return made


@needs_compiler
@pytest.mark.parametrize("weight", [1e-6, 1.0, 1e6])
def test_both_languages_agree(plain_c: PlainC, weight: float) -> None:
    """States, d and Riccati matrix to rounding, from sluggish to stiff."""
    aircraft = light_transport()
    model = declared_model(aircraft, 100.0)
    flight = prepare(long_flight(600), aircraft, model.columns).flight
    _compare(plain_c, model, flight, weight)


@needs_compiler
def test_both_agree_with_every_kind_of_term_and_input(plain_c: PlainC) -> None:
    """Bank, sideslip, rates, missing samples, uneven sampling, alphadot, corners, lift and drag, inclined thrust."""
    aircraft = light_transport()
    terms = {
        "C_L": ("abs(alpha)*q_hat",),
        "C_D": ("pos(alpha - 0.01)^2",),
        "C_X": ("C_T^2",),
        "C_Z": ("V_hat*mach",),
        "C_m": ("alpha_dot_hat", "alpha^2*delta_e"),
    }
    entries = [(coefficient, parse_term(text)) for coefficient, texts in terms.items() for text in texts]
    model = declared_model(aircraft, 100.0, [term for _, term in entries]).extended(entries)
    values = model.values.copy()
    values[-len(entries) :] = [0.3, -0.4, 0.1, 0.2, -5.0, -1.0]
    constants = model.constants._replace(thrust_incidence=0.03, thrust_z_arm=0.2, airspeed_of_rates=0.0)
    model = type(model)(model.entries, values, model.columns, constants)
    given = prepare(long_flight(400), aircraft, model.columns).flight
    generator = np.random.default_rng(7)
    inputs, measured = given.inputs.copy(), given.measured.copy()
    inputs[:, 4:8] = 0.02 * generator.standard_normal((400, 4))
    measured[generator.random(measured.shape) < 0.1] = np.nan
    measured[50:60] = np.nan
    time = given.time + 0.3 * 0.03 * generator.uniform(-1.0, 1.0, 400)
    _compare(plain_c, model, given._replace(time=time, inputs=inputs, measured=measured), 1.0)


def _compare(plain_c: PlainC, model, flight: Flight, weight: float) -> None:
    wanted = estimate_aircraft_error(model, flight, VARIANCE, weight * DENSITY, respond=False)
    found = plain_c.prepare(model, flight, VARIANCE, weight * DENSITY)
    found()
    for one, other in ((wanted.d, found.d), (wanted.states, found.states), (wanted.riccati, found.riccati)):
        size = np.nanmax(np.abs(one), axis=0)
        np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
        assert np.nanmax(np.abs(one - other) / size) < 1e-9
