"""Figures 1 to 5 of the paper, redrawn from our estimates; call them within `drawing_style` of the reporting."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aerosid.model_error.estimators.functions import model_functions
from aerosid.reporting.inline_svg import COLOURS
from aerosid.studies.paper import continuous_example, discrete_example
from aerosid.studies.paper.flight_example import INTERVAL, Flight, noisy, reference_flight
from aerosid.studies.paper.polynomial_fit import PolynomialFit
from aerosid.studies.paper.table3 import estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

WIDTH = 7.5
"""Display: inch; 540 pt, as the figures of a close-loop report."""


@dataclass(frozen=True)
class Drawing:
    """A figure with its number and description; `names` are its lines, by the role that gives their colour."""

    number: int
    caption: str
    names: tuple[tuple[str, str], ...]
    draw: Callable[[], Figure]


_TRUE_ESTIMATED = (("measured", "true"), ("after", "estimated"))


def drawings(table1: Sequence[PolynomialFit], table2: Sequence[PolynomialFit]) -> tuple[Drawing, ...]:
    """The five figures.

    Parameters
    ----------
    table1, table2 : sequence of PolynomialFit
        Cases I to IV of the tables.
    """
    return (
        Drawing(
            1,
            "Discrete system, case II (X1 and X1³ removed): states, model error d1 and residuals of the 100 points. "
            "The paper's curves for true and estimated lie on each other, as here.",
            _TRUE_ESTIMATED,
            lambda: _discrete(table1[1], discrete_example.CASES[1]),
        ),
        Drawing(
            2,
            "Discrete system, case IV (X1, X2 and X1³ removed, six points).",
            _TRUE_ESTIMATED,
            lambda: _discrete(table1[3], discrete_example.CASES[3]),
        ),
        Drawing(
            3,
            "Continuous system, case II (X2 and X2³ removed): states and model error d1 of the 300 points. X(0) and "
            "the sampling interval are ours.",
            _TRUE_ESTIMATED,
            lambda: _continuous(table2[1], continuous_example.CASES[1]),
        ),
        Drawing(
            4,
            "Light transport: the true states and those of the deficient model (both alpha² terms missing), open loop "
            "from the same trim with the same elevator. Out of its trim the deficient model departs; it is drawn as "
            "long as its angle of attack stays below 1 rad. The paper's flight condition is not printed.",
            (("measured", "true"), ("declared", "deficient model")),
            lambda: _deficient(reference_flight()),
        ),
        Drawing(
            5,
            "Light transport: the true states and those estimated by the recursion with the deficient model, no noise.",
            _TRUE_ESTIMATED,
            lambda: _estimated(reference_flight()),
        ),
    )


def _axes(rows: int, columns: int, labels: Sequence[str], across: str) -> tuple[Figure, list[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, 1.7 * rows + 0.3), layout="constrained")
    axes = [figure.add_subplot(rows, columns, i + 1) for i in range(len(labels))]
    for place, (axis, label) in enumerate(zip(axes, labels, strict=True)):
        axis.set_ylabel(label)
        axis.grid(visible=True)
        if place >= len(labels) - columns:
            axis.set_xlabel(across)
        for edge in ("top", "right"):
            axis.spines[edge].set_visible(False)
    return figure, axes


def _true(axis: Axes, x: Array, y: Array) -> None:
    axis.plot(x, y, color=COLOURS["measured"], linewidth=3.0, solid_capstyle="round")


def _line(axis: Axes, x: Array, y: Array, role: str = "after") -> None:
    axis.plot(x, y, color=COLOURS[role], linestyle=(0, (2.0, 1.5)) if role == "declared" else "-")


def _discrete(fit: PolynomialFit, case: discrete_example.Case) -> Figure:
    figure, axes = _axes(2, 2, ("X1", "X2", "model error d1", "residual y − x̂ of X1"), "sample")
    truth, history = discrete_example.true_states(case.points), fit.history
    sample = np.arange(float(case.points))
    for i in range(2):
        _true(axes[i], sample, truth[:, i])
        _line(axes[i], sample, history.states[:, i])
    columns = discrete_example.candidate_columns(truth[:-1])
    d = columns[:, list(case.lacking)] @ np.array([discrete_example.TRUTH[i] for i in case.lacking])
    _true(axes[2], sample[:-1], d)
    _line(axes[2], sample[:-1], history.model_error[:, 0])
    _line(axes[3], sample, truth[:, 0] - history.states[:, 0])
    return figure


def _continuous(fit: PolynomialFit, case: discrete_example.Case) -> Figure:
    figure, axes = _axes(2, 2, ("X1", "X2", "model error d1", "error of d1"), "sample")
    history = fit.history
    truth = continuous_example.true_states(np.asarray(history.time))
    sample = np.arange(float(case.points))
    for i in range(2):
        _true(axes[i], sample, truth[:, i])
        _line(axes[i], sample, history.states[:, i])
    columns = continuous_example.candidate_columns(truth)
    d = columns[:, list(case.lacking)] @ np.array([continuous_example.TRUTH[i] for i in case.lacking])
    _true(axes[2], sample, d)
    _line(axes[2], sample, history.model_error[:, 0])
    _line(axes[3], sample, history.model_error[:, 0] - d)
    return figure


_FLIGHT_LABELS = ("u, m/s", "w, m/s", "q, rad/s", "θ, rad")


def _deficient(flight: Flight) -> Figure:
    figure, axes = _axes(2, 2, _FLIGHT_LABELS, "time, s")
    step = model_functions(flight.rates, flight.observe, n=4, p=4, substeps=2).step
    inputs, states = flight.inputs((0.0, 0.0)), [flight.states[0].copy()]
    for k in range(flight.time.size - 1):
        following = step(states[-1], inputs[k], inputs[k + 1], float(flight.time[k]), INTERVAL)
        if not abs(np.arctan2(following[1], following[0])) < 1.0:
            break
        states.append(following)
    deficient = np.array(states)
    for i, axis in enumerate(axes):
        _true(axis, flight.time, flight.states[:, i])
        _line(axis, flight.time[: len(deficient)], deficient[:, i], "declared")
    return figure


def _estimated(flight: Flight) -> Figure:
    figure, axes = _axes(2, 2, _FLIGHT_LABELS, "time, s")
    history = estimate(flight, *noisy(flight, None, 0), (1.0, 1.0))
    for i, axis in enumerate(axes):
        _true(axis, flight.time, flight.states[:, i])
        _line(axis, flight.time, history.states[:, i])
    return figure
