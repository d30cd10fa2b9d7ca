"""Writing of tables.json, details.json and paper.html: all of them, or none under its final name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from aerosid.file_set import text, write_files
from aerosid.studies.paper import published, table1, table3, table4
from aerosid.studies.paper.page import page_html
from aerosid.studies.paper.run import Reproduction


def tables(result: Reproduction) -> dict[str, Any]:
    """Contents of tables.json: our numbers in the layout of the paper's tables."""
    return {
        "table1": table1.json_rows(result.table1.fits),
        "table2": table1.json_rows(result.table2.fits),
        "table3": table3.json_rows(result.table3),
        "table4": table4.json_rows(result.table4),
    }


def details(result: Reproduction) -> dict[str, Any]:
    """Contents of details.json: printed numbers, spreads, and the supplementary studies."""
    return {
        "table1": {
            "printed": published.TABLE_1,
            "worst_error": {fit.case: fit.worst for fit in result.table1.fits},
            "worst_error_X2_squared": {fit.case: fit.worst for fit in result.table1.squared},
            "worst_error_wrong_start": {fit.case: fit.worst for fit in result.table1.wrong_start},
            "worst_error_first_points_left_out": {fit.case: fit.worst for fit in result.table1.skipped},
            "worst_error_restarted": {fit.case: fit.worst for fit in result.table1.restarted},
        },
        "table2": {
            "worst_error": {fit.case: fit.worst for fit in result.table2.fits},
            "worst_error_direct": {fit.case: fit.worst for fit in result.table2.direct},
            "worst_error_wrong_start": {fit.case: fit.worst for fit in result.table2.wrong_start},
            "worst_error_forward_backward": {fit.case: fit.worst for fit in result.table2.iterated},
            "error_of_case_III": [
                {"interval": interval, "Q2_inverse": density, "worst_error": error}
                for (interval, density), error in result.table2.errors.items()
            ],
        },
        "table3": [
            {
                "candidate": row.candidate,
                "direct_pitch": row.direct_pitch,
                "direct_axial": row.direct_axial,
                "printed_pitch": published.TABLE_3[row.candidate][0],
                "printed_axial": published.TABLE_3[row.candidate][1],
            }
            for row in result.table3
        ],
        "table4": [_level(level) for level in result.table4],
    }


def _level(level: table4.NoiseLevel) -> dict[str, Any]:
    printed = published.TABLE_4[level.snr]
    row: dict[str, Any] = {
        "snr": level.snr,
        "seeds": len(level.ours),
        "Q2_inverse": level.density,
        "cut_off_hz": level.cut_off_hz,
    }
    for i, name in enumerate(("C_X_alpha2", "C_m_alpha2")):
        several = len(level.ours) > 1
        row[name] = {
            "printed": printed[i],
            "mean": float(level.ours[:, i].mean()),
            "deviation": float(level.ours[:, i].std(ddof=1)) if several else None,
            "paper_chain_mean": float(level.direct[:, i].mean()),
            "paper_chain_deviation": float(level.direct[:, i].std(ddof=1)) if several else None,
        }
    return row


def write_reproduction(result: Reproduction, directory: Path) -> tuple[Path, ...]:
    """The paths of the files written.

    Parameters
    ----------
    result : Reproduction
    directory : Path
        Output folder; created where it does not exist.

    Raises
    ------
    UsageError
        Where the folder cannot be created or written.
    """
    texts = {
        "tables.json": json.dumps(tables(result), indent=2, allow_nan=False) + "\n",
        "details.json": json.dumps(details(result), indent=2, allow_nan=False) + "\n",
        "paper.html": page_html(result),
    }
    return write_files(directory, {name: text(content) for name, content in texts.items()})
