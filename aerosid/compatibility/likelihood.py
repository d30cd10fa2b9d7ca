"""Likelihood of instrument faults and gusts from kinematics, with its derivatives.

The path is integrated from the recorded accelerations and rates; their noise is process noise with a known path and is
accounted for by whitening, and so is air that moves. Parameters are the faults' numbers and, for every stretch, its
initial state.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.compatibility.faults import Fault, dynamics, recorded, seen, true_inputs, vane_position
from aerosid.compatibility.flight_path import DRIVING, trace_path
from aerosid.compatibility.recording import Recording
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.layout import layout_of
from aerosid.signals.sensor_dynamics import SensorStates, sensor_states
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import InputNoise, make_whitening_carry, whiten_stretch

Array = NDArray[np.float64]
_SIZES = layout_of(LONGITUDINAL).sizes

V, ALPHA, THETA, H = (LONGITUDINAL.outputs.index(name) for name in ("V", "alpha", "theta", "h"))
STATE_PLACES = np.array([0, 1, 3, 4])
"""u, w, theta, h: the pitch rate drives the path and is no state of it."""

STATES = STATE_PLACES.size


@dataclass(frozen=True)
class Gust:
    """Air that moves: vane and pitot see it, the path does not but for what the accelerometers measured of it.

    Attributes
    ----------
    sigma_w, sigma_u : float
        Standard deviation of its velocity along the body axes z and x, m/s; 0 in still air.
    length_w, length_u : float
        Scale length of its correlation, m.
    """

    sigma_w: float = 0.0
    length_w: float = 150.0
    sigma_u: float = 0.0
    length_u: float = 150.0


@dataclass(frozen=True)
class Structure:
    """Which faults act, with their numbers, and how the air moves."""

    faults: tuple[Fault, ...] = ()
    values: tuple[float, ...] = ()
    gust: Gust = Gust()


@dataclass(frozen=True)
class Whitened:
    """One stretch in units of standard deviations.

    `residual` (n, 8), NaN where nothing is compared; `columns` (n, 8, 4 + P) with respect to its initial state and the
    faults' numbers, acting then tested; `log_sum` of the innovations' variances.
    """

    recording: int
    residual: Array
    columns: Array
    log_sum: float


@dataclass(frozen=True)
class Stretch:
    """One stretch simulated, not yet whitened.

    `block` (n, 8, 1 + 4 + P): measured minus simulated, then the derivatives of the simulated outputs with respect to
    the initial state and to the faults' numbers, acting then tested; `held` (n, 8) what is compared; `trace` the
    linearisation along the path; `time` (n,) s; `sensors` on the way of the noise.
    """

    recording: int
    time: Array
    block: Array
    held: NDArray[np.bool_]
    trace: Trace
    sensors: SensorStates


def simulate(
    recordings: Sequence[Recording],
    structure: Structure,
    states: Sequence[Array],
    tested: Sequence[tuple[Fault, float]] = (),
) -> Iterator[Stretch]:
    """Every stretch of every recording, simulated with its sensitivities.

    Parameters
    ----------
    states : sequence of ndarray, shape (5,)
        Initial state of every stretch of every recording.
    tested : sequence of (Fault, distance)
        Faults that do not act; their columns are wanted over that distance from none.
    """
    remaining = iter(states)
    for n, recording in enumerate(recordings):
        inputs = true_inputs(recording, structure.faults, structure.values)
        directions, drivers = _directions(recording, structure, tested, inputs)
        for stretch in recording.stretches:
            arguments = (inputs, directions, drivers, structure, next(remaining), tested)
            yield _simulate_stretch(n, recording, stretch, *arguments)


def whiten(
    recordings: Sequence[Recording], stretches: Iterable[Stretch], gust: Gust, variance: Array
) -> Iterator[Whitened]:
    """Residuals and sensitivities in standard deviations; `variance` (8,) of each output's noise, SI squared."""
    for stretch in stretches:
        recording = recordings[stretch.recording]
        noise = input_noise(gust, recording, stretch.time)
        block = stretch.block.copy()
        carry = make_whitening_carry(noise, block.shape[2], stretch.trace, stretch.sensors)
        log_sum = whiten_stretch(stretch.held, block, stretch.trace, variance, noise, stretch.sensors, carry)
        residual = np.where(stretch.held, block[:, :, 0], np.nan)
        yield Whitened(stretch.recording, residual, block[:, :, 1:], float(log_sum))


