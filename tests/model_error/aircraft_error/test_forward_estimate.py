"""The model-error recursion on the aircraft against the differential equations (21)-(23) themselves, and its limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.flight import Airframe, central_difference, state_rates, van_loan
from problems import BOTH_SQUARES, LIGHT, NOISE, SILENT, Problem, declaring, entry
from scipy.linalg import solve_continuous_are

from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, equation_of
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.simulation import doublet, fly, trim
from aerosid.model_error.aircraft_error.forward_estimate import AircraftErrorHistory, estimate_aircraft_error

Array = NDArray[np.float64]
FRAME = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, LIGHT.airspeed, 100.0)
VARIANCE = np.array([NOISE[name] for name in ("V", "alpha", "q", "theta")]) ** 2
DENSITY = np.array([0.2, 30.0, 0.08, 0.0])


class Linearised:
    """The oracle's equations of u, w, q, theta, and their Jacobian by differences."""

    def __init__(self, model: AerodynamicModel, flight: Flight) -> None:
        self.terms = {(c, str(t)): float(v) for (c, t), v in zip(model.entries, model.values, strict=True)}
        self.flight = flight
        self.names = model.columns

    def inputs(self, t: float) -> dict[str, float]:
        columns = self.flight.inputs.T
        return {
            name: float(np.interp(t, self.flight.time, column))
            for name, column in zip(self.names, columns, strict=True)
        }

    def rates(self, t: float, x: Array) -> Array:
        return state_rates([*x, 0.0], self.inputs(t), self.terms, FRAME)[:4]

    def jacobian(self, t: float, x: Array) -> Array:
        return central_difference(lambda y: self.rates(t, y), x, np.array([1e-2, 1e-2, 1e-4, 1e-4]))


def weight_of(x: Array, variance: Array) -> Array:
    """R^-1 of u, w, q, theta for that of V, alpha, q, theta: the polar map's Jacobian, inverted."""
    speed = np.hypot(x[0], x[1])
    polar = np.array([[x[0] / speed, x[1] / speed], [-x[1] / speed**2, x[0] / speed**2]])
    weight = np.zeros((4, 4))
    weight[:2, :2] = polar.T @ np.diag(1.0 / variance[:2]) @ polar
    weight[2, 2], weight[3, 3] = 1.0 / variance[2:]
    return weight


def run(
    problem: Problem, seed: int = 0, density: Array = DENSITY
) -> tuple[AerodynamicModel, Manoeuvre, AircraftErrorHistory]:
    model, manoeuvre = problem.prepared(problem.fly(seed=seed))
    return model, manoeuvre, estimate_aircraft_error(model, manoeuvre.flight, VARIANCE, density)


def test_history_is_the_solution_of_the_estimators_differential_equations() -> None:
    """Eqs. (21)-(23) integrated as they stand, the record linear between samples, in a few hundred steps."""
    # A gentle input: in a step of the elevator the record is no straight line between samples.
    problem = Problem(undeclared=BOTH_SQUARES, amplitude=0.002, duration=3.0, interval=0.01)
    density = 0.003 * DENSITY  # at the full one the gain is so high that an explicit solution takes hours
    model, manoeuvre, found = run(problem, seed=1, density=density)
    oracle, flight = Linearised(model, manoeuvre.flight), manoeuvre.flight
    # The measured u and w follow from V and alpha; the estimator is not asked.
    speed, alpha, q, theta = flight.measured[:, :4].T
    measured = np.column_stack([speed * np.cos(alpha), speed * np.sin(alpha), q, theta])
    interval = problem.interval

    def slope(t: float, point: Array, f_x: Array) -> Array:
        x, riccati = point[:4], point[4:].reshape(4, 4)
        y = np.array([np.interp(t, flight.time, column) for column in measured.T])
        weight = weight_of(y, VARIANCE) / interval
        x_dot = oracle.rates(t, x) + 2.0 * riccati @ weight @ (y - x)
        riccati_dot = f_x @ riccati + riccati @ f_x.T - 2.0 * riccati @ weight @ riccati + 0.5 * np.diag(density)
        return np.concatenate([x_dot, riccati_dot.ravel()])

    samples, substeps = 150, 5
    point = np.concatenate([found.states[0], found.riccati[0].ravel()])
    path = [point]
    step = interval / substeps
    for k in range((samples - 1) * substeps):
        t = k * step
        f_x = oracle.jacobian(t, point[:4])
        first = slope(t, point, f_x)
        second = slope(t + step / 2.0, point + step / 2.0 * first, f_x)
        third = slope(t + step / 2.0, point + step / 2.0 * second, f_x)
        fourth = slope(t + step, point + step * third, f_x)
        point = point + step / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        if (k + 1) % substeps == 0:
            path.append(point)
    states, riccati = np.array(path)[:, :4], np.array(path)[:, 4:].reshape(-1, 4, 4)
    correction = np.array(
        [
            2.0 * s @ weight_of(y, VARIANCE) / interval @ (y - x)
            for s, y, x in zip(riccati, measured[:samples], states, strict=True)
        ]
    )
    settled = slice(20, samples)  # where the wrong start is forgotten
    spread = np.sqrt(np.einsum("kii->ki", riccati))
    assert_allclose(((found.states[:samples] - states) / spread)[settled], 0.0, atol=0.15)
    relative = (found.riccati[:samples] - riccati) / (spread[:, :, None] * spread[:, None, :])
    assert_allclose(relative[settled], 0.0, atol=0.03)
    for i in range(3):
        error = (found.d[:samples, i] - correction[:, i])[settled]
        assert np.sqrt(np.mean(error**2)) < 0.06 * np.sqrt(np.mean(correction[settled, i] ** 2)), i
    assert_allclose(
        found.d[:samples, 3] / np.abs(found.d[:samples, 3]).max(),
        correction[:, 3] / np.abs(correction[:, 3]).max(),
        atol=0.2,
    )


