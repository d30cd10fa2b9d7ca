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
# Extra: what it reads, in words.
_READS = {
    "hdf5": "MATLAB 7.3 and HDF5",
    "mavlink": "MAVLink",
    "mdf4": "MDF 4",
    "tdms": "TDMS",
    "irig106": "IRIG 106 chapter 10",
    "igc": "IGC",
}


def require_extra(extra: str, path: str) -> None:
    """Nothing, where the library of an extra is installed: asked before anything else of such a file.

    Raises
    ------
    LogError
        If it is not.
    """
    for module, installs in EXTRAS.items():
        if installs == extra:
            library(module, path)


def library(module: str, path: str) -> ModuleType:
    """The module, imported now.

    Parameters
    ----------
    module : str
        A key of `EXTRAS`.
    path : str
        The file that needs it, for the message.

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
            f"{path}: {_READS[extra]} files are read by the library {module.split('.')[0]}, which is not installed; "
            f"install it with `pip install 'aerosid[{extra}]'`."
        ) from None
