"""Strip charts: the channels of a log with their residuals and the inputs below, and d(t) with the terms' parts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.model_error.aircraft_error.force_history import ErrorHistory
from aerosid.nomenclature import CHANNELS, is_surface
from aerosid.reporting.figures.chart import Band, Chart, Corridor, FloatArray, Limits, Line, Mark, Points, Role
from aerosid.reporting.figures.layout import Row, limits_around, stacked
from aerosid.reporting.words import shown_unit, subscripted

CHANNELS_A_CHART = 8
"""Display: channels in one figure: a flight is shown on one sheet."""

TALLEST = 570.0
"""Display: maximum height, pt, of a figure's strips: with legend and caption it fills a page of A4."""

INPUTS_DRAWN = 3
"""Display: controls under the channels at most."""

_MAIN, _RESIDUAL, _INPUT, _EQUATION = 62.0, 30.0, 46.0, 50.0
"""Display: pt, heights of strips."""

_WITHIN, _BETWEEN = 4.0, 12.0
"""Display: pt between a strip and its residual, and between channels."""

_LONGEST_LABEL = 16
"""Display: characters of a strip's label at most."""

_MODELS: tuple[Role, ...] = ("declared", "before", "after")
_RESIDUALS: tuple[Role, ...] = ("before", "trimmed", "after")
_DECLARED_ALONE: tuple[Role, ...] = ("declared",)
"""Of a flight on which nothing was estimated."""


def strip_chart(
    simulated: Simulated,
    channels: Sequence[str],
    inputs: Sequence[str],
    noise: Mapping[str, float],
    corridors: Mapping[str, tuple[FloatArray, FloatArray]] | None = None,
) -> Chart:
    """Measured points and simulated lines of each channel, its residuals below, the inputs at the bottom.

    Parameters
    ----------
    simulated : Simulated
        One log with its simulations.
    channels, inputs : sequence of str
        The channels shown, from the top.
    noise : mapping of str to float
        Standard deviation of each channel's noise, SI, for the band of twice its size in the residual strip.
    corridors : mapping of str to (ndarray, ndarray)
        Lower and upper edge (N,), SI, of a channel's tolerance; NaN where none applies.
    """
    time = simulated.log.time
    natural = len(channels) * (_MAIN + _RESIDUAL + _WITHIN + _BETWEEN) + len(inputs) * (_INPUT + _BETWEEN)
    pressed = min(1.0, TALLEST / natural)
    rows: list[Row] = []
    for name in channels:
        responses = _responses(simulated, name)
        band = _shown(simulated, name, 2.0 * noise.get(name, 0.0))
        edges = (corridors or {}).get(name)
        factor = shown_unit(_unit(name, simulated)).factor
        allowed = (factor * edges[0], factor * edges[1]) if edges else None
        rows.append(_main_row(time, responses, axis_label(name, simulated), allowed, pressed))
        limits = _residual_limits(responses, band)
        label = f"Δ{axis_label(name, simulated)}"
        marks = _residual_marks(time, responses, band)
        rows.append(Row(pressed * _RESIDUAL, pressed * _WITHIN, label, limits, marks, quiet=True))
    for name in inputs:
        values = shown_unit(_unit(name, simulated)).factor * simulated.log[name]
        limits = limits_around(values)
        line = Line(time, values, "ink")
        rows.append(Row(pressed * _INPUT, pressed * _BETWEEN, axis_label(name, simulated), limits, (line,)))
    return stacked(rows, (float(time[0]), float(time[-1])), simulated.log.name)


def model_error_chart(histories: Sequence[ErrorHistory]) -> Chart:
    """d(t) of each equation of one log, and its part explained by the found terms through the same estimator."""
    rows = []
    for history in histories:
        marks: list[Mark] = []
        if history.deviation is not None:
            edges = (history.d - 2.0 * history.deviation, history.d + 2.0 * history.deviation)
            marks.append(Corridor(history.time, *edges, "noise"))
        marks.append(Points(history.time, history.d))
        if history.terms or history.effects:
            marks.append(Line(history.time, history.explained, "after"))
        label = f"d in {subscripted(history.coefficient)} [1]"
        rows.append(Row(_EQUATION, _BETWEEN, label, _error_limits(history), tuple(marks)))
    times = [history.time for history in histories]
    span = (min(float(time[0]) for time in times), max(float(time[-1]) for time in times))
    return stacked(rows, span, histories[0].log)


def _error_limits(history: ErrorHistory) -> Limits:
    """Limits for d(t), or for its band where that is wider, so that an uncertain d(t) does not look like a signal."""
    if history.deviation is not None:
        reach = 2.0 * float(np.nanmedian(history.deviation))
        if reach > 0.5 * float(np.nanmax(history.d) - np.nanmin(history.d)):
            return limits_around(np.concatenate([history.d - reach, history.d + reach]))
    return limits_around(history.d, history.explained)


