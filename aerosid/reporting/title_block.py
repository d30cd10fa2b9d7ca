"""Title block of the report: run, files with checksums, flight condition, references, sign convention."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, planes_of
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.provenance import Provenance, all_settings
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import ROLES
from aerosid.loop.settings import USUAL
from aerosid.notation import listed, plain
from aerosid.reporting.flight_condition import NOT_RECORDED, flight_condition
from aerosid.reporting.result_json import portable
from aerosid.reporting.roles import NAMES

AXES = "body axes x forward, y right, z down from the centre of gravity; moments and accelerations refer to it"
SIGNS = {
    LONGITUDINAL.name: "pitch rate and C_m nose up; elevator positive trailing edge down (C_m_delta_e negative)",
    LATERAL.name: (
        "roll rate and C_l right wing down; yaw rate and C_n nose right; sideslip positive with the wind from the "
        "right; aileron positive right trailing edge down (C_l_delta_a negative); rudder positive trailing edge left "
        "(C_n_delta_r negative)"
    ),
}
"""Of each plane of the motion."""


_ACCELERATIONS = "specific force a_z = −9.81 m/s² in level flight"


@dataclass(frozen=True)
class UsedFile:
    """An input file of the report: its use, its span, and the SHA-256 of its bytes."""

    path: str
    role: str
    span: str
    sha256: str


def title_block(result: ClosedLoop) -> dict[str, Any]:
    """The variables of the title block's template: texts only.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop; data missing from its provenance are left out.
    """
    roles = [(NAMES[role], log) for role in ROLES for log in getattr(result, role)]
    return {
        "run": _run(result),
        "files": _files(result, roles),
        "conditions": _rows([flight_condition(log, result.aircraft) for _, log in roles]),
        "logs": [(log.name, role) for role, log in roles],
        "references": _references(result),
    }


def _run(result: ClosedLoop) -> list[tuple[str, str]]:
    made = result.provenance
    given = [("Date", made.date), ("Analyst", made.analyst)]
    rows = [(name, text) for name, text in given if text]
    rows.append(("Program", ", ".join((f"aerosid {result.version}", *_versions(), f"seed {result.seed}"))))
    if made.command:
        rows.append(("Command", made.command))
    if made.date or made.settings:
        rows.append(("Changed settings", "; ".join(_changed(made)) or "none, all defaults"))
    if made.remarks:
        rows.append(("Remarks", made.remarks))
    return rows


def _versions() -> Iterator[str]:
    """The versions of the computing software."""
    yield f"Python {platform.python_version()}"
    for name in ("numpy", "scipy", "numba"):
        try:
            yield f"{name} {version(name)}"
        except PackageNotFoundError:
            yield f"{name} not installed"


def _changed(made: Provenance) -> Iterator[str]:
    """A text for each setting that differs from its default, with both values: `priors: yes (default no)`."""
    usual = all_settings(USUAL)
    for name, value in made.settings.items():
        words = name.replace(".", ", ").replace("_", " ")
        yield f"{words}: {_said(value)} (default {_said(usual.get(name))})"


def _said(value: Any) -> str:
    """A setting's value as text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return plain(value)
    if isinstance(value, list):
        return ", ".join(map(_said, value)) or "none"
    return "none" if value is None else str(value)


def _files(result: ClosedLoop, roles: list[tuple[str, FlightLog]]) -> list[UsedFile]:
    logs = [
        UsedFile(portable(log.path or log.name), role, f"{plain(log.time[0])} to {plain(log.time[-1])}", log.sha256)
        for role, log in roles
    ]
    read_with = dict.fromkeys((log.channel_map, log.channel_map_sha256) for _, log in roles if log.channel_map)
    maps = [UsedFile(portable(path), "channel map", "", digest) for path, digest in read_with]
    aircraft = UsedFile(portable(result.aircraft.path), "aircraft file", "", result.aircraft.sha256)
    return [*logs, *maps, aircraft]


def _rows(conditions: list[dict[str, str]]) -> list[tuple[str, list[str]]]:
    """One row per quantity, one text per log; quantities recorded in no log are listed once at the end."""
    rows = [(name, [condition[name] for condition in conditions]) for name in conditions[0]]
    silent = [name for name, texts in rows if set(texts) == {NOT_RECORDED}]
    recorded = [row for row in rows if row[0] not in silent]
    return [*recorded, (listed(silent), [NOT_RECORDED] * len(conditions))] if silent else recorded


def _references(result: ClosedLoop) -> list[tuple[str, str]]:
    aircraft = result.aircraft
    speed = aircraft.airspeed
    first = result.identification[0]
    if speed is not None:
        reference_speed = f"{plain(speed, 5)} m/s"
    elif "V" in first and np.isfinite(first["V"]).any():
        reference_speed = f"{plain(float(np.nanmean(first['V'])), 5)} m/s, mean of {first.name}"
    else:
        reference_speed = "not given"
    sideways = LATERAL in planes_of(aircraft.axes)
    span = f"span b {plain(aircraft.span)} m, " if sideways and aircraft.span is not None else ""
    names = ("I_xx", "I_yy", "I_zz", "I_xz") if sideways else ("I_yy",)
    inertias = ", ".join(f"{name} {plain(getattr(aircraft, name) or 0.0)}" for name in names)
    sizes = (
        f"wing area S {plain(aircraft.wing_area)} m², {span}mean chord c {plain(aircraft.mean_chord)} m, "
        f"airspeed U0 {reference_speed}, {'moments' if sideways else 'moment'} of inertia {inertias} kg m²"
    )
    signs = "; ".join(SIGNS[plane.name] for plane in planes_of(aircraft.axes))
    return [
        ("References", sizes),
        ("Declared numbers from", aircraft.source or "not given"),
        ("Signs", f"{AXES}; {signs}; {_ACCELERATIONS}"),
    ]
