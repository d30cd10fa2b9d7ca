"""Effects: operators against closed forms, the likelihood's columns against differences of independent simulations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.effects import fly_separating, fly_through_air
from oracles.flight import Airframe, dense_gaussian
from problems import LIGHT, NOISE, Problem, terms_of
from scipy.signal import lsim

from aerosid.effects import ActiveEffect, Effect, InputEffect, OutputEffect
from aerosid.effects.control import (
    control_deadband,
    control_delay,
    control_effects,
    control_lag,
    control_rate_limit,
)
from aerosid.effects.disturbance import gust
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.sensor import sensor_bias, sensor_delay, sensor_lag, sensor_scale
from aerosid.effects.step_change import step_change
from aerosid.estimation.effect_columns import with_moving_air, with_offsets
from aerosid.estimation.likelihood import Likelihood, Whitened
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import self_consistent
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.signals.delay_and_lag import deadbanded, delayed, delayed_linear, lagged, rate_limited
from aerosid.signals.noise import estimate_noise

Array = NDArray[np.float64]
UNEVEN = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.05, 80))
EVEN = 0.03 * np.arange(200)
WAVY = np.sin(2.0 * EVEN) + 0.3 * np.sign(np.sin(5.0 * EVEN))
SPREAD = np.array([NOISE.get(name, 1.0) for name in LONGITUDINAL.outputs])
START = np.array([99.9, 1.46, 0.0, 0.0146, 1500.0])


@pytest.mark.parametrize("delay", [0.0, 0.013, 0.2, -0.11])
def test_a_delayed_cubic_is_exact(delay: float) -> None:
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.7, 0.4])
    answer = delayed(UNEVEN, np.column_stack([cubic(UNEVEN), 3.0 * cubic(UNEVEN)]), delay)
    wanted = cubic(np.clip(UNEVEN - delay, UNEVEN[0], UNEVEN[-1]))
    assert_allclose(answer[:, 0], wanted, rtol=0.0, atol=1e-12)
    assert_allclose(answer[:, 1], 3.0 * wanted, rtol=0.0, atol=1e-12)


def test_a_delayed_input_keeps_its_corners() -> None:
    """A shift by whole samples moves samples; by half a sample, means of neighbours."""
    assert_allclose(delayed_linear(EVEN, WAVY, 0.09)[3:], WAVY[:-3], atol=1e-12)
    assert_allclose(delayed_linear(EVEN, WAVY, 0.015)[1:], 0.5 * (WAVY[1:] + WAVY[:-1]), atol=1e-12)
    assert (delayed_linear(EVEN, WAVY, 0.09)[:4] == WAVY[0]).all()


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        (sensor_bias("alpha", "rad", 1e-3), (0.02,)),
        (sensor_scale("q"), (1.2,)),
        (sensor_delay("alpha"), (0.1,)),
        (sensor_delay("alpha"), (-0.04,)),
        (sensor_lag("theta"), (0.3,)),
    ],
)
def test_a_corrected_record_is_the_sensors_input(effect: OutputEffect, values: tuple[float, ...]) -> None:
    """Of a smooth motion, once the lag's initial transient has decayed; NaN outside the record."""
    seen = 0.05 * np.sin(2.0 * EVEN) + 0.02 * np.cos(5.0 * EVEN)
    record = effect.output(EVEN, seen[:, None], values)[:, 0]
    corrected = effect.corrected(EVEN, record, values)
    inside = slice(70, -8)
    assert_allclose(corrected[inside], seen[inside], rtol=0.0, atol=2e-4)
    assert np.isnan(corrected).sum() == (0 if effect.kind != "sensor_delay" else np.ceil(abs(values[0]) / 0.03))


@pytest.mark.parametrize("constant", [0.004, 0.1, 3.0])
def test_a_lag_is_scipys_first_order_system(constant: float) -> None:
    system = ([[-1.0 / constant]], [[1.0 / constant]], [[1.0]], [[0.0]])
    _, wanted, _ = lsim(system, WAVY, EVEN, X0=[WAVY[0]], interp=True)
    assert_allclose(lagged(EVEN, WAVY[:, None], constant)[:, 0], wanted, rtol=0.0, atol=1e-10)


