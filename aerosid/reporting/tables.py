"""derivatives.csv, residuals.csv and next_input.csv, for the engineer's own tools."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.result_schema import DerivativeEntry

RESPONSES = ("measured", "declared", "before", "after")
"""Quantities of each channel in residuals.csv, in this order."""

_ROWS_AT_ONCE = 8192
"""Numerical: rows that are written together."""


def derivatives_csv(result: ClosedLoop) -> str:
    """The derivative table with the keys of result.json's `derivatives` as columns; empty where a number is unknown."""
    rows = [DerivativeEntry.model_validate(row).model_dump().values() for row in result.derivatives]
    return _csv_line(list(DerivativeEntry.model_fields)) + "".join(_csv_line([_cell(v) for v in row]) for row in rows)


def residuals_csv(result: ClosedLoop) -> str:
    """Log, time, then measured, declared, before and after of each channel; empty where a sample is missing.

    Notes
    -----
    Columns are named `V_measured [m/s]`, in the SI units of the glossary. Numbers are written to nine significant
    digits: beyond what any recorder resolves, and half the size of all of them.
    """
    channels = measured_channels(result.simulated)
    header = ["log", "time [s]", *(f"{c}_{r} [{unit_of(c)}]" for c in channels for r in RESPONSES)]
    return _csv_line(header) + "".join(_rows(simulated, channels) for simulated in result.simulated)


def next_input_csv(result: ClosedLoop) -> str | None:
    """The input to fly next as a native log: time and deflections from trim; None where there is none."""
    planned = None if result.next_flight is None else result.next_flight.input
    if planned is None:
        return None
    names = tuple(planned.deflections)
    columns = np.column_stack([planned.time, *(planned.deflections[name] for name in names)])
    header = _csv_line(["time [s]", *(f"{name} [rad]" for name in names)])
    rows = "".join(_csv_line([f"{value:.9g}" for value in row]) for row in columns.tolist())
    return f"# {planned.name}; {', '.join(names)}: deviation from trim, linear between rows\n{header}{rows}"


def measured_channels(simulated: Sequence[Simulated]) -> tuple[str, ...]:
    """The channels compared on any log: outputs in the order of the glossary, then others in order of occurrence."""
    measured = dict.fromkeys(channel for response in simulated for channel in response.measured)
    known = [channel for channel, entry in CHANNELS.items() if entry.kind == "output" and channel in measured]
    return (*known, *(channel for channel in measured if channel not in known))


def unit_of(channel: str) -> str:
    """The unit of a channel; `1` for one that is not in the glossary."""
    return CHANNELS[channel].unit if channel in CHANNELS else "1"


def _rows(simulated: Simulated, channels: Sequence[str]) -> str:
    """The lines of one log."""
    empty = np.full(simulated.log.samples, np.nan)
    columns = [simulated.log.time]
    for channel in channels:
        for response in RESPONSES:
            histories: Mapping[str, NDArray[np.float64]] = getattr(simulated, response)
            columns.append(histories.get(channel, empty))
    line = ",%.15g" + ",%.9g" * (len(columns) - 1) + "\n"  # times may count from 1970
    name = _csv_line([simulated.log.name]).removesuffix("\n")
    return "".join(
        _block(np.column_stack([column[start : start + _ROWS_AT_ONCE] for column in columns]), line, name)
        for start in range(0, simulated.log.samples, _ROWS_AT_ONCE)
    )


def _block(numbers: NDArray[np.float64], line: str, name: str) -> str:
    """Some lines: formatted a whole line at a time, which is several times faster than number by number."""
    numbers[~np.isfinite(numbers)] = np.nan
    text = "".join(line % tuple(row) for row in numbers.tolist()).replace(",nan", ",")
    return name + text.removesuffix("\n").replace("\n", "\n" + name) + "\n"


def _csv_line(cells: Sequence[str]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerow(cells)
    return stream.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)