def inputs_to_draw(simulated: Simulated, wanted: frozenset[str]) -> tuple[str, ...]:
    """The inputs of a log that moved, control surfaces first, then other inputs of the model's terms.

    Parameters
    ----------
    simulated : Simulated
        One log.
    wanted : frozenset of str
        Channels in the completed model's terms; of the others only control surfaces are drawn.
    """
    log = simulated.log
    names = [name for name in log.channels if is_surface(name) or name in wanted]
    moving = [name for name in names if _moves(log[name]) and name not in simulated.measured]
    ordered = sorted(moving, key=lambda name: (name not in wanted, not is_surface(name)))
    return tuple(ordered[:INPUTS_DRAWN])


def axis_label(name: str, simulated: Simulated) -> str:
    """Symbol and unit in brackets, the symbol's subscript as `_{x}`; an unknown name is truncated."""
    text = shown_unit(_unit(name, simulated)).text
    label = subscripted(name)
    if label == name and len(name) > _LONGEST_LABEL:
        label = name[: _LONGEST_LABEL - 1] + "…"
    return f"{label} [{text or 1}]"


def _unit(name: str, simulated: Simulated) -> str:
    return CHANNELS[name].unit if name in CHANNELS else simulated.log.units.get(name, "1")


def _moves(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size and np.ptp(known) > 1e-9 * max(1.0, float(np.max(np.abs(known)))))


def _responses(simulated: Simulated, channel: str) -> dict[Role, FloatArray]:
    """Measured and simulated histories of one channel in the unit shown; the trimmed one where nothing was fitted."""
    factor = shown_unit(_unit(channel, simulated)).factor
    roles: tuple[Role, ...] = ("measured", *_MODELS)
    if simulated.role != "identification":
        roles = (*roles, "trimmed")
    held: dict[Role, Mapping[str, FloatArray]] = {role: getattr(simulated, role) for role in roles}
    return {role: factor * histories[channel] for role, histories in held.items() if channel in histories}


def _shown(simulated: Simulated, channel: str, value: float) -> float:
    """An SI number of a channel in the unit shown; 0 where it is unknown."""
    value *= shown_unit(_unit(channel, simulated)).factor
    return value if math.isfinite(value) else 0.0


def _main_row(
    time: FloatArray,
    responses: Mapping[Role, FloatArray],
    label: str,
    allowed: tuple[FloatArray, FloatArray] | None,
    pressed: float,
) -> Row:
    """The strip with the measured points and the simulations over them."""
    measured = responses["measured"]
    marks: list[Mark] = list(_stretches(time, *allowed)) if allowed else []
    marks.append(Points(time, measured))
    marks.extend(Line(time, responses[r], r, 1.0 if r == "after" else 1.2) for r in _MODELS if r in responses)
    limits = limits_around(measured, *(responses[role] for role in _MODELS if role in responses))
    return Row(pressed * _MAIN, pressed * _BETWEEN, label, limits, tuple(marks))


def _stretches(time: FloatArray, low: FloatArray, high: FloatArray) -> Iterator[Corridor | Line]:
    """A faint corridor with thin edges for each stretch in which the tolerance is known."""
    present = np.isfinite(low) & np.isfinite(high)
    ends = np.flatnonzero(np.diff(present.astype(np.int8), prepend=0, append=0))
    for start, stop in zip(ends[0::2], ends[1::2], strict=True):
        inside = slice(start, stop)
        yield Corridor(time[inside], low[inside], high[inside])
        yield from (Line(time[inside], edge[inside], "tolerance-edge", 0.5) for edge in (low, high))


def _residual_marks(time: FloatArray, responses: Mapping[Role, FloatArray], band: float) -> tuple[Mark, ...]:
    shown = _residual_roles(responses)
    residuals = [Line(time, responses["measured"] - responses[r], r, 0.8) for r in shown if r in responses]
    return (Band(-band, band), *residuals) if band else tuple(residuals)


def _residual_roles(responses: Mapping[Role, FloatArray]) -> tuple[Role, ...]:
    """The models whose residuals are shown: the declared one where there is no other."""
    known = any(np.isfinite(responses[role]).any() for role in _RESIDUALS if role in responses)
    return _RESIDUALS if known else _DECLARED_ALONE


def _residual_limits(responses: Mapping[Role, FloatArray], band: float) -> Limits:
    """Limits chosen for the completed model, so that its remaining error is visible."""

    def largest(role: Role) -> float:
        residual = np.abs(responses["measured"] - responses[role]) if role in responses else np.zeros(1)
        return float(np.max(residual[np.isfinite(residual)], initial=0.0))

    if _residual_roles(responses) == _DECLARED_ALONE:
        reach = 1.12 * (max(largest("declared"), band) or 1.0)
        return -reach, reach
    fine = max(largest("after"), band) or largest("before") or 1.0
    limit = 1.12 * max(fine, min(largest("before"), 4.0 * fine))
    return -limit, limit
