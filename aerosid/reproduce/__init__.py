"""Parameswaran & Raol 1994 reproduced: every table and figure beside what the paper printed."""

from __future__ import annotations

from aerosid.reproduce.run import Reproduction, reproduce
from aerosid.reproduce.writing import write_reproduction

__all__ = ["Reproduction", "reproduce", "write_reproduction"]
