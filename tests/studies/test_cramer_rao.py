"""The Cramer-Rao bound of the studies: against a dense oracle, against the estimator, and with autocorrelated noise."""

from dataclasses import replace

import numpy as np
import pytest
from lateral_problems import PITCH, SIDE, commuter
from numpy.typing import NDArray
from oracles.flight import Airframe, simulate
from oracles.rigid_body import Body
from oracles.rigid_body import simulate as rigid_body_flight
from problems import LIGHT, Problem, entry
from scipy.integrate import solve_ivp
from scipy.linalg import toeplitz

from aerosid.aircraft.declared_model import declared_model
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre, prepare
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, state_vector
from aerosid.flight_model.flight import Flight
from aerosid.logs.flight_log import FlightLog
from aerosid.signals.stationary_noise import StationaryNoise
from aerosid.studies.cramer_rao import Sensitivity, sensitivity
from aerosid.studies.many_flights import fly_many
from aerosid.studies.monte_carlo.noise_draw import redrawn

Array = NDArray[np.float64]
MEASURED = ("V", "alpha", "q", "theta", "a_x", "a_z")
ELEVATOR = 2e-4


def true_flight(samples: int, interval: float) -> tuple[AerodynamicModel, Manoeuvre, Array]:
    problem = Problem(duration=samples * interval, interval=interval)
    log = replace(problem, noise=dict.fromkeys((*MEASURED, "delta_e"), 0.0)).fly()
    model = problem.truth
    manoeuvre = prepare(log, LIGHT, model.columns)
    V, alpha, q, theta = (log[name][0] for name in ("V", "alpha", "q", "theta"))
    return model, manoeuvre, np.array([V * np.cos(alpha), V * np.sin(alpha), q, theta, 0.0])


def white(manoeuvre: Manoeuvre, snr: float) -> tuple[Array, Array]:
    """Autocovariances (p, p, N) of white noise, and its variances (8,) in the order of LONGITUDINAL.outputs."""
    measured = manoeuvre.flight.measured
    variance = np.ones(8)
    noise = np.zeros((len(MEASURED), len(MEASURED), manoeuvre.flight.time.size))
    for i, name in enumerate(manoeuvre.outputs):
        place = LONGITUDINAL.outputs.index(name)
        variance[place] = noise[i, i, 0] = (np.std(measured[:, place]) / snr) ** 2
    return noise, variance


def test_many_flights_at_once_are_the_solutions_of_the_equations() -> None:
    """Lift and drag, alpha_dot_hat, lateral motion, sensors off the centre of gravity: against scipy's integrator."""
    rng = np.random.default_rng(3)
    model, manoeuvre, start = true_flight(14, 0.1)
    model = model.extended([entry(*pair) for pair in (("C_L", "alpha"), ("C_D", "C_L^2"), ("C_m", "alpha_dot_hat"))])
    values = np.stack([model.values, model.values * 1.02], axis=1)
    values[-3:] = [[0.3, 0.25], [2.4, 2.5], [-6.0, -5.0]]
    flight = manoeuvre.flight
    inputs = flight.inputs.copy()
    inputs[:, 4:8] = 0.05 * rng.standard_normal((flight.time.size, 4))
    positions = np.zeros((8, 3))
    positions[1], positions[4], positions[5] = (3.0, 0.4, -0.2), (1.0, 0.5, 0.3), (-2.0, 0.2, 0.6)
    manoeuvre = replace(manoeuvre, flight=flight._replace(inputs=inputs, positions=positions))
    extra = np.stack([inputs[:, 8:], inputs[:, 8:] + 0.002], axis=2)
    found = fly_many(model, manoeuvre, values, np.stack([start, start + 0.1], axis=1), extra)
    frame = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, LIGHT.airspeed, 100.0)
    names = dict(zip(("rho", "thrust", "mass", "speed_of_sound", "phi", "p", "r", "beta"), inputs.T, strict=False))
    at = {"alpha": positions[1], "a_x": positions[4], "a_z": positions[5]}
    for k, begin in enumerate((start, start + 0.1)):
        terms = {(c, str(t)): float(v) for (c, t), v in zip(model.entries, values[:, k], strict=True)}
        _, outputs = simulate(begin, flight.time, {**names, "delta_e": extra[:, 0, k]}, terms, frame, at)
        scale = np.maximum(np.abs(outputs).max(axis=0), 1e-3)
        assert np.max(np.abs(found[:, :, k] - outputs) / scale) < 2e-7


