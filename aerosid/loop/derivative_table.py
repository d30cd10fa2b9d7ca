"""The derivative table: declared, re-estimated and completed values with their standard errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.goodness import variance_inflation
from aerosid.model_error.paper_chain import Chain
from aerosid.notation import number
from aerosid.search.attribution import Attribution


@dataclass(frozen=True)
class DerivativeRow:
    """One line of the derivative table; None where a number does not exist."""

    coefficient: str
    term: str
    declared: float | None
    refitted: float | None
    value: float
    std_error: float | None
    std_error_white: float | None
    rls: float | None
    rls_std_error: float | None
    correlation_max: float | None
    shown: bool
    variance_inflation: float | None = None
    """By how much the other parameters widen its variance: what it would be if all others were known is 1."""
    scatter: float | None = None
    """Standard deviation of the estimates from each identification log alone, where there are several."""
    filter_error: float | None = None
    """The estimate among forces of any shape, where the flight shows more than the structure explains."""
    filter_error_std_error: float | None = None
    """Its standard deviation; `std_error` is no smaller."""


SHOWN = 0.3
"""A derivative known to worse than this share of its size (its own or the declared, the greater) is not shown."""


def is_shown(value: float, declared: float | None, std_error: float) -> bool:
    """Whether a record holds enough information on a derivative to put it into a table unflagged."""
    return bool(std_error <= SHOWN * max(abs(value), abs(declared or 0.0)))


def derivative_rows(
    aircraft: Aircraft, found: Attribution, chain: Chain | None, scattered: Mapping[Entry, float]
) -> tuple[DerivativeRow, ...]:
    """One row for each declared or found term, coefficient by coefficient."""
    declared = {(d.coefficient, d.term): d for d in aircraft.derivatives}
    completed, spread = found.completed, found.completed_deviations
    inflation, beside = variance_inflation(completed), found.filter_error
    rows = []
    order = sorted(dict.fromkeys([*declared, *completed.free]), key=lambda entry: aircraft.coefficients.index(entry[0]))
    for entry in order:
        row = declared.get(entry)
        given = row.value if row else None
        if entry not in completed.free:
            value = completed.model.value(entry)
            rows.append(DerivativeRow(entry[0], str(entry[1]), given, given, value, None, None, None, None, None, True))
            continue
        n = completed.free.index(entry)
        value, error = completed.model.value(entry), float(spread.corrected[n])
        in_chain = chain is not None and entry in chain.entries
        rows.append(
            DerivativeRow(
                coefficient=entry[0],
                term=str(entry[1]),
                declared=given,
                refitted=found.before.model.value(entry) if entry in found.before.free else None,
                value=value,
                std_error=_finite(error),
                std_error_white=_finite(float(spread.white[n])),
                rls=chain.model.value(entry) if chain is not None and in_chain else None,
                rls_std_error=_finite(float(chain.std_errors[chain.entries.index(entry)]))
                if chain is not None and in_chain
                else None,
                correlation_max=_finite(float(spread.correlation_max[n])),
                shown=is_shown(value, given, error),
                variance_inflation=_finite(float(inflation[n])),
                scatter=scattered.get(entry),
                filter_error=_finite(float(beside.values[n])) if beside else None,
                filter_error_std_error=_finite(float(beside.deviations[n])) if beside else None,
            )
        )
    return tuple(rows)


def told_of_not_shown(rows: Sequence[DerivativeRow]) -> list[str]:
    """One sentence for each derivative that the record cannot show, with what hides it."""
    sentences = []
    for row in rows:
        if row.shown:
            continue
        error = "no bound" if row.std_error is None else f"a standard error of {number(row.std_error, 2)}"
        why = ""
        if row.correlation_max is not None and row.correlation_max > 0.95:
            why = f"; its correlation with another estimate is {row.correlation_max:.3f}"
        sentences.append(
            f"These records cannot show {row.coefficient} {row.term}: {number(row.value)} has {error}{why}. "
            "Do not read it as measured."
        )
    return sentences


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
