"""Weighted means of derivatives over repeats of one condition and one structure, with Cochran's test of homogeneity."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from aerosid.studies.batch.one_log import CONDITION
from aerosid.studies.journal import Row
from aerosid.studies.settings import BATCH

FloatArray = NDArray[np.float64]
Structure = tuple[tuple[str, str, str], ...]
"""Kind, place and term of each effect of a model in addition to the declared terms."""


@dataclass(frozen=True)
class Likeness:
    """Tolerances within which two manoeuvres' conditions count as repeats.

    `airspeed` as a fraction; `altitude` m; `mach`; `alpha` rad.
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
    """One derivative from one manoeuvre; `condition` V, h, mach, alpha, mass at its start, SI, None where unknown."""

    log: str
    coefficient: str
    term: str
    declared: float | None
    value: float
    std_error: float
    shown: bool
    condition: Mapping[str, float | None]
    structure: Structure = ()


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
        Manoeuvres that show it; those with too little information on it are excluded.
    left_out : int
    value : float or None
        Mean, weighted by the inverse squares of the reported standard errors; None where no manoeuvre shows it.
    std_error : float or None
        Of one manoeuvre: root mean square of the corrected standard errors.
    scatter : float or None
        Standard deviation between the repeats; None for a single one.
    condition : mapping of str to float or None
        Means over the manoeuvres.
    structure : int
        Number of the structure, from 1: the effects identified in all of these manoeuvres. Other structures have
        rows of their own, since an estimate beside other terms is of another quantity.
    heterogeneity : float or None
        Cochran's Q: squared distances of the estimates from their weighted mean in units of their standard errors; None
        for a single one.
    p_value : float or None
        Probability of a Q as great for estimates of one value (chi-squared with n - 1 degrees of freedom).
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
    structure: int = 1
    heterogeneity: float | None = None
    p_value: float | None = None

    @property
    def homogeneous(self) -> bool:
        """Whether the repeats are consistent with one value; otherwise their mean has no physical meaning."""
        return self.p_value is None or self.p_value >= BATCH.alike

    @property
    def honest(self) -> float | None:
        """Scatter over reported standard error: about 1 where the standard errors are correct."""
        return None if self.scatter is None or not self.std_error else self.scatter / self.std_error


def measured(rows: Mapping[str, Row]) -> tuple[Measured, ...]:
    """Every derivative of every manoeuvre with a value and a standard error.

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
            structure_of(row),
        )
        for log, row in rows.items()
        for entry in row["derivatives"]
        if entry["value"] is not None and entry["std_error"] is not None
    )


def conditions(rows: Mapping[str, Row], likeness: Likeness = Likeness()) -> dict[str, int]:
    """The number of each log's condition, from 1 by increasing airspeed and altitude.

    A log joins the first condition with a mean within the tolerances.
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


def structure_of(row: Row) -> Structure:
    """The effects of a manoeuvre's model in addition to the declared ones: kind, place and term of each, sorted."""
    return tuple(sorted((effect["kind"], effect["where"], effect["term"]) for effect in row["effects"]))


def structures(rows: Mapping[str, Row]) -> dict[Structure, int]:
    """The number of each structure, from 1: the most frequent first, the simpler one of two with equal frequency."""
    counts = Counter(structure_of(row) for row in rows.values())
    ordered = sorted(counts, key=lambda structure: (-counts[structure], len(structure), structure))
    return {structure: number for number, structure in enumerate(ordered, start=1)}


def derivative_table(rows: Mapping[str, Row], likeness: Likeness = Likeness()) -> tuple[TableRow, ...]:
    """One row for each derivative, condition and structure, in the order of the aircraft file, then of the conditions.

    Notes
    -----
    Only estimates of equal structures are combined: C_m alpha beside a term in alpha^2 is the slope at alpha = 0,
    without it a mean slope, and the average of the two is neither.
    """
    group_of, number_of = conditions(rows, likeness), structures(rows)
    entries = measured(rows)
    order = list(dict.fromkeys((m.coefficient, m.term) for m in sorted(entries, key=lambda m: m.declared is None)))
    order.sort(key=lambda entry: _COEFFICIENTS.index(entry[0]) if entry[0] in _COEFFICIENTS else len(_COEFFICIENTS))
    table = []
    for entry in order:
        like: dict[tuple[int, int], list[Measured]] = {}
        for m in entries:
            if (m.coefficient, m.term) == entry:
                like.setdefault((group_of[m.log], number_of[m.structure]), []).append(m)
        table += [_row(like[group, structure], group, structure) for group, structure in sorted(like)]
    return tuple(table)


_COEFFICIENTS = ("C_X", "C_D", "C_Z", "C_L", "C_m")


def _row(here: Sequence[Measured], number: int, structure: int) -> TableRow:
    shown = [m for m in here if m.shown]
    value = std_error = scatter = heterogeneity = p_value = None
    if shown:
        values, errors = np.array([m.value for m in shown]), np.array([m.std_error for m in shown])
        weights = 1.0 / np.maximum(errors, 1e-300) ** 2
        value = float(weights @ values / weights.sum())
        std_error = float(np.sqrt(np.mean(errors**2)))
        if len(shown) > 1:
            scatter = float(values.std(ddof=1))
            heterogeneity, p_value = homogeneity(values, errors)
    first = here[0]
    return TableRow(
        coefficient=first.coefficient,
        term=first.term,
        declared=first.declared,
        group=number,
        manoeuvres=len(shown),
        left_out=len(here) - len(shown),
        value=value,
        std_error=std_error,
        scatter=scatter,
        condition=_mean([m.condition for m in shown or here]),
        structure=structure,
        heterogeneity=heterogeneity,
        p_value=p_value,
    )


def homogeneity(values: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Cochran's Q of estimates with their standard errors, and its p-value.

    Parameters
    ----------
    values, errors : ndarray, shape (n,)
        n of at least 2, in the derivative's own unit.

    References
    ----------
    Cochran, The combination of estimates from different experiments, Biometrics 10 (1), 1954.
    """
    weights = 1.0 / np.maximum(errors, 1e-300) ** 2
    mean = weights @ values / weights.sum()
    q = float(weights @ (values - mean) ** 2)
    return q, float(chdtrc(values.size - 1, q))


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
