"""Values and slopes of the aerodynamic model's terms, as tables for compiled code.

Compiled code sees neither text nor objects but a `TermTable`, so a new term compiles nothing new.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled import njit_inline
from aerosid.errors import AircraftError
from aerosid.flight_model.axes import LONGITUDINAL, Axes, input_columns_of, loads_of
from aerosid.flight_model.term_grammar import LIFT, SHAPES, VARIABLE_COUNT, VARIABLES, Factor, Term, parse_term

__all__ = [
    "COEFFICIENTS",
    "INPUT_COLUMNS",
    "LIFT",
    "VARIABLES",
    "VARIABLE_COUNT",
    "Factor",
    "Term",
    "TermTable",
    "build_table",
    "check_lift",
    "fill_values",
    "input_columns",
    "lift_first",
    "parse_term",
    "pass_slopes",
    "value_count",
]

COEFFICIENTS = loads_of(LONGITUDINAL)
"""The force and moment coefficients that a term of a longitudinal model may add to."""

INPUT_COLUMNS = input_columns_of(LONGITUDINAL)
"""Leading columns of the inputs of a longitudinal model; the further channels that terms name follow them."""


class TermTable(NamedTuple):
    """Terms as arrays: T terms with F factors in all, those of term t at first[t] to first[t + 1] - 1.

    The kernels compute them as products of two numbers each, every product once however many terms hold it. All numbers
    stand in one array of values: the V variables, the number 1, the B shaped factors, the P products, each of two
    values that stand before it.

    Attributes
    ----------
    coefficient : int64[T]
        Index in `loads_of` the case.
    first : int64[T + 1]
        Start of each term's factors.
    variable : int64[F]
        Slot in the array of values: `VARIABLES`, then the input columns.
    shape : int64[F]
        0 plain, 1 abs, 2 pos.
    offset : float64[F]
        Subtracted from the variable, in its SI unit.
    power : int64[F]
    value : int64[T]
        Slot of each term's value.
    reach : int64[T]
        How many products are needed for the terms up to this one.
    shaped_variable, shaped_kind, shaped_offset : int64[B], int64[B], float64[B]
        As `variable`, `shape` and `offset`, of the factors that are not plain.
    left, right : int64[P]
        Slots of what is multiplied.
    uses_alpha_dot : int
        Number, from 1, of the first term that depends on alpha_dot_hat, which makes the equations implicit; else 0.
    lift_row, lift_slot : int
        Where a term holds C_L or C_Z: that coefficient's row, and its slot among the variables; else -1 and 0.
    """

    coefficient: NDArray[np.int64]
    first: NDArray[np.int64]
    variable: NDArray[np.int64]
    shape: NDArray[np.int64]
    offset: NDArray[np.float64]
    power: NDArray[np.int64]
    value: NDArray[np.int64]
    reach: NDArray[np.int64]
    shaped_variable: NDArray[np.int64]
    shaped_kind: NDArray[np.int64]
    shaped_offset: NDArray[np.float64]
    left: NDArray[np.int64]
    right: NDArray[np.int64]
    uses_alpha_dot: int
    lift_row: int
    lift_slot: int


def input_columns(terms: Iterable[Term], axes: Axes = LONGITUDINAL) -> tuple[str, ...]:
    """All columns of the kernel's inputs: the leading ones, then delta_e and the other channels that the terms need.

    delta_e comes first, the others in order of appearance.
    """
    leading = input_columns_of(axes)
    known = {*leading, *VARIABLES}
    needed = dict.fromkeys(factor.variable for term in terms for factor in term.factors if factor.variable not in known)
    return *leading, *sorted(needed, key=lambda name: name != "delta_e")


def build_table(
    entries: Sequence[tuple[str, Term]], input_columns: Sequence[str], coefficients: Sequence[str] = COEFFICIENTS
) -> TermTable:
    """The terms as arrays for compiled code.

    Parameters
    ----------
    entries
        Pairs of coefficient name and term, one a row of the table.
    input_columns
        Names of all columns of the kernel's inputs, the leading ones first.
    coefficients
        Names of the coefficients that a term may add to.

    Raises
    ------
    AircraftError
        Where a coefficient is unknown, a term names a channel that no column holds, or a coefficient depends on one
        that is not there or on itself.
    """
    slots = {name: slot for slot, name in enumerate((*VARIABLES, *input_columns))}
    first = [0]
    factors: list[Factor] = []
    for coefficient, term in entries:
        if coefficient not in coefficients:
            raise AircraftError(f"coefficient '{coefficient}' is unknown; expected one of {', '.join(coefficients)}")
        for name in sorted(term.variables - slots.keys()):
            raise AircraftError(
                f"term '{term}' of {coefficient} needs the channel {name}, which the log does not hold; "
                "map that channel or remove the term"
            )
        check_lift(coefficient, term, coefficients)
        factors.extend(term.factors)
        first.append(len(factors))
    lift = _lift_held(factors)
    variable = [slots[factor.variable] for factor in factors]
    shape = [SHAPES.index(factor.shape) for factor in factors]
    shaped = dict.fromkeys((v, k, f.offset) for v, k, f in zip(variable, shape, factors, strict=True) if k)
    one = len(VARIABLES) + len(input_columns)  # a measured variable stands among both
    bases = {base: one + 1 + n for n, base in enumerate(shaped)}
    products: dict[tuple[int, int], int] = {}

    def product(left: int, right: int) -> int:
        if left == one:
            return right
        return products.setdefault((left, right), one + 1 + len(bases) + len(products))

    value, reach = [], []
    for begin, end in itertools.pairwise(first):
        whole = one
        for f in range(begin, end):
            base = bases[variable[f], shape[f], factors[f].offset] if shape[f] else variable[f]
            power = base
            for _ in range(factors[f].power - 1):
                power = product(power, base)
            whole = product(whole, power)
        value.append(whole)
        reach.append(len(products))
    return TermTable(
        coefficient=_whole(coefficients.index(coefficient) for coefficient, _ in entries),
        first=_whole(first),
        variable=_whole(variable),
        shape=_whole(shape),
        offset=np.array([factor.offset for factor in factors], dtype=np.float64),
        power=_whole(factor.power for factor in factors),
        value=_whole(value),
        reach=_whole(reach),
        shaped_variable=_whole(base[0] for base in bases),
        shaped_kind=_whole(base[1] for base in bases),
        shaped_offset=np.array([base[2] for base in bases], dtype=np.float64),
        left=_whole(pair[0] for pair in products),
        right=_whole(pair[1] for pair in products),
        uses_alpha_dot=next((t for t, (_, term) in enumerate(entries, 1) if "alpha_dot_hat" in term.variables), 0),
        lift_row=coefficients.index(lift) if lift else -1,
        lift_slot=slots[lift] if lift else 0,
    )


def _lift_held(factors: Iterable[Factor]) -> str:
    """The lift coefficient that factors name; empty where none does."""
    lifts = sorted({factor.variable for factor in factors} & set(LIFT))
    if len(lifts) > 1:
        raise AircraftError(
            "terms hold both C_L and C_Z; lift stands in them as the aircraft file has it, C_L or C_Z; write all in one"
        )
    return lifts[0] if lifts else ""


def lift_first(coefficients: Iterable[str]) -> tuple[str, ...]:
    """The coefficients, lift before the others, whose terms may hold it."""
    return tuple(sorted(coefficients, key=lambda name: name not in LIFT))


def check_lift(coefficient: str, term: Term, coefficients: Sequence[str]) -> None:
    """Refuse a coefficient in a term of its own, or one that the model does not have.

    Raises
    ------
    AircraftError
        With what may stand there.
    """
    for name in sorted(term.variables & set(LIFT)):
        if name not in coefficients:
            raise AircraftError(
                f"term '{term}' of {coefficient} holds {name}, which this model does not have; its coefficients are "
                f"{', '.join(coefficients)}"
            )
        if name == coefficient or coefficient in LIFT:
            raise AircraftError(
                f"term '{term}' of {coefficient} holds {name}: it may stand in terms of the other coefficients, as in "
                'C_D "C_L^2" or C_X "C_Z^2"; write it in alpha'
            )


def _whole(numbers: Iterable[int]) -> NDArray[np.int64]:
    return np.array(list(numbers), dtype=np.int64)


@njit_inline
def value_count(table: TermTable, inputs: int) -> int:
    """Length of the array of values where the kernel has `inputs` columns of inputs."""
    count: int = VARIABLE_COUNT + inputs + 1 + table.shaped_variable.shape[0] + table.left.shape[0]
    return count


@njit_inline
def fill_values(table: TermTable, products: int, values: NDArray[np.float64]) -> None:
    """Compute all that terms are made of from the variables, up to the first `products` products.

    Parameters
    ----------
    table
        The terms.
    products
        As many as the highest `reach` of the terms that are wanted.
    values : float64[V + 1 + B + P]
        Holds the variables: `VARIABLES`, then the input columns, SI.
    """
    shaped = table.shaped_variable.shape[0]
    one = values.shape[0] - table.left.shape[0] - shaped - 1
    values[one] = 1.0
    for b in range(shaped):
        x = values[table.shaped_variable[b]] - table.shaped_offset[b]
        values[one + 1 + b] = abs(x) if table.shaped_kind[b] == 1 else max(x, 0.0)
    place = one + 1 + shaped
    for p in range(products):
        values[place + p] = values[table.left[p]] * values[table.right[p]]


@njit_inline
def pass_slopes(table: TermTable, products: int, values: NDArray[np.float64], slopes: NDArray[np.float64]) -> None:
    """Turn slopes with respect to all values into slopes with respect to the variables alone, by the chain rule.

    Where |x| and pos(x) have a corner the slope of |x| is 0 and that of pos(x) is the one from below, 0.

    Parameters
    ----------
    table
        The terms.
    products
        As many as `fill_values` was given.
    values : float64[V + 1 + B + P]
        As `fill_values` leaves them.
    slopes : float64[V + 1 + B + P, K]
        Slopes of K sums of terms with respect to each value as if it were a variable of its own; those of the
        variables, rows 0 to V - 1, are added to.

    Notes
    -----
    From the last product to the first (reverse accumulation): no division, so that a factor may be zero.
    """
    shaped, columns = table.shaped_variable.shape[0], slopes.shape[1]
    one = values.shape[0] - table.left.shape[0] - shaped - 1
    place = one + 1 + shaped
    for back in range(products):
        p = products - 1 - back
        left, right = table.left[p], table.right[p]
        x, y = values[left], values[right]
        for k in range(columns):
            slope = slopes[place + p, k]
            slopes[left, k] += slope * y
            slopes[right, k] += slope * x
    for b in range(shaped):
        x = values[table.shaped_variable[b]] - table.shaped_offset[b]
        steep = np.sign(x) if table.shaped_kind[b] == 1 else 1.0 if x > 0.0 else 0.0
        for k in range(columns):
            slopes[table.shaped_variable[b], k] += slopes[one + 1 + b, k] * steep
