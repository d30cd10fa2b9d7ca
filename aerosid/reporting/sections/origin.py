"""Versions of the software that made the report."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """Versions of the packages that compute."""
    packages = {"aerosid": result.version, "Python": platform.python_version()}
    for name in ("numpy", "scipy", "numba"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = "not installed"
    return {"packages": packages}