def _simulate_stretch(
    number: int,
    recording: Recording,
    stretch: slice,
    inputs: Array,
    directions: Array,
    drivers: Sequence[int],
    structure: Structure,
    state: Array,
    tested: Sequence[tuple[Fault, float]],
) -> Stretch:
    time, here = recording.time[stretch], np.ascontiguousarray(inputs[stretch])
    path = trace_path(time, here, state, np.ascontiguousarray(directions[stretch]))
    arms = vane_position(recording, structure.faults, structure.values)
    outputs, by_state, by_input = see(path.states, here, *arms)
    block = np.zeros((time.size, len(LONGITUDINAL.outputs), 1 + STATES + len(structure.faults) + len(tested)))
    block[:, :, 1 : 1 + STATES] = by_state @ path.columns[:, :, STATE_PLACES]
    moved = by_state @ path.columns[:, :, 5:] + by_input[:, :, :3] @ directions[stretch]
    for column, place in enumerate(drivers):
        block[:, :, 1 + STATES + place] = moved[:, :, column]
    _enter_vane(block, path.states, here, arms, structure.faults, tested)
    _enter_sensors(block, outputs, time, structure, tested)
    held = recording.compared[stretch]
    block[:, :, 0] = np.where(held, recording.measured[stretch] - outputs, 0.0)
    trace = Trace(
        outputs, path.columns, path.transition, _wide(path.start), _wide(path.end), by_state, by_input, _SIZES
    )
    sensors = sensor_states(
        ((fault.place, dynamics(fault, value)) for fault, value in seen(structure.faults, structure.values)),
        float(np.median(np.diff(time))),
        len(LONGITUDINAL.outputs),
    )
    return Stretch(number, time, block, held, trace, sensors)


def see(states: Array, inputs: Array, x_arm: float, z_arm: float) -> tuple[Array, Array, Array]:
    """What true instruments show along a path: outputs (n, 8), derivatives by state and by input (n, 8, 5).

    The inputs of the derivatives are a_x, a_z, q and the gusts along body z and x; air that moves with the aircraft
    lowers what its instruments see.
    """
    samples = states.shape[0]
    u, w = states[:, 0], states[:, 1]
    q, beta = inputs[:, 2], inputs[:, 6]
    plane, cos_beta = np.hypot(u, w), np.cos(beta)
    vane_u, vane_w = u + q * z_arm, w - q * x_arm
    square = vane_u**2 + vane_w**2
    outputs = np.zeros((samples, len(LONGITUDINAL.outputs)))
    outputs[:, V] = plane / cos_beta
    outputs[:, ALPHA] = np.arctan2(vane_w, vane_u)
    outputs[:, THETA], outputs[:, H] = states[:, 3], states[:, 4]
    by_state, by_input = (
        np.zeros((samples, len(LONGITUDINAL.outputs), 5)),
        np.zeros((samples, len(LONGITUDINAL.outputs), 5)),
    )
    by_state[:, V, 0], by_state[:, V, 1] = u / plane / cos_beta, w / plane / cos_beta
    by_state[:, ALPHA, 0], by_state[:, ALPHA, 1] = -vane_w / square, vane_u / square
    by_state[:, THETA, 3] = by_state[:, H, 4] = 1.0
    by_input[:, ALPHA, 2] = (-x_arm * vane_u - z_arm * vane_w) / square
    by_input[:, :, 3], by_input[:, :, 4] = -by_state[:, :, 1], -by_state[:, :, 0]
    return outputs, by_state, by_input


