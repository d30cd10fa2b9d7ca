"""The figures of the report, drawn with matplotlib's objects: strip charts of a log, and d(t) with what explains it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aerosid.nomenclature import CHANNELS
from aerosid.reporting.inline_svg import COLOURS
from aerosid.reporting.thinning import envelope
from aerosid.reporting.words import shown_unit, symbol
from aerosid.results import ErrorHistory, Simulated

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]

CHANNELS_A_CHART = 4
"""Channels in one figure: with their residuals and the inputs they fill most of an A4 page."""

INPUTS_DRAWN = 3

_WIDTH, _LEFT, _RIGHT = 540.0, 52.0, 6.0  # pt
_MAIN, _RESIDUAL, _INPUT, _EQUATION = 62.0, 34.0, 34.0, 84.0
_WITHIN, _BETWEEN, _TOP, _BOTTOM = 4.0, 12.0, 6.0, 28.0
_LONGEST_LABEL = 16

_DASHES: dict[str, tuple[float, tuple[float, ...]]] = {
    "declared": (0.0, (1.2, 1.6)),
    "before": (0.0, (5.0, 2.0)),
    "trimmed": (0.0, (7.0, 1.5, 1.5, 1.5)),
}
_WIDTHS = {"after": 1.0, "declared": 1.3}


@dataclass(frozen=True)
class _Panel:
    """One strip: its height, the gap above it [pt], and its label."""

    height: float
    gap: float
    label: str


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
    panels: list[_Panel] = []
    for name in channels:
        panels.append(_Panel(_MAIN, _BETWEEN, axis_label(name, simulated)))
        panels.append(_Panel(_RESIDUAL, _WITHIN, "residual"))
    panels.extend(_Panel(_INPUT, _BETWEEN, axis_label(name, simulated)) for name in inputs)
    time = simulated.log.time
    figure, axes = _stack(panels, (float(time[0]), float(time[-1])))
    for i, name in enumerate(channels):
        factor = shown_unit(_unit(name, simulated)).factor
        _responses(axes[2 * i], simulated, name, factor)
        _residuals(axes[2 * i + 1], simulated, name, factor, noise.get(name))
    for axis, name in zip(axes[2 * len(channels) :], inputs, strict=True):
        values = shown_unit(_unit(name, simulated)).factor * simulated.log[name]
        _line(axis, time, values, "ink")
        axis.set_ylim(*_limits(values))
    _finish(axes)
    return figure


def model_error_chart(histories: Sequence[ErrorHistory]) -> Figure:
    """d(t) of each equation of one log, and what the found terms explain of it through the same estimator."""
    panels = [_Panel(_EQUATION, _BETWEEN, f"d in {_subscripted(history.coefficient)}") for history in histories]
    spans = [history.time for history in histories]
    figure, axes = _stack(panels, (min(float(time[0]) for time in spans), max(float(time[-1]) for time in spans)))
    for axis, history in zip(axes, histories, strict=True):
        _points(axis, history.time, history.d)
        if history.terms:
            _line(axis, history.time, history.explained, "after")
        axis.set_ylim(*_limits(history.d, history.explained))
    _finish(axes)
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


def _stack(panels: Sequence[_Panel], span: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    """A figure with the panels below one another on one time axis."""
    from matplotlib.figure import Figure

    height = _TOP - panels[0].gap + sum(panel.height + panel.gap for panel in panels) + _BOTTOM
    figure = Figure((_WIDTH / 72.0, height / 72.0), dpi=72)
    axes = []
    top = height - _TOP + panels[0].gap
    for panel in panels:
        top -= panel.gap + panel.height
        place = (_LEFT / _WIDTH, top / height, (_WIDTH - _LEFT - _RIGHT) / _WIDTH, panel.height / height)
        axis = figure.add_axes(place)
        axis.set_xlim(*span)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
        small = panel.label == "residual"
        figure.text(
            9.0 / _WIDTH,
            (top + 0.5 * panel.height) / height,
            panel.label,
            rotation=90,
            rotation_mode="anchor",
            ha="center",
            va="center",
            parse_math=False,
            fontsize=6.5 if small else 8.0,
            color=COLOURS["muted" if small else "ink"],
        )
        axes.append(axis)
    return figure, axes


def _finish(axes: Sequence[Axes]) -> None:
    """Few ticks with plain numbers, faint grid lines, time below the last panel only."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter

    plain = FuncFormatter(lambda value, _: f"{0.0 if abs(value) < 1e-12 else value:.6g}".replace("-", "−"))
    low, high = axes[0].get_xlim()
    instants = MaxNLocator(8, steps=[1, 2, 5, 10]).tick_values(low, high)
    for axis in axes:
        last = axis is axes[-1]
        tall = axis.get_position().height * axis.figure.get_size_inches()[1] * 72.0 > 50.0  # type: ignore[union-attr]
        axis.xaxis.set_major_locator(FixedLocator([t for t in instants if low <= t <= high]))
        axis.xaxis.set_major_formatter(plain if last else NullFormatter())
        bottom, top = axis.get_ylim()
        levels = MaxNLocator(4 if tall else 2, steps=[1, 2, 2.5, 5, 10]).tick_values(bottom, top)
        axis.yaxis.set_major_locator(FixedLocator([level for level in levels if bottom <= level <= top]))
        axis.yaxis.set_major_formatter(plain)
        axis.tick_params(labelsize=7.5 if tall or last else 6.5)
        axis.grid(True)
    axes[-1].set_xlabel("time [s]", labelpad=2.0)


