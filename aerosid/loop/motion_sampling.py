"""Recordings too slow or too short for the motion of the aircraft, and controls that jump between samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError, LogError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.linear_model import linearise
from aerosid.flight_model.modes import modes_of
from aerosid.loop.effect_rows import Effect
from aerosid.loop.flying_qualities.linear_analysis import LinearRow, condition_of
from aerosid.notation import number

FloatArray = NDArray[np.float64]

TIMING = ("sensor_delay", "sensor_lag", "control_delay", "control_lag")
"""Numerical: kinds of effects whose value is a time, s, that a control's unknown course between samples imitates."""


@dataclass(frozen=True)
class SamplingSettings:
    """Limits of the remarks on sampling.

    Attributes
    ----------
    least, fewest : float
        Samples a period of the fastest oscillation below which a recording is refused, and remarked on. Of simulated
        light transports with nothing missing, sampled 3 to 49 times a period, those below ten got false delays of a
        control or scale errors, and those below four false terms or contradictions.
    jump : float
        Change of a control from one sample to the next over that before and that after, 1, from which it is a jump.
    apparent : float
        Standard deviations of an angular rate's noise that the unknown instant of a jump may be worth. Chosen.
    """

    least: float = 4.0
    fewest: float = 10.0
    jump: float = 5.0
    apparent: float = 3.0


SAMPLING = SamplingSettings()
"""The limits of every result."""


class Oscillation(NamedTuple):
    """The name of an oscillatory mode in words, and its period, s."""

    name: str
    period: float


def fastest_oscillation(A: FloatArray, states: tuple[str, ...]) -> Oscillation | None:
    """That of a linear model with the rates' matrix (n, n) by n states; None where no mode oscillates."""
    modes = modes_of(A, states)
    found = [Oscillation(mode.name.replace("_", " "), mode.period) for mode in modes if mode.period is not None]
    return min(found, key=lambda each: each.period, default=None)


def require_sampled_motion(declared: AerodynamicModel, manoeuvres: Sequence[Manoeuvre]) -> None:
    """Refuse a recording between whose samples the declared aircraft oscillates.

    Parameters
    ----------
    declared : AerodynamicModel
        With its declared values; where it has no trim at a flight's mean condition nothing is refused.

    Raises
    ------
    LogError
        With the interval and the period.
    """
    for each in manoeuvres:
        try:
            linear = linearise(declared, condition_of(each))
        except EstimationError:
            continue
        fastest, interval = fastest_oscillation(linear.A, linear.states), each.log.interval
        if fastest is not None and fastest.period < SAMPLING.least * interval:
            raise LogError(
                f"{each.log.path or each.log.name} is sampled every {number(interval, 3)} s, but the declared "
                f"{fastest.name} has a period of {number(fastest.period, 3)} s, and fewer than {SAMPLING.least:g} "
                "samples a period do not show it; use a faster recording, or correct the aircraft file if that "
                "period is wrong."
            )


def notes_on_sampling(
    linear: Sequence[LinearRow], manoeuvres: Sequence[Manoeuvre], effects: Sequence[Effect], *, leaves: bool
) -> tuple[str, ...]:
    """One sentence for each recording that does not hold what the declared model says of the motion, and for each jump.

    Parameters
    ----------
    linear : sequence of LinearRow
        That of the declared model counts: the other is estimated from these recordings.
    manoeuvres : sequence of Manoeuvre
        The flights that were fitted.
    effects : sequence of Effect
        What was found.
    leaves : bool
        Whether a residual remains.
    """
    declared = next((row for row in linear if row.model == "declared"), None)
    if declared is None:
        return ()
    return tuple(
        note
        for each in manoeuvres
        for note in (
            *_of_fastest_oscillation(declared, each),
            *(_of_jumps(declared, each) if leaves or _has_short_timing(effects, each.log.interval) else ()),
        )
    )


def _of_fastest_oscillation(declared: LinearRow, manoeuvre: Manoeuvre) -> list[str]:
    """Remarks on a recording with too few samples a period, or shorter than one."""
    fastest = fastest_oscillation(declared.A, declared.states)
    if fastest is None:
        return []
    mode, period = f"the declared {fastest.name} of {number(fastest.period, 3)} s", fastest.period
    time, interval = manoeuvre.log.time, manoeuvre.log.interval
    length, notes = float(time[-1] - time[0]), []
    if period < SAMPLING.fewest * interval:
        notes.append(
            f"{manoeuvre.name} is sampled every {number(interval, 3)} s, {number(period / interval, 2)} times in "
            f"{mode}: what is found may be due to the motion between samples. Record at least {SAMPLING.fewest:g} "
            "samples a period."
        )
    if length < period:
        notes.append(
            f"{manoeuvre.name} is {number(length, 3)} s long, shorter than {mode}: most derivatives cannot be told "
            "apart in it. Record a longer manoeuvre, or choose a longer span."
        )
    return notes


def _of_jumps(declared: LinearRow, manoeuvre: Manoeuvre) -> list[str]:
    """Remarks on controls that jump: within their interval the instant is not known."""
    interval, notes = manoeuvre.log.interval, []
    for place, control in enumerate(declared.inputs):
        if control not in manoeuvre.columns:
            continue
        values = manoeuvre.flight.inputs[:, manoeuvre.columns.index(control)]
        at, size = _largest_jump(values)
        # The deviation of an instant anywhere within the interval, as the impulse that the rate gets too early or late.
        late = size * interval / math.sqrt(12.0)
        worth = {
            name: abs(float(declared.B[declared.states.index(name), place])) * late / manoeuvre.noise[n]
            for n, name in enumerate(manoeuvre.axes.outputs)
            if name in declared.states and name in ("p", "q", "r") and manoeuvre.noise[n] > 0.0  # NaN: not measured
        }
        rate = max(worth, key=lambda name: worth[name], default="")
        if rate and worth[rate] > SAMPLING.apparent:
            notes.append(
                f"{manoeuvre.name}: {control} jumps by {number(size, 2)} rad between the samples at "
                f"{manoeuvre.flight.time[at]:.2f} and {manoeuvre.flight.time[at + 1]:.2f} s. When within that interval "
                f"is not recorded and is worth {number(worth[rate], 2)} standard deviations of the noise of {rate}: "
                "residuals after such jumps, and delays and lags shorter than the interval, may be due to that. Record "
                "the control faster."
            )
    return notes


def _largest_jump(values: FloatArray) -> tuple[int, float]:
    """Sample before the largest jump of a control, (N,), and its size; size zero without one."""
    steps = np.abs(np.diff(values))
    if steps.size < 3:
        return 0, 0.0
    beside = np.maximum(np.append(steps[1:], 0.0), np.insert(steps[:-1], 0, 0.0))
    jumps = np.where(steps > SAMPLING.jump * beside, steps, 0.0)
    at = int(np.argmax(jumps))
    return at, float(jumps[at])


def _has_short_timing(effects: Sequence[Effect], interval: float) -> bool:
    """Whether a delay or a lag shorter than a sampling interval was found."""
    return any(effect.kind in TIMING and abs(effect.value) < interval for effect in effects)
