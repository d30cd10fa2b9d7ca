"""The schema of result.json: what scripts rely on, and how a closed loop is written as it.

The file is a pure function of the result: fixed order of keys, shortest exact decimals, no time of writing.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict

SCHEMA = 1


def finite_or_none(number: Any) -> Any:
    """The number as a float; None where it is None, NaN or infinite, none of which JSON can hold."""
    if number is None or not math.isfinite(number):
        return None
    return float(number)


Number = Annotated[float | None, BeforeValidator(finite_or_none)]


def encodable(text: Any) -> Any:
    """The text with what UTF-8 cannot hold written out: a path on disk may be any bytes."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8") if isinstance(text, str) else text


Text = Annotated[str, BeforeValidator(encodable)]
Role = Literal["identification", "validation", "hold_out", "aircraft"]
LogRole = Literal["identification", "validation", "hold_out"]


class _Row(BaseModel):
    model_config = ConfigDict(frozen=True, from_attributes=True, allow_inf_nan=False)


class InputFile(_Row):
    """A file that the result depends on; `span` of a log is what was used of it, s of its own time."""

    path: Text
    sha256: Text
    role: Role
    span: tuple[float, float] | None = None
    channel_map: Text | None = None
    channel_map_sha256: Text | None = None


class ConfirmationRow(_Row):
    """A term's number from the validation logs alone."""

    value: Number
    std_error: Number
    p_value: Number


class EvidenceRow(_Row):
    """Why an effect is believed."""

    correlation: Number
    p_value: Number
    validation_gain: Number
    likelihood_gain: Number
    hold_out_gain: Number = None
    confirmation: ConfirmationRow | None = None


class ParameterRow(_Row):
    """One number of an effect that has several."""

    value: Number
    std_error: Number
    unit: Text


class EffectRow(_Row):
    """What the data show to be missing; `time` and `parameters` stand only where the kind has them."""

    rank: int
    kind: Text
    where: Text
    term: Text
    value: Number
    std_error: Number
    unit: Text
    time: Number = None
    parameters: dict[Text, ParameterRow] | None = None
    evidence: EvidenceRow


class AlternativeRow(EffectRow):
    """An effect that these manoeuvres cannot tell from the chosen effect `instead_of`."""

    instead_of: Text
    worse_by: Number = None
    margin: Number = None


class DerivativeEntry(_Row):
    """One line of the derivative table."""

    coefficient: Text
    term: Text
    declared: Number
    refitted: Number
    value: Number
    std_error: Number
    std_error_white: Number
    rls: Number
    rls_std_error: Number
    correlation_max: Number
    shown: bool
    variance_inflation: Number = None
    scatter: Number = None
    filter_error: Number = None
    filter_error_std_error: Number = None
    estimate: Number = None


class CoefficientEntry(_Row):
    """Share of a measured coefficient's variance that the model explains."""

    coefficient: Text
    log: Text
    r2_before: Number
    r2_after: Number


class ErrorEntry(_Row):
    """Root-mean-square of measured minus simulated of one channel on one log."""

    log: Text
    role: LogRole
    channel: Text
    unit: Text
    declared: Number
    before: Number
    after: Number
    trimmed: Number
    noise: Number
    r2_trimmed: Number = None
    noise_doubt: Text = ""


class PrefilterEntry(_Row):
    """The prefilter that fed the model-error recursion."""

    kind: Text
    cut_off_hz: Number
    reason: Text
    effect_on_estimates: Text


class ScreeningEntry(_Row):
    """One candidate in the screening of the model error."""

    coefficient: Text
    term: Text
    correlation: Number
    partial: Number
    gain: Number
    independence: Number
    chosen: bool


class InstrumentEntry(_Row):
    """One fault of an instrument, from kinematics alone; `axis` of a position."""

    kind: Text
    where: Text
    axis: Text
    value: Number
    std_error: Number
    unit: Text
    p_value: Number
    likelihood_gain: Number


class AirEntry(_Row):
    """Gusts along a body axis, from kinematics alone: m/s and m."""

    axis: Text
    sigma: Number
    length: Number


class AgreementEntry(_Row):
    """How one channel of one log agrees with the integrated path: root-mean-squares, and whether the rest is white."""

    log: Text
    channel: Text
    unit: Text
    before: Number
    after: Number
    noise: Number
    white: bool


class ContradictionEntry(_Row):
    """Channels of one log that cannot belong to one motion."""

    log: Text
    channels: tuple[Text, ...]
    remedy: Text
    misfit: Number
    sentence: Text


