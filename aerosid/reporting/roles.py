"""Roles of logs in words: what each log of a result was used for, and what the validation logs decided."""

from __future__ import annotations

from aerosid.loop.result import ClosedLoop

NAMES = {"identification": "identification", "validation": "validation", "hold_out": "hold-out"}


def use_of(role: str, result: ClosedLoop | None = None) -> str:
    """What a log of that role was used for, for its table; of a result also what its validation logs decided."""
    if role == "identification":
        return "used for the fit"
    if role == "hold_out":
        return "touched by no decision"
    if result is None:
        return "not used for the fit"
    decided = ", ".join(result.decided_by_validation)
    return f"not used for the fit; {decided or 'asked what it refutes and confirms, and changed nothing'}"


def label_of(role: str, result: ClosedLoop | None = None) -> str:
    """The role's name and use: `hold-out: touched by no decision`."""
    return f"{NAMES.get(role, role)}: {use_of(role, result)}"
