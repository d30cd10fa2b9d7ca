"""Roles of the logs of one loop: identification, validation (may refute effects), or hold-out (no decision)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, count, islice
from pathlib import Path
from typing import Literal, get_args

from aerosid.aircraft import Aircraft
from aerosid.errors import UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.shared_samples import shared_samples
from aerosid.logs.spans import named_by_span

Role = Literal["identification", "validation", "hold_out"]
ROLES: tuple[Role, ...] = get_args(Role)

OPTIONS: dict[Role, str] = {"identification": "the fitted logs", "validation": "--validate", "hold_out": "--hold-out"}
"""How a person gave a log its role."""


def require_logs(identification: object, aircraft: object, validation: object = (), hold_out: object = ()) -> None:
    """Refuse what is no aircraft, no sequence of logs, or no log at all: a caller from Python can pass anything.

    Raises
    ------
    TypeError
        With what to pass.
    UsageError
        Where there is no log to identify from.
    """
    if not isinstance(aircraft, Aircraft):
        raise TypeError(
            f"the aircraft is {_shown(aircraft)}, expected an Aircraft; pass that of load_aircraft(file or name)."
        )
    for role, logs in zip(ROLES, (identification, validation, hold_out), strict=True):
        if isinstance(logs, FlightLog):
            raise TypeError(f"{role} is one FlightLog, expected a list of them; pass it as [log].")
        if not isinstance(logs, Sequence) or isinstance(logs, str):
            raise TypeError(f"{role} is {_shown(logs)}, expected a list of FlightLog; pass [read_log(file)].")
        for log in logs:
            if not isinstance(log, FlightLog):
                raise TypeError(f"{role} holds {_shown(log)}, expected FlightLog; pass that of read_log(file).")
    if not identification:
        raise UsageError("there is no log to identify from; pass at least one, as [read_log(file)].")


def _shown(found: object) -> str:
    kind = type(found).__name__
    return f"{kind} {str(found)[:60]!r}" if isinstance(found, str | Path) else f"a {kind}"


def require_separate(
    identification: Sequence[FlightLog], validation: Sequence[FlightLog], hold_out: Sequence[FlightLog]
) -> None:
    """Refuse two logs that hold the same samples.

    Raises
    ------
    UsageError
        Where two do: what was fitted predicts itself, and what is counted twice looks twice as certain.
    """
    given: list[tuple[Role, FlightLog]] = [
        *(("identification", log) for log in identification),
        *(("validation", log) for log in validation),
        *(("hold_out", log) for log in hold_out),
    ]
    for (first_role, first), (second_role, second) in combinations(given, 2):
        span = shared_samples(second, first)
        if span is None:
            continue
        why = (
            "each sample is to be counted once"
            if first_role == second_role
            else f"{OPTIONS[second_role]} needs samples of its own"
        )
        raise UsageError(
            f"{second.path or second.name} ({OPTIONS[second_role]}) holds samples of {first.path or first.name} "
            f"({OPTIONS[first_role]}) from {span[0]:g} to {span[1]:g} s, but {why}; give another flight or span."
        )


def named_apart(*parts: Sequence[FlightLog]) -> tuple[tuple[FlightLog, ...], ...]:
    """The logs, with those of one name distinguished by folder, by span, or else by number.

    Recorders restart their file numbers each day, and the name identifies the flight of an effect.
    """
    given = [log for part in parts for log in part]
    names = [log.name for log in given]
    taken = Counter(names)
    for name in [name for name, often in taken.items() if often > 1]:
        places = [n for n, log in enumerate(given) if log.name == name]
        alike = [given[n] for n in places]
        numbered = (f"{name}_{k}" for k in count(1))
        ways = (
            [f"{Path(log.path).parent.name}_{name}" if log.path else name for log in alike],
            [named_by_span(name, log.time[0], log.time[-1]) for log in alike],
            list(islice((free for free in numbered if free not in taken), len(alike))),
        )
        found = next(way for way in ways if len(set(way)) == len(way) and not taken.keys() & set(way))
        taken.update(found)
        for n, other in zip(places, found, strict=True):
            names[n] = other
    named = iter(replace(log, name=name) if name != log.name else log for log, name in zip(given, names, strict=True))
    return tuple(tuple(next(named) for _ in part) for part in parts)
