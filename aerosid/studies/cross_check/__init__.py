"""Validation of close-loop with JSBSim: the paper's flight, aircraft with known derivatives, and injected effects."""

from __future__ import annotations

from aerosid.studies.cross_check.run import CrossCheck, cross_check
from aerosid.studies.cross_check.writing import write_cross_check

__all__ = ["CrossCheck", "cross_check", "write_cross_check"]
