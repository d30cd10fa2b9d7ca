"""The comparison with other tools as a section of the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from aerosid.reporting.figures.chart import Axis, Chart, Line, Panel, Points, Role, Words
from aerosid.reporting.figures.layout import WIDTH
from aerosid.reporting.figures.numbered import FigureBook
from benchmarks.rivals.contest import FLIGHTS, RIVALS, Score, compete
from benchmarks.sections import Section, Table

_HEADINGS = (
    *("tool", "s", "time / aerosid's", "error / bound", "worst derivative", "95 % intervals true", "structure right"),
    "flights",
)


_TASK = (
    "The task: the sample flight of the light transport (flight_data/light_transport_doublet.csv), 470 samples, seven "
    "channels and the elevator with noise. Its aircraft file lacks C_X alpha^2 and C_m alpha^2. Every tool gets the "
    "flight, the constants, the declared derivatives to start from, and the second sample flight where it can use one. "
    "Errors are counted on the sample flight and on others with other noise: root mean square over 12 derivatives and "
    "all flights, each in units of its Cramér-Rao bound (structure known, elevator's noise counted), so that 1 is the "
    "best that an unbiased estimate can be. Times are the best of several on the sample flight, warm, all tools in "
    "turn in one process."
)


def contest_section(folder: Path, book: FigureBook, flights: int = FLIGHTS) -> Section:
    """All tools on the sample flight and on others with other noise; `folder` is where they compile."""
    scores = compete(folder, flights, RIVALS)
    asked = [score for score in scores if not score.told]
    told = [score for score in scores if score.told]
    figures = (
        book.add(
            _chart(scores),
            "Time on the sample flight, and root-mean-square error in units of the Cramér-Rao bound; logarithmic axes, "
            "and less is better on both.",
            "A row for each tool with its time and its error over the bound, the numbers of the two tables above.",
        ),
        book.add(
            _error_against_time(scores),
            "The same errors against the times; numbers as in the figure before. Logarithmic axes: below and "
            "to the left is better. 1 is the bound.",
            "Error over the bound against time, a numbered dot for each tool.",
        ),
    )
    return Section(
        "tools",
        "What a user would pick instead",
        (
            _TASK,
            Table(_HEADINGS, _rows(asked, asked[0].seconds), 1, "Asked what is missing, and every derivative"),
            Table(_HEADINGS, _rows(told, told[0].seconds), 1, "Told the structure, asked every derivative"),
            *figures,
            Table(
                ("tool", "what it is given, how it is set"),
                tuple((f"{score.name}{', told' if score.told else ''}", score.given) for score in scores),
                2,
            ),
            *_reading(scores),
        ),
    )


def _rows(scores: Sequence[Score], reference: float | None) -> tuple[tuple[str, ...], ...]:
    return tuple(_row(score, reference) for score in scores)


def _row(score: Score, reference: float | None) -> tuple[str, ...]:
    if score.missing or score.seconds is None:
        return score.name, score.missing, *("" for _ in _HEADINGS[2:])
    return (
        score.name,
        f"{score.seconds:.3g}",
        _ratio(score.seconds / reference) if reference else "",
        _with_deviation(score),
        f"{score.worst:.2f}",
        _share(score.covered),
        "told" if score.right is None else f"{score.right} of {score.flights}",
        f"{score.flights}",
    )


def _reading(scores: Sequence[Score]) -> list[str]:
    """What the numbers of this run say, in ratios."""
    times = {score.name: score.seconds for score in scores if score.told and score.seconds is not None}
    covered = {score.name: _share(score.covered) for score in scores}
    own = times.pop("aerosid")
    faster = [
        f"{name} ({own / seconds:.1f} times; intervals true in {covered[name]})"
        for name, seconds in times.items()
        if seconds < own
    ]
    texts = []
    if faster:
        names = ", ".join(faster)
        texts.append(f"Told the structure, faster than aerosid (intervals true in {covered['aerosid']}): {names}.")
    texts.append(
        "Errors below the bound are luck of the noise that was drawn, the same for all tools. Derivatives of one "
        "flight share its noise, so that the share of true intervals scatters by a few per cent. Where one flight was "
        "judged, its error is that of one draw."
    )
    return texts


def _with_deviation(score: Score) -> str:
    deviation = "" if score.error_deviation is None else f" ± {score.error_deviation:.2f}"
    return f"{score.error:.2f}{deviation}"


def _share(covered: float | None) -> str:
    return "none given" if covered is None else f"{100.0 * covered:.0f} %"


def _ratio(value: float) -> str:
    """Two digits, never as a power of ten."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _chart(scores: Sequence[Score]) -> Chart:
    """A row for each tool: its time on one logarithmic axis, its error over the bound on another."""
    there = [score for score in scores if score.seconds is not None and score.error is not None]
    rows = np.arange(len(there), 0.0, -1.0)
    limits = (0.3, len(there) + 0.7)
    height = 15.0 * len(there)
    names = [
        Words(0.98, row - 0.15, f"{score.name}{', told' if score.told else ''} ({n})", "ink", "right", 7.5)
        for n, (row, score) in enumerate(zip(rows, there, strict=True), 1)
    ]
    panels = [
        Panel(0.0, _BOTTOM, _NAMES, height, Axis("", (0.0, 1.0)), Axis("", limits), tuple(names), framed=False),
        _dots(
            _NAMES + 6.0, "time on the sample flight [s]", [s.seconds or 1.0 for s in there], rows, limits, there, 10.0
        ),
        _dots(_NAMES + _ACROSS + 16.0, "error / bound", [s.error or 1.0 for s in there], rows, limits, there, 2.0),
    ]
    return Chart(WIDTH, _BOTTOM + height + 6.0, tuple(panels))


