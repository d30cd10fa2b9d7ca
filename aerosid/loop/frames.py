"""Tables of a result as pandas frames, with the names of result.json as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.effect_rows import Effect
from aerosid.loop.model_validation.open_loop_errors import ErrorRow

if TYPE_CHECKING:
    import pandas as pd

EVIDENCE = ("correlation", "p_value", "validation_gain", "hold_out_gain", "likelihood_gain")
"""Evidence of an effect with a column of its own."""


def derivatives_frame(rows: Sequence[DerivativeRow]) -> pd.DataFrame:
    """One row a derivative, indexed by coefficient and term."""
    return _frame(DerivativeRow, rows, ["coefficient", "term"])


def errors_frame(rows: Sequence[ErrorRow]) -> pd.DataFrame:
    """One row a log and channel, indexed by both, with `reduction`: error before over error after."""
    frame = _frame(ErrorRow, rows, ["log", "channel"])
    return frame.assign(reduction=frame["before"].astype(float) / frame["after"].astype(float))


def effects_frame(effects: Sequence[Effect]) -> pd.DataFrame:
    """One row an effect, indexed by its rank; the evidence in columns of its own."""
    import pandas as pd

    names = [entry.name for entry in fields(Effect) if entry.name not in ("evidence", "parameters")]
    rows = [
        {name: getattr(effect, name) for name in names} | {name: getattr(effect.evidence, name) for name in EVIDENCE}
        for effect in effects
    ]
    return pd.DataFrame(rows, columns=[*names, *EVIDENCE]).set_index("rank")


def _frame(kind: type[Any], rows: Sequence[Any], index: list[str]) -> pd.DataFrame:
    import pandas as pd

    names = [entry.name for entry in fields(kind)]
    return pd.DataFrame([[getattr(row, name) for name in names] for row in rows], columns=names).set_index(index)
