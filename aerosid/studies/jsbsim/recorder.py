"""The log of a flight of JSBSim: its sensors, with their errors, positions and noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import CHANNELS
from aerosid.signals.delay_and_lag import delayed, lagged
from aerosid.studies.jsbsim.injected import InjectedEffect
from aerosid.studies.jsbsim.lever_arms import by_lever_arm
from aerosid.studies.jsbsim.plan import USUAL_NOISE, FlightPlan

Array = NDArray[np.float64]


def recorded_flight(
    plan: FlightPlan,
    moving: Sequence[str],
    effects: Sequence[InjectedEffect],
    frames: Array,
    count: int,
    histories: Mapping[str, Array],
    thrust: float,
) -> FlightLog:
    """The recorded log: sensors with their errors, noise, and the recorded thrust, which is the trim's.

    Parameters
    ----------
    plan : FlightPlan
    moving : sequence of str
        Channels moved in the flight; those of them in `USUAL_NOISE` are recorded.
    effects : sequence of InjectedEffect
        Those of sensors are applied here.
    frames : (F,)
        Times of the frames, s.
    count : int
        Frames per sample.
    histories : mapping of str to (F,)
        True values in the frames, SI.
    thrust : float
        Thrust of the trim, N.
    """
    generator = np.random.default_rng(plan.seed)
    channels = {}
    for name, deviation in USUAL_NOISE.items():
        if name not in moving:
            continue
        sensed = _sensed(name, effects, frames, histories)[::count]
        channels[name] = sensed + plan.noise * deviation * generator.standard_normal(sensed.size)
    samples = plan.manoeuvre.time.size
    channels["thrust"] = np.full(samples, thrust)
    if isinstance(plan.aircraft, str) or plan.aircraft.density is None:
        channels["rho"] = histories["rho"][::count]
        channels["mach"] = histories["mach"][::count]
    name = plan.aircraft if isinstance(plan.aircraft, str) else plan.aircraft.name
    units = {channel: CHANNELS[channel].unit for channel in channels}
    return FlightLog(f"{name} {plan.manoeuvre.name}", plan.manoeuvre.time, channels, units)


def _sensed(name: str, effects: Sequence[InjectedEffect], frames: Array, true: Mapping[str, Array]) -> Array:
    """The sensor's reading of a channel in every frame."""
    values = true[name]
    for effect in effects:
        if effect.where != name or not effect.kind.startswith("sensor_"):
            continue
        number = effect.values[0]
        if effect.kind == "sensor_position":
            values = values + by_lever_arm(name, true, effect.values)
        elif effect.kind == "sensor_bias":
            values = values + number
        elif effect.kind == "sensor_scale":
            values = values * number
        elif effect.kind == "sensor_delay":
            values = delayed(frames, values[:, None], number)[:, 0]
        else:
            values = lagged(frames, np.array(values)[:, None], number)[:, 0]
    return values
