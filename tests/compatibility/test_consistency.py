"""Flight-path kinematics against SciPy's integrator, and instrument errors in simulated flights."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.flight import central_difference
from problems import BOTH_SQUARES, Problem, with_channels
from scipy.integrate import solve_ivp
from scipy.stats import binom

from aerosid.compatibility import Agreement, InstrumentFinding, KinematicConsistency, check_kinematics
from aerosid.compatibility.flight_path import STATES, integrate_path
from aerosid.compatibility.recording import Recording, read_recording
from aerosid.compatibility.window_fit import true_inputs
from aerosid.effects.sensor import sensor_offers
from aerosid.logs.flight_log import FlightLog

Array = NDArray[np.float64]
G = 9.80665


def integrated(time: Array, inputs: Array, initial: Array) -> Array:
    """u, w, theta, h (n, 4) by SciPy, interval by interval, the inputs linear in each."""

    def rates(t: float, x: Array) -> list[float]:
        a_x, a_z, q, p, r, phi, beta = (float(np.interp(t, time, column)) for column in inputs.T)
        u, w, theta, _ = x
        v = np.tan(beta) * np.hypot(u, w)
        return [
            a_x - G * np.sin(theta) - q * w + r * v,
            a_z + G * np.cos(theta) * np.cos(phi) + q * u - p * v,
            q * np.cos(phi) - r * np.sin(phi),
            u * np.sin(theta) - v * np.sin(phi) * np.cos(theta) - w * np.cos(phi) * np.cos(theta),
        ]

    states = [np.array(initial, dtype=float)]
    for start, stop in itertools.pairwise(time):
        states.append(solve_ivp(rates, (start, stop), states[-1], rtol=1e-11, atol=1e-12).y[:, -1])
    return np.array(states)


def lively(samples: int = 40, interval: float = 0.05) -> tuple[Array, Array, Array]:
    """Time, inputs (n, 7) and initial u, w, theta, h of a banked, slipping, pitching flight."""
    time = interval * np.arange(samples)
    generator = np.random.default_rng(3)
    phases = generator.uniform(0.0, 2.0 * np.pi, 7)
    size = np.array([0.8, 3.0, 0.15, 0.2, 0.1, 0.4, 0.05])
    inputs = size * np.sin(2.5 * time[:, None] + phases) + np.array([0.5, -9.8, 0.02, 0, 0, 0.1, 0.02])
    return time, inputs, np.array([90.0, 6.0, 0.08, 1200.0])


def test_the_path_is_scipy_s() -> None:
    time, inputs, initial = lively()
    path = integrate_path(time, inputs, initial, np.zeros((time.size, 3, 0)))
    np.testing.assert_allclose(path.states, integrated(time, inputs, initial), rtol=1e-7, atol=1e-6)


def test_its_derivatives_are_differences_of_scipy_s_paths() -> None:
    time, inputs, initial = lively(12, 0.05)
    initial[STATES.index("h")] = 0.0  # the integrator's tolerance is relative
    direction = np.sin(np.arange(36.0)).reshape(12, 3, 1)
    path = integrate_path(time, inputs, initial, direction)

    def moved(parameters: Array) -> Array:
        changed = inputs.copy()
        changed[:, :3] += parameters[4] * direction[:, :, 0]
        return integrated(time, changed, initial + parameters[:4])[-1]

    expected = central_difference(moved, np.zeros(5), np.array([1e-2, 1e-2, 1e-5, 1.0, 1e-4]))
    np.testing.assert_allclose(path.columns[-1], expected, rtol=2e-5, atol=2e-5)


FLOWN = Problem(undeclared=BOTH_SQUARES, elevator="3211", duration=15.0, amplitude=0.05)


@cache
def flight(seed: int = 1) -> FlightLog:
    """A pitching manoeuvre of an aircraft with undeclared terms, on which kinematics do not depend."""
    return FLOWN.fly(seed)


def faulty(kind: str, channel: str, value: float) -> FlightLog:
    """The flight with one instrument error; delays and lags act on the noise-free motion, here by interpolation."""
    log, quiet = flight(), replace(FLOWN, noise=dict.fromkeys(FLOWN.noise, 0.0)).fly(1)
    noise = log[channel] - quiet[channel]
    true = quiet[channel]
    time = log.time
    if kind == "sensor_bias":
        recorded = true + value
    elif kind == "sensor_scale":
        recorded = value * true
    elif kind == "sensor_delay":
        recorded = np.interp(time - value, time, true)
    elif kind == "sensor_lag":
        response = solve_ivp(
            lambda t, y: (np.interp(t, time, true) - y) / value, time[[0, -1]], true[:1], t_eval=time, max_step=0.01
        )
        recorded = response.y[0]
    else:  # the vane, or the accelerometer, `value` metres ahead
        q = quiet["q"]
        recorded = true - q * value / quiet["V"] if channel == "alpha" else true - np.gradient(q, time) * value
    return with_channels(log, **{channel: recorded + noise})


def explanations(result: KinematicConsistency) -> dict[tuple[str, str], InstrumentFinding]:
    """Findings and their alternatives, by kind and channel."""
    rows = [*result.findings, *(row for group in result.inseparable for row in group[1:])]
    return {(row.kind, row.where): row for row in rows}


ONE_OF_A_KIND = [
    ("sensor_bias", "theta", 0.02),
    ("sensor_scale", "q", 1.05),
    ("sensor_delay", "alpha", 0.12),
    ("sensor_lag", "alpha", 0.15),
    ("sensor_position", "a_z", 4.0),
]
THE_REST = [
    ("sensor_bias", "a_x", 0.15),
    ("sensor_bias", "a_z", 0.15),
    ("sensor_bias", "q", 0.004),
    ("sensor_bias", "alpha", 0.015),
    ("sensor_scale", "alpha", 1.1),
    ("sensor_scale", "a_z", 1.04),
    ("sensor_scale", "theta", 0.93),
    ("sensor_delay", "theta", 0.08),
    ("sensor_delay", "q", 0.06),
    ("sensor_position", "alpha", 6.0),
]
PLANTED = [*ONE_OF_A_KIND, *(pytest.param(*case, marks=pytest.mark.slow) for case in THE_REST)]


@pytest.mark.parametrize(("kind", "channel", "value"), PLANTED)
def test_a_planted_instrument_error_is_found_with_its_size(kind: str, channel: str, value: float) -> None:
    result = check_kinematics([faulty(kind, channel, value)])
    assert result is not None
    assert result.verdict is Agreement.CORRECTED
    found = explanations(result)[kind, channel]
    assert abs(found.value - value) < 4.0 * found.std_error + 0.02 * abs(value - (kind == "sensor_scale"))
    # Every finding is this error or one indistinguishable from it.
    assert len(result.findings) == 1


def test_two_simultaneous_instrument_errors_are_both_found() -> None:
    both = with_channels(faulty("sensor_delay", "alpha", 0.12), q=faulty("sensor_scale", "q", 1.05)["q"])
    result = check_kinematics([both])
    assert result is not None
    assert {("sensor_delay", "alpha"), ("sensor_scale", "q")} <= set(explanations(result))
    assert len(result.findings) == 2


def test_biases_of_a_x_and_theta_are_indistinguishable_without_altitude() -> None:
    """Only the climb distinguishes them, and that by 1.5 m/s: a vertical wind of half a metre a second is usual."""
    log = faulty("sensor_bias", "a_x", -0.15)
    with_h, without = check_kinematics([log]), check_kinematics([with_channels(log, h=None)])
    assert with_h is not None
    assert without is not None
    assert [(row.kind, row.where) for row in with_h.findings] == [("sensor_bias", "a_x")]
    group = {(row.kind, row.where): row.value for row in without.inseparable[0]}
    assert group["sensor_bias", "a_x"] == pytest.approx(-0.15, abs=0.03)
    assert group["sensor_bias", "theta"] == pytest.approx(0.15 / G, abs=0.003)


def test_a_gust_is_not_named_as_an_instrument_error() -> None:
    log, quiet = flight(), replace(FLOWN, noise=dict.fromkeys(FLOWN.noise, 0.0)).fly(1)
    generator = np.random.default_rng(5)
    memory = np.exp(-100.0 * 0.03 / 150.0)
    air = np.zeros(log.samples)
    for k in range(1, air.size):
        air[k] = memory * air[k - 1] + 0.8 * np.sqrt(1.0 - memory**2) * generator.standard_normal()
    u, w = quiet["V"] * np.cos(quiet["alpha"]), quiet["V"] * np.sin(quiet["alpha"]) - air
    seen = {"V": np.hypot(u, w), "alpha": np.arctan2(w, u)}
    result = check_kinematics([with_channels(log, **{n: log[n] - quiet[n] + seen[n] for n in seen})])
    assert result is not None
    assert not result.findings
    (gust,) = result.air
    assert gust.axis == "w"
    assert 0.4 < gust.sigma < 1.6


def test_several_logs_of_one_installation_are_one_estimate() -> None:
    logs = [replace(faulty("sensor_delay", "alpha", 0.12), name=name) for name in ("one", "two")]
    alone, joint = check_kinematics(logs[:1]), check_kinematics(logs)
    assert alone is not None
    assert joint is not None
    assert joint.logs == ("one", "two")
    assert joint.findings[0].std_error < 0.85 * alone.findings[0].std_error


def test_gaps_cut_the_record_and_missing_outputs_are_left_out() -> None:
    log = flight()
    q, alpha = log["q"].copy(), log["alpha"].copy()
    q[200:230] = np.nan
    alpha[300:310] = np.nan
    recording = read_recording(with_channels(log, q=q, alpha=alpha))
    assert isinstance(recording, Recording)
    assert [(piece.start, piece.stop) for piece in recording.stretches] == [(0, 200), (230, 500)]
    assert not recording.compared[300:310, 1].any()
    assert not recording.compared[200:230].any()


def test_a_log_without_accelerations_is_not_checked() -> None:
    assert check_kinematics([with_channels(flight(), a_x=None)]) is None


def test_every_instrument_error_at_its_null_value_leaves_the_inputs_unchanged() -> None:
    recording = read_recording(flight())
    assert recording is not None
    for offer in sensor_offers(dict.fromkeys(("a_x", "a_z", "q"), 0.01)):
        np.testing.assert_allclose(true_inputs(recording, offer.effects), recording.inputs, atol=1e-12)


def test_without_a_recorded_control_an_instrument_error_is_found_by_the_kinematic_equations() -> None:
    result = check_kinematics([with_channels(faulty("sensor_delay", "alpha", 0.12), delta_e=None)])
    assert result is not None
    (finding,) = result.findings
    assert (finding.kind, finding.where) == ("sensor_delay", "alpha")
    assert abs(finding.value - 0.12) < 4.0 * finding.std_error


def alarms(seeds: range) -> int:
    """Flights without instrument errors on which one is named: two noise levels, white and coloured noise."""
    count = 0
    for seed in seeds:
        problem = Problem(undeclared=BOTH_SQUARES, elevator=("3211", "doublet")[seed % 2], duration=12.0)
        factor = 1.0 if seed % 4 < 2 else 4.0
        noise = {name: factor * value for name, value in problem.noise.items()}
        log = replace(problem, noise=noise).fly(seed)
        if seed % 3 == 2:
            quiet = replace(problem, noise=dict.fromkeys(noise, 0.0)).fly(seed)
            names = ("V", "alpha", "theta", "h")
            log = with_channels(log, **{name: coloured(log[name] - quiet[name]) + quiet[name] for name in names})
        result = check_kinematics([log])
        assert result is not None
        count += bool(result.findings)
    return count


def coloured(white: Array) -> Array:
    """First-order noise of the same standard deviation, correlated by 0.7 from sample to sample."""
    noise = white.copy()
    for k in range(1, noise.size):
        noise[k] = 0.7 * noise[k - 1] + np.sqrt(1.0 - 0.49) * white[k]
    return noise


def test_nothing_is_named_without_an_instrument_error() -> None:
    """At one flight in a hundred one of six alarms in 6 % of such draws; where every second one would, in 98 %."""
    assert alarms(range(6)) == 0


@pytest.mark.slow
def test_at_most_one_flight_in_a_hundred_raises_a_false_alarm() -> None:
    """More than 9 of 400 come up in 1 % of runs at one in a hundred, in 99 % at one in twenty."""
    most = int(binom.isf(0.01, 400, 0.01))
    assert binom.sf(most, 400, 0.05) > 0.98
    assert alarms(range(400, 800)) <= most
