"""An aileron's lag near the time constant of the rolling mode, on flights by equations that share no code with ours."""

from dataclasses import replace

import numpy as np
import pytest
from equations_decided import decided

from aerosid.equation_error.decision import EquationErrorDecision
from benchmarks.sideways_plants import SidePlant, catalogue
from benchmarks.six_axis_flights import BODIES, Circumstances, WholeBody, aircraft_of, flown

DRONE, JET = (next(body for body in BODIES if body.name == name) for name in ("survey drone", "regional jet"))
"""The drone's rolling mode has a time constant of 0.052 s."""

AT = Circumstances(DRONE, 0.02, 20.0, gust=0.34, memory=0.3, off=0.06)
SEED = 61_000
"""Of tests; it was built on other flights, those of `benchmarks/sideways_detection.py` with seeds 91 and 400 to 433."""

LAG = 0.08
LAGGING = next(each for each in catalogue(1.0, 1.0, AT.seconds, DRONE.span) if each.label == "lag delta_a")


def closed(seed: int, plant: SidePlant, body: WholeBody = DRONE) -> EquationErrorDecision:
    at = replace(AT, body=body, gust=0.01 * body.airspeed)
    aircraft = aircraft_of(at, plant, "lateral", np.random.default_rng(seed))
    fitted, unseen = (flown(name, at, plant, seed + n) for n, name in enumerate(("fitted", "unseen")))
    return decided(aircraft, [fitted], [unseen])


@pytest.mark.parametrize("seed", [SEED, *(pytest.param(SEED + n, marks=pytest.mark.slow) for n in (10, 20))])
def test_neither_the_lag_nor_the_roll_damping_is_that_of_the_other(seed: int) -> None:
    found = closed(seed, LAGGING)
    (lag,) = [active for active in found.completed.point.effects if active.effect.kind == "control_lag"]
    assert lag.values[0] == pytest.approx(LAG, rel=0.06)
    errors = np.sqrt(np.diag(found.covariance))
    for (kind, entry, *_), value, error in zip(
        found.completed.design.unknowns, found.completed.solution.values, errors, strict=True
    ):
        if kind == "term" and entry[0] == "C_l":
            assert abs(value - DRONE.terms["C_l", str(entry[1])]) < 4.0 * error


def test_no_density_is_asked_where_the_lag_is_far_from_every_mode() -> None:
    """The jet's rolling mode has a time constant of 0.68 s."""
    assert not closed(SEED, LAGGING, JET).completed.problem.of_recorded_motion
