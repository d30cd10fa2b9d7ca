"""Flights with feedback of the motion to the inputs: the two are consistent, and every derivative is the total one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from problems import NOISE, Problem, with_channels

from aerosid.effects import ActiveEffect, StateEffect, frozen
from aerosid.effects.control import control_delay, control_lag
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.ground_effect import ground_effect
from aerosid.effects.sensor import sensor_delay, sensor_lag
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre, initial_state
from aerosid.estimation.motion_loop import added_along, self_consistent
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import simulate_outputs
from aerosid.flight_model.motion_laws import factor_places, offsets_of_unit_size, rate_up_to_now

Array = NDArray[np.float64]
SPREAD = np.array([NOISE.get(name, 1.0) for name in LONGITUDINAL.outputs])
SEPARATING = ActiveEffect(flow_separation(0.12, "C_Z", ("C_X", "C_m")), (0.1, 25.0, 0.15, 0.2, -0.05, -0.03))
AT_ONCE = ActiveEffect(flow_separation(0.12, "C_Z", ("C_m",)), (0.11, 15.0, 0.1, 0.0, -0.02))
LIFTED = ActiveEffect(ground_effect("C_Z", 14.0), (0.3, 14.0))
PITCHED = ActiveEffect(ground_effect("C_m", 14.0), (-0.04, 14.0))
LATE_CONTROL = ActiveEffect(control_delay("delta_e"), (0.07,))
SLOW_CONTROL = ActiveEffect(control_lag("delta_e"), (0.1,))
SLOW_VANE = ActiveEffect(sensor_lag("alpha"), (0.12,))
LATE_RATE = ActiveEffect(sensor_delay("q"), (0.08,))
CASES = {
    "separation": (SEPARATING,),
    "separation, slow vane, late control": (SEPARATING, SLOW_VANE, LATE_CONTROL),
    "separation without memory, late gyro": (LATE_RATE, AT_ONCE),
    "lift near the ground": (LIFTED,),
    "lift near the ground, slow vane and control": (SLOW_CONTROL, LIFTED, SLOW_VANE),
    "lift and moment near the ground, and separation": (LIFTED, SEPARATING, PITCHED),
}


def flown(effects: Sequence[ActiveEffect], seed: int = 1) -> tuple[AerodynamicModel, Manoeuvre]:
    """A low flight; its model has the columns that the effects fill."""
    problem = Problem(duration=4.0, interval=0.04, elevator="3211", amplitude=-0.05)
    log = problem.fly(seed)
    model, manoeuvre = problem.prepared(with_channels(log, h=log["h"] - log["h"].min() + 4.0))
    return with_columns_of(model, effects), manoeuvre


@pytest.mark.parametrize("effects", CASES.values(), ids=CASES)
def test_motion_and_addition_agree(effects: tuple[ActiveEffect, ...]) -> None:
    """The acting inputs are those that the effects add along the motion of a flight with just these inputs."""
    model, manoeuvre = flown(effects)
    flight, _ = acting_flight(model, manoeuvre, effects)
    values, start = np.array(model.values), initial_state(manoeuvre.flight)
    acting, states = self_consistent(model, flight, values, start, effects)
    _, again = simulate_outputs(start, acting, values, model.table, model.constants)
    assert_allclose(states, again, rtol=1e-12)
    wanted = flight.inputs.copy()
    for active in effects:
        if isinstance(active.effect, StateEffect):
            for column, change in added_along(active, model, flight, values, states, 0.0).items():
                assert np.ptp(change) > 1e-4
                wanted[:, model.columns.index(column)] += change
    assert_allclose(acting.inputs, wanted, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("active", [SEPARATING, AT_ONCE, PITCHED])
def test_factors_times_offsets_of_unit_size_are_what_an_effect_adds(active: ActiveEffect) -> None:
    effect = active.effect
    assert isinstance(effect, StateEffect)
    effect = replace(effect, proportional=False)
    active = replace(active, effect=effect)
    model, manoeuvre = flown((active,))
    u, w, _, _, h = states = simulate_outputs(
        initial_state(manoeuvre.flight), manoeuvre.flight, np.array(model.values), model.table, model.constants
    )[1].T
    added = added_along(active, model, manoeuvre.flight, np.array(model.values), np.ascontiguousarray(states.T), 2.0)
    time, alpha = manoeuvre.flight.time, np.arctan2(w, u)
    numbers, places = effect.law_numbers(active.values), factor_places(effect.law, len(effect.columns))
    rows = offsets_of_unit_size(
        effect.law, numbers, len(effect.columns), time, (alpha, rate_up_to_now(time, alpha), h - 2.0)
    )
    (slope,) = (value for entry, value in zip(model.entries, model.values, strict=True) if _is_lift_slope(entry))
    for column, place, row in zip(effect.columns, places, rows, strict=True):
        factor = slope if place is None else numbers[place]
        assert_allclose(factor * row, added[column], rtol=1e-12, atol=1e-15)


def _is_lift_slope(entry: Entry) -> bool:
    return (entry[0], str(entry[1])) == ("C_Z", "alpha")


@pytest.mark.parametrize("effects", CASES.values(), ids=CASES)
def test_derivatives_are_those_of_whole_simulations(effects: tuple[ActiveEffect, ...]) -> None:
    """By central differences of self-consistent flights; two logs with their own initial states."""
    model, first = flown(effects)
    _, second = flown(effects, seed=2)
    second = replace(
        second, flight=second.flight._replace(inputs=0.7 * first.flight.inputs + 0.3 * second.flight.inputs)
    )
    manoeuvres = first, second
    free = tuple(entry for entry in model.entries if not str(entry[1]).startswith("offset"))[:10]
    starts = [initial_state(each.flight) for each in manoeuvres]
    terms, numbers = len(free), [active.values for active in effects]

    def parts(likelihood: Likelihood, point: Array) -> list[tuple[Array, Array]]:
        values = np.array(model.values)
        values[model.indices(free)] = point[:terms]
        rest, acting = point[terms + 10 :], []
        for active in effects:
            acting.append(replace(active, values=tuple(rest[: len(active.values)])))
            rest = rest[len(active.values) :]
        states = [point[terms + 5 * n : terms + 5 * n + 5] for n in range(2)]
        return [(p.predicted, p.columns) for p in likelihood.stretches(values, states, acting, SPREAD**2)]

    point = np.concatenate([model.values[model.indices(free)], *starts, *numbers])
    steps = [effect.step for active in effects for effect in active.effect.parameters]
    steps = np.array([*(1e-4 * (1.0 + np.abs(point[:terms]))), *([1e-3, 1e-3, 1e-5, 1e-5, 1e-3] * 2), *steps])
    held = [np.isfinite(each.flight.measured) for each in manoeuvres]
    found = [columns for _, columns in parts(Likelihood(model, manoeuvres, free, False), point)]
    plain = Likelihood(model, manoeuvres, (), False)
    for n in range(point.size):
        at_zero = point[n] == 0.0  # a relaxation time of none: the derivative from above
        step = np.eye(point.size)[n] * (0.01 * steps[n] if at_zero else 0.1 * steps[n])
        upper, lower = parts(plain, point + step), parts(plain, point if at_zero else point - step)
        for log in range(2):
            wanted = (upper[log][0] - lower[log][0]) / (step[n] if at_zero else 2.0 * step[n]) / SPREAD
            wanted = np.where(held[log], wanted, 0.0)
            size = np.abs(wanted).max(axis=0)
            assert size.max() > 0.0 or (terms <= n < terms + 10)
            assert_allclose(found[log][:, :, n], wanted, rtol=0.0, atol=2e-4 * size.max() + 1e-9, err_msg=f"{n} {log}")


def test_a_frozen_effect_still_depends_on_the_motion() -> None:
    """Its values are no free parameters, but the other columns are the same as with the free effect."""
    effects = (LIFTED, SEPARATING)
    model, manoeuvre = flown(effects)
    likelihood = Likelihood(model, (manoeuvre,), model.entries[:10], False)
    start = [initial_state(manoeuvre.flight)]
    (free,) = likelihood.stretches(model.values, start, effects, SPREAD**2)
    (held,) = likelihood.stretches(model.values, start, [frozen(active) for active in effects], SPREAD**2)
    assert held.columns.shape[2] == 15
    assert_allclose(held.columns, free.columns[:, :, :15], rtol=1e-12)


def test_stretches_join(monkeypatch: pytest.MonkeyPatch) -> None:
    """A record that is cut into stretches has the columns of the whole."""
    model, manoeuvre = flown((SEPARATING, LIFTED))
    start = [initial_state(manoeuvre.flight)]
    likelihood = Likelihood(model, (manoeuvre,), model.entries[:10], False)
    (whole,) = likelihood.stretches(model.values, start, (SEPARATING, LIFTED), SPREAD**2)
    monkeypatch.setattr("aerosid.estimation.likelihood.STRETCH", 17)
    parts = list(likelihood.stretches(model.values, start, (SEPARATING, LIFTED), SPREAD**2))
    assert len(parts) == 6
    assert_allclose(np.concatenate([part.columns for part in parts]), whole.columns, rtol=1e-12, atol=1e-12)


def test_unbounded_sensitivities_are_not_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stalled flow can keep a diverging motion below the limit of alpha: no square of its columns is taken."""
    model, manoeuvre = flown((SEPARATING,))
    likelihood = Likelihood(model, (manoeuvre,), model.entries[:10], False)
    start, values = [initial_state(manoeuvre.flight)], np.array(model.values)
    assert likelihood.evaluate(values, start, (SEPARATING,), SPREAD**2) is not None
    monkeypatch.setattr("aerosid.estimation.motion_loop.RUNAWAY", 10.0)
    assert likelihood.evaluate(values, start, (SEPARATING,), SPREAD**2) is None
