"""Optional libraries of formats: imported on demand, with a one-sentence error where one is not installed."""

from __future__ import annotations

import importlib
from types import ModuleType

from aerosid.errors import LogError

# Imported module: the extra of aerosid that installs it.
EXTRAS = {
    "h5py": "hdf5",
    "pymavlink.dialects.v20.ardupilotmega": "mavlink",
    "asammdf": "mdf4",
    "nptdms": "tdms",
    "chapter10": "irig106",
    "aerofiles.igc": "igc",
}
# Extra: the formats that it reads, in words.
_READS = {
    "hdf5": "MATLAB 7.3 and HDF5",
    "mavlink": "MAVLink",
    "mdf4": "MDF 4",
    "tdms": "TDMS",
    "irig106": "IRIG 106 chapter 10",
    "igc": "IGC",
}


def require_extra(extra: str, path: str) -> None:
    """None; checks first of all that the library of an extra is installed.

    Raises
    ------
    LogError
        If it is not.
    """
    for module, installs in EXTRAS.items():
        if installs == extra:
            library(module, path)


def library(module: str, path: str) -> ModuleType:
    """The module, imported at the call.

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
