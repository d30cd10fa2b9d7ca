"""The full model as JSON, and its derivatives as a CSV table."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from aerosid import __version__
from aerosid.aircraft import Aircraft
from aerosid.reporting.export.options import Exported, ExportOptions, named, origin

SCHEMA = 1
"""Format: version of the exported tables."""


def json_text(aircraft: Aircraft, options: ExportOptions) -> Exported:
    """The contents of the aircraft file, with units.

    Keys: schema, aerosid, name, source, file, sha256, reference, mass, air, thrust, derivatives (coefficient, term,
    value, sigma, fixed, shown), completed (origin of a completed file) and effects. What is not given is null; span,
    I_xx, I_zz and I_xz are present only where the file gives them.
    """
    options.only("json")
    document = {
        "schema": SCHEMA,
        "aerosid": __version__,
        "name": aircraft.name,
        "source": aircraft.source,
        "file": Path(aircraft.path).name,
        "sha256": aircraft.sha256,
        "reference": {
            "wing_area": _quantity(aircraft.wing_area, "m^2"),
            "mean_chord": _quantity(aircraft.mean_chord, "m"),
            "airspeed": _quantity(aircraft.airspeed, "m/s"),
            **({} if aircraft.span is None else {"span": _quantity(aircraft.span, "m")}),
        },
        "mass": {
            "mass": _quantity(aircraft.mass, "kg"),
            "I_yy": _quantity(aircraft.I_yy, "kg m^2"),
            **{name: _quantity(inertia, "kg m^2") for name, inertia in _lateral_inertias(aircraft)},
        },
        "air": {"density": _quantity(aircraft.density, "kg/m^3")},
        "thrust": {
            "force": _quantity(aircraft.thrust, "N"),
            "incidence": _quantity(aircraft.thrust_incidence, "rad"),
            "z_arm": _quantity(aircraft.thrust_z_arm, "m"),
        },
        "completed": None if aircraft.completion is None else asdict(aircraft.completion),
        "derivatives": [
            {
                "coefficient": entry.coefficient,
                "term": str(entry.term),
                "value": entry.value,
                "sigma": entry.sigma,
                "fixed": entry.fixed,
                "shown": entry.shown,
            }
            for entry in aircraft.derivatives
        ],
        "effects": [
            {
                "kind": effect.kind,
                "where": effect.where,
                "term": effect.term,
                "value": effect.value,
                "std_error": effect.std_error,
                "time": effect.time,
                "parameters": dict(effect.parameters),
            }
            for effect in aircraft.effects
        ],
    }
    return Exported(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def csv_text(aircraft: Aircraft, options: ExportOptions) -> Exported:
    """One row per derivative, after `#` lines with the reference quantities and the effects."""
    options.only("csv")
    lines = [
        f"aircraft: {aircraft.name}",
        f"source: {aircraft.source}",
        f"file: {Path(aircraft.path).name}, SHA-256 {aircraft.sha256}",
        *([origin(aircraft)] if aircraft.completion else []),
        f"wing_area [m^2]: {aircraft.wing_area!r}",
        f"mean_chord [m]: {aircraft.mean_chord!r}",
        f"airspeed of q_hat and V_hat [m/s]: {'current' if aircraft.airspeed is None else repr(aircraft.airspeed)}",
        f"mass [kg]: {aircraft.mass!r}",
        f"I_yy [kg m^2]: {aircraft.I_yy!r}",
        *([] if aircraft.span is None else [f"span [m]: {aircraft.span!r}"]),
        *(f"{name} [kg m^2]: {inertia!r}" for name, inertia in _lateral_inertias(aircraft)),
        f"density [kg/m^3]: {'of the log' if aircraft.density is None else repr(aircraft.density)}",
        f"thrust [N]: {'of the log' if aircraft.thrust is None else repr(aircraft.thrust)}",
        f"thrust incidence [rad], z_arm [m]: {aircraft.thrust_incidence!r}, {aircraft.thrust_z_arm!r}",
        *(
            f"effect: {named(effect)}, "
            + ", ".join(f"{name} {number!r}" for name, number in _numbers(effect.value, effect.time, effect.parameters))
            for effect in aircraft.effects
        ),
    ]
    stream = io.StringIO()
    for line in lines:
        stream.write(f"# {' '.join(line.split())}\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("coefficient", "term", "value", "sigma", "fixed", "shown"))
    for entry in aircraft.derivatives:
        sigma = "" if entry.sigma is None else repr(entry.sigma)
        marks = ("true" if mark else "false" for mark in (entry.fixed, entry.shown))
        writer.writerow((entry.coefficient, str(entry.term), repr(entry.value), sigma, *marks))
    return Exported(stream.getvalue())


def _lateral_inertias(aircraft: Aircraft) -> list[tuple[str, float]]:
    """Those of roll and yaw given in the file."""
    given = [(name, getattr(aircraft, name)) for name in ("I_xx", "I_zz", "I_xz")]
    return [(name, inertia) for name, inertia in given if inertia is not None]


def _quantity(value: float | None, unit: str) -> dict[str, Any]:
    return {"value": value, "unit": unit}


def _numbers(value: float | None, time: float | None, parameters: Any) -> list[tuple[str, float]]:
    given = [("value", value), ("time", time), *parameters.items()]
    return [(name, number) for name, number in given if number is not None]
