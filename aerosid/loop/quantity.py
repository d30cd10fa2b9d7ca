"""Quantity: a number with its standard deviation and its unit."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """One number with its standard deviation, None where that is unknown, and its unit."""

    value: float
    std_error: float | None
    unit: str
