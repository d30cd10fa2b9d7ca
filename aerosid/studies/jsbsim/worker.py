"""The process that runs JSBSim: reads a job from a folder, flies it, writes the results next to it.

    python -m aerosid.studies.jsbsim.worker FOLDER

JSBSim prints to standard output, and some of its exceptions end the process; neither reaches the user.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from aerosid.errors import EstimationError
from aerosid.reporting.export.jsbsim_units import POUND_FORCE
from aerosid.studies.jsbsim.derivatives import differentiate, differentiate_sideways
from aerosid.studies.jsbsim.executive import RECORDED, Executive, State
from aerosid.studies.jsbsim.properties import ANSWER, DEVIATIONS, DRIVES, HISTORIES, JOB, THRUST


def main(folder: Path) -> None:
    """Do the job of a folder; an expected error is written as a result too."""
    job = json.loads((folder / JOB).read_text(encoding="utf-8"))
    try:
        answer = _TASKS[job["task"]](folder, job)
    except EstimationError as error:
        answer = {"error": str(error)}
    (folder / ANSWER).write_text(json.dumps(answer), encoding="utf-8")


def _load(folder: Path, name: str, job: dict[str, Any]) -> Executive:
    return Executive(
        folder,
        name,
        frame=job["frame"],
        altitude=job["altitude"],
        properties=job["properties"],
        reads=job["reads"],
        thrust_below=job["thrust_below"],
    )


def _fly(folder: Path, job: dict[str, Any]) -> dict[str, Any]:
    """Trim and fly the aircraft `flown`, differentiate the aircraft `clean` about that trim."""
    executive = _load(folder, job["flown"], job)
    for pattern, forward, below, *right in job["places"]:
        executive.place(pattern, forward, below, *right)
    with np.load(folder / DRIVES) as stored:
        drives = {name: stored[name] for name in stored.files}
    for name in drives.keys() - {THRUST, *DEVIATIONS.values()}:
        executive[name] = drives[name][0]  # effects present from the start are part of the trim
    executive.attached = job["attached"]
    trimmed = executive.trim(job["airspeed"], job.get("sideways", False))
    executive.freeze(trimmed)
    for name, value in job["after_trim"].items():
        executive[name] = value
    drives[THRUST] = drives[THRUST] * (trimmed.thrust / POUND_FORCE)
    histories = executive.fly(drives)
    np.savez(folder / HISTORIES, **histories)  # type: ignore[arg-type]
    answer: dict[str, Any] = {"trim": asdict(trimmed)}
    clean = _load(folder, job["clean"], job)
    flown = {
        name: (float(histories[channel].min()), float(histories[channel].max()))
        for name, channel in (("alpha", "alpha"), ("q", "q"), ("delta_e", "surface"), ("airspeed", "V"))
    }
    answer["slopes"] = differentiate(clean, trimmed, flown).as_lists()
    if job.get("sideways", False):
        sides = {"beta": "beta", "p": "p", "r": "r", "delta_a": "aileron", "delta_r": "rudder"}
        flown |= {name: (float(histories[key].min()), float(histories[key].max())) for name, key in sides.items()}
        answer["sideways"] = differentiate_sideways(clean, trimmed, flown)
    answer["flown"] = flown
    answer |= {name: getattr(clean, name) for name in _BODY}
    return answer


_BODY = ("mass", "I_xx", "I_yy", "I_zz", "I_xz", "wing_area", "mean_chord", "span")


def _trim(folder: Path, job: dict[str, Any]) -> dict[str, Any]:
    """Trim the aircraft `clean` and differentiate it there."""
    executive = _load(folder, job["clean"], job)
    trimmed = executive.trim(job["airspeed"])
    return {"trim": asdict(trimmed), "slopes": differentiate(executive, trimmed, {}).as_lists()}


def _freeze(folder: Path, job: dict[str, Any]) -> dict[str, Any]:
    """Coefficients and recorded quantities of the aircraft `clean` in each of several states."""
    executive = _load(folder, job["clean"], job)
    coefficients, readings = [], []
    for numbers in job["states"]:
        further = numbers.pop("properties", {})
        for name, value in further.items():
            executive[name] = value
        executive.freeze(State(**numbers))
        coefficients.append(executive.coefficients().tolist())
        readings.append(
            dict(zip(("C_Y", "C_l", "C_n"), executive.lateral_coefficients().tolist(), strict=True))
            | {name: executive[key] * factor for name, (key, factor) in RECORDED.items()}
            | {"alpha_dot": executive["aero/alphadot-rad_sec"], "accelerations": executive.accelerations().tolist()}
        )
    return {"coefficients": coefficients, "readings": readings}


_TASKS = {"fly": _fly, "trim": _trim, "freeze": _freeze}

if __name__ == "__main__":
    main(Path(sys.argv[1]))
