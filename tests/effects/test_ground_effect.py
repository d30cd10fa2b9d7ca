"""Ground effect: its shape against JSBSim's tables, its flight against an integration with feedback of height."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.effects import runge_kutta
from oracles.flight import Airframe, state_rates
from problems import LIGHT, Problem, terms_of, with_channels

from aerosid.effects import ActiveEffect
from aerosid.effects.ground_effect import ground_effect
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import initial_state
from aerosid.estimation.motion_loop import self_consistent
from aerosid.flight_model.flight import simulate_outputs
from aerosid.flight_model.motion_laws import influence
from aerosid.search.hypotheses import effect_hypotheses

Array = NDArray[np.float64]
FRAME = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, LIGHT.airspeed, 100.0)
PROBLEM = Problem(duration=5.0, interval=0.05, elevator="3211", amplitude=-0.03)


def table(name: str) -> Array:
    """A function of height over span from JSBSim's c172p, (N, 2)."""
    jsbsim = pytest.importorskip("jsbsim")
    path = Path(jsbsim.get_default_root_dir()) / "aircraft" / "c172p" / "c172p.xml"
    function = next(f for f in ET.parse(path).iter("function") if f.get("name", "").endswith(name))
    data = next(function.iter("tableData")).text
    assert data is not None
    return np.array(data.split(), dtype=float).reshape(-1, 2)


@pytest.mark.parametrize(("name", "gain"), [("kCLge", 0.25), ("kCDge", -1.0)])
def test_the_influence_has_the_shape_of_jsbsims_tables(name: str, gain: float) -> None:
    """One point of the lift table (0.4) stands out of its own neighbours by 0.02."""
    ratio, factor = table(name)[1:].T
    assert_allclose(1.0 + gain * influence(ratio, 1.0), factor, atol=0.035)
    assert np.median(np.abs(1.0 + gain * influence(ratio, 1.0) - factor)) < 0.012


@pytest.mark.parametrize(("coefficient", "gain"), [("C_Z", 0.3), ("C_m", -0.04), ("C_X", 0.03)])
def test_flight_near_the_ground_is_that_of_a_plain_integration(coefficient: str, gain: float) -> None:
    log = PROBLEM.fly(1)
    model, manoeuvre = PROBLEM.prepared(with_channels(log, h=log["h"] - 1495.0))
    effect = ActiveEffect(ground_effect(coefficient, 14.0), (gain, 14.0))
    model = with_columns_of(model, [effect])
    start = initial_state(manoeuvre.flight)
    flight, _ = acting_flight(model, manoeuvre, [effect])
    values = np.array(model.values)
    acting, _ = self_consistent(model, flight, values, start, [effect])
    _, found = simulate_outputs(start, acting, values, model.table, model.constants)
    _, free = simulate_outputs(start, flight, values, model.table, model.constants)

    terms = {key: value for key, value in terms_of(model).items() if not key[1].startswith("offset")}
    terms[coefficient, "extra"] = 1.0
    driving = {"rho": LIGHT.density, "mass": LIGHT.mass}

    def rates(t: float, x: Array) -> Array:
        given = {name: float(np.interp(t, flight.time, flight.inputs[:, place])) for name, place in PLACES.items()}
        near = math.exp(-2.48 * (2.0 * max(x[4], 0.0) / 14.0) ** 0.768)
        alpha, speed = math.atan2(x[1], x[0]), math.hypot(x[0], x[1])
        variables = {"1": 1.0, "alpha": alpha, "q_hat": x[2] * LIGHT.mean_chord / 200.0, "delta_e": given["delta_e"]}
        own = sum(v * variables[name] for (c, name), v in terms.items() if c == coefficient and name != "extra")
        assert speed > 0.0
        given["extra"] = gain * near * (own if coefficient == "C_Z" else 1.0)
        return np.array(state_rates(x, {**driving, **given}, terms, FRAME))

    wanted = runge_kutta(rates, start, flight.time)
    assert influence(wanted[:, 4], 14.0).max() > 0.1
    for i in range(5):
        size = np.abs(wanted[:, i] - free[:, i]).max()
        assert_allclose(found[:, i], wanted[:, i], rtol=0.0, atol=0.02 * size)


PLACES = {"thrust": 1, "delta_e": 8}


def test_it_is_a_candidate_near_the_ground_alone() -> None:
    """A radio altimeter gives the ground's altitude; without one a low altitude is taken as above ground."""
    log = PROBLEM.fly(1)
    low = log["h"] - 1495.0

    def asked(**channels: Array) -> int:
        model, manoeuvre = PROBLEM.prepared(with_channels(log, **channels))
        offered = effect_hypotheses(model, [manoeuvre], LIGHT.coefficients)
        return sum(hypothesis.kind == "ground_effect" for hypothesis in offered)

    assert asked() == 0
    assert asked(h=low) == 9
    assert asked(h=low + 300.0, h_agl=low) == 9
    assert asked(h=low, h_agl=low + 300.0) == 0
    assert asked(h=low - 100.0) == 0
