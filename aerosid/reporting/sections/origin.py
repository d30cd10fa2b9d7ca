"""What is needed to get the same report again."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from aerosid.loop.result import ClosedLoop
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.result_schema import input_files


def context(result: ClosedLoop, _figures: FigureBook) -> dict[str, Any]:
    """Versions, seed and the checksums of every input."""
    packages = {"aerosid": result.version, "Python": platform.python_version()}
    for name in ("numpy", "scipy", "numba"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = "not installed"
    return {"packages": packages, "inputs": input_files(result)}
