"""Accelerometers in one unit that is not where it is declared, on flights simulated by equations of their own."""

import numpy as np
import pytest
from equations_decided import decided

from aerosid.effects.kinds import UNIT
from benchmarks.sideways_plants import catalogue
from benchmarks.six_axis_flights import BODIES, Circumstances, aircraft_of, flown

SEED = 62_000
"""Of these tests; built on flights of another simulator."""


@pytest.mark.parametrize(
    ("name", "gust"), [("regional jet", 0.0), pytest.param("survey drone", 0.01, marks=pytest.mark.slow)]
)
def test_it_is_one_finding_and_no_term(name: str, gust: float) -> None:
    """One by one the three channels took a displaced centre of gravity, vanes behind it and terms of C_Y and C_m."""
    body = next(each for each in BODIES if each.name == name)
    at = Circumstances(body, 0.04, 25.0, gust=gust * body.airspeed, memory=0.3, off=0.06)
    plant = next(each for each in catalogue(1.0, 1.0, at.seconds, body.span) if each.label == "position of the unit")
    aircraft = aircraft_of(at, plant, "six", np.random.default_rng(SEED))
    fitted, unseen = (flown(log, at, plant, SEED + n) for n, log in enumerate(("fitted", "unseen")))
    found = decided(aircraft, [fitted], [unseen])
    (row,) = found.findings
    assert row.hypothesis.label == ("sensor_position", UNIT, "")
    assert row.active is not None
    ahead, _, below = plant.positions["a_x"]
    assert abs(row.value - ahead) < 3.5 * row.std_error
    values = dict(zip(row.active.effect.axes, row.active.values, strict=True))
    assert values == {"x": pytest.approx(ahead, rel=0.2), "z": pytest.approx(below, rel=0.15)}