def test_a_lagged_ramp_on_uneven_samples_trails_by_its_constant() -> None:
    t = UNEVEN - UNEVEN[0]
    wanted = 2.0 + 3.0 * (t - 0.2 * (1.0 - np.exp(-t / 0.2)))
    assert_allclose(lagged(UNEVEN, (2.0 + 3.0 * t)[:, None], 0.2)[:, 0], wanted, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("samples", "shown"), [(1, 1.5), (10, 1.05)])
def test_a_rate_limit_counts_from_half_a_sampling_interval_on(samples: int, shown: float) -> None:
    # The fastest movement lasts so many intervals; its start and end between two samples are not recorded.
    time = 0.1 * np.arange(60.0)
    values = np.interp(np.arange(60.0), [20.0, 20.0 + samples], [0.0, 0.05])
    (limit,) = (e.parameters[0] for e in control_effects("delta_e", time, values) if e.kind == "control_rate_limit")
    fastest = 0.05 / (0.1 * samples)
    assert limit.null == pytest.approx(fastest)
    assert limit.null - limit.least == pytest.approx(fastest / shown)


def test_a_rate_limited_step_is_a_ramp_and_slow_signals_pass() -> None:
    step = np.where(EVEN < 1.0, 0.0, 0.6)
    first = int(np.argmax(step > 0.0)) - 1
    assert_allclose(rate_limited(EVEN, step, 0.5), np.clip(0.5 * (EVEN - EVEN[first]), 0.0, 0.6), atol=1e-12)
    assert_allclose(rate_limited(EVEN, np.sin(EVEN), 1.001), np.sin(EVEN), atol=1e-12)
    surface = [WAVY[0]]
    for before, wanted in zip(EVEN[1:] - EVEN[:-1], WAVY[1:], strict=True):
        away = wanted - surface[-1]
        surface.append(wanted if abs(away) <= 1.5 * before else surface[-1] + np.sign(away) * 1.5 * before)
    assert_allclose(rate_limited(EVEN, WAVY, 1.5), surface, atol=1e-12)


def test_a_dead_band_takes_its_width_from_every_excursion() -> None:
    ramp = 0.02 * EVEN  # its running median is itself, but at the ends
    inner = slice(4, -4)
    assert_allclose(deadbanded(ramp, 0.03)[inner], np.maximum(ramp - 0.03, 0.0)[inner], atol=2e-3)
    padded = np.concatenate([[WAVY[0]] * 2, WAVY, [WAVY[-1]] * 2])
    smooth = [np.median(padded[k : k + 5]) for k in range(WAVY.size)]
    wanted = []
    for value, middle in zip(WAVY, smooth, strict=True):
        excursion = middle - smooth[0]
        wanted.append(value - np.sign(excursion) * min(abs(excursion), 0.4))
    assert_allclose(deadbanded(WAVY, 0.4), wanted, atol=1e-12)
    step = np.where(EVEN < 1.0, 0.0, 0.6)
    assert_allclose(deadbanded(step, 0.2), np.where(EVEN < 1.0, 0.0, 0.4), atol=1e-12)  # its edge stays an edge


def test_the_neutral_position_of_a_dead_band_is_no_single_noisy_sample() -> None:
    """Else the surface within the band is off by the noise of the first sample: a step change of trim after a pulse."""
    time, noise = 0.03 * np.arange(400), 2e-4
    pulse = np.where((time > 1.0) & (time < 4.0), 0.04, 0.0)
    first = []
    for seed in range(50):
        recorded = pulse + noise * np.random.default_rng(seed).standard_normal(time.size)
        (band,) = (e for e in control_effects("delta_e", time, recorded) if e.kind == "control_deadband")
        surface = band.transform(time, recorded, (0.012,))
        first.append(np.median(surface[time > 4.2]) - (np.median(surface[(time > 1.2) & (time < 3.8)]) - 0.028))
    # 34 samples are at rest before the pulse; a median of the 92 within it has an error of its own.
    assert np.std(first) < 0.35 * noise


@pytest.mark.parametrize("constant", [0.01, 0.15, 0.6])
def test_white_noise_through_a_lag(constant: float) -> None:
    """Variance and memory are those of the impulse response, and of half a million samples of noise."""
    factor, memory = control_lag("delta_e").noise((constant,), 0.03)
    time = 0.03 * np.arange(2000)
    impulse = lagged(time, np.eye(1, 2000, 5)[0][:, None], constant)[:, 0]
    assert factor == pytest.approx(impulse @ impulse, rel=1e-9)
    assert memory == pytest.approx(impulse[1:] @ impulse[:-1] / (impulse @ impulse), rel=1e-9)
    long = 0.03 * np.arange(500_000)
    noise = lagged(long, np.random.default_rng(1).standard_normal((long.size, 1)), constant)[:, 0]
    # Neighbours hang together over at most 2 T/dt = 40 samples: the mean of the squares is good to 1 %.
    assert noise.var() == pytest.approx(factor, rel=0.04)
    assert np.mean(noise[1:] * noise[:-1]) / noise.var() == pytest.approx(memory, abs=0.02)


