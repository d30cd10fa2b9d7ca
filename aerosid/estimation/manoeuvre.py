"""Preparation of a log for estimation: gap-free inputs, measured outputs, noise levels, integration steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.errors import LogError
from aerosid.estimation.preparation_settings import PREPARATION
from aerosid.flight_model.axes import ATMOSPHERE_AND_BODY, LONGITUDINAL, Axes, input_columns_of, state_vector
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.vane import alpha_at_centre
from aerosid.logs.channel_noise import noise_deviation
from aerosid.logs.constant_channels import is_constant
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.sample_patterns import spike_times, spikes
from aerosid.nomenclature import is_surface
from aerosid.notation import listed, plain
from aerosid.signals.moving_window import moving_mean
from aerosid.signals.noise import calmed

STANDARD_SPEED_OF_SOUND = 340.29
"""Physical: m/s, at sea level in the standard atmosphere; without a mach channel no term can hold mach."""


@dataclass(frozen=True)
class Manoeuvre:
    """One log as the arrays that the estimators take.

    Attributes
    ----------
    log : FlightLog
        The log itself.
    flight : Flight
        The arrays.
    columns : tuple of str
        The names of the flight's input columns.
    outputs : tuple of str
        The output channels that are measured, in the order of the case's outputs.
    noise : ndarray, shape (m,)
        Standard deviation of each output's measurement noise, from the log alone; NaN where not measured.
    notes : tuple of str
        Assumptions: which channel or constant gave density, thrust and mass, gaps that were bridged.
    ground : float
        Altitude of the ground below, m: `h` less the height above ground; 0 where that is not logged.
    axes : Axes
        The case of the equations of motion that the arrays are made for.
    smooth : tuple of str
        The controls whose samples are corrected for being smooth between them (`smooth_controls`).
    """

    log: FlightLog
    flight: Flight
    columns: tuple[str, ...]
    outputs: tuple[str, ...]
    noise: NDArray[np.float64]
    notes: tuple[str, ...]
    ground: float = 0.0
    axes: Axes = LONGITUDINAL
    smooth: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The log's name."""
        return self.log.name

    def row(self, output: str) -> int:
        """The place of an output among the case's."""
        return self.axes.outputs.index(output)

    def measured(self, output: str) -> NDArray[np.float64]:
        """The samples of an output (N,), SI, NaN where missing."""
        return self.flight.measured[:, self.row(output)]

    @property
    def sideslip_measured(self) -> bool:
        """Whether sideslip, where the case integrates it, has a sensor."""
        return "v" not in self.axes.integrated or "beta" in self.outputs

    @property
    def extra_columns(self) -> tuple[str, ...]:
        """The input columns past the leading ones, E of them."""
        return self.columns[len(input_columns_of(self.axes)) :]

    @property
    def extra_inputs(self) -> NDArray[np.float64]:
        """The inputs past the leading ones, (N, E), SI."""
        return self.flight.inputs[:, len(input_columns_of(self.axes)) :]

    @cached_property
    def interval(self) -> float:
        """Median interval between samples, s."""
        return float(np.median(np.diff(self.flight.time)))

    @cached_property
    def first_state(self) -> NDArray[np.float64]:
        """Start value of the initial state (n,), from the first samples."""
        return initial_state(self.flight, self.axes)

    @cached_property
    def mean_airspeed(self) -> float:
        """Mean of the measured airspeed, m/s."""
        if "V" in self.axes.outputs:
            return float(np.nanmean(self.measured("V")))
        return float(np.nanmean(self.flight.inputs[:, self.columns.index("V")]))

    @property
    def span(self) -> tuple[str, float, int]:
        """Name, start, s, and number of samples: which part of which log it is."""
        time = self.flight.time
        return self.name, float(time[0]), int(time.size)

    @cached_property
    def spread(self) -> NDArray[np.float64]:
        """Standard deviation of each output's samples, (m,), SI; 1 where nothing was measured."""
        present = [column[np.isfinite(column)] for column in self.flight.measured.T]
        return np.array([values.std() if values.size else 1.0 for values in present])