def test_steady_riccati_matrix_is_half_the_kalman_bucy_filters() -> None:
    """P of the algebraic equation with R dt and the error density; Q1 = R^-1/dt and Q2^-1 = Q give S = P/2."""
    problem = Problem(elevator="none", duration=40.0, noise=SILENT)
    model, manoeuvre, found = run(problem)
    oracle = Linearised(model, manoeuvre.flight)
    x = found.states[-1]
    noise = np.linalg.inv(weight_of(x, VARIANCE)) * problem.interval
    wanted = solve_continuous_are(oracle.jacobian(40.0, x).T, np.eye(4), np.diag(DENSITY), noise) / 2.0
    spread = np.sqrt(np.diag(wanted))
    assert_allclose((found.riccati[-1] - wanted) / np.outer(spread, spread), 0.0, atol=2e-5)


def test_a_perfect_model_has_no_error() -> None:
    _, _, found = run(Problem(noise=SILENT))
    scale = np.abs(np.diff(found.states, axis=0)).max(axis=0) / 0.03
    assert np.abs(found.d / scale).max() < 1e-5
    assert np.abs(found.innovations).max() < 1e-5


@pytest.mark.parametrize("key", [("C_m", "alpha^2"), ("C_X", "alpha^2"), ("C_Z", "alpha^2"), ("C_m", "alpha*delta_e")])
@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_a_small_planted_term_leaves_its_picture_in_d(key: tuple[str, str], factor: float) -> None:
    """`responded` is the d of a unit term: fly a little of it, do not declare it, and compare."""
    size = 0.01
    problem = Problem(undeclared={key: size}, noise=SILENT)
    model, manoeuvre = problem.prepared(problem.fly())
    model = model.extended([entry(*key)])
    found = estimate_aircraft_error(model, manoeuvre.flight, VARIANCE, factor * DENSITY)
    picture = size * found.responded[:, :, model.index(entry(*key))]
    own = equation_of(LONGITUDINAL, key[0])
    error = found.d[:, own] - picture[:, own]
    assert np.sqrt(np.mean(error**2)) < 0.01 * np.sqrt(np.mean(picture[:, own] ** 2))


def test_theta_and_height_carry_no_error_where_their_density_is_zero() -> None:
    """Theta' = q is kinematics: its d is only what the coupled gain gives, far below noise taken for error."""
    _, _, found = run(Problem(undeclared=BOTH_SQUARES), seed=2)
    _, _, allowed = run(Problem(undeclared=BOTH_SQUARES), seed=2, density=np.array([0.2, 30.0, 0.08, 0.01]))
    assert np.std(found.d[50:, 3]) < 0.2 * np.std(allowed.d[50:, 3])
    assert found.states.shape[1] == found.d.shape[1] == 4