class KinematicsEntry(_Row):
    """Whether the instruments agree with each other; groups of `inseparable` begin with a finding."""

    logs: tuple[Text, ...]
    verdict: Literal["consistent", "corrected", "inconsistent"]
    sentence: Text
    findings: tuple[InstrumentEntry, ...]
    inseparable: tuple[tuple[InstrumentEntry, ...], ...]
    air: tuple[AirEntry, ...]
    channels: tuple[AgreementEntry, ...]
    contradictions: tuple[ContradictionEntry, ...]
    notes: tuple[Text, ...]


class ModeEntry(_Row):
    """One mode of a linear model; `numbers` holds those that the mode has."""

    name: Text
    numbers: dict[Text, ParameterRow]


class LinearEntry(_Row):
    """A model linearised at level flight: x' = A x + B u in u, w, q, theta, SI; rows of A and B by state.

    Levels are those of MIL-F-8785C for `category` and `aircraft_class`, 4 where worse than level 3.
    """

    model: Literal["declared", "completed"]
    airspeed: Number
    density: Number
    mass: Number
    trim: dict[Text, ParameterRow]
    states: tuple[Text, ...]
    inputs: tuple[Text, ...]
    A: tuple[tuple[Number, ...], ...]
    B: tuple[tuple[Number, ...], ...]
    modes: tuple[ModeEntry, ...]
    qualities: dict[Text, ParameterRow]
    category: Text
    aircraft_class: Text
    short_period_level: int | None
    short_period_level_range: tuple[int, int] | None
    phugoid_level: int | None


class PlannedStepEntry(_Row):
    """One level of a planned input; s and rad from trim."""

    start: Number
    duration: Number
    deflection: Number


class PlannedPeakEntry(_Row):
    """Least and greatest expected value of one quantity, SI, and its limits."""

    name: Text
    unit: Text
    trim: Number
    lowest: Number
    highest: Number
    limit_low: Number
    limit_high: Number
    given: bool


class PlannedInputEntry(_Row):
    """The input of next_input.csv."""

    name: Text
    amplitude: Number
    rate: Number
    airspeed: Number
    density: Number
    steps: tuple[PlannedStepEntry, ...]
    peaks: tuple[PlannedPeakEntry, ...]


class QuestionEntry(_Row):
    """Something that the flights leave open, and what the planned input would answer."""

    kind: Literal["alternative", "derivative"]
    subject: Text
    rival: Text
    present: Number
    expected: Number
    needed: Number
    probability: Number
    repeats: int | None
    elsewhere: Text


class NextFlightEntry(_Row):
    """What to fly next; `input` is null where no input within the limits decides anything."""

    input: PlannedInputEntry | None
    questions: tuple[QuestionEntry, ...]
    tried: int
    note: Text


class FitEntry(_Row):
    """How well one channel of one log is simulated."""

    log: Text
    role: LogRole
    channel: Text
    variant: Literal["before", "after"]
    theil: Number
    bias: Number
    variance: Number
    covariance: Number
    r2: Number
    autocorrelation: tuple[Number, ...]
    whiteness: Number


class InnovationEntry(_Row):
    """The whitened residuals of one channel of an identification log."""

    log: Text
    channel: Text
    ratio: Number
    autocorrelation: tuple[Number, ...]
    whiteness: Number


class CorrelationEntry(_Row):
    """Correlations of the estimated derivatives."""

    parameters: tuple[Text, ...]
    rows: tuple[tuple[Number, ...], ...]


class ProvenanceEntry(_Row):
    """The day, and who asked how."""

    date: Text
    command: Text
    analyst: Text
    remarks: Text


class ResultFile(_Row):
    """The whole of result.json, in the order of its keys; further keys of later versions are ignored on reading."""

    schema_: Literal[1]
    aerosid: Text
    seed: int
    inputs: tuple[InputFile, ...]
    verdict: Text
    summary: Text
    effects: tuple[EffectRow, ...]
    alternatives: tuple[AlternativeRow, ...]
    derivatives: tuple[DerivativeEntry, ...]
    coefficients: tuple[CoefficientEntry, ...]
    error: tuple[ErrorEntry, ...]
    prefilter: PrefilterEntry | None = None
    screening: tuple[ScreeningEntry, ...] = ()
    fit: tuple[FitEntry, ...] = ()
    innovations: tuple[InnovationEntry, ...] = ()
    correlation: CorrelationEntry | None = None
    notes: tuple[Text, ...] = ()
    linear: tuple[LinearEntry, ...] = ()
    next_flight: NextFlightEntry | None = None
    kinematics: KinematicsEntry | None = None
    provenance: ProvenanceEntry | None = None
    settings: dict[Text, Any] = {}
    settings_changed: tuple[Text, ...] = ()
    decided_by_validation: tuple[Text, ...] = ()

    model_config = ConfigDict(
        frozen=True,
        allow_inf_nan=False,
        alias_generator=lambda name: name.rstrip("_"),  # pydantic keeps the name `schema` for itself
        validate_by_name=True,
    )
