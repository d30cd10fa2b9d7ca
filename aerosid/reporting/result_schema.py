"""The schema of result.json, and a closed loop written by it.

The file is a pure function of the result: fixed order of keys, shortest exact decimals, no time of writing.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ConfigDict, Field

from aerosid.reporting.next_flight_schema import NextFlightEntry
from aerosid.reporting.schema_types import Number, Row, Text

SCHEMA = 1
"""Format: version of result.json."""


Role = Literal["identification", "validation", "hold_out", "aircraft"]
LogRole = Literal["identification", "validation", "hold_out"]


class InputFile(Row):
    """A file that the result depends on; `span` of a log is the part that was used, s of its own time."""

    path: Text
    sha256: Text
    role: Role
    span: tuple[float, float] | None = None
    channel_map: Text | None = None
    channel_map_sha256: Text | None = None


class ConfirmationRow(Row):
    """A term's parameter from the validation logs alone."""

    value: Number
    std_error: Number
    p_value: Number


class EvidenceRow(Row):
    """Evidence for an effect."""

    correlation: Number
    p_value: Number
    validation_gain: Number
    likelihood_gain: Number
    hold_out_gain: Number = None
    confirmation: ConfirmationRow | None = None
    unseen_better: bool | None = None


class ParameterRow(Row):
    """One parameter of an effect that has several."""

    value: Number
    std_error: Number
    unit: Text


class EffectRow(Row):
    """An effect missing from the declared model; `time`, `along` and `parameters` only where the kind has them.

    `log` of a step change, where several logs were fitted.
    """

    rank: int
    kind: Text
    where: Text
    term: Text
    value: Number
    std_error: Number
    unit: Text
    time: Number = None
    along: Text | None = None
    log: Text | None = None
    parameters: dict[Text, ParameterRow] | None = None
    evidence: EvidenceRow


class AlternativeRow(EffectRow):
    """An effect that these manoeuvres cannot distinguish from the chosen effect `instead_of`."""

    instead_of: Text
    worse_by: Number = None
    margin: Number = None


class DerivativeEntry(Row):
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
    declared_away: Number = None
    by_validation: bool = False


class CoefficientEntry(Row):
    """R^2: fraction of a measured coefficient's variance explained by the model."""

    coefficient: Text
    log: Text
    r2_before: Number
    r2_after: Number


class ErrorEntry(Row):
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


class PrefilterEntry(Row):
    """The prefilter that fed the model-error recursion."""

    kind: Text
    cut_off_hz: Number
    reason: Text
    effect_on_estimates: Text


class ScreeningEntry(Row):
    """One candidate in the screening of the model error."""

    coefficient: Text
    term: Text
    correlation: Number
    partial: Number
    gain: Number
    independence: Number
    chosen: bool


class InstrumentEntry(Row):
    """One instrument error, from kinematics alone; `axis` of a position."""

    kind: Text
    where: Text
    axis: Text
    value: Number
    std_error: Number
    unit: Text
    p_value: Number
    likelihood_gain: Number


class AirEntry(Row):
    """Gusts along a body axis, from kinematics alone: m/s and m."""

    axis: Text
    sigma: Number
    length: Number


class AgreementEntry(Row):
    """Root-mean-square of one channel of one log less the reconstructed path, and whether the remainder is white."""

    log: Text
    channel: Text
    unit: Text
    before: Number
    after: Number
    noise: Number
    white: bool


class ContradictionEntry(Row):
    """Channels of one log that cannot belong to one motion."""

    log: Text
    channels: tuple[Text, ...]
    remedy: Text
    misfit: Number
    sentence: Text


class KinematicsEntry(Row):
    """Data compatibility of the instruments; groups of `inseparable` begin with a finding."""

    logs: tuple[Text, ...]
    verdict: Literal["consistent", "corrected", "inconsistent"]
    sentence: Text
    findings: tuple[InstrumentEntry, ...]
    inseparable: tuple[tuple[InstrumentEntry, ...], ...]
    air: tuple[AirEntry, ...]
    channels: tuple[AgreementEntry, ...]
    contradictions: tuple[ContradictionEntry, ...]
    notes: tuple[Text, ...]


class ModeEntry(Row):
    """One mode of a linear model; `numbers` holds those that the mode has.

    `extrapolated` names those that last longer than the longest identification log.
    """

    name: Text
    numbers: dict[Text, ParameterRow]
    extrapolated: tuple[Text, ...]


class LevelEntry(Row):
    """A level of flying qualities, and the best and worst within two deviations, null where unknown."""

    level: int
    span: tuple[int, int] | None


class LinearEntry(Row):
    """A model linearised at level flight: x' = A x + B u in `states`, SI; rows of A and B by state.

    Levels are those of MIL-F-8785C for `category` and `aircraft_class`, 4 where worse than level 3; `levels` by mode.
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
    levels: dict[Text, LevelEntry]
    record: Number | None


class FitEntry(Row):
    """Goodness of fit of one channel of one log."""

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


class PredictionEntry(Row):
    """R^2 of one channel of one log over a prediction horizon."""

    log: Text
    role: LogRole
    channel: Text
    horizon: Literal["one_step", "five_seconds", "open_loop"]
    seconds: Number
    predicted: Number
    r2: dict[Text, Number]
    theil: dict[Text, Number]


class OtherDerivativeEntry(Row):
    """A derivative that differs on a validation log: there, and on the identification logs."""

    log: Text
    coefficient: Text
    term: Text
    value: Number
    std_error: Number
    fitted: Number
    fitted_std_error: Number


class InnovationEntry(Row):
    """The whitened residuals of one channel of an identification log."""

    log: Text
    channel: Text
    ratio: Number
    autocorrelation: tuple[Number, ...]
    whiteness: Number


class CorrelationEntry(Row):
    """Correlations of the estimated derivatives."""

    parameters: tuple[Text, ...]
    rows: tuple[tuple[Number, ...], ...]


class ProvenanceEntry(Row):
    """Date, command line and analyst."""

    date: Text
    command: Text
    analyst: Text
    remarks: Text


class RivalStructureEntry(Row):
    """One method's structure; `error` is the median of error over noise on the flights that were compared."""

    method: Text
    effects: tuple[Text, ...]
    error: Number


class SecondOpinionEntry(Row):
    """Cross-check by the model error d(t) alone."""

    agrees: bool
    sentence: Text
    role: Text
    structures: tuple[RivalStructureEntry, ...]
    error_ratio: Number | None


class ResultFile(Row):
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
    predictions: tuple[PredictionEntry, ...] = ()
    other_derivatives: tuple[OtherDerivativeEntry, ...] = ()
    correlation: CorrelationEntry | None = None
    notes: tuple[Text, ...] = ()
    linear: tuple[LinearEntry, ...] = ()
    next_flight: NextFlightEntry | None = None
    kinematics: KinematicsEntry | None = None
    provenance: ProvenanceEntry | None = None
    settings: dict[Text, Any] = Field(default_factory=dict)
    settings_changed: tuple[Text, ...] = ()
    decided_by: Text = "likelihood"
    decided_by_validation: tuple[Text, ...] = ()
    second_opinion: SecondOpinionEntry | None = None

    model_config = ConfigDict(
        frozen=True,
        allow_inf_nan=False,
        alias_generator=lambda name: name.rstrip("_"),  # pydantic keeps the name `schema` for itself
        validate_by_name=True,
    )
