"""The schema of study.json: what scripts rely on."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from aerosid.reporting.schema_types import Text
from aerosid.studies.monte_carlo.statistics import LevelStatistics


class _Row(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class StudyFailure(_Row):
    """Reason why runs gave no result, and their number."""

    reason: Text
    runs: int


class StudyFile(_Row):
    """The whole of study.json; `plan` holds all that determines a result, `levels` the statistics by noise level."""

    schema_: Literal[1]
    aerosid: Text
    seed: int
    runs: int
    plan: dict[Text, Any]
    levels: tuple[LevelStatistics, ...]
    failures: tuple[StudyFailure, ...]

    model_config = ConfigDict(
        frozen=True,
        allow_inf_nan=False,
        alias_generator=lambda name: name.rstrip("_"),
        validate_by_name=True,
    )
