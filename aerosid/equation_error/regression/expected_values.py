"""A-priori relations between the unknowns of a regression: rows whose product with the unknowns has a known value."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.gust_response import GustResponse
from aerosid.equation_error.equations.points import Unknown

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExpectedValues:
    """Relations of unit standard deviation: `rows` (K, P) times the first P unknowns have expected `values` (K,)."""

    rows: Array
    values: Array

    def inform(self, information: Array, vector: Array) -> None:
        """Add what they know to normal equations of at least P unknowns, in place: (Q, Q) and right side (Q,)."""
        count = self.rows.shape[1]
        own_information, own_vector = self._normal_equations
        information[:count, :count] += own_information
        vector[:count] += own_vector

    @cached_property
    def _normal_equations(self) -> tuple[Array, Array]:
        """Their own: a design is solved several times."""
        return self.rows.T @ self.rows, self.rows.T @ self.values

    def without(self, removed: Collection[int]) -> ExpectedValues:
        """The relations with some unknowns zero."""
        rest = [p for p in range(self.rows.shape[1]) if p not in removed]
        return ExpectedValues(np.ascontiguousarray(self.rows[:, rest]), self.values)

    def disagreement(self, unknowns: Array) -> float:
        """Reduction of ln L by values (Q,) of the unknowns that differ from the expected ones."""
        beside = self.rows @ unknowns[: self.rows.shape[1]] - self.values
        return 0.5 * float(beside @ beside)


def gust_responses_among(
    responses: Mapping[Unknown, GustResponse], unknowns: Sequence[Unknown]
) -> ExpectedValues | None:
    """A-priori responses of coefficients to gusts as relations between the unknowns of a regression; None without any.

    `responses`: by the unknown of each.
    """
    places = {unknown: p for p, unknown in enumerate(unknowns)}
    expected = {places[unknown]: each for unknown, each in responses.items() if unknown in places}
    if not expected:
        return None
    rows, values = np.zeros((len(expected), len(unknowns))), np.zeros(len(expected))
    for k, (place, response) in enumerate(expected.items()):
        rows[k, place] = 1.0 / response.deviation
        for entry, (factor, declared) in response.derivatives.items():
            if ("term", entry) in places:
                rows[k, places["term", entry]] = -factor / response.deviation
            else:
                values[k] += factor * declared / response.deviation
    return ExpectedValues(rows, values)
