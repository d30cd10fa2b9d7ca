"""Folders of the bundled aircraft, sample flights and channel maps."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from aerosid.errors import UsageError

Folder = Literal["aircraft_models", "flight_data"]

_PACKAGE = Path(__file__).resolve().parents[1]


def bundled_folder(folder: Folder) -> Path:
    """The directory of bundled data, in a checkout as well as in an installation from a wheel.

    Parameters
    ----------
    folder : {"aircraft_models", "flight_data"}
        Which of the two.

    Raises
    ------
    UsageError
        If the name is another, or the installation lacks the folder.

    Notes
    -----
    In a checkout the folders stand beside the package; the wheel holds them inside it (pyproject.toml, force-include).
    """
    if folder not in get_args(Folder):
        raise UsageError(f"no bundled folder is named {folder!r}; give one of {', '.join(get_args(Folder))}.")
    for parent in (_PACKAGE, _PACKAGE.parent):
        candidate = parent / folder
        if candidate.is_dir():
            return candidate
    raise UsageError(f"The installation of aerosid in {_PACKAGE} lacks its folder {folder}; install it again.")
