"""Process isolation of JSBSim, in a temporary folder of its own: a crash of JSBSim becomes a one-sentence error."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError, UsageError
from aerosid.studies.jsbsim.configuration import planet_xml
from aerosid.studies.jsbsim.properties import ANSWER, DRIVES, HISTORIES, JOB, PLANET

Array = NDArray[np.float64]
_LONGEST = 600.0
"""Numerical: time limit, s, of one flight in JSBSim."""

_ENOUGH = 400
"""Display: characters of JSBSim's last output quoted in a message."""


def require_jsbsim() -> None:
    """None; checks that JSBSim is installed.

    Raises
    ------
    UsageError
        Where it is not installed.
    """
    if importlib.util.find_spec("jsbsim") is None:
        raise UsageError("JSBSim, which this command needs, is not installed; install it with pip install jsbsim.")


def run_job(
    aircraft: Mapping[str, ET.Element], job: Mapping[str, Any], drives: Mapping[str, Array] | None = None
) -> tuple[dict[str, Any], dict[str, Array]]:
    """The worker's results, and the histories of the flight (empty where none was flown).

    Parameters
    ----------
    aircraft : mapping of str to Element
        Name -> `<fdm_config>`.
    job : mapping
        The job, as read by `worker`.
    drives : mapping of str to (F,), optional
        Property -> value in each frame.

    Raises
    ------
    EstimationError
        Where JSBSim refuses the aircraft or the flight, or ends.
    UsageError
        Where JSBSim is not installed.
    """
    require_jsbsim()
    with tempfile.TemporaryDirectory(prefix="aerosid-jsbsim-") as name:
        folder = Path(name)
        (folder / PLANET).write_text(planet_xml(), encoding="utf-8")
        for label, config in aircraft.items():
            place = folder / "aircraft" / label
            place.mkdir(parents=True)
            ET.ElementTree(config).write(place / f"{label}.xml", encoding="utf-8", xml_declaration=True)
        (folder / JOB).write_text(json.dumps(dict(job)), encoding="utf-8")
        if drives is not None:
            np.savez(folder / DRIVES, **drives)  # type: ignore[arg-type]
        _run(folder)
        answer: dict[str, Any] = json.loads((folder / ANSWER).read_text(encoding="utf-8"))
        if "error" in answer:
            raise EstimationError(answer["error"])
        histories: dict[str, Array] = {}
        if (folder / HISTORIES).exists():
            with np.load(folder / HISTORIES) as stored:
                histories = {key: stored[key] for key in stored.files}
    return answer, histories


def _run(folder: Path) -> None:
    """Start the worker and wait; it must write its results."""
    # The worker imports the package from where this process did, and leaves no file in the user's folder.
    paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
    environment = os.environ | {"PYTHONPATH": paths, "JSBSIM_DEBUG": "0"}
    command = [sys.executable, "-m", "aerosid.studies.jsbsim.worker", str(folder)]
    try:
        run = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, timeout=_LONGEST, check=False, errors="replace"
        )
    except subprocess.TimeoutExpired:
        raise EstimationError(f"JSBSim did not end within {_LONGEST:g} s; fly a shorter manoeuvre.") from None
    if (folder / ANSWER).exists():
        return
    output = " ".join(f"{run.stdout}\n{run.stderr}".split())[-_ENOUGH:]
    how = f"with signal {signal.Signals(-run.returncode).name}" if run.returncode < 0 else f"with code {run.returncode}"
    raise EstimationError(
        f"JSBSim ended {how} on this aircraft (last output: {output or 'none'}); try another aircraft."
    )
