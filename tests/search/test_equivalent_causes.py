"""Engine failure and store release: the lever arm is an alternative to the step of a moment."""

from __future__ import annotations

import numpy as np
import pytest
from lateral_flights import MASS, SIDE, SPAN, Lateral, aircraft, level

from aerosid.effects import ActiveEffect
from aerosid.effects.thrust import thrust_asymmetry, thrust_asymmetry_step
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import initial_state, prepare
from aerosid.flight_model.flight import simulate_outputs
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.settings import LoopSettings

QUICK = LoopSettings(paper_chain=False, second_opinion=False, linear_analysis=False, next_flight=False)
TIME = Lateral().time
WHEN = 7.5


def from_then_on(size: float) -> np.ndarray:
    """A ramp over one sample."""
    return size * np.clip((TIME - WHEN) / 0.04 + 0.5, 0.0, 1.0)


@pytest.mark.slow
def test_an_arm_of_the_thrust_yaws_as_the_suites_equations_do() -> None:
    """N = T y: the suite's flight holds the arm as an input of C_n, the model as an effect."""
    truth = Lateral(extra={("C_n", "C_T*x_1"): 1.0 / SPAN}, inputs={"x_1": from_then_on(0.2)}, noise=0.0)
    declared = aircraft(SIDE)
    model, _ = declared_with_candidates([truth.log()], [], declared)
    effect = ActiveEffect(thrust_asymmetry_step(WHEN, 0.04), (0.2, WHEN))
    assert thrust_asymmetry().column == effect.effect.where_acts  # type: ignore[union-attr]
    model = with_columns_of(model, [effect])
    manoeuvre = prepare(
        truth.log(), declared, model.columns[: len(declared_with_candidates([truth.log()], [], declared)[0].columns)]
    )
    flight, _ = acting_flight(model, manoeuvre, [effect])
    outputs, _ = simulate_outputs(
        initial_state(manoeuvre.flight, manoeuvre.axes), flight, np.array(model.values), model.table, model.constants
    )
    for channel in ("p", "r", "beta"):
        true = truth.log()[channel]
        error = outputs[:, manoeuvre.row(channel)] - true
        assert np.sqrt(np.mean(error**2)) < 0.01 * np.ptp(true), channel


@pytest.mark.slow
@pytest.mark.parametrize(
    ("term", "size", "kind", "where", "arm"),
    [
        ("C_n", 0.2 / SPAN, "thrust_asymmetry", "thrust", 0.2),
        ("C_l", 0.03 * MASS * 9.80665 / (level()[2] * SPAN), "cg_shift", "y", 0.03),
    ],
)
def test_the_lever_arm_is_an_alternative_to_the_step(term: str, size: float, kind: str, where: str, arm: float) -> None:
    flight = Lateral(extra={(term, "C_T*x_1"): 1.0}, inputs={"x_1": from_then_on(size)})
    result = close_loop([flight.log()], aircraft(SIDE), settings=QUICK)
    assert [(each.kind, each.where) for each in result.effects] == [("step_change", term)]
    (other,) = (each for each in result.alternatives if each.kind == kind)
    assert (other.where, other.unit, other.instead_of) == (where, "m", f"step_change of {term}")
    assert abs(other.value - arm) < 3.0 * other.std_error + 0.03 * arm
    assert abs(other.time - WHEN) < 0.1
