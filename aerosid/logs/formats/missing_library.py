"""Optional libraries of formats: imported when a file needs one, and one sentence where it is not installed."""

from __future__ import annotations

import importlib
from types import ModuleType

from aerosid.errors import LogError

# Module that is imported: the extra of aerosid that installs it.
EXTRAS = {
    "h5py": "hdf5",
    "pymavlink.dialects.v20.ardupilotmega": "mavlink",
    "asammdf": "mdf4",
    "nptdms": "tdms",
    "chapter10": "irig106",
    "aerofiles.igc": "igc",
}


def library(module: str, path: str, what: str) -> ModuleType:
    """The module, imported now.

    Parameters
    ----------
    module : str
        A key of `EXTRAS`.
    path : str
        The file that needs it, for the message.
    what : str
        The format, in words.

    Raises
    ------
    LogError
        If it is not installed; the sentence names the extra.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        extra = EXTRAS[module]
        raise LogError(
            f"{path}: {what} files are read by the library {module.split('.')[0]}, which is not installed; install it "
            f"with `pip install 'aerosid[{extra}]'`."
        ) from None
