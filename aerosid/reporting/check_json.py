"""The schema of what `check --json` prints, and how the quality of logs is written as it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Literal

from pydantic import BaseModel, ConfigDict

import aerosid
from aerosid.compatibility import KinematicConsistency
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.quality import LogQuality
from aerosid.reporting.result_json import kinematics_entry, portable
from aerosid.reporting.result_schema import KinematicsEntry, Number, Text


class _Row(BaseModel):
    model_config = ConfigDict(frozen=True, from_attributes=True, allow_inf_nan=False)


class ChannelEntry(_Row):
    """What one channel is worth: numbers in `unit`, `missing` a share, `stuck` s; null where a number is none."""

    name: Text
    unit: Text
    minimum: Number
    maximum: Number
    missing: Number
    spikes: int
    stuck: Number
    quantum: Number
    noise: Number
    excitation: Number


class FindingEntry(_Row):
    """One thing that is wrong; `blocking` where close-loop cannot work on the log."""

    problem: Text
    subject: Text
    detail: Text
    blocking: bool
    sentence: Text


class CheckedLog(_Row):
    """One log: sampling (s), channels, what is wrong, and whether its instruments agree."""

    name: Text
    path: Text
    sha256: Text
    channel_map: Text | None
    channel_map_sha256: Text | None
    samples: int
    start: Number
    stop: Number
    interval: Number
    unevenness: Number
    gaps: tuple[tuple[float, float], ...]
    usable: bool
    channels: tuple[ChannelEntry, ...]
    findings: tuple[FindingEntry, ...]
    notes: tuple[Text, ...]
    kinematics: KinematicsEntry | None


class CheckFile(_Row):
    """The whole document."""

    schema_: Literal[1] = 1
    aerosid: Text
    verb: Literal["check"] = "check"
    logs: tuple[CheckedLog, ...]

    model_config = ConfigDict(
        frozen=True,
        allow_inf_nan=False,
        alias_generator=lambda name: name.rstrip("_"),
        validate_by_name=True,
    )


def check_text(checked: Sequence[tuple[FlightLog, LogQuality, KinematicConsistency | None]]) -> str:
    """The text of the document: identical bytes for identical logs."""
    made = CheckFile(aerosid=aerosid.__version__, logs=tuple(_log(*each) for each in checked))
    return made.model_dump_json(by_alias=True, indent=2) + "\n"


def _log(log: FlightLog, quality: LogQuality, agreement: KinematicConsistency | None) -> CheckedLog:
    return CheckedLog(
        name=quality.name,
        path=portable(quality.path),
        sha256=log.sha256,
        channel_map=portable(log.channel_map) or None,
        channel_map_sha256=log.channel_map_sha256 or None,
        samples=quality.samples,
        start=quality.start,
        stop=quality.stop,
        interval=quality.interval,
        unevenness=quality.unevenness,
        gaps=quality.gaps,
        usable=quality.usable,
        channels=tuple(ChannelEntry.model_validate(asdict(channel)) for channel in quality.channels),
        findings=tuple(
            FindingEntry(
                problem=finding.problem.name.lower(),
                subject=finding.subject,
                detail=finding.detail,
                blocking=finding.blocking,
                sentence=str(finding),
            )
            for finding in quality.findings
        ),
        notes=quality.notes,
        kinematics=kinematics_entry(agreement),
    )
