"""The stacked regression of all equations and records: rows by segment, a column for each unknown."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.channels import HEIGHT, KINEMATIC, LATERAL_PATHS
from aerosid.equation_error.equations.instrumental_variables import TRENDS
from aerosid.equation_error.equations.points import Segment, Unknown, value_of
from aerosid.equation_error.regression.coloured_regression import (
    Colour,
    colour_of,
    whitened_segments,
)
from aerosid.equation_error.regression.declared_values import DeclaredUnknowns
from aerosid.equation_error.regression.expected_values import ExpectedValues
from aerosid.equation_error.regression.output_density import OutputDensity
from aerosid.equation_error.regression.residual_colours import Coloured, ColourGroups, coloured
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.flight_model.aerodynamics import CONSTANT

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Design:
    """Rows of all segments, stacked.

    Attributes
    ----------
    segments : tuple of (recording, equation)
    groups : tuple of (equation, float)
        Segments that may share a colour: the same equation at the same interval, s.
    bounds : ndarray, shape (S + 1,)
        First row of each segment.
    target : ndarray, shape (R,)
    columns : ndarray, shape (R, P)
    unknowns : tuple, length P
    inverse_deviations : ndarray, shape (P,)
        Inverse prior standard deviation of each unknown, 0 without a prior.
    floors : ndarray, shape (S,)
        Least size of each segment's residual.
    instruments : tuple of (ndarray, shape (n, K), or None)
        Instrumental variables that span the space in which each segment is compared; None for all of it.
    declared : DeclaredUnknowns, optional
        Unknowns with a-priori values, whose disagreement with the estimates reduces ln L.
    expected : ExpectedValues, optional
        A-priori relations between unknowns, which inform the estimates.
    density : OutputDensity, optional
        Determinant by which the residuals' density becomes that of the recorded motion.
    """

    segments: tuple[tuple[int, str], ...]
    groups: tuple[tuple[str, float], ...]
    bounds: NDArray[np.int64]
    target: Array
    columns: Array
    unknowns: tuple[Unknown, ...]
    inverse_deviations: Array
    floors: Array
    instruments: tuple[Array | None, ...]
    declared: DeclaredUnknowns | None = None
    expected: ExpectedValues | None = None
    density: OutputDensity | None = None

    def rows(self, segment: int) -> slice:
        """The rows of a segment."""
        return self._rows[segment]

    @cached_property
    def _rows(self) -> list[slice]:
        edges = self.bounds.tolist()
        return [slice(first, stop) for first, stop in pairwise(edges)]

    @cached_property
    def target_and_columns(self) -> Array:
        """The target beside the columns, (R, 1 + P): a regression whitens them with one colour after another."""
        return np.column_stack([self.target, self.columns])

    def colour_groups(self, memory: float) -> tuple[list[tuple[str, float]], ColourGroups]:
        """Equations whose segments may share a colour, and those segments.

        `memory`: the longest of the noise of coefficients and lateral paths, s.
        """
        by_group: dict[tuple[str, float], list[int]] = {}
        for s, group in enumerate(self.groups):
            by_group.setdefault(group, []).append(s)
        longest = [
            memory / interval if equation not in KINEMATIC or equation in LATERAL_PATHS else np.inf
            for equation, interval in by_group
        ]
        may_differ = [all(self.instruments[s] is None for s in members) for members in by_group.values()]
        members = [s for each in by_group.values() for s in each]
        first = np.zeros(len(by_group) + 1, dtype=np.int64)
        np.cumsum([len(each) for each in by_group.values()], out=first[1:])
        return [*by_group], ColourGroups(np.array(members), first, np.array(longest), np.array(may_differ))

    def extended(self, columns: Array, unknowns: Sequence[Unknown]) -> Design:
        """The design with further columns (R, K)."""
        return Design(
            self.segments,
            self.groups,
            self.bounds,
            self.target,
            np.column_stack([self.columns, columns]),
            (*self.unknowns, *unknowns),
            np.append(self.inverse_deviations, np.zeros(len(unknowns))),
            self.floors,
            self.instruments,
            self.declared,
            self.expected,
            self.density,
        )

    def without(self, unknowns: Collection[Unknown]) -> Design:
        """The design without some unknowns, compared with no declared values."""
        removed = {p for p, unknown in enumerate(self.unknowns) if unknown in unknowns}
        kept = [p for p in range(len(self.unknowns)) if p not in removed]
        return replace(
            self,
            columns=np.ascontiguousarray(self.columns[:, kept]),
            unknowns=tuple(self.unknowns[p] for p in kept),
            inverse_deviations=self.inverse_deviations[kept],
            declared=None,
            expected=None if self.expected is None else self.expected.without(removed),
            density=None if self.density is None else self.density.without(removed),
        )

    def normal_equations(self, slopes: Array, target: Array) -> tuple[Array, Array]:
        """Information (P, P) and its right side (P,) of whitened rows (R, P) and (R,), and of all prior knowledge.

        Declared values are not in it.
        """
        information, vector = slopes.T @ slopes + np.diag(self.inverse_deviations**2), slopes.T @ target
        if self.expected is not None:
            self.expected.inform(information, vector)
        return information, vector


@dataclass(frozen=True)
class Weights:
    """Noise model: colour of the residuals of each segment (S), size of each segment's innovations (S,).

    `excess`: power factor, by equation, contained in the sizes where equations are compared by instrumental variables.
    """

    colours: tuple[Colour, ...]
    sizes: Array
    excess: Mapping[tuple[str, float], float] = field(default_factory=dict)

    @cached_property
    def _filters(self) -> tuple[Array, Array, NDArray[np.int64]]:
        """The colours' weights, starts and orders as arrays for compiled code."""
        orders = np.array([colour.start.shape[0] for colour in self.colours], dtype=np.int64)
        most = int(orders.max())
        weights, starts = np.zeros((orders.size, most + 1)), np.zeros((orders.size, most, most))
        for s, (order, colour) in enumerate(zip(orders.tolist(), self.colours, strict=True)):
            weights[s, : order + 1], starts[s, :order, :order] = colour.weights, colour.start
        return weights, starts, orders

    def whitened(self, values: Array, bounds: NDArray[np.int64]) -> Array:
        """Segments of columns (R, K) that begin at `bounds` (S + 1,), whitened and divided by their sizes."""
        return np.asarray(whitened_segments(values, bounds, *self._filters, self.sizes))


