"""Folder of the user's caches: compiled kernels and compiled page templates."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER_VARIABLE = "AEROSID_CACHE_DIR"
"""Environment variable that names the folder of compiled kernels in place of the user's cache folder."""


def user_folder() -> Path:
    """Where kernels are written: AEROSID_CACHE_DIR, or aerosid below NUMBA_CACHE_DIR, or the user's cache folder."""
    if chosen := os.environ.get(FOLDER_VARIABLE):
        return Path(chosen)
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "aerosid"
    from platformdirs import user_cache_path

    return user_cache_path("aerosid", appauthor=False) / "kernels"


def made_user_folder(name: str) -> Path | None:
    """A folder of that name below, readable by the user alone; None where none can be made."""
    folder = user_folder() / name
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return None
    return folder
