"""Misfits of the channels to the path integrated over short windows, and the outputs that they make contradict."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from aerosid.compatibility.flight_path import DRIVING, OBSERVED
from aerosid.compatibility.recording import Recording
from aerosid.compatibility.settings import ContradictionSettings
from aerosid.compatibility.window_fit import FIRST_ROUND, QUICK, WindowFitSettings, fit_windows
from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.effects.limits import OFFERED
from aerosid.effects.sensor import sensor_bias
from aerosid.nomenclature import CHANNELS

Misfits = Mapping[str, tuple[float, float]]
"""Of each output, the unexplained fraction of its variation, 1, and the misfit itself, SI."""


def misfits_of(
    windows: Recording,
    settings: ContradictionSettings,
    instrument_errors: Sequence[ActiveEffect] = (),
    outputs: Sequence[str] = OBSERVED,
    fit: WindowFitSettings = QUICK,
) -> Misfits:
    """Unexplained fraction of each output's variation, and the misfit itself (SI), with free biases.

    `instrument_errors`: others that are free too, with start values; `fit`: settings of the fit.
    """
    left_out = [OBSERVED.index(name) for name in OBSERVED if name not in outputs]
    compared = windows.compared.copy()
    compared[:, left_out] = False
    windows = replace(windows, compared=compared)
    with np.errstate(all="ignore"):
        fitted = fit_windows(windows, [*instrument_errors, *_biases(windows, settings)], fit)
    result = {}
    for name in windows.outputs:
        i = OBSERVED.index(name)
        squares, variation, count = 0.0, 0.0, 0
        for stretch, residual in zip(windows.stretches, fitted.residuals, strict=True):
            held = windows.compared[stretch, i]
            measured = windows.measured[stretch, i][held]
            if measured.size > 1:
                squares += float(np.sum(residual[held, i] ** 2))
                variation += float(np.sum((measured - measured.mean()) ** 2))
                count += measured.size
        misfit = float(np.sqrt(squares / max(count, 1)))
        misfit = misfit if np.isfinite(misfit) else np.inf
        result[name] = (misfit / float(np.sqrt(max(variation, 1e-300) / max(count, 1))), misfit)
    return result


def misfits_if_near(
    changed: Recording,
    settings: ContradictionSettings,
    is_near: Callable[[Misfits], bool],
) -> Misfits | None:
    """The misfits of a recording with a remedy; None where those after the fit's first round are not near.

    Most remedies are hopeless: with the right one the noise's variances, which later rounds estimate, hardly matter.
    """
    return misfits_of(changed, settings) if is_near(misfits_of(changed, settings, fit=FIRST_ROUND)) else None


def _biases(windows: Recording, settings: ContradictionSettings) -> list[ActiveEffect]:
    """Biases of the driving inputs, and of theta and alpha; those of the others are part of the initial states."""
    seen = [name for name in ("theta", "alpha") if name in windows.outputs]
    return [
        limited(
            sensor_bias(name, CHANNELS[name].unit, max(windows.noise[name], 1e-9)),
            settings.small_bias if name in seen else OFFERED.largest_bias[CHANNELS[name].unit],
        )
        for name in (*DRIVING, *seen)
    ]


def limited(effect: OutputEffect, reach: float, start: float | None = None) -> ActiveEffect:
    """The effect from `start`, by default null, its parameter within a reach of null."""
    (parameter,) = effect.parameters
    lowest, highest = max(parameter.lowest, parameter.null - reach), min(parameter.highest, parameter.null + reach)
    bound = replace(parameter, lowest=lowest, highest=highest)
    return ActiveEffect(replace(effect, parameters=(bound,)), (parameter.null if start is None else start,))


def contradicting_outputs(windows: Recording, settings: ContradictionSettings, misfits: Misfits) -> tuple[str, ...]:
    """The outputs whose misfit exceeds noise, gusts and drift."""
    contradicting = []
    for name, (fraction, misfit) in misfits.items():
        least = max(settings.least(name, windows.airspeed), settings.above_noise * windows.noise[name])
        if fraction > settings.worst_fraction(name) and misfit > least:
            contradicting.append(name)
    return tuple(contradicting)


def suspect_outputs(windows: Recording, settings: ContradictionSettings, misfits: Misfits) -> tuple[str, ...]:
    """The outputs that contradict if a change of sign, unit or clock removes their misfit."""
    suspect = []
    for name, (fraction, misfit) in misfits.items():
        air = settings.doubtful_air * settings.least(name, windows.airspeed)
        noise = settings.doubtful_noise * settings.above_noise * windows.noise[name]
        if fraction > settings.doubtful and misfit > max(air, noise):
            suspect.append(name)
    return tuple(suspect)