def _responses(axis: Axes, simulated: Simulated, channel: str, factor: float) -> None:
    """Measured, declared, re-estimated and completed of one channel."""
    time = simulated.log.time
    measured = factor * simulated.measured[channel]
    _points(axis, time, measured)
    lines = {}
    for role in ("declared", "before", "after"):
        history: Mapping[str, FloatArray] = getattr(simulated, role)
        if channel in history:
            lines[role] = factor * history[channel]
            _line(axis, time, lines[role], role)
    axis.set_ylim(*_limits(measured, *lines.values()))


def _residuals(axis: Axes, simulated: Simulated, channel: str, factor: float, noise: float | None) -> None:
    """Measured minus simulated; the scale serves the completed model, so that its last misfit can be seen."""
    time = simulated.log.time
    measured = simulated.measured[channel]
    roles = ("before", "trimmed", "after") if simulated.role == "validation" else ("before", "after")
    largest = {}
    if noise is not None and math.isfinite(noise):
        axis.axhspan(-2.0 * factor * noise, 2.0 * factor * noise, color=COLOURS["noise"], lw=0.0, gid="noise")
        largest["noise"] = 2.0 * factor * noise
    for role in roles:
        history: Mapping[str, FloatArray] = getattr(simulated, role)
        if channel in history:
            residual = factor * (measured - history[channel])
            _line(axis, time, residual, role, width=0.8)
            known = np.abs(residual[np.isfinite(residual)])
            largest[role] = float(known.max()) if known.size else 0.0
    fine = max(largest.get("after", 0.0), largest.get("noise", 0.0)) or largest.get("before", 0.0) or 1.0
    limit = 1.12 * max(fine, min(largest.get("before", 0.0), 4.0 * fine))
    axis.set_ylim(-limit, limit)


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


def _line(axis: Axes, time: FloatArray, values: FloatArray, role: str, width: float | None = None) -> None:
    from matplotlib.lines import Line2D

    line = Line2D(
        *envelope(time, values),
        color=COLOURS[role],
        linewidth=width or _WIDTHS.get(role, 1.1),
        linestyle=_DASHES.get(role, "solid"),
        gid=role,
    )
    axis.add_line(line)


def _points(axis: Axes, time: FloatArray, values: FloatArray) -> None:
    """One dot a sample: a path of strokes without length and with round ends, far lighter than so many markers."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    instants, levels = envelope(time, values)
    known = np.isfinite(levels)
    corners = np.repeat(np.column_stack([instants[known], levels[known]]), 2, axis=0)
    codes = np.tile(np.array([Path.MOVETO, Path.LINETO], dtype=np.uint8), int(known.sum()))
    path = Path(corners, codes)
    path.should_simplify = False
    dots = PathPatch(path, fill=False, edgecolor=COLOURS["measured"], linewidth=2.2, capstyle="round", gid="measured")
    axis.add_patch(dots)