# The likelihood


@pytest.fixture(scope="module")
def flight() -> tuple[AerodynamicModel, Manoeuvre]:
    problem = Problem(duration=5.0, interval=0.05)
    model, manoeuvre = problem.prepared(problem.fly(seed=1))
    return with_offsets(model, LIGHT.coefficients), manoeuvre


def whitened(
    model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect], filtering: bool = False
) -> Whitened:
    likelihood = Likelihood(model, (manoeuvre,), model.entries[:10], filtering)
    (part,) = likelihood.stretches(model.values, [START], effects, SPREAD**2)
    return part


def flown_by_hand(
    model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect], point: Array
) -> Array:
    """Outputs (N, 8) with every effect written out again; `point`: ten terms, five states, the effects' parameters."""
    flight = manoeuvre.flight
    time, place = flight.time, model.columns.index("delta_e")
    inputs = np.zeros((time.size, len(model.columns)))
    inputs[:, : flight.inputs.shape[1]] = flight.inputs
    numbers = iter(point[15:])
    given = [[next(numbers) for _ in active.values] for active in effects]

    def lag(values: Array, constant: float) -> Array:
        system = ([[-1.0 / constant]], [[1.0 / constant]], [[1.0]], [[0.0]])
        return np.asarray(lsim(system, values, time - time[0], X0=[values[0]], interp=True)[1])

    for active, p in zip(effects, given, strict=True):
        kind = active.effect.kind
        if kind == "control_lag":
            inputs[:, place] = lag(inputs[:, place], p[0])
        elif kind == "control_delay":
            inputs[:, place] = np.interp(time - p[0], time, inputs[:, place])
        elif kind == "step_change":
            column = model.columns.index(f"offset_{active.effect.where}")
            inputs[:, column] += p[0] * np.clip((time - p[1]) / 0.05 + 0.5, 0.0, 1.0)
        elif kind == "control_rate_limit":
            inputs[:, place] = rate_limited(time, inputs[:, place], p[0])
        elif kind == "control_deadband":
            at_rest = 4.0 * float(estimate_noise(time, inputs[:, place]))
            inputs[:, place] = deadbanded(inputs[:, place], p[0], at_rest)
    moved = flight._replace(inputs=inputs, input_variance=np.zeros(len(model.columns) - 8))
    values = np.concatenate([point[:10], model.values[10:]])
    outputs, _ = simulate_outputs(point[10:15], moved, values, model.table, model.constants)
    for active, p in zip(effects, given, strict=True):
        kind = active.effect.kind
        if not kind.startswith("sensor"):
            continue
        i = LONGITUDINAL.outputs.index(active.effect.where)
        outputs[:, i] = {
            "sensor_bias": lambda y, n: y + n,
            "sensor_scale": lambda y, n: y * n,
            "sensor_lag": lag,
            "sensor_delay": lambda y, n: delayed(time, y[:, None], n)[:, 0],
        }[kind](outputs[:, i], p[0])
    return outputs


def slopes_of(function: Callable[[Array], Array], point: Array, steps: Array) -> Array:
    columns = []
    for n, step in enumerate(steps):
        shift = np.eye(point.size)[n] * step
        columns.append((function(point + shift) - function(point - shift)) / (2.0 * step))
    return np.stack(columns, axis=2)