def _wide(by_input: Array) -> Array:
    """Derivatives by a_x, a_z, q with empty places for the gusts, which the path does not feel."""
    wide = np.zeros((*by_input.shape[:2], 5))
    wide[:, :, :3] = by_input
    return wide


def input_noise(gust: Gust, recording: Recording, time: Array) -> InputNoise:
    """Variance and memory of the noise of a_x, a_z, q and of the gusts along body z and x."""
    travelled = recording.airspeed * float(np.median(np.diff(time)))
    driving = [recording.noise[name] ** 2 for name in DRIVING]
    variance = np.array([*driving, gust.sigma_w**2, gust.sigma_u**2])
    lengths = np.array([gust.length_w, gust.length_u])
    return InputNoise(variance, np.concatenate([np.zeros(3), np.exp(-travelled / lengths)]))


def _directions(
    recording: Recording, structure: Structure, tested: Sequence[tuple[Fault, float]], inputs: Array
) -> tuple[Array, list[int]]:
    """How a_x, a_z, q move with each fault that drives the path, (N, 3, D), and each one's place among all faults."""
    moves, places = [], []
    for n, fault in enumerate(structure.faults):
        if not fault.drives:
            continue
        sides = []
        for sign in (1.0, -1.0):
            values = list(structure.values)
            values[n] += sign * fault.step
            sides.append(true_inputs(recording, structure.faults, values)[:, :3])
        moves.append((sides[0] - sides[1]) / (2.0 * fault.step))
        places.append(n)
    for n, (fault, distance) in enumerate(tested):
        if not fault.drives:
            continue
        changed = true_inputs(recording, (*structure.faults, fault), (*structure.values, fault.null + distance))
        moves.append((changed - inputs)[:, :3] / distance)
        places.append(len(structure.faults) + n)
    return (np.stack(moves, axis=2) if moves else np.zeros((recording.time.size, 3, 0))), places


def _enter_vane(
    block: Array,
    states: Array,
    inputs: Array,
    arms: tuple[float, float],
    faults: Sequence[Fault],
    tested: Sequence[tuple[Fault, float]],
) -> None:
    """The columns of the vane's position, in place."""
    q, (x_arm, z_arm) = inputs[:, 2], arms
    vane_u, vane_w = states[:, 0] + q * z_arm, states[:, 1] - q * x_arm
    slope = -q * vane_u / (vane_u**2 + vane_w**2)
    for n, fault in enumerate((*faults, *(fault for fault, _ in tested))):
        if fault.kind == "sensor_position" and fault.channel == "alpha":
            block[:, ALPHA, 1 + STATES + n] = slope


def _enter_sensors(
    block: Array,
    outputs: Array,
    time: Array,
    structure: Structure,
    tested: Sequence[tuple[Fault, float]],
) -> None:
    """Let the faults of what sees the path act on outputs and columns, and enter their own columns, in place."""
    places = {fault: n for n, fault in enumerate(structure.faults)}
    for fault, value in seen(structure.faults, structure.values):
        i = fault.place
        given = outputs[:, i : i + 1].copy()
        upper = recorded(time, given, fault, value + fault.step)
        lower_at = max(value - fault.step, fault.lowest)
        lower = recorded(time, given, fault, lower_at)
        block[:, i, 1:] = recorded(time, block[:, i, 1:], fault, value, slope=True)
        block[:, i, 1 + STATES + places[fault]] = (upper - lower)[:, 0] / (value + fault.step - lower_at)
        outputs[:, i] = recorded(time, given, fault, value)[:, 0]
    for n, (fault, distance) in enumerate(tested):
        if not fault.drives and fault.kind != "sensor_position":
            i = fault.place
            given = outputs[:, i : i + 1]
            change = recorded(time, given, fault, fault.null + distance) - given
            block[:, i, 1 + STATES + len(structure.faults) + n] = change[:, 0] / distance
