"""The figures of the report, drawn with matplotlib's objects: strip charts of a log, and d(t) with what explains it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aerosid.nomenclature import CHANNELS
from aerosid.reporting.strips import Limits, Row, Strip, stacked
from aerosid.reporting.words import shown_unit, symbol
from aerosid.results import ErrorHistory, Simulated

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]

CHANNELS_A_CHART = 4
"""Channels in one figure: with their residuals and the inputs they fill most of an A4 page."""

INPUTS_DRAWN = 3

_MAIN, _RESIDUAL, _INPUT, _EQUATION = 62.0, 34.0, 34.0, 84.0  # heights, pt
_WITHIN, _BETWEEN = 4.0, 12.0
_LONGEST_LABEL = 16
_MODELS = ("declared", "before", "after")


def strip_chart(
    simulated: Simulated, channels: Sequence[str], inputs: Sequence[str], noise: Mapping[str, float]
) -> Figure:
    """Measured points and simulated lines of each channel, its residuals below, the inputs at the bottom.

    Parameters
    ----------
    simulated : Simulated
        One log with its simulations.
    channels, inputs : sequence of str
        What is drawn, from the top.
    noise : mapping of str to float
        Standard deviation of each channel's noise, SI, for the band of twice its size in the residual strip.
    """
    time = simulated.log.time
    rows: list[Row] = []
    for name in channels:
        responses = _responses(simulated, name)
        limits = _limits(responses["measured"], *(responses[role] for role in _MODELS if role in responses))
        rows.append(Row(_MAIN, _BETWEEN, axis_label(name, simulated), limits))
        rows.append(
            Row(_RESIDUAL, _WITHIN, "residual", _residual_limits(responses, _band(simulated, name, noise)), True)
        )
    for name in inputs:
        values = shown_unit(_unit(name, simulated)).factor * simulated.log[name]
        rows.append(Row(_INPUT, _BETWEEN, axis_label(name, simulated), _limits(values)))
    figure, strips = stacked(rows, (float(time[0]), float(time[-1])))
    for name, main, residual in zip(channels, strips[0::2], strips[1::2], strict=False):
        responses = _responses(simulated, name)
        _draw_responses(main, time, responses)
        _draw_residuals(residual, time, responses, _band(simulated, name, noise))
    for name, strip in zip(inputs, strips[2 * len(channels) :], strict=True):
        strip.line(time, shown_unit(_unit(name, simulated)).factor * simulated.log[name], "ink")
    return figure


def model_error_chart(histories: Sequence[ErrorHistory]) -> Figure:
    """d(t) of each equation of one log, and what the found terms explain of it through the same estimator."""
    rows = [
        Row(_EQUATION, _BETWEEN, f"d in {_subscripted(history.coefficient)}", _limits(history.d, history.explained))
        for history in histories
    ]
    times = [history.time for history in histories]
    figure, strips = stacked(rows, (min(float(time[0]) for time in times), max(float(time[-1]) for time in times)))
    for strip, history in zip(strips, histories, strict=True):
        strip.points(history.time, history.d)
        if history.terms:
            strip.line(history.time, history.explained, "after")
    return figure


def inputs_to_draw(simulated: Simulated, wanted: frozenset[str]) -> tuple[str, ...]:
    """The inputs of a log that moved, control surfaces first, then those that the model's terms name.

    Parameters
    ----------
    simulated : Simulated
        One log.
    wanted : frozenset of str
        Channels in the completed model's terms; of the others only control surfaces are drawn.
    """
    log = simulated.log
    names = [name for name in log.channels if name.startswith("delta_") or name in wanted]
    moving = [name for name in names if _moves(log[name]) and name not in simulated.measured]
    ordered = sorted(moving, key=lambda name: (name not in wanted, not name.startswith("delta_")))
    return tuple(ordered[:INPUTS_DRAWN])


def axis_label(name: str, simulated: Simulated) -> str:
    """Symbol and unit in brackets, the symbol's subscript as `_{x}`; an unknown name of any length is cut."""
    text = shown_unit(_unit(name, simulated)).text
    label = _subscripted(name)
    if label == name and len(name) > _LONGEST_LABEL:
        label = name[: _LONGEST_LABEL - 1] + "…"
    return f"{label} [{text}]" if text else label


def _unit(name: str, simulated: Simulated) -> str:
    return CHANNELS[name].unit if name in CHANNELS else simulated.log.units.get(name, "1")


def _subscripted(name: str) -> str:
    base, subscript = symbol(name)
    return f"{base}_{{{subscript}}}" if subscript else base


def _moves(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size and np.ptp(known) > 1e-9 * max(1.0, float(np.max(np.abs(known)))))


def _responses(simulated: Simulated, channel: str) -> dict[str, FloatArray]:
    """Measured and simulated histories of one channel in the unit shown; the trimmed one on validation logs only."""
    factor = shown_unit(_unit(channel, simulated)).factor
    roles = ("measured", *_MODELS, "trimmed") if simulated.role == "validation" else ("measured", *_MODELS)
    held: dict[str, Mapping[str, FloatArray]] = {role: getattr(simulated, role) for role in roles}
    return {role: factor * histories[channel] for role, histories in held.items() if channel in histories}


def _band(simulated: Simulated, channel: str, noise: Mapping[str, float]) -> float:
    """Twice the noise of a channel in the unit shown; 0 where it is unknown."""
    value = 2.0 * shown_unit(_unit(channel, simulated)).factor * noise.get(channel, 0.0)
    return value if math.isfinite(value) else 0.0


def _draw_responses(strip: Strip, time: FloatArray, responses: Mapping[str, FloatArray]) -> None:
    strip.points(time, responses["measured"])
    for role in _MODELS:
        if role in responses:
            strip.line(time, responses[role], role, 1.0 if role == "after" else 1.2)


def _draw_residuals(strip: Strip, time: FloatArray, responses: Mapping[str, FloatArray], band: float) -> None:
    if band:
        strip.band(-band, band)
    for role in ("before", "trimmed", "after"):
        if role in responses:
            strip.line(time, responses["measured"] - responses[role], role, 0.8)


def _residual_limits(responses: Mapping[str, FloatArray], band: float) -> Limits:
    """A scale that serves the completed model, so that its last misfit can be seen."""

    def largest(role: str) -> float:
        residual = np.abs(responses["measured"] - responses[role]) if role in responses else np.zeros(1)
        return float(np.max(residual[np.isfinite(residual)], initial=0.0))

    fine = max(largest("after"), band) or largest("before") or 1.0
    limit = 1.12 * max(fine, min(largest("before"), 4.0 * fine))
    return -limit, limit


def _limits(reference: FloatArray, *others: FloatArray) -> tuple[float, float]:
    """Limits that hold the reference, and of the others as much as does not press it flat."""
    known = reference[np.isfinite(reference)]
    if not known.size:
        known = np.zeros(1)
    low, high = float(known.min()), float(known.max())
    span = (high - low) or max(1e-6, 0.02 * abs(high))
    lowest, highest = low, high
    for values in others:
        finite = values[np.isfinite(values)]
        if finite.size:
            lowest = min(lowest, max(float(finite.min()), low - 0.6 * span))
            highest = max(highest, min(float(finite.max()), high + 0.6 * span))
    margin = 0.07 * (highest - lowest or span)
    return lowest - margin, highest + margin
