"""derivatives.csv and residuals.csv, for the engineer's own tools."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from aerosid.nomenclature import CHANNELS
from aerosid.reporting.result_schema import DerivativeEntry
from aerosid.results import ClosedLoop, Simulated

if TYPE_CHECKING:
    import pandas as pd

RESPONSES = ("measured", "declared", "before", "after")
"""What residuals.csv holds of each channel, in this order."""

_SIGNIFICANT_DIGITS = 9


def derivatives_csv(result: ClosedLoop) -> str:
    """The derivative table with the keys of result.json's `derivatives` as columns; empty where a number is unknown."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(DerivativeEntry.model_fields)
    for row in result.derivatives:
        writer.writerow([_cell(value) for value in DerivativeEntry.model_validate(row).model_dump().values()])
    return stream.getvalue()


def residuals_csv(result: ClosedLoop) -> str:
    """Log, time, then measured, declared, before and after of each channel; empty where a sample is missing.

    Notes
    -----
    Columns are named `V_measured [m/s]`, in the SI units of the glossary. Numbers are rounded to nine significant
    digits: beyond what any recorder resolves, and half the size.
    """
    import pandas as pd

    channels = measured_channels(result.simulated)
    frames = [_frame(response, channels) for response in result.simulated]
    table: pd.DataFrame = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=_header(channels))
    return str(table.to_csv(index=False, lineterminator="\n"))


def measured_channels(simulated: Sequence[Simulated]) -> tuple[str, ...]:
    """The channels that any log was compared in: outputs in the order of the glossary, then others as they come."""
    held = dict.fromkeys(channel for response in simulated for channel in response.measured)
    known = [channel for channel, entry in CHANNELS.items() if entry.kind == "output" and channel in held]
    return (*known, *(channel for channel in held if channel not in known))


def unit_of(channel: str) -> str:
    """The unit that a channel is held in; `1` for one that the glossary does not know."""
    return CHANNELS[channel].unit if channel in CHANNELS else "1"


def rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """`values` (N,) to nine significant digits; NaN and zero stay."""
    safe = np.where(np.isfinite(values) & (values != 0.0), np.abs(values), 1.0)
    factor = 10.0 ** (_SIGNIFICANT_DIGITS - 1 - np.floor(np.log10(safe)))
    return np.asarray(np.rint(values * factor) / factor)


def _header(channels: Sequence[str]) -> list[str]:
    return ["log", "time [s]", *(_column(channel, response) for channel in channels for response in RESPONSES)]


def _column(channel: str, response: str) -> str:
    return f"{channel}_{response} [{unit_of(channel)}]"


def _frame(simulated: Simulated, channels: Sequence[str]) -> pd.DataFrame:
    """The rows of one log."""
    import pandas as pd

    empty = np.full(simulated.log.samples, np.nan)
    columns: dict[str, Any] = {"log": simulated.log.name, "time [s]": simulated.log.time}
    for channel in channels:
        for response in RESPONSES:
            histories: Mapping[str, NDArray[np.float64]] = getattr(simulated, response)
            values = histories.get(channel, empty)
            columns[_column(channel, response)] = rounded(np.where(np.isfinite(values), values, np.nan))
    return pd.DataFrame(columns)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)