def design_of(segments: Sequence[Segment], settings: EquationErrorSettings) -> Design:
    """The regression of some equations with their constants, drifts and free terms."""
    bounds = np.concatenate([[0], np.cumsum([each.target.size for each in segments])]).astype(np.int64)
    index: dict[Unknown, int] = {}
    parts: list[tuple[int, int, Array]] = []
    precision: dict[Unknown, float] = {}

    def put(unknown: Unknown, segment: int, values: Array) -> None:
        parts.append((index.setdefault(unknown, len(index)), segment, values))

    for s, each in enumerate(segments):
        if each.equation in KINEMATIC:
            put(("constant", each.equation, each.recording), s, np.ones(each.target.size))
            if settings.drifts.get(each.equation, 0.0) > 0.0:
                unknown = ("drift", each.equation, each.recording)
                put(unknown, s, each.time)
                precision[unknown] = 1.0 / settings.drifts[each.equation]
        if each.equation == HEIGHT:
            unknown = ("bend", each.equation, each.recording)
            put(unknown, s, 0.5 * each.time**2)
            precision[unknown] = 1.0 / settings.height_bend
        if each.random_walk is not None:
            for n, values in enumerate(each.random_walk.T):
                mode: Unknown = ("random_walk", each.equation, each.recording, n)
                put(mode, s, values)
                precision[mode] = 1.0
        if each.drifts:
            put(("drift", each.equation, each.recording), s, each.time)
        if each.gust is not None:
            put(("gust", each.equation), s, each.gust)
        if each.rotary_gust is not None:
            put(("rotary_gust", each.equation), s, each.rotary_gust)
        for entry, values in each.columns.items():
            which = value_of(entry, each.recording)
            put(which, s, values)
            # The mean of a sideslip without a vane is contained in the constants, however symmetric the aircraft.
            if entry[1] == CONSTANT and entry[0] in settings.asymmetry and not each.drifts:
                precision[which] = 1.0 / settings.asymmetry[entry[0]]
    columns = np.zeros((int(bounds[-1]), len(index)))
    for p, s, values in parts:
        columns[bounds[s] : bounds[s + 1], p] += values
    target = np.concatenate([each.target for each in segments])
    return Design(
        tuple((each.recording, each.equation) for each in segments),
        tuple((each.equation, round(float(each.time[1] - each.time[0]), 6)) for each in segments),
        bounds,
        target,
        columns,
        tuple(index),
        np.array([precision.get(unknown, 0.0) for unknown in index]),
        np.array([each.floor for each in segments]),
        tuple(each.instruments for each in segments),
    )