def doublet_flights(unknown: Array, time: Array, fixed: Array, values: dict[tuple[str, str], float]) -> Array:
    """Outputs (6 N, K) of K flights by the paper's equations (33)-(36), written out, all in one run of scipy's solver.

    `unknown` (7 + N, K): C_m_alpha, C_m_q, C_Z_alpha, u, w, q, theta at the start, then the elevator at the samples.
    """
    rho, thrust, mass = fixed
    cm_alpha, cm_q, cz_alpha = unknown[:3]
    count = unknown.shape[1]

    def forces(x: Array, elevator: Array) -> tuple[Array, Array, Array]:
        u, w, q, _ = x
        alpha, pressure = np.arctan2(w, u), 0.5 * rho * (u**2 + w**2) * LIGHT.wing_area
        hat = q * LIGHT.mean_chord / 200.0
        c_x = values["C_X", "1"] + values["C_X", "alpha"] * alpha
        c_z = values["C_Z", "1"] + cz_alpha * alpha + values["C_Z", "q_hat"] * hat
        c_m = values["C_m", "1"] + cm_alpha * alpha + cm_q * hat + values["C_m", "delta_e"] * elevator
        c_z = c_z + values["C_Z", "delta_e"] * elevator
        moment = pressure * LIGHT.mean_chord * c_m / LIGHT.I_yy
        return (pressure * c_x + thrust) / mass, pressure * c_z / mass, moment

    def rates(t: float, flat: Array) -> Array:
        x = flat.reshape(4, count)
        k = min(int(np.searchsorted(time, t, side="right")) - 1, time.size - 2)
        share = (t - time[k]) / (time[k + 1] - time[k])
        a_x, a_z, moment = forces(x, (1.0 - share) * unknown[7 + k] + share * unknown[8 + k])
        u, w, q, theta = x
        gravity_x, gravity_z = -9.80665 * np.sin(theta), 9.80665 * np.cos(theta)
        return np.concatenate([a_x + gravity_x - q * w, a_z + gravity_z + q * u, moment, q])

    x = unknown[3:7].ravel()
    rows = []
    for k in range(time.size):
        u, w, q, theta = x.reshape(4, count)
        a_x, a_z, _ = forces(x.reshape(4, count), unknown[7 + k])
        rows.append([np.hypot(u, w), np.arctan2(w, u), q, theta, a_x, a_z])
        if k + 1 < time.size:
            x = solve_ivp(rates, (time[k], time[k + 1]), x, method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    return np.array(rows).transpose(1, 0, 2).reshape(-1, count)


def test_the_bound_is_a_dense_gaussians() -> None:
    """Central differences of scipy's solver on equations of the test's own, one dense covariance, one inverse."""
    samples = 40
    model, manoeuvre, start = true_flight(samples, 0.08)
    free = [entry("C_m", "alpha"), entry("C_m", "q_hat"), entry("C_Z", "alpha")]
    flight = manoeuvre.flight
    values = {(c, str(t)): float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}
    at = np.concatenate([[model.value(e) for e in free], start[:4], flight.inputs[:, 8]])
    steps = np.concatenate([[1e-4, 1e-3, 1e-4], [1e-2, 1e-2, 1e-4, 1e-4], np.full(samples, 1e-4)])
    sides = np.concatenate([at[:, None] + np.diag(steps), at[:, None] - np.diag(steps)], axis=1)
    outputs = doublet_flights(sides, flight.time, flight.inputs[0, :3], values)
    slopes = (outputs[:, : at.size] - outputs[:, at.size :]) / (2.0 * steps)
    noise, _ = white(manoeuvre, 20.0)
    covariance = np.diag(np.repeat(np.diagonal(noise[:, :, 0]), samples))
    covariance += ELEVATOR**2 * slopes[:, 7:] @ slopes[:, 7:].T
    expected = np.sqrt(np.diag(np.linalg.inv(slopes[:, :7].T @ np.linalg.solve(covariance, slopes[:, :7]))))[:3]
    held = sensitivity(model, manoeuvre, start, free, np.array([True]))
    assert held is not None
    np.testing.assert_allclose(held.bound(noise, np.array([ELEVATOR**2])), expected, rtol=1e-4)
    quiet = slopes[:, :7].T / np.repeat(np.diagonal(noise[:, :, 0]), samples)
    silent = np.sqrt(np.diag(np.linalg.inv(quiet @ slopes[:, :7])))
    np.testing.assert_allclose(held.bound(noise, np.zeros(1)), silent[:3], rtol=1e-4)
    assert np.all(silent[:3] < 0.999 * expected)


def test_the_estimators_information_at_the_truth_gives_the_same_bound() -> None:
    model, manoeuvre, start = true_flight(250, 0.03)
    noise, variance = white(manoeuvre, 10.0)
    held = sensitivity(model, manoeuvre, start, model.entries, np.array([True]))
    assert held is not None
    flight = manoeuvre.flight._replace(input_variance=np.array([ELEVATOR**2]))
    likelihood = Likelihood(model, (replace(manoeuvre, flight=flight),), model.entries)
    columns = [part.columns.reshape(-1, 15) for part in likelihood.stretches(model.values, [start], (), variance)]
    triangle = np.linalg.qr(np.vstack(columns)[:, :14], mode="r")
    expected = np.linalg.norm(np.linalg.inv(triangle), axis=1)[: len(model.entries)]
    np.testing.assert_allclose(held.bound(noise, np.array([ELEVATOR**2])), expected, rtol=1e-4)
    assert np.all(held.bound(noise, np.array([0.0])) <= expected * (1.0 + 1e-4))


def test_noise_with_memory_bounds_as_white_noise_after_its_filter() -> None:
    """Exact: differences of neighbouring samples weighted by the correlation are white, with the first sample kept."""
    rho = 0.8
    model, manoeuvre, start = true_flight(120, 0.05)
    noise, _ = white(manoeuvre, 20.0)
    coloured = noise[:, :, :1] * rho ** np.arange(120.0)
    held = sensitivity(model, manoeuvre, start, model.entries, np.array([False]))
    assert held is not None
    slopes = held.unknown.transpose(1, 0, 2)[:, :, :14]
    filtered = np.concatenate([slopes[:, :1], (slopes[:, 1:] - rho * slopes[:, :-1]) / np.sqrt(1.0 - rho**2)], axis=1)
    scaled = filtered / np.sqrt(np.diagonal(noise[:, :, 0]))[:, None, None]
    triangle = np.linalg.qr(scaled.reshape(-1, 14), mode="r")
    expected = np.linalg.norm(np.linalg.inv(triangle), axis=1)[: len(model.entries)]
    np.testing.assert_allclose(held.bound(coloured, np.zeros(0)), expected, rtol=1e-6)


def test_there_is_no_bound_without_noise() -> None:
    model, manoeuvre, start = true_flight(60, 0.05)
    noise, _ = white(manoeuvre, 20.0)
    held = sensitivity(model, manoeuvre, start, model.entries, np.array([False]))
    assert held is not None
    with pytest.raises(ValueError, match="without noise"):
        held.bound(np.zeros_like(noise), np.zeros(0))


def dense_covariance(noise: Array) -> Array:
    """(p N, p N), output by output, of the autocovariances (p, p, N)."""
    outputs = range(noise.shape[0])
    return np.block([[toeplitz(noise[j, i], noise[i, j]) for j in outputs] for i in outputs])


def dense_bound(found: Sensitivity, noise: Array, by_input: Array | None = None) -> Array:
    """One dense covariance, one inverse; `by_input` (N, p, E N) times the inputs' deviation."""
    unknown = found.unknown
    moving = np.any(unknown != 0.0, axis=(0, 1))
    columns = unknown[:, :, moving].transpose(1, 0, 2).reshape(-1, int(moving.sum()))
    covariance = dense_covariance(noise)
    if by_input is not None:
        disturbed = by_input.transpose(1, 0, 2).reshape(columns.shape[0], -1)
        covariance += disturbed @ disturbed.T
    held = found.held.T.ravel()
    columns, covariance = columns[held], covariance[np.ix_(held, held)]
    size = np.linalg.norm(columns, axis=0)
    information = (columns / size).T @ np.linalg.solve(covariance, columns / size)
    return np.asarray((np.sqrt(np.diag(np.linalg.inv(information))) / size)[: found.derivatives])


def by_every_sample(model: AerodynamicModel, manoeuvre: Manoeuvre, state: Array, places: list[int]) -> Array:
    """Outputs (N, p, N) by each sample of the elevator: two whole flights per sample."""
    inputs, samples = manoeuvre.flight.inputs[:, 8:], manoeuvre.flight.time.size
    moves = 1e-5 * np.eye(samples)[:, None, :]
    extra = np.concatenate([inputs[:, :, None] + moves, inputs[:, :, None] - moves], axis=2)
    flown = fly_many(
        model, manoeuvre, np.tile(model.values[:, None], 2 * samples), np.tile(state[:, None], 2 * samples), extra
    )[:, places]
    return np.asarray((flown[:, :, :samples] - flown[:, :, samples:]) / 2e-5)


def with_gaps(manoeuvre: Manoeuvre, seed: int) -> Manoeuvre:
    """A tenth of the samples of each output missing, and all samples of one output for a while."""
    measured = manoeuvre.flight.measured.copy()
    measured[np.random.default_rng(seed).random(measured.shape) < 0.1] = np.nan
    measured[20:35, 2] = np.nan
    return replace(manoeuvre, flight=manoeuvre.flight._replace(measured=measured))


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_noisy_inputs_bound_as_the_dense_covariance_of_what_they_cause(memory: float) -> None:
    """Non-uniform sampling, missing samples, white and autocorrelated noise of the outputs."""
    samples = 90
    model, manoeuvre, start = true_flight(samples, 0.06)
    time = manoeuvre.flight.time + 0.02 * np.random.default_rng(1).random(samples)
    noise, _ = white(manoeuvre, 40.0)
    manoeuvre = with_gaps(replace(manoeuvre, flight=manoeuvre.flight._replace(time=time)), 2)
    noise = noise[:, :, :1] * memory ** np.arange(float(samples))
    found = sensitivity(model, manoeuvre, start, model.entries, np.array([True]))
    assert found is not None
    places = [LONGITUDINAL.outputs.index(name) for name in manoeuvre.outputs]
    expected = dense_bound(found, noise, 10.0 * ELEVATOR * by_every_sample(model, manoeuvre, start, places))
    np.testing.assert_allclose(found.bound(noise, np.array([(10.0 * ELEVATOR) ** 2])), expected, rtol=1e-5)
    assert np.max(expected / dense_bound(found, noise)) > 1.8  # the inputs' noise matters here


def test_noise_drawn_again_bounds_as_its_dense_covariance() -> None:
    """Channels with cross-correlated and autocorrelated noise, and missing samples."""
    samples = 240
    model, manoeuvre, start = true_flight(samples, 0.05)
    manoeuvre = with_gaps(manoeuvre, 4)
    generator = np.random.default_rng(5)
    shared = np.convolve(generator.standard_normal(samples + 40), np.exp(-np.arange(40) / 8.0), "valid")[:samples]
    own = generator.standard_normal((samples, len(MEASURED)))
    source, deviation = redrawn((0.5 * shared[:, None] + own) * [0.1, 1e-3, 1e-3, 1e-3, 0.02, 0.05])
    noise = np.multiply.outer(deviation, deviation)[:, :, None] * source.autocovariance(samples, len(MEASURED))
    assert np.max(np.abs(noise[0, 1])) > 0.1 * deviation[0] * deviation[1]
    found = sensitivity(model, manoeuvre, start, model.entries, np.array([False]))
    assert found is not None
    np.testing.assert_allclose(found.bound(noise, np.zeros(0)), dense_bound(found, noise), rtol=1e-5)


def test_noise_that_is_not_possible_has_no_inverse() -> None:
    impossible = np.zeros((1, 1, 30))
    impossible[0, 0, :2] = 1.0, 0.9  # neighbours correlated, more distant samples not at all
    with pytest.raises(ValueError, match="positive definite"):
        StationaryNoise(impossible, np.ones((1, 30), dtype=bool)).solve(np.ones((1, 30, 1)))


@pytest.mark.slow
def test_white_noise_is_least_squares_at_any_length() -> None:
    """1500 samples, 9000 numbers: more than the limit of a dense covariance."""
    model, manoeuvre, start = true_flight(1500, 0.02)
    noise, variance = white(manoeuvre, 20.0)
    found = sensitivity(model, manoeuvre, start, [entry("C_m", "alpha"), entry("C_Z", "alpha")], np.array([True]))
    assert found is not None
    deviation = np.sqrt(variance[[LONGITUDINAL.outputs.index(name) for name in manoeuvre.outputs]])
    columns = (found.unknown[:, :, :6] / deviation[:, None]).reshape(-1, 6)
    expected = np.linalg.norm(np.linalg.inv(np.linalg.qr(columns, mode="r")), axis=1)[:2]
    np.testing.assert_allclose(found.bound(noise, np.zeros(1)), expected, rtol=1e-6)
    assert np.all(found.bound(noise, np.array([ELEVATOR**2])) > expected)


@pytest.mark.parametrize("values", [SIDE, PITCH | SIDE], ids=["lateral", "six"])
def test_many_lateral_flights_at_once_are_those_of_the_suites_equations(values: dict[str, dict[str, float]]) -> None:
    """Turning, sideslipping flight, sensors off the centre of gravity: by vectors and matrices and scipy's solver."""
    rng = np.random.default_rng(5)
    aircraft = commuter(values)
    model, axes = declared_model(aircraft, 72.0), aircraft.axes
    time = 0.05 * np.arange(13)
    given = {"rho": 1.02, "thrust": 5000.0, "mass": 4650.0, "speed_of_sound": 340.0}
    given |= {"V": 72.0 + np.sin(3.0 * time), "alpha": 0.03, "q": 0.02, "theta": 0.04}
    given |= {name: 0.05 * rng.standard_normal(time.size) for name in model.extra_columns}
    inputs = np.column_stack([np.broadcast_to(given.get(name, 0.0), time.shape) for name in model.columns])
    positions = 0.5 * rng.standard_normal((len(axes.outputs), 3))
    none = np.full((time.size, len(axes.outputs)), np.nan)
    flight = Flight(time, inputs, none, positions, 1, np.zeros(len(model.extra_columns)))
    log = FlightLog("f", time, {}, {})
    manoeuvre = Manoeuvre(log, flight, model.columns, axes.outputs, none[0], (), axes=axes)
    motion = {"u": 71.9, "v": 3.0, "w": 2.1, "p": 0.2, "q": 0.03, "r": -0.1, "phi": 0.3, "theta": 0.05, "h": 9.0}
    start = state_vector(axes, motion)
    extra = inputs[:, len(model.columns) - len(model.extra_columns) :]
    found = fly_many(
        model, manoeuvre, np.column_stack([model.values, 1.05 * model.values]),
        np.column_stack([start, start]), np.stack([extra, extra], axis=2),
    )  # fmt: skip
    body = Body(
        39.0, 1.98, 19.8, (27500.0, 32600.0, 51000.0, 1600.0), None, 72.0,
        positions=dict(zip(axes.outputs, positions, strict=True)),
    )  # fmt: skip
    channels = dict(zip(model.columns, inputs.T, strict=True))
    for k, factor in enumerate((1.0, 1.05)):
        terms = {(c, str(t)): factor * float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}
        _, seen = rigid_body_flight(axes.integrated, start, time, channels, terms, body)
        wanted = np.array([[np.real(sample[name]) for name in axes.outputs] for sample in seen])
        scale = np.maximum(np.abs(wanted).max(axis=0), 1e-3)
        assert np.max(np.abs(found[:, :, k] - wanted) / scale) < 1e-6
