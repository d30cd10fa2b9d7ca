"""Exceptions, each with the exit code that the command line returns for it.

AerosidError
├── UsageError          exit 2: wrong usage
├── AircraftError       exit 2: a wrong aircraft file
├── ChannelMapError     exit 2: a wrong channel map
├── LogError            exit 3: an unusable log
└── EstimationError     exit 4: the estimation broke down

A scientific outcome ('unexplained', 'not_excited') is a result and never an exception. Each message is one sentence
that names the file, the channel or key, the sample or time, what was found, what was expected and what to do.
"""

from __future__ import annotations

from typing import ClassVar


class AerosidError(Exception):
    """Base of every error that aerosid raises on purpose."""

    exit_code: ClassVar[int] = 4


class UsageError(AerosidError):
    """The command or function was called wrongly."""

    exit_code: ClassVar[int] = 2


class AircraftError(AerosidError):
    """The aircraft file, or a term in it, is wrong."""

    exit_code: ClassVar[int] = 2


class ChannelMapError(AerosidError):
    """The channel map is wrong, or does not fit the log."""

    exit_code: ClassVar[int] = 2


class LogError(AerosidError):
    """The log cannot be used."""

    exit_code: ClassVar[int] = 3


class EstimationError(AerosidError):
    """The estimation broke down on input that was in order."""

    exit_code: ClassVar[int] = 4