STEP = ActiveEffect(step_change("C_m", 2.51, 0.05), (-0.015, 2.51), "flight")
SETS: dict[str, list[ActiveEffect]] = {
    "control_lag": [ActiveEffect(control_lag("delta_e"), (0.15,))],
    "control_delay": [ActiveEffect(control_delay("delta_e"), (0.12,))],
    "control_rate_limit": [ActiveEffect(control_rate_limit("delta_e", 2.4, 0.2), (0.1,))],
    "control_deadband": [ActiveEffect(control_deadband("delta_e", 0.06), (0.02,))],
    "sensor_bias": [ActiveEffect(sensor_bias("alpha", "rad", 0.0015), (0.02,))],
    "sensor_scale": [ActiveEffect(sensor_scale("q"), (1.08,))],
    "sensor_delay": [ActiveEffect(sensor_delay("alpha"), (0.103,))],
    "sensor_lag": [ActiveEffect(sensor_lag("a_z"), (0.1,))],
    "step_change": [STEP],
    "together": [
        ActiveEffect(sensor_scale("q"), (1.08,)),
        ActiveEffect(control_lag("delta_e"), (0.11,)),
        ActiveEffect(sensor_delay("q"), (0.07,)),
        STEP,
        ActiveEffect(sensor_bias("q", "rad/s", 0.001), (0.01,)),
        ActiveEffect(control_delay("delta_e"), (0.08,)),
        ActiveEffect(sensor_lag("q"), (0.1,)),
    ],
}


@pytest.mark.parametrize("name", SETS)
def test_columns_are_the_sensitivities_of_the_simulation(flight: tuple[AerodynamicModel, Manoeuvre], name: str) -> None:
    """Those of terms and initial states pass through the sensors' effects too, and one effect through the next."""
    model, manoeuvre = flight
    effects = SETS[name]
    part = whitened(model, manoeuvre, effects)
    point = np.concatenate([model.values[:10], START, *(active.values for active in effects)])
    assert_allclose(part.predicted, flown_by_hand(model, manoeuvre, effects, point), rtol=0.0, atol=1e-9)
    numbers = [parameter.step for active in effects for parameter in active.effect.parameters]
    steps = np.array([*(1e-4 * (1.0 + np.abs(model.values[:10]))), 1e-2, 1e-2, 1e-4, 1e-4, 1e-1, *numbers])
    wanted = slopes_of(lambda p: flown_by_hand(model, manoeuvre, effects, p), point, steps)
    held = np.isfinite(manoeuvre.flight.measured)
    wanted = np.where(held[:, :, None], wanted / SPREAD[None, :, None], 0.0)
    for n in range(point.size):
        size = np.abs(wanted[:, :, n]).max()
        assert size > 0.0
        assert_allclose(part.columns[:, :, n], wanted[:, :, n], rtol=0.0, atol=2e-3 * size, err_msg=str(n))


def test_columns_of_tested_effects_are_those_of_acting_effects(flight: tuple[AerodynamicModel, Manoeuvre]) -> None:
    """At an effect's null values, the score test's column is the fit's."""
    model, manoeuvre = flight
    effects: list[Effect] = [control_lag("delta_e"), sensor_scale("q"), step_change("C_m", 2.51, 0.05)]
    nulls = [ActiveEffect(effect, tuple(p.null for p in effect.parameters)) for effect in effects]
    likelihood = Likelihood(model, (manoeuvre,), model.entries[:10], False)
    (tested,) = likelihood.stretches(model.values, [START], (), SPREAD**2, nulls)
    acting = whitened(model, manoeuvre, nulls)
    assert_allclose(tested.residual, acting.residual, atol=1e-9)
    assert_allclose(tested.columns, acting.columns, atol=1e-9 * np.abs(acting.columns).max())


SEPARATION = {"alpha_star": 0.10, "sharpness": 25.0, "delay": 0.15, "relaxation": 0.2, "C_X": -0.05, "C_m": -0.03}
SEPARATING = ActiveEffect(flow_separation(0.1, "C_Z", ("C_X", "C_m")), tuple(SEPARATION.values()))


def test_separation_is_that_of_a_sixth_state(flight: tuple[AerodynamicModel, Manoeuvre]) -> None:
    """The separation point integrated with the motion, against simulation and separation that follow each other."""
    problem = Problem(duration=3.5, interval=0.02, amplitude=-0.08)
    _, manoeuvre = problem.prepared(problem.fly(seed=1))
    model, _ = flight
    inputs = np.zeros((manoeuvre.flight.time.size, len(model.columns)))
    inputs[:, :9] = manoeuvre.flight.inputs
    wide = manoeuvre.flight._replace(inputs=inputs, input_variance=np.zeros(len(model.columns) - 8))
    values = np.array(model.values)
    acting, _ = self_consistent(model, wide, values, START, [SEPARATING])
    outputs, _ = simulate_outputs(START, acting, values, model.table, model.constants)
    attached, _ = simulate_outputs(START, wide, values, model.table, model.constants)
    driving = {"rho": LIGHT.density, "mass": LIGHT.mass, "thrust": inputs[:, 1], "delta_e": inputs[:, 8]}
    terms = {key: value for key, value in terms_of(model).items() if not key[1].startswith("offset")}
    wanted, point = fly_separating(START, wide.time, driving, terms, FRAME, SEPARATION)
    assert point.min() < 0.5 < 0.95 < point.max()
    for i, name in enumerate(LONGITUDINAL.outputs):
        effect = np.abs(wanted[:, i] - attached[:, i]).max()
        assert_allclose(outputs[:, i], wanted[:, i], rtol=0.0, atol=0.03 * effect, err_msg=name)