def _error_against_time(scores: Sequence[Score]) -> Chart:
    """Each tool's error over the bound against its time, on logarithmic axes."""
    there = [score for score in scores if score.seconds is not None and score.error is not None]
    x = np.log10([score.seconds or 1.0 for score in there])
    y = np.log2([score.error or 1.0 for score in there])
    (left, right), (low, high) = _whole(x), _whole(y)
    marks: list[Line | Points | Words] = []
    for exponent in range(left, right + 1):
        marks.append(Line(np.full(2, float(exponent)), np.array([low, high], dtype=np.float64), "grid", 0.5))
        marks.append(Words(exponent + 0.03, low + 0.06, f"{10.0**exponent:g}", "muted", size=6.5))
    for exponent in range(low, high + 1):
        role: Role = "muted" if exponent == 0 else "grid"
        marks.append(Line(np.array([left, right], dtype=np.float64), np.full(2, float(exponent)), role, 0.5))
        marks.append(Words(right - 0.03, exponent + 0.06, f"{2.0**exponent:g}", "muted", "right", 6.5))
    for n, score in enumerate(there):
        own: Role = "after" if score.name.startswith("aerosid") else "declared"
        marks.append(Points(x[n : n + 1], y[n : n + 1], own, ordered=False))
        marks.append(Words(float(x[n]) + 0.05, float(y[n]) + 0.07, str(n + 1), "ink", size=7.5))
    across, height = WIDTH - 70.0, 150.0
    axes = Axis("time on the sample flight [s]", (left, right)), Axis("error / bound", (low, high))
    return Chart(WIDTH, _BOTTOM + height + 6.0, (Panel(55.0, _BOTTOM, across, height, *axes, tuple(marks)),))


def _whole(values: np.ndarray) -> tuple[int, int]:
    """Whole exponents around some logarithms."""
    return math.floor(float(values.min()) - 0.2), math.ceil(float(values.max()) + 0.2)


_NAMES, _ACROSS, _BOTTOM = 170.0, 170.0, 30.0  # pt


def _dots(
    left: float,
    label: str,
    values: Sequence[float],
    rows: np.ndarray,
    limits: tuple[float, float],
    scores: Sequence[Score],
    base: float,
) -> Panel:
    """One panel of dots; grid and numbers at the powers of `base`."""
    x = np.log(values) / np.log(base)
    low, high = math.floor(float(x.min()) - 0.2), math.ceil(float(x.max()) + 0.2)
    marks: list[Line | Points | Words] = []
    for exponent in range(low, high + 1):
        across = np.full(2, float(exponent))
        marks.append(Line(across, np.array(limits), "muted" if base**exponent == 1.0 else "grid", 0.5))
        if exponent < high:
            marks.append(Words(exponent + 0.04, limits[0] + 0.1, f"{base**exponent:g}", "muted", size=6.5))
    for n, score in enumerate(scores):
        role: Role = "after" if score.name.startswith("aerosid") else "declared"
        marks.append(Line(np.array([low, x[n]]), np.full(2, rows[n]), role, 2.5))
        marks.append(Points(x[n : n + 1], rows[n : n + 1], role, ordered=False))
    return Panel(left, _BOTTOM, _ACROSS, 15.0 * len(scores), Axis(label, (low, high)), Axis("", limits), tuple(marks))
