"""The schema of batch.json: what scripts rely on."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

from aerosid.reporting.schema_types import Number, Text


class _Row(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class BatchAircraft(_Row):
    """The aircraft file of the batch."""

    path: Text
    sha256: Text


class BatchEffect(_Row):
    """An effect missing from the declared model on one log."""

    kind: Text
    where: Text
    term: Text
    value: Number
    std_error: Number


class BatchDerivative(_Row):
    """One derivative of one log; `value` is the declared one where `shown` is false."""

    coefficient: Text
    term: Text
    declared: Number
    value: Number
    std_error: Number
    std_error_white: Number
    shown: bool


class BatchError(_Row):
    """Root-mean-square of measured minus simulated of one channel."""

    channel: Text
    unit: Text
    before: Number
    after: Number
    noise: Number


class BatchLog(_Row):
    """One log; only those of one `condition_number` and one `structure` are combined in tables."""

    log: Text
    condition_number: int
    structure: int
    sha256: Text
    verdict: Text
    summary: Text
    condition: dict[Text, Number]
    effects: tuple[BatchEffect, ...]
    derivatives: tuple[BatchDerivative, ...]
    error: tuple[BatchError, ...]


class BatchFailure(_Row):
    """A log that could not be used."""

    log: Text
    reason: Text


class BatchFile(_Row):
    """The whole of batch.json."""

    schema_: Literal[1]
    aerosid: Text
    aircraft: BatchAircraft
    settings: dict[Text, object] = {}
    logs: tuple[BatchLog, ...]
    failures: tuple[BatchFailure, ...]

    model_config = ConfigDict(
        frozen=True,
        allow_inf_nan=False,
        alias_generator=lambda name: name.rstrip("_"),
        validate_by_name=True,
    )