def prepare(log: FlightLog, aircraft: Aircraft, columns: tuple[str, ...]) -> Manoeuvre:
    """Convert a log into the arrays of the flight model.

    Parameters
    ----------
    log : FlightLog
        Measured channels, SI.
    aircraft : Aircraft
        Source of density, thrust and mass where the log has none, and of the case of the equations of motion.
    columns : tuple of str
        The input columns of the aerodynamic model.

    Raises
    ------
    LogError
        Where a channel that the case requires, or an input that the model needs, is not in the log.
    """
    axes = aircraft.axes
    for name in axes.required:
        if name not in log:
            raise LogError(
                f"{log.path}: channel {name} is missing (found {', '.join(log.channels)}); the estimation needs it, "
                "map it in a channel map."
            )
        if (held := int(np.isfinite(log[name]).sum())) < PREPARATION.fewest:
            raise LogError(
                f"{log.path}: channel {name} holds {held} samples that are numbers, but the estimation needs at least "
                f"{PREPARATION.fewest}; record it, or map another column."
            )
    notes: list[str] = []
    inputs = np.zeros((log.time.size, len(columns)))
    for j, name in enumerate(columns):
        inputs[:, j] = _input(log, aircraft, name, notes)
    if "alpha" in axes.measured and "alpha" in log.positions:
        inputs[:, columns.index("alpha")] += _vane_motion(log)
    substeps, ground = _substeps(log, aircraft, inputs), _ground(log)
    outputs = tuple(name for name in axes.outputs if name in log and np.isfinite(log[name]).sum() >= PREPARATION.fewest)
    frozen, unmoved = _frozen(log, outputs, axes)
    if frozen:
        notes.append(f"{listed(frozen)}: one value throughout, as of an instrument that is frozen; not used.")
        outputs = tuple(name for name in outputs if name not in frozen)
    if unmoved:
        notes.append(f"{listed(unmoved)}: one value throughout; used, as the estimation needs it: check the sensor.")
    extra = columns[len(input_columns_of(axes)) :]
    noisy = (*outputs, *(name for name in extra if is_surface(name)))
    deviation = {name: noise_deviation(log, name) for name in noisy}
    notes += _notes_on_spikes(log, deviation)
    variance = np.array([deviation.get(name, 0.0) ** 2 for name in extra])
    measured = np.full((log.time.size, len(axes.outputs)), np.nan)
    noise = np.array([deviation.get(name, np.nan) for name in axes.outputs])
    positions = np.zeros((len(axes.outputs), 3))
    for name in outputs:
        measured[:, axes.outputs.index(name)] = log[name]
        positions[axes.outputs.index(name)] = log.positions.get(name, (0.0, 0.0, 0.0))
    # A copy: kernels compile anew for arrays that may not be written.
    flight = Flight(np.array(log.time), inputs, measured, positions, substeps, variance)
    return Manoeuvre(log, flight, columns, outputs, noise, tuple(dict.fromkeys(notes)), ground, axes)


def _notes_on_spikes(log: FlightLog, deviation: Mapping[str, float]) -> list[str]:
    """A note on each channel with spikes, which the estimation takes for motion or a control's; by their noise."""
    found = {name: spikes(log[name], noise) for name, noise in deviation.items()}
    return [
        f"{name}: spikes, {spike_times(log.time, places)}; leave these fields empty if they are no motion."
        for name, places in found.items()
        if places.size
    ]