def test_columns_of_a_separating_flow(flight: tuple[AerodynamicModel, Manoeuvre]) -> None:
    """Together with a sensor's effect, with respect to terms, initial state and all seven parameters."""
    model, manoeuvre = flight
    star = float(np.nanmax(manoeuvre.flight.measured[:, 1])) - 0.01
    numbers = (star, 25.0, 0.15, 0.2, -0.05, -0.03)
    effects = [replace(SEPARATING, values=numbers), ActiveEffect(sensor_scale("q"), (1.08,))]
    part = whitened(model, manoeuvre, effects)

    def predicted(point: Array) -> Array:
        moved = model.with_values(np.concatenate([point[:10], model.values[10:]]))
        likelihood = Likelihood(moved, (manoeuvre,), (), False)
        acting = [replace(effects[0], values=tuple(point[15:21])), replace(effects[1], values=(point[21],))]
        (found,) = likelihood.stretches(moved.values, [point[10:15]], acting, SPREAD**2)
        return found.predicted

    point = np.concatenate([model.values[:10], START, numbers, [1.08]])
    steps = np.array([*(1e-3 * (1.0 + np.abs(model.values[:10]))), 1e-2, 1e-2, 1e-4, 1e-4, 1e-1])
    steps = np.concatenate([steps, [1e-4, 0.05, 2e-3, 2e-3, 1e-4, 1e-4, 1e-3]])
    wanted = slopes_of(predicted, point, steps)
    held = np.isfinite(manoeuvre.flight.measured)
    wanted = np.where(held[:, :, None], wanted / SPREAD[None, :, None], 0.0)
    for n in range(point.size):
        size = np.abs(wanted[:, :, n]).max()
        assert size > 0.0
        assert_allclose(part.columns[:, :, n], wanted[:, :, n], rtol=0.0, atol=0.02 * size, err_msg=str(n))


# Coloured noise


@pytest.mark.parametrize("sensor", [None, sensor_lag("alpha"), sensor_scale("q")])
def test_coloured_noise_is_whitened_as_by_the_dense_gaussian(sensor: OutputEffect | None) -> None:
    """Gust and lagged elevator noise together, all samples in one covariance; a slow sensor lags them too."""
    problem = Problem(duration=1.2, interval=0.05)
    plain, manoeuvre = problem.prepared(problem.fly(seed=4))
    model = with_moving_air(plain)
    measured = manoeuvre.flight.measured.copy()
    measured[np.random.default_rng(0).random(measured.shape) < 0.1] = np.nan
    own = manoeuvre.flight._replace(measured=measured, input_variance=np.array([0.004**2]))
    manoeuvre = replace(manoeuvre, flight=own)
    faults = [] if sensor is None else [ActiveEffect(sensor, (0.3 if sensor.kind == "sensor_lag" else 1.4,))]
    effects = [ActiveEffect(control_lag("delta_e"), (0.1,)), ActiveEffect(gust(), (0.8, 150.0)), *faults]
    likelihood = Likelihood(model, (manoeuvre,), model.entries)
    (part,) = likelihood.stretches(model.values, [START], effects, SPREAD**2)
    by_hand = [ActiveEffect(control_lag("delta_e"), (0.1,)), *faults]
    assert_allclose(part.predicted, flown_by_hand_all(model, manoeuvre, by_hand), atol=1e-9)

    time, held = own.time, np.isfinite(measured)
    samples = time.size
    surface = lagged(time, own.inputs[:, 8:9], 0.1)[:, 0]

    def sensed(result: Array) -> Array:
        for fault in faults:
            i = LONGITUDINAL.outputs.index(fault.effect.where)
            assert isinstance(fault.effect, OutputEffect)
            result[:, i] = fault.effect.output(time, result[:, i : i + 1], fault.values)[:, 0]
        return result[held]

    def outputs(errors: Array) -> Array:
        inputs = own.inputs.copy()
        inputs[:, 8] = surface + errors
        moved = own._replace(inputs=inputs, input_variance=np.zeros(1))
        result, _ = simulate_outputs(START, moved, np.array(plain.values), plain.table, plain.constants)
        return sensed(result)

    by_elevator = jacobian(outputs, np.zeros(samples), 1e-4)
    by_air = jacobian(lambda air: sensed(through_air(plain, own, surface, air)), np.zeros(samples), 1e-2)
    factor, memory = control_lag("delta_e").noise((0.1,), 0.05)
    apart = np.abs(np.arange(samples)[:, None] - np.arange(samples))
    airspeed = float(np.nanmean(measured[:, 0]))
    covariance = np.diag(np.broadcast_to(SPREAD**2, held.shape)[held])
    covariance += factor * 0.004**2 * by_elevator @ memory**apart @ by_elevator.T
    covariance += 0.8**2 * by_air @ np.exp(-airspeed * 0.05 * apart / 150.0) @ by_air.T
    residual = (measured - part.predicted)[held]
    columns = unwhitened(model, manoeuvre, by_hand)[held]
    wanted = dense_gaussian(residual, covariance, columns)
    white = part.residual[held]
    assert white @ white == pytest.approx(wanted.squares, rel=3e-3)
    assert part.log_sum == pytest.approx(wanted.log_determinant, abs=0.3)
    flat = part.columns[held][:, : columns.shape[1]]
    scale = np.sqrt(np.diag(wanted.information))
    assert_allclose(flat.T @ flat / np.outer(scale, scale), wanted.information / np.outer(scale, scale), atol=5e-3)


