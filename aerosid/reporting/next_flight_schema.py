"""Schema of the next flight in result.json."""

from __future__ import annotations

from typing import Literal

from aerosid.reporting.schema_types import Number, Row, Text


class PlannedStepEntry(Row):
    """One level of a planned input; s, rad from trim, and the surface's channel."""

    start: Number
    duration: Number
    deflection: Number
    surface: Text


class PlannedPeakEntry(Row):
    """Least and greatest expected value of one quantity, SI, and its limits."""

    name: Text
    unit: Text
    trim: Number
    lowest: Number
    highest: Number
    limit_low: Number
    limit_high: Number
    given: bool


class PlannedInputEntry(Row):
    """The input of next_input.csv."""

    name: Text
    amplitude: Number
    rate: Number
    airspeed: Number
    density: Number
    steps: tuple[PlannedStepEntry, ...]
    peaks: tuple[PlannedPeakEntry, ...]


class QuestionEntry(Row):
    """An open question, and the result expected from the planned input."""

    kind: Literal["alternative", "derivative"]
    subject: Text
    rival: Text
    present: Number
    expected: Number
    needed: Number
    probability: Number
    repeats: int | None
    elsewhere: Text


class NextFlightEntry(Row):
    """The next flight; `input` is null where no input within the limits answers a question."""

    input: PlannedInputEntry | None
    questions: tuple[QuestionEntry, ...]
    tried: int
    note: Text
