"""Assumptions and remarks of a result as the report gives them: what holds alike for several is said once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from aerosid.loop.derivative_table import (
    CONTRADICTED,
    DerivativeRow,
    derivative_name,
    grounds_of_contradiction,
    grounds_of_keeping,
    notes_on_insignificant_derivatives,
    witnesses,
)
from aerosid.loop.judgement_settings import JUDGEMENT
from aerosid.loop.result import ClosedLoop
from aerosid.notation import listed, number, plain


def remarks(result: ClosedLoop) -> tuple[str, ...]:
    """The notes of the result, those of several logs or derivatives joined where they say the same; no note is lost.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop, whose notes name one log or one derivative each.
    """
    single = {note: row for row in result.derivatives for note in notes_on_insignificant_derivatives([row])}
    # The longest first: a log may be called as another, a colon and more.
    names = sorted((log.name for log in (*result.identification, *result.validation, *result.hold_out)), key=len)[::-1]
    grouped: dict[tuple[bool, str], dict[str, None]] = {}
    hidden: list[DerivativeRow] = []
    for note in result.notes:
        if note in single:
            hidden.append(single[note])
            continue
        log = next((name for name in names if note.startswith(f"{name}: ")), "")
        grouped.setdefault((bool(log), note.removeprefix(f"{log}: ") if log else note), {})[log] = None
    joined = [f"{listed(list(logs))}: {text}" if of_logs else text for (of_logs, text), logs in grouped.items()]
    return (*joined, *_on_insignificant(hidden))


def _on_insignificant(rows: Sequence[DerivativeRow]) -> Iterator[str]:
    """Sentences on the derivatives whose declared values the aircraft keeps, on those it contradicts, on the others."""
    kept = [row for row in rows if row.estimate is not None]
    used = [row for row in rows if row.estimate is None]
    against = [row for row in used if row.declared is not None and row.declared != row.value]
    others = [row for row in used if row not in against]
    tested = [row for row in against if row.declared_away is not None]
    hiding = [row for row in against if row not in tested]
    groups = [(group, _keeps(group)) for group in _by_witness(kept)]
    groups += [(group, _uses(group)) for each in (tested, hiding) for group in _by_witness(each)]
    for group, end in (*groups, (others, "")):
        if len(group) == 1:
            yield from notes_on_insignificant_derivatives(group)
        elif group:
            yield f"{_estimates(group)}{end}."


def _by_witness(rows: Sequence[DerivativeRow]) -> list[list[DerivativeRow]]:
    """The rows that the fitted flights decided, and those that the validation flights did; no empty group."""
    groups = [[row for row in rows if row.by_validation is seen] for seen in (False, True)]
    return [group for group in groups if group]


def _keeps(rows: Sequence[DerivativeRow]) -> str:
    """That the aircraft keeps declared values."""
    return (
        f"; the completed aircraft keeps the declared {_values([row.value for row in rows])}{grounds_of_keeping(rows)}"
    )


def _uses(rows: Sequence[DerivativeRow]) -> str:
    """Why the aircraft uses estimates that are not significant."""
    return (
        f"; the completed aircraft uses what is estimated, because {witnesses(rows)} "
        f"{CONTRADICTED} {_values([row.declared or 0.0 for row in rows])}{grounds_of_contradiction(rows)}"
    )


def _estimates(rows: Sequence[DerivativeRow]) -> str:
    """The derivatives with estimate and standard error, and what must not be done with them."""
    names = listed([f"{derivative_name(row.coefficient, row.term)} ({_estimate(row)})" for row in rows])
    return f"Not significant in these records: {names}. Do not use the estimates as measured values"


def _estimate(row: DerivativeRow) -> str:
    value = number(row.value if row.estimate is None else row.estimate)
    text = f"{value}, no bound" if row.std_error is None else f"{value} ± {number(row.std_error, 2)}"
    if row.correlation_max is not None and row.correlation_max > JUDGEMENT.correlated:
        text += f", correlation {row.correlation_max:.3f} with another estimate"
    return text


def _values(values: Sequence[float]) -> str:
    return f"value{'s' if len(values) > 1 else ''} {listed([plain(value, 4) for value in values])}"