FRAME = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, LIGHT.airspeed, 100.0)


def through_air(model: AerodynamicModel, flight: Flight, surface: Array, air: Array) -> Array:
    driving = {"rho": LIGHT.density, "mass": LIGHT.mass, "thrust": flight.inputs[:, 1], "delta_e": surface}
    return fly_through_air(START, flight.time, driving, terms_of(model), FRAME, air, substeps=1)


def jacobian(function: Callable[[Array], Array], at: Array, step: float) -> Array:
    columns = [(function(at + row) - function(at - row)) / (2.0 * step) for row in step * np.eye(at.size)]
    return np.array(columns).T


def flown_by_hand_all(model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]) -> Array:
    point = np.concatenate([model.values[:10], START, *(active.values for active in effects)])
    return flown_by_hand(model, manoeuvre, effects, point)


def unwhitened(model: AerodynamicModel, manoeuvre: Manoeuvre, effects: Sequence[ActiveEffect]) -> Array:
    """Sensitivities of the outputs to the terms, the initial state and the effects' parameters, (N, 8, M)."""
    point = np.concatenate([model.values[:10], START, *(active.values for active in effects)])
    numbers = [parameter.step for active in effects for parameter in active.effect.parameters]
    steps = np.array([*(1e-4 * (1.0 + np.abs(model.values[:10]))), 1e-2, 1e-2, 1e-4, 1e-4, 1e-1, *numbers])
    return slopes_of(lambda p: flown_by_hand(model, manoeuvre, effects, p), point, steps)


def test_a_gust_does_not_change_the_mean(flight: tuple[AerodynamicModel, Manoeuvre]) -> None:
    """It increases the covariance of the residual, not the simulation or its sensitivities before whitening."""
    model, manoeuvre = flight
    calm = whitened(with_moving_air(model), manoeuvre, [])
    shaken = [ActiveEffect(gust(), (3.0, 200.0))]
    still = whitened(with_moving_air(model), manoeuvre, shaken)
    assert (still.predicted == calm.predicted).all()
    assert_allclose(still.columns, calm.columns, atol=0.0)
    met = whitened(with_moving_air(model), manoeuvre, shaken, filtering=True)
    assert (met.predicted == calm.predicted).all()
    assert met.log_sum > calm.log_sum + 100.0
    assert np.nansum(met.residual**2) < np.nansum(calm.residual**2)


def test_an_input_effect_may_act_on_a_column_of_its_own() -> None:
    assert isinstance(STEP.effect, InputEffect)
    assert (STEP.effect.where, STEP.effect.where_acts) == ("C_m", "offset_C_m")
