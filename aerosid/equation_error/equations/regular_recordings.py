"""The records of a regression: gaps filled, at a constant interval, in the band that all have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.band import Band, band_end, band_up_to
from aerosid.equation_error.equations.bridged_holes import bridged_by_kinematics
from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.settings import TRIALS, EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre

Array = NDArray[np.float64]

IRREGULAR = 0.02
"""Numerical: fraction of the sampling interval, 1, by which samples may deviate from a regular grid before they are
interpolated to one."""


def read_recordings(
    identification: Sequence[Manoeuvre], validation: Sequence[Manoeuvre], settings: EquationErrorSettings
) -> tuple[Recording, ...]:
    """All records, those to be fitted first, with the band chosen from all of them together."""
    measured = [(m, fitted) for part, fitted in ((identification, True), (validation, False)) for m in part]
    derived = [_regular(*each) for each in measured]
    limits = (settings.band_lowest, settings.band_highest, settings.band_share)
    ends: dict[float, float] = {}
    for each in derived:
        if each.interval not in ends:
            alike = [other for other in derived if other.interval == each.interval]
            ends[each.interval] = max(
                band_end(
                    [other.channels[rate] for other in alike],
                    each.interval,
                    settings.band_ratio,
                    settings.band_depth,
                    limits,
                )
                for rate in equations_of(each.manoeuvre.axes).rates
            )
    refined = [_refined(each, ends[each.interval], settings.coarsest) for each in derived]
    return tuple(
        bridged_by_kinematics(each, manoeuvre, settings) for each, (manoeuvre, _) in zip(refined, measured, strict=True)
    )


def _refined(recording: Recording, end: float, coarsest: float) -> Recording:
    """The record in its band, with samples interpolated by cubic splines where its own are too far apart.

    A time delay is evaluated between samples by linear interpolation, which would attenuate the signal as well.
    """
    factor = int(np.ceil(recording.interval / coarsest - 1e-6))
    if factor <= 1:
        return replace(recording, band=band_up_to(end, recording.interval))
    from scipy.interpolate import CubicSpline  # deferred import: most records are fine enough

    manoeuvre = recording.manoeuvre
    time = manoeuvre.flight.time
    interval = recording.interval / factor
    fine = time[0] + interval * np.arange(factor * (time.size - 1) + 1)
    flight = manoeuvre.flight._replace(
        time=fine,
        inputs=CubicSpline(time, manoeuvre.flight.inputs)(fine),
        measured=np.column_stack([np.interp(fine, time, column) for column in manoeuvre.flight.measured.T]),
    )
    return replace(
        recording,
        manoeuvre=replace(manoeuvre, flight=flight),
        interval=interval,
        channels={name: CubicSpline(time, values)(fine) for name, values in recording.channels.items()},
        # The rounding error of a sample affects all interpolated neighbours.
        resolution={name: step * np.sqrt(factor) for name, step in recording.resolution.items()},
        band=band_up_to(end, interval),
        refinement=factor,
    )


def _regular(manoeuvre: Manoeuvre, fitted: bool) -> Recording:
    flight = manoeuvre.flight
    time = flight.time
    interval = float(np.round(np.median(np.diff(time)), 6))
    # Against the grid between its ends: over a long record the rounding of the interval adds up to a whole sample.
    even = np.linspace(time[0], time[-1], time.size)
    is_irregular = float(np.abs(time - even).max()) > IRREGULAR * interval
    if is_irregular:
        count = int(np.floor((time[-1] - time[0]) / interval + 1e-6)) + 1
        time = time[0] + interval * np.arange(count)
    channels = {}
    for name in manoeuvre.outputs:
        values = flight.measured[:, manoeuvre.axes.outputs.index(name)]
        present = np.isfinite(values)
        channels[name] = np.interp(time, flight.time[present], values[present])
    inputs = flight.inputs
    if is_irregular:
        inputs = np.column_stack([np.interp(time, flight.time, column) for column in flight.inputs.T])
    measured = np.column_stack([channels.get(name, np.full(time.size, np.nan)) for name in manoeuvre.axes.outputs])
    regular = replace(manoeuvre, flight=flight._replace(time=time, inputs=inputs, measured=measured))
    resolution = {name: _step(values) for name, values in channels.items()}
    return Recording(regular, fitted, interval, channels, resolution, Band(1, np.ones(1)))


def _step(values: Array) -> float:
    """The quantisation step of a channel, where it repeats values; else 0."""
    levels = np.unique(values)
    if levels.size > TRIALS.repeated * values.size or levels.size < 2:
        return 0.0
    return float(np.median(np.diff(levels)))
