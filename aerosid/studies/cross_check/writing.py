"""Writing of the pages and cross_check.json: all of them, or none under its final name."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from aerosid.file_set import text, write_files
from aerosid.notation import finite_throughout
from aerosid.studies.cross_check.page import pages
from aerosid.studies.cross_check.run import CrossCheck
from aerosid.studies.cross_check.sideways_check import SidewaysCheck
from aerosid.studies.cross_check.stock_check import StockCheck
from aerosid.studies.paper import table3, table4


def numbers(result: CrossCheck) -> dict[str, Any]:
    """Contents of cross_check.json."""
    return {
        "schema": 1,
        "jsbsim": result.jsbsim,
        "seed": result.seed,
        "paper": {
            "agreement": result.paper.agreement,
            "table3": table3.json_rows(result.paper.table3),
            "table4": table4.json_rows(result.paper.table4),
        },
        "aircraft": [_aircraft(check) for check in result.aircraft],
        "lateral": [_flown(check) for check in result.sideways],
        "effects": [
            {
                "effect": check.planted.effect,
                "aircraft": check.planted.aircraft,
                "outcome": None if check.outcome is None else check.outcome.name.lower(),
                "verdict": check.verdict.name.lower(),
                "named": check.named,
                "alternatives": check.alternatives,
            }
            for check in result.effects
        ],
    }


def _aircraft(check: StockCheck) -> dict[str, Any]:
    further = {"flown_again": check.flown_again, "tables": [asdict(point) for point in check.tables]}
    return _flown(check) | further


def _flown(check: StockCheck | SidewaysCheck) -> dict[str, Any]:
    """Entries common to all aircraft flown."""
    return {
        "name": check.name,
        "airspeed": check.airspeed,
        "altitude": check.altitude,
        "flown": check.flown,
        "verdict": check.result.verdict.name.lower(),
        "summary": check.result.summary,
        "derivatives": [asdict(row) | {"truth": row.truth} for row in check.rows],
        "error": [asdict(row) for row in check.errors],
    }


def write_cross_check(result: CrossCheck, directory: Path) -> tuple[Path, ...]:
    """The paths of the files written.

    Raises
    ------
    UsageError
        Where the folder cannot be created or written.
    """
    contents = pages(result)
    contents["cross_check.json"] = json.dumps(finite_throughout(numbers(result)), indent=1, allow_nan=False) + "\n"
    return write_files(directory, {name: text(content) for name, content in contents.items()})
