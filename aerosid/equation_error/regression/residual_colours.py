"""Colours and sizes of all equations' residuals: one colour for the records of an equation, or each record's own.

A record in other air, or with an undeclared effect that others lack, biases a shared colour: step changes in two
records make the noise of either look slow, and are absorbed by it. Each record has its own colour where Schwarz's
criterion prefers that to a shared one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit
from aerosid.equation_error.regression.coloured_regression import Colour, likeliest_colour
from aerosid.signals.array_elements import copy_row, copy_rows

Array = NDArray[np.float64]


class ColourGroups(NamedTuple):
    """Segments of residuals that may share a colour.

    Attributes
    ----------
    members : int64[S]
        The segments, group after group.
    first : int64[G + 1]
        Place of each group's first member among them.
    longest : float64[G]
        Longest memory of a pole, samples.
    may_differ : bool[G]
        Whether each segment of a group may have its own colour.
    """

    members: NDArray[np.int64]
    first: NDArray[np.int64]
    longest: Array
    may_differ: NDArray[np.bool_]


@dataclass(frozen=True)
class Coloured:
    """Residuals with the colour of each segment.

    Attributes
    ----------
    colours : tuple of Colour, length S
    sizes : ndarray, shape (S,)
        Of the innovations.
    white : ndarray, shape (R,)
        Innovations.
    """

    colours: tuple[Colour, ...]
    sizes: Array
    white: Array


def coloured(residuals: Array, bounds: NDArray[np.int64], floors: Array, groups: ColourGroups, order: int) -> Coloured:
    """Colours and sizes of residuals (R,).

    Parameters
    ----------
    bounds : ndarray, shape (S + 1,)
        First row of each segment.
    floors : ndarray, shape (S,)
        Least size of each.
    order : int
        Of the autoregressions; less where records are short.
    """
    weights, starts, orders, sizes, white = _coloured(residuals, bounds, floors, groups, order)
    colours = tuple(Colour(weights[s, : n + 1], starts[s, :n, :n]) for s, n in enumerate(orders.tolist()))
    return Coloured(colours, sizes, white)


@njit
def _coloured(
    residuals: Array, bounds: NDArray[np.int64], floors: Array, groups: ColourGroups, order: int
) -> tuple[Array, Array, NDArray[np.int64], Array, Array]:
    """As `coloured`: weights (S, p + 1) and starts (S, p, p) of the colours, their orders, sizes, innovations."""
    segments = floors.shape[0]
    weights, starts = np.zeros((segments, order + 1)), np.zeros((segments, order, order))
    orders, sizes = np.zeros(segments, dtype=np.int64), np.zeros(segments)
    white = np.empty(residuals.shape[0])
    for g in range(groups.longest.shape[0]):
        members = groups.members[groups.first[g] : groups.first[g + 1]]
        count, limit = members.shape[0], min(np.exp(-1.0 / groups.longest[g]), 0.999)
        edges = np.zeros(count + 1, dtype=np.int64)
        for m in range(count):
            edges[m + 1] = edges[m] + bounds[members[m] + 1] - bounds[members[m]]
        values, divisors, least = np.empty(edges[count]), np.empty(count), np.empty(count)
        for m in range(count):
            part = residuals[bounds[members[m]] : bounds[members[m] + 1]]
            copy_row(values[edges[m] : edges[m + 1]], part)
            divisors[m], least[m] = max(float(np.std(part)), 1e-300), max(floors[members[m]], 1e-12)
        own = np.empty(0)
        if groups.may_differ[g] and count > 1:
            own = _each_alone(
                values, edges, members, bounds, divisors, least, limit, weights, starts, orders, sizes, white
            )
        shared, start, innovations, found, likelihood = likeliest_colour(values, edges, divisors, least, order, limit)
        if own.size and np.sum(own) - 0.5 * order * (count - 1) * np.log(edges[count]) > likelihood:
            continue
        for m in range(count):
            s, reached = members[m], shared.shape[0] - 1
            weights[s] = 0.0
            copy_row(weights[s], shared)
            copy_rows(starts[s], start)
            orders[s], sizes[s] = reached, found[m]
            copy_row(white[bounds[s] : bounds[s + 1]], innovations[edges[m] : edges[m + 1]])
    return weights, starts, orders, sizes, white


@njit
def _each_alone(
    values: Array,
    edges: NDArray[np.int64],
    members: NDArray[np.int64],
    bounds: NDArray[np.int64],
    divisors: Array,
    least: Array,
    limit: float,
    weights: Array,
    starts: Array,
    orders: NDArray[np.int64],
    sizes: Array,
    white: Array,
) -> Array:
    """Ln L (M,) of each member of a group with its own colour; those are written to the arrays of all segments."""
    own = np.zeros(members.shape[0])
    for m in range(members.shape[0]):
        s, samples = members[m], edges[m + 1] - edges[m]
        alone, start, innovations, found, own[m] = likeliest_colour(
            values[edges[m] : edges[m + 1]],
            np.array([0, samples]),
            divisors[m : m + 1],
            least[m : m + 1],
            starts.shape[1],
            limit,
        )
        reached = alone.shape[0] - 1
        copy_row(weights[s], alone)
        copy_rows(starts[s], start)
        orders[s], sizes[s] = reached, found[0]
        copy_row(white[bounds[s] : bounds[s + 1]], innovations)
    return own