def _frozen(log: FlightLog, outputs: Sequence[str], axes: Axes) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The outputs of one value throughout that are not required, and the required channels of one value.

    None where every required channel holds still, as in undisturbed flight.
    """
    if all(float(np.nanmax(log[name]) - np.nanmin(log[name])) < PREPARATION.rounding for name in axes.required):
        return (), ()
    unmoved = tuple(name for name in axes.required if is_constant(log[name]))
    return tuple(name for name in outputs if name not in axes.required and is_constant(log[name])), unmoved


def _ground(log: FlightLog) -> float:
    """Altitude of the ground, m, taken as level throughout the flight."""
    if "h" not in log or "h_agl" not in log:
        return 0.0
    below = log["h"] - log["h_agl"]
    known = np.isfinite(below)
    return float(np.median(below[known])) if known.any() else 0.0


def _vane_motion(log: FlightLog) -> NDArray[np.float64]:
    """Angle of attack at the centre of gravity less that at the vane, (N,) rad."""
    p, q, r = (np.nan_to_num(log[name]) if name in log else np.zeros(log.time.size) for name in ("p", "q", "r"))
    alpha = log["alpha"]
    return np.nan_to_num(alpha_at_centre(alpha, log.positions["alpha"], p, q, r, log["V"]) - alpha)


def _substeps(log: FlightLog, aircraft: Aircraft, inputs: NDArray[np.float64]) -> int:
    """Integration steps in a sampling interval, from the fastest motion by the declared derivatives.

    omega^2 of the short period is at most |M_alpha| + |Z_alpha M_q|, its damping at most half of |Z_alpha| + |M_q|;
    that of the Dutch roll likewise with N_beta, Y_beta and N_r; roll subsides with L_p.
    """
    interval = float(np.median(np.diff(log.time)))
    speed = float(np.nanmedian(log["V"]))
    size = {(d.coefficient, str(d.term)): abs(d.value) for d in aircraft.derivatives}
    density, mass = (float(np.median(inputs[:, ATMOSPHERE_AND_BODY.index(name)])) for name in ("rho", "mass"))
    force = 0.5 * density * speed**2 * aircraft.wing_area
    lift = max(size.get(("C_Z", "alpha"), 0.0), size.get(("C_L", "alpha"), 0.0))
    heave = force / (mass * speed) * lift
    pitch = force * aircraft.mean_chord / aircraft.I_yy
    damping = pitch * aircraft.mean_chord / (2.0 * speed) * size.get(("C_m", "q_hat"), 0.0)
    fastest = np.sqrt(pitch * size.get(("C_m", "alpha"), 0.0) + heave * damping) + 0.5 * (heave + damping)
    if aircraft.span is not None and aircraft.I_xx is not None and aircraft.I_zz is not None:
        moment, half_span = force * aircraft.span, aircraft.span / (2.0 * speed)
        roll = moment / aircraft.I_xx * half_span * size.get(("C_l", "p_hat"), 0.0)
        yaw = moment / aircraft.I_zz * half_span * size.get(("C_n", "r_hat"), 0.0)
        side = force / (mass * speed) * size.get(("C_Y", "beta"), 0.0)
        stiffness = moment / aircraft.I_zz * size.get(("C_n", "beta"), 0.0) + side * yaw
        fastest = max(fastest, roll, np.sqrt(stiffness) + 0.5 * (side + yaw))
    shortest, longest = PREPARATION.shortest_substep, PREPARATION.longest_substep
    longest = float(np.clip(PREPARATION.longest_angle / max(fastest, 1e-9), shortest, longest))
    return max(1, int(np.ceil(interval / longest - 1e-9)))


def initial_state(flight: Flight, axes: Axes = LONGITUDINAL) -> NDArray[np.float64]:
    """Start value of the state (n,) from the first samples of the measurements.

    The mean of the first samples present; theta from the axial specific force where it is not measured.
    """
    first = {name: first_mean(flight.measured[:, i], PREPARATION.first) for i, name in enumerate(axes.outputs)}
    columns = {name: float(flight.inputs[0, j]) for j, name in enumerate(input_columns_of(axes))}

    def held(name: str) -> float:
        value = first.get(name, columns.get(name, 0.0))
        return value if np.isfinite(value) else 0.0

    def place(name: str) -> tuple[float, float, float]:
        if name not in axes.outputs:
            return 0.0, 0.0, 0.0
        ahead, right, below = flight.positions[axes.outputs.index(name)].tolist()
        return ahead, right, below

    speed, p, q, r, theta = held("V"), held("p"), held("q"), held("r"), held("theta")
    alpha = alpha_at_centre(held("alpha"), place("alpha"), p, q, r, speed)
    ahead, _, below = place("beta")
    beta = held("beta") - (ahead * r - below * p) / speed
    if "theta" in first and not np.isfinite(first["theta"]):
        a_x = first.get("a_x", np.nan)
        theta = steady_pitch(a_x) if np.isfinite(a_x) else alpha
    plane = speed * np.cos(beta)
    motion = {name: held(name) for name in axes.integrated} | {"theta": theta}
    motion |= {"u": plane * np.cos(alpha), "v": speed * np.sin(beta), "w": plane * np.sin(alpha)}
    return state_vector(axes, motion)


def steady_pitch(a_x: float) -> float:
    """Pitch angle, rad, of unaccelerated flight with a specific force `a_x` [m/s^2]; no steeper than 64 degrees."""
    return float(np.arcsin(np.clip(a_x / GRAVITY, -0.9, 0.9)))


def first_mean(values: NDArray[np.float64], count: int) -> float:
    """The mean of the first so many samples that are there; NaN where none is."""
    present = values[np.isfinite(values)]
    return float(present[:count].mean()) if present.size else float("nan")


def _input(log: FlightLog, aircraft: Aircraft, name: str, notes: list[str]) -> NDArray[np.float64]:
    """One input column, without gaps."""
    if name == "speed_of_sound":
        if "mach" not in log:
            return np.full(log.time.size, STANDARD_SPEED_OF_SOUND)
        return _slow(log.time, _without_gaps(log, "V", notes) / np.maximum(_without_gaps(log, "mach", notes), 1e-3))
    if name in log:
        return _without_gaps(log, name, notes)
    if name == "rho":
        if "q_bar" in log:
            notes.append("Density is 2 q_bar / V^2, averaged over 2 s.")
            return _slow(log.time, 2.0 * _without_gaps(log, "q_bar", notes) / _without_gaps(log, "V", notes) ** 2)
        if aircraft.density is None:
            raise LogError(
                f"{log.path}: neither the log (rho or q_bar) nor the aircraft file ([air] density) gives the air "
                "density; add one of them."
            )
        notes.append(f"Density is the aircraft file's, {plain(aircraft.density)} kg/m^3.")
        return np.full(log.time.size, aircraft.density)
    if name == "thrust":
        if aircraft.thrust is None:
            notes.append("Thrust is taken as zero: neither the log nor the aircraft file gives it.")
        return np.full(log.time.size, aircraft.thrust or 0.0)
    if name == "mass":
        return np.full(log.time.size, aircraft.mass)
    if name in _AT_REST:
        return np.zeros(log.time.size)
    raise LogError(
        f"{log.path}: channel {name} is missing (found {', '.join(log.channels)}), but a declared or candidate term "
        "names it; map it in a channel map or strike the term."
    )


_AT_REST = ("phi", "p", "r", "beta", "q", "theta")
"""Measured motion that is zero where no channel gives it."""


def _without_gaps(log: FlightLog, name: str, notes: list[str]) -> NDArray[np.float64]:
    """A channel with missing samples interpolated linearly; a note records it."""
    values = log[name]
    present = np.isfinite(values)
    if present.all():
        return values
    if present.sum() < 2:
        raise LogError(f"{log.path}: channel {name} holds {int(present.sum())} samples, but it is needed throughout.")
    notes.append(f"{int((~present).sum())} missing samples of the input {name} are interpolated linearly.")
    return np.interp(log.time, log.time[present], values[present])


def _slow(time: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    samples = max(1, round(PREPARATION.slow_air / float(np.median(np.diff(time)))))
    return moving_mean(values, min(samples, values.size), "edge")


def with_calm_inputs(manoeuvre: Manoeuvre) -> Manoeuvre:
    """The manoeuvre with the noise of its recorded inputs averaged out where they vary slowly."""
    flight = manoeuvre.flight
    inputs, first = flight.inputs.copy(), len(input_columns_of(manoeuvre.axes))
    for j, variance in enumerate(flight.input_variance, first):
        if variance > 0.0:
            inputs[:, j] = calmed(inputs[:, j], float(np.sqrt(variance)))
    return replace(manoeuvre, flight=flight._replace(inputs=inputs))
