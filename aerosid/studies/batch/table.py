"""Derivatives over manoeuvres: repeats at one condition put together, their scatter beside the deviations reported."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.studies.batch.one_log import CONDITION
from aerosid.studies.journal import Row


@dataclass(frozen=True)
class Likeness:
    """How near two manoeuvres' conditions must be to count as repeats.

    `airspeed` as a share of it; `altitude` m; `mach`; `alpha` rad.
    """

    airspeed: float = 0.03
    altitude: float = 300.0
    mach: float = 0.02
    alpha: float = 0.015

    def alike(self, one: Mapping[str, float | None], two: Mapping[str, float | None]) -> bool:
        """Whether two conditions are the same, as far as both are known."""
        for name, reach in (("V", None), ("h", self.altitude), ("mach", self.mach), ("alpha", self.alpha)):
            a, b = one.get(name), two.get(name)
            if a is None or b is None:
                continue
            if abs(a - b) > (self.airspeed * abs(a) if reach is None else reach):
                return False
        return True


@dataclass(frozen=True)
class Measured:
    """One derivative from one manoeuvre; `condition` V, h, mach, alpha at its beginning, SI, None where unknown."""

    log: str
    coefficient: str
    term: str
    declared: float | None
    value: float
    std_error: float
    shown: bool
    condition: Mapping[str, float | None]


@dataclass(frozen=True)
class TableRow:
    """One derivative at one condition.

    Attributes
    ----------
    coefficient, term : str
    declared : float or None
    group : int
        Number of the condition, from 1.
    manoeuvres : int
        That show it; those that hold too little information on it are left out.
    left_out : int
    value : float or None
        Mean, weighted with the reported deviations; None where no manoeuvre shows it.
    std_error : float or None
        Of one manoeuvre: root mean square of the corrected deviations.
    scatter : float or None
        Standard deviation between the repeats; None for a single one.
    condition : mapping of str to float or None
        Means over the manoeuvres.
    """

    coefficient: str
    term: str
    declared: float | None
    group: int
    manoeuvres: int
    left_out: int
    value: float | None
    std_error: float | None
    scatter: float | None
    condition: Mapping[str, float | None]

    @property
    def honest(self) -> float | None:
        """Scatter over reported deviation: about 1 where the deviations are true."""
        return None if self.scatter is None or not self.std_error else self.scatter / self.std_error


def measured(rows: Mapping[str, Row]) -> tuple[Measured, ...]:
    """Every derivative of every manoeuvre that has a value and a deviation.

    Parameters
    ----------
    rows : mapping of str to dict
        `one_log.summary_row` by the name of the log.
    """
    return tuple(
        Measured(
            log,
            entry["coefficient"],
            entry["term"],
            entry["declared"],
            entry["value"],
            entry["std_error"],
            entry["shown"],
            row["condition"],
        )
        for log, row in rows.items()
        for entry in row["derivatives"]
        if entry["value"] is not None and entry["std_error"] is not None
    )


def conditions(rows: Mapping[str, Row], likeness: Likeness = Likeness()) -> dict[str, int]:
    """The number of each log's condition, from 1 by rising airspeed and altitude.

    A log joins the first condition whose mean it is like.
    """
    groups: list[list[str]] = []
    for log in sorted(rows, key=lambda name: (_sortable(rows[name]["condition"]), name)):
        own = rows[log]["condition"]
        home = next((g for g in groups if likeness.alike(_mean([rows[m]["condition"] for m in g]), own)), None)
        if home is None:
            groups.append([log])
        else:
            home.append(log)
    return {log: number for number, group in enumerate(groups, start=1) for log in group}


def derivative_table(rows: Mapping[str, Row], likeness: Likeness = Likeness()) -> tuple[TableRow, ...]:
    """One row for each derivative at each condition, in the order of the aircraft file, then of the conditions."""
    group_of = conditions(rows, likeness)
    entries = measured(rows)
    order = list(dict.fromkeys((m.coefficient, m.term) for m in sorted(entries, key=lambda m: m.declared is None)))
    order.sort(key=lambda entry: _COEFFICIENTS.index(entry[0]) if entry[0] in _COEFFICIENTS else len(_COEFFICIENTS))
    table = []
    for coefficient, term in order:
        for number in sorted(set(group_of.values())):
            here = [m for m in entries if (m.coefficient, m.term) == (coefficient, term) and group_of[m.log] == number]
            if here:
                table.append(_row(here, number))
    return tuple(table)


_COEFFICIENTS = ("C_X", "C_D", "C_Z", "C_L", "C_m")


def _row(here: Sequence[Measured], number: int) -> TableRow:
    told = [m for m in here if m.shown]
    value = std_error = scatter = None
    if told:
        values, errors = np.array([m.value for m in told]), np.array([m.std_error for m in told])
        weights = 1.0 / np.maximum(errors, 1e-300) ** 2
        value = float(weights @ values / weights.sum())
        std_error = float(np.sqrt(np.mean(errors**2)))
        scatter = float(values.std(ddof=1)) if len(told) > 1 else None
    first = here[0]
    return TableRow(
        coefficient=first.coefficient,
        term=first.term,
        declared=first.declared,
        group=number,
        manoeuvres=len(told),
        left_out=len(here) - len(told),
        value=value,
        std_error=std_error,
        scatter=scatter,
        condition=_mean([m.condition for m in told or here]),
    )


def _mean(held: Sequence[Mapping[str, float | None]]) -> dict[str, float | None]:
    return {name: _average(_known(held, name)) for name in CONDITION}


def _average(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _known(held: Sequence[Mapping[str, float | None]], name: str) -> list[float]:
    return list(_values(held, name))


def _values(held: Sequence[Mapping[str, float | None]], name: str) -> Iterator[float]:
    for condition in held:
        value = condition.get(name)
        if value is not None:
            yield value


def _sortable(condition: Mapping[str, float | None]) -> tuple[float, ...]:
    return tuple(np.inf if condition.get(name) is None else float(condition[name] or 0.0) for name in CONDITION)
