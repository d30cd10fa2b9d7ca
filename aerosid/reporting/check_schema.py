"""The schema of what `check --json` prints: what scripts rely on."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

from aerosid.reporting.schema_types import Number, Text


class _Row(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class CheckedChannel(_Row):
    """Quality of one channel: numbers in `unit`, `missing` a fraction, `stuck` s; null where not a number."""

    name: Text
    unit: Text
    minimum: Number
    maximum: Number
    missing: Number
    spikes: int
    stuck: Number
    resolution: Number
    noise: Number
    excitation: Number


class CheckedFinding(_Row):
    """One problem of a log, and its remedy."""

    problem: Text
    subject: Text
    sentence: Text


class CheckedLog(_Row):
    """One log, s: sampling, channels, problems, data compatibility, and the closing sentence."""

    log: Text
    path: Text
    samples: int
    start: float
    stop: float
    interval: float
    gaps: tuple[tuple[float, float], ...]
    channels: tuple[CheckedChannel, ...]
    findings: tuple[CheckedFinding, ...]
    notes: tuple[Text, ...]
    instruments: Literal["consistent", "corrected", "inconsistent"] | None
    usable: bool
    sentence: Text
    lively: Text


class CheckFile(_Row):
    """The whole document."""

    schema_: Literal[1]
    aerosid: Text
    verb: Literal["check"]
    logs: tuple[CheckedLog, ...]

    model_config = ConfigDict(
        frozen=True,
        allow_inf_nan=False,
        alias_generator=lambda name: name.rstrip("_"),
        validate_by_name=True,
    )
