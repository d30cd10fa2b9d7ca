"""Parameswaran & Raol 1994 reproduced: every table and figure compared with the printed ones."""

from __future__ import annotations

from aerosid.studies.paper.run import Reproduction, reproduce
from aerosid.studies.paper.writing import write_reproduction

__all__ = ["Reproduction", "reproduce", "write_reproduction"]
