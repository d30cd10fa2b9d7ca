"""Names of effects in lists."""

from __future__ import annotations

from aerosid.effects import KINDS


def listed_name(kind: str, where: str) -> str:
    """An effect that is no term, as an entry of a list: `control lag of delta_e`, `vertical turbulence`."""
    if where or kind not in KINDS:
        return kind.replace("_", " ") + (f" of {where}" if where else "")
    return KINDS[kind].short_name
