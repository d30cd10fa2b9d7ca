"""Logs with a channel on another clock, and what is told of the contradictions in a log."""

from __future__ import annotations

import numpy as np
from problems import with_channels

from aerosid.compatibility.agreement import Contradiction
from aerosid.compatibility.contradiction import contradictions
from aerosid.compatibility.recording import read_recording
from aerosid.logs.flight_log import FlightLog


def judged(log: FlightLog) -> tuple[Contradiction, ...]:
    recording = read_recording(log)
    assert recording is not None
    return contradictions([recording])


def late(log: FlightLog, channel: str, seconds: float) -> FlightLog:
    return with_channels(log, **{channel: np.interp(log.time - seconds, log.time, log[channel])})
