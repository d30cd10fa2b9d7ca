"""The aerodynamic model: named terms with values, and the tables that the kernels take."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.axes import LONGITUDINAL, Axes, input_columns_of, loads_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.layout import layout_of
from aerosid.flight_model.terms import Term, TermTable, build_table, parse_term
from aerosid.nomenclature import is_surface

Entry = tuple[str, Term]
"""A term in a coefficient: ("C_m", alpha^2)."""

CONSTANT = parse_term("1")


@dataclass(frozen=True)
class AerodynamicModel:
    """Terms with values in the coefficients, with the constants of one aircraft.

    Attributes
    ----------
    entries : tuple of (coefficient, Term)
        What stands in which coefficient, T of them, without repetition.
    values : ndarray, shape (T,)
        The value of each entry.
    columns : tuple of str
        The inputs' columns, in the order of the kernel's input array.
    constants : Constants
        Geometry, inertia and reference speeds; their layout is that of `axes`.
    axes : Axes
        The case of the equations of motion.
    """

    entries: tuple[Entry, ...]
    values: NDArray[np.float64]
    columns: tuple[str, ...]
    constants: Constants
    axes: Axes = LONGITUDINAL
    table: TermTable = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "constants", self.constants._replace(layout=layout_of(self.axes)))
        object.__setattr__(self, "table", _table(self.entries, self.columns, loads_of(self.axes)))

    @property
    def extra_columns(self) -> tuple[str, ...]:
        """The input columns past the leading ones, E of them: what terms name and effects fill."""
        return self.columns[len(input_columns_of(self.axes)) :]

    def extra_place(self, column: str) -> int:
        """The place of a column among the extra ones."""
        return self.columns.index(column) - len(input_columns_of(self.axes))

    def index(self, entry: Entry) -> int:
        """The position of `entry`; ValueError where the model does not hold it."""
        return self.entries.index(entry)

    @functools.cached_property
    def places(self) -> Mapping[Entry, int]:
        """The position of every entry."""
        return {entry: place for place, entry in enumerate(self.entries)}

    def value(self, entry: Entry) -> float:
        """The value of `entry`; 0 where the model does not hold it."""
        return float(self.values[self.entries.index(entry)]) if entry in self.entries else 0.0

    def with_values(self, values: NDArray[np.float64]) -> AerodynamicModel:
        """The same terms with other values (T,)."""
        return replace(self, values=values)

    def extended(self, entries: Iterable[Entry]) -> AerodynamicModel:
        """The model with further entries at zero value; those that it holds already are left as they are."""
        held = set(self.entries)
        added = [entry for entry in dict.fromkeys(entries) if entry not in held]
        if not added:
            return self
        return replace(
            self, entries=(*self.entries, *added), values=np.concatenate([self.values, np.zeros(len(added))])
        )

    def with_columns(self, columns: Iterable[str]) -> AerodynamicModel:
        """The model with further input columns at the end; those that it has already are left as they are."""
        added = [name for name in dict.fromkeys(columns) if name not in self.columns]
        return replace(self, columns=(*self.columns, *added)) if added else self

    def without(self, entries: Iterable[Entry]) -> AerodynamicModel:
        """The model with `entries` struck out."""
        dropped = set(entries)
        keep = [i for i, entry in enumerate(self.entries) if entry not in dropped]
        return replace(self, entries=tuple(self.entries[i] for i in keep), values=self.values[keep])

    def indices(self, entries: Iterable[Entry]) -> NDArray[np.int64]:
        """The positions of `entries`, in their order."""
        place = {entry: i for i, entry in enumerate(self.entries)}
        return np.array([place[entry] for entry in entries], dtype=np.int64)


@functools.lru_cache(maxsize=64)
def _table(entries: tuple[Entry, ...], columns: tuple[str, ...], coefficients: tuple[str, ...]) -> TermTable:
    """The table of the terms; a search asks for the same ones again and again, with other values."""
    return build_table(entries, columns, coefficients)


def controls_of(model: AerodynamicModel) -> tuple[str, ...]:
    """The surfaces that the model's terms use."""
    used = {name for _, term in model.entries for name in term.variables}
    return tuple(name for name in model.extra_columns if is_surface(name) and name in used)
