"""Roles of logs in words: the use of each log of a result, and the decisions of the validation logs."""

from __future__ import annotations

from aerosid.loop.result import ClosedLoop

NAMES = {"identification": "identification", "validation": "validation", "hold_out": "hold-out"}


def use_of(role: str, result: ClosedLoop | None = None) -> str:
    """Use of a log of that role, for table titles; with a result also the decisions of its validation logs."""
    if result is not None and not result.identified:
        return "nothing was fitted"
    if role == "identification":
        return "used in the fit"
    if role == "hold_out":
        return "used in no decision"
    if result is None:
        return "not used in the fit"
    decided = ", ".join(result.decided_by_validation)
    return f"not used in the fit; {decided or 'no effect confirmed or refuted'}"


def label_of(role: str, result: ClosedLoop | None = None) -> str:
    """The role's name and use: `hold-out: used in no decision`."""
    return f"{NAMES.get(role, role)}: {use_of(role, result)}"