def residual_weights(design: Design, residuals: Array, settings: EquationErrorSettings) -> Weights:
    """Colours and sizes estimated from residuals (R,)."""
    names, groups = design.colour_groups(settings.memory)
    found = coloured(residuals, design.bounds, design.floors, groups, settings.order)
    excess = dict.fromkeys(names, 1.0)
    sizes = found.sizes
    if not uses_no_instruments(design):
        for g, name in enumerate(names):
            members = groups.members[groups.first[g] : groups.first[g + 1]]
            excess[name] = _excess(design, members.tolist(), found, settings)
            sizes[members] *= np.sqrt(excess[name])
    return Weights(found.colours, sizes, excess)


def _excess(design: Design, members: Sequence[int], found: Coloured, settings: EquationErrorSettings) -> float:
    """Power of one equation's whitened residuals in the space of its instruments over their power in all directions.

    A low order does not whiten slow noise completely, and the response to the controls is slow: the noise is that which
    remains where the equation is compared, with the usual ratio as prior (scaled inverse chi squared).
    """
    free, power = 0, 0.0
    for s in members:
        instruments = design.instruments[s]
        if instruments is not None:
            basis = found.colours[s].whitened_basis(instruments)
            power += float(np.sum((basis.T @ found.white[design.rows(s)]) ** 2)) / float(found.sizes[s]) ** 2
            free += freedom(design, s)
    if free == 0:
        return 1.0
    known = settings.usual_freedom
    return (power + known * settings.usual_excess) / (free + known)


def freedom(design: Design, segment: int) -> int:
    """Degrees of freedom in which a segment is compared, less those of its constant and its drifts."""
    instruments = design.instruments[segment]
    return 0 if instruments is None else max(instruments.shape[1] - TRENDS, 0)


def whiten(design: Design, values: Array, weights: Weights) -> Array:
    """Rows (R, K) whitened and divided by their sizes."""
    return weights.whitened(np.ascontiguousarray(values), design.bounds)


def compared(design: Design, white: Array, bases: Sequence[Array | None]) -> Array:
    """Whitened rows (R, K), each segment's projected on its whitened instruments."""
    if all(basis is None for basis in bases):
        return white
    out = white.copy()
    for s, basis in enumerate(bases):
        if basis is not None:
            out[design.rows(s)] = basis @ (basis.T @ white[design.rows(s)])
    return out


def coordinates(design: Design, white: Array, bases: Sequence[Array | None]) -> Array:
    """Whitened rows (R, K) as `compared` in fewer: each segment's coordinates in its whitened instruments."""
    if all(basis is None for basis in bases):
        return white
    parts = (white[design.rows(s)] for s in range(len(bases)))
    return np.concatenate([part if basis is None else basis.T @ part for part, basis in zip(parts, bases, strict=True)])


def compared_columns(design: Design, columns: Array, weights: Weights) -> Array:
    """Further columns (R, K), whitened and compared as those of the design are: beside a solution's slopes."""
    return compared(design, whiten(design, columns, weights), whitened_instruments(design, weights))


def in_space_of_instruments(design: Design) -> Design:
    """A design whose target and columns are projected on each segment's instruments, where it has any."""
    if uses_no_instruments(design):
        return design
    rows = compared(design, design.target_and_columns, design.instruments)
    return replace(design, target=rows[:, 0], columns=rows[:, 1:])


def whitened_instruments(design: Design, weights: Weights) -> list[Array | None]:
    """Orthonormal basis of each segment's instruments after whitening; None where all is compared."""
    return [
        None if instruments is None else colour.whitened_basis(instruments)
        for colour, instruments in zip(weights.colours, design.instruments, strict=True)
    ]


def uses_no_instruments(design: Design) -> bool:
    """Whether no equation is compared by instrumental variables."""
    return all(instruments is None for instruments in design.instruments)


def white_weights(design: Design) -> Weights:
    """Initial weights: white noise, of the standard deviation of each segment's target."""
    return weights_of_white_noise(design, design.target)


def weights_of_white_noise(design: Design, rows: Array) -> Weights:
    """White noise in each segment, as large as its part of some `rows` (R,) varies and no smaller than its floor."""
    count = len(design.segments)
    sizes = np.array([max(float(np.std(rows[design.rows(s)])), design.floors[s], 1e-12) for s in range(count)])
    return Weights((colour_of(np.ones(1)),) * count, sizes)