def test_a_gap_is_crossed_open_loop_and_s_grows_as_van_loan_says() -> None:
    problem = Problem(noise=SILENT)
    model, manoeuvre = problem.prepared(problem.fly())
    measured = manoeuvre.flight.measured.copy()
    gap = slice(60, 90)
    measured[gap, :4] = np.nan
    flight = manoeuvre.flight._replace(measured=measured)
    found = estimate_aircraft_error(model, flight, VARIANCE, DENSITY)
    assert np.isnan(found.d[gap]).all()
    assert np.isfinite(np.delete(found.d, np.arange(60, 90), axis=0)).all()
    speed, alpha = manoeuvre.flight.measured[:, 0], manoeuvre.flight.measured[:, 1]
    assert_allclose(found.states[:, 0], speed * np.cos(alpha), rtol=1e-6)
    oracle = Linearised(model, flight)
    for k in range(61, 88):
        transition, added = van_loan(oracle.jacobian(flight.time[k], found.states[k]), 0.5 * np.diag(DENSITY), 0.03)
        wanted = transition @ found.riccati[k] @ transition.T + added
        spread = np.sqrt(np.diag(wanted))
        assert_allclose((found.riccati[k + 1] - wanted) / np.outer(spread, spread), 0.0, atol=1e-7)


def test_one_channel_missing_leaves_the_others_to_speak() -> None:
    problem = Problem(undeclared=BOTH_SQUARES)
    model, manoeuvre, whole = run(problem, seed=3)
    measured = manoeuvre.flight.measured.copy()
    measured[:, 3] = np.nan
    without = estimate_aircraft_error(model, manoeuvre.flight._replace(measured=measured), VARIANCE, DENSITY)
    assert np.isfinite(without.d).all()
    assert np.corrcoef(without.d[30:, 2], whole.d[30:, 2])[0, 1] > 0.999
    measured = manoeuvre.flight.measured.copy()
    measured[::2, 1] = np.nan
    every_other = estimate_aircraft_error(model, manoeuvre.flight._replace(measured=measured), VARIANCE, DENSITY)
    assert np.corrcoef(every_other.d[30:, 2], whole.d[30:, 2])[0, 1] > 0.9


def sound(found: AircraftErrorHistory) -> None:
    """Finite, and S symmetric and positive definite at every sample."""
    assert np.isfinite(found.states).all()
    assert np.isfinite(found.d).all()
    assert_allclose(found.riccati, found.riccati.transpose(0, 2, 1), rtol=1e-9, atol=1e-300)
    spread = np.sqrt(np.einsum("kii->ki", found.riccati))
    scaled = found.riccati / (spread[:, :, None] * spread[:, None, :])
    assert np.linalg.eigvalsh(scaled).min() > 0.0


@pytest.mark.parametrize("interval", [0.001, 0.01, 0.1])
@pytest.mark.parametrize(
    "density", [(1e-6, 1e6, 1e-6, 1e6), (1e6, 1e-6, 1e6, 0.0), (1e-9, 1e-9, 1e-9, 1e-9), (1e6, 1e6, 1e6, 1e6)]
)
def test_any_weights_keep_s_positive_definite(interval: float, density: tuple[float, ...]) -> None:
    problem = Problem(undeclared=BOTH_SQUARES, interval=interval, duration=300 * interval if interval < 0.01 else 6.0)
    sound(run(problem, density=np.array(density))[2])


def test_an_hour_stays_finite_and_positive_definite() -> None:
    problem = Problem(duration=3600.0, interval=0.1)
    time = problem.time
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    elevator = sum(doublet(time, start, 1.0, 0.03) for start in np.arange(5.0, 3590.0, 40.0))
    log = fly(problem.truth, level, time, elevator, density=LIGHT.density, mass=LIGHT.mass, noise=NOISE, seed=1)
    flown = replace(LIGHT, thrust=level.thrust)
    model, manoeuvre = replace(problem, aircraft=declaring(flown, {("C_m", "alpha"): -0.6})).prepared(log)
    found = estimate_aircraft_error(model, manoeuvre.flight, VARIANCE, DENSITY, respond=False)
    assert found.d.shape == (36_000, 4)
    assert found.responded.size == 0
    sound(found)
    # The last minutes see the same error as the first: nothing wears out.
    assert np.std(found.d[-6_000:, 2]) / np.std(found.d[:6_000, 2]) == pytest.approx(1.0, abs=0.1)
