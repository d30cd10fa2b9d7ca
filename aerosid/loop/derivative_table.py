"""The derivative table: declared, re-estimated and completed values with their standard errors."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from aerosid.aircraft import Aircraft
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.judgement_settings import JUDGEMENT
from aerosid.loop.model_validation.goodness import variance_inflation
from aerosid.model_error.paper_chain.chain import Chain
from aerosid.notation import finite, listed, number, plain
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
    """Filter-error estimate (process noise in every coefficient), where a significant residual remains."""
    filter_error_std_error: float | None = None
    """Its standard deviation; `std_error` is no smaller."""
    estimate: float | None = None
    """Of an insignificant derivative: the estimate that `std_error` belongs to, while `value` stays as declared."""
    declared_away: float | None = None
    """Of an insignificant one that the records contradict together with the identified effects: by how many standard
    errors, were the effects' numbers known, its declared value is away. `std_error` contains those numbers' own."""
    by_validation: bool = False
    """Of an insignificant one: whether it keeps its declared value, or not, as the validation flights are predicted
    better."""


def is_shown(value: float, declared: float | None, std_error: float, *, constant: bool = False) -> bool:
    """Whether a derivative is significant, so that it is tabulated unflagged.

    A constant holds the trim, which any flight determines and which may be near zero: its threshold is lower.
    """
    return bool(std_error <= JUDGEMENT.least_known(constant=constant) * max(abs(value), abs(declared or 0.0)))


def derivative_name(coefficient: str, term: str) -> str:
    """A derivative in a sentence: `C_m alpha`, `the constant of C_m`."""
    return f"the constant of {coefficient}" if term == "1" else f"{coefficient} {term}"


def derivative_rows(
    aircraft: Aircraft,
    found: Attribution,
    completed: Attribution,
    chain: Chain | None,
    scattered: Mapping[Entry, float],
    fixed: Mapping[Entry, float] = MappingProxyType({}),
    contradicted: Mapping[Entry, float | None] = MappingProxyType({}),
    by_validation: Collection[Entry] = (),
) -> tuple[DerivativeRow, ...]:
    """One row for each declared or found term, coefficient by coefficient.

    Parameters
    ----------
    found : Attribution
        With every declared derivative free: source of the standard errors.
    completed : Attribution
        With those that are `fixed` at their declared values: source of the values.
    fixed : mapping of Entry to float
        The insignificant estimates of the fixed derivatives.
    contradicted : mapping of Entry to float or None
        Insignificant derivatives that are not fixed, with how many standard errors their declared values are away.
    by_validation : collection of Entry
        Insignificant derivatives of which the validation flights decided whether they are fixed.
    """
    declared = {(d.coefficient, d.term): d.value for d in aircraft.derivatives}
    inflation = variance_inflation(found.completed)
    rows = []
    order = dict.fromkeys([*declared, *completed.completed.free])
    for entry in sorted(order, key=lambda entry: aircraft.coefficients.index(entry[0])):
        given = declared.get(entry)
        value = completed.completed.model.value(entry)
        if entry not in fixed and entry not in completed.completed.free:
            rows.append(DerivativeRow(entry[0], str(entry[1]), given, given, value, None, None, None, None, None, True))
            continue
        source = found if entry in fixed else completed
        n = source.completed.free.index(entry)
        uncertainty, filtered = source.completed_deviations, source.filter_error
        error = float(uncertainty.corrected[n])
        rls, rls_error = _recursive(chain, entry)
        rows.append(
            DerivativeRow(
                coefficient=entry[0],
                term=str(entry[1]),
                declared=given,
                refitted=found.before.model.value(entry) if entry in found.before.free else None,
                value=given if entry in fixed and given is not None else value,
                std_error=finite(error),
                std_error_white=finite(float(uncertainty.white[n])),
                rls=rls,
                rls_std_error=rls_error,
                correlation_max=finite(float(uncertainty.correlation_max[n])),
                shown=entry not in fixed and is_shown(value, given, error, constant=not entry[1].factors),
                variance_inflation=finite(float(inflation[found.completed.free.index(entry)])),
                scatter=scattered.get(entry),
                filter_error=finite(float(filtered.values[n])) if filtered else None,
                filter_error_std_error=finite(float(filtered.deviations[n])) if filtered else None,
                estimate=fixed.get(entry),
                declared_away=contradicted.get(entry),
                by_validation=entry in by_validation,
            )
        )
    return tuple(rows)


def _recursive(chain: Chain | None, entry: Entry) -> tuple[float | None, float | None]:
    """The estimate of recursive least squares with its standard error; None where that did not see the entry."""
    if chain is None or entry not in chain.entries:
        return None, None
    return chain.model.value(entry), finite(float(chain.std_errors[chain.entries.index(entry)]))


def witnesses(rows: Sequence[DerivativeRow]) -> str:
    """Who contradicts the declared values of such rows."""
    return "the validation flights" if rows[0].by_validation else "the records and the identified effects"


CONTRADICTED = "contradict the declared"
"""Display: why a derivative is not fixed at its declared value."""


def grounds_of_contradiction(rows: Sequence[DerivativeRow]) -> str:
    """Why declared values cannot stand beside the identified effects, which the standard errors do not tell.

    Parameters
    ----------
    rows : sequence of DerivativeRow
        All tested, all with which an identified effect would be insignificant, or all that validation flights decided.
    """
    if rows[0].by_validation:
        return f": with those of {_all_of(rows)} they are predicted worse"
    away = [number(row.declared_away, 2) for row in rows if row.declared_away is not None]
    them, are = ("them", "estimates are") if len(rows) > 1 else ("it", "estimate is")
    if not away:
        return f": beside {them} an identified effect would not be significant"
    return (
        f": with the effects as estimated the {are} {listed(away)} standard errors from {them}, but the standard error "
        "given here includes that the effects are uncertain or others in their place"
    )


def grounds_of_keeping(rows: Sequence[DerivativeRow]) -> str:
    """Why declared values are kept where the validation flights decided it; empty otherwise."""
    if not rows[0].by_validation:
        return ""
    return f": with those of {_all_of(rows)} the validation flights are predicted better"


def _all_of(rows: Sequence[DerivativeRow]) -> str:
    """What validation flights decide of: all insignificant derivatives of a coefficient at once."""
    return f"all insignificant derivatives of {listed(list(dict.fromkeys(row.coefficient for row in rows)))}"


def notes_on_insignificant_derivatives(rows: Sequence[DerivativeRow]) -> list[str]:
    """One sentence for each derivative that is not significant, with the reason."""
    sentences = []
    for row in rows:
        if row.shown:
            continue
        error = "no bound" if row.std_error is None else f"a standard error of {number(row.std_error, 2)}"
        why = ""
        if row.correlation_max is not None and row.correlation_max > JUDGEMENT.correlated:
            why = f"; its correlation with another estimate is {row.correlation_max:.3f}"
        estimate = row.value if row.estimate is None else row.estimate
        holds = ""
        if row.estimate is not None:
            holds = (
                f"; the completed aircraft keeps the declared value {plain(row.value, 4)}{grounds_of_keeping([row])}"
            )
        elif row.declared is not None and row.declared != row.value:
            contradicted = f"{CONTRADICTED} value {plain(row.declared, 4)}{grounds_of_contradiction([row])}"
            holds = f"; the completed aircraft uses it, because {witnesses([row])} {contradicted}"
        sentences.append(
            f"Not significant in these records: {derivative_name(row.coefficient, row.term)}. The estimate "
            f"{number(estimate)} has {error}{why}. Do not use it as a measured value{holds}."
        )
    return sentences
