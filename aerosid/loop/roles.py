"""Roles of the logs of one loop: fitted, predicted with a say in what is named, or held out from every decision."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Literal, get_args

from aerosid.errors import UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.shared_samples import shared_samples

Role = Literal["identification", "validation", "hold_out"]
ROLES: tuple[Role, ...] = get_args(Role)

OPTIONS: dict[Role, str] = {"identification": "the fitted logs", "validation": "--validate", "hold_out": "--hold-out"}
"""How a person gave a log its role."""


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
