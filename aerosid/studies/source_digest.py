"""Digest of this package's sources: results of different versions of the code must not be combined."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path


@cache
def source_state(package: Path = Path(__file__).parents[1]) -> str:
    """A hash of every Python file of the package, names and bytes; the same wherever it is installed.

    A version number does not change while an estimator is being edited; this digest does.
    """
    state = hashlib.sha256()
    for path in sorted(package.rglob("*.py"), key=lambda path: path.relative_to(package).as_posix()):
        content = path.read_bytes()
        state.update(f"{path.relative_to(package).as_posix()}\0{len(content)}\0".encode())
        state.update(content)
    return state.hexdigest()
