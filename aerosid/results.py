"""What one closed loop reports: frozen rows with the names of result.json, and the histories behind the figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.flight_log import FlightLog

FloatArray = NDArray[np.float64]


class Verdict(Enum):
    """The outcome of a loop; each value is a sentence for a person."""

    EXPLAINED = "The named effects explain what the declared model lacks, down to the measurement noise."
    PARTLY_EXPLAINED = "The named effects are there, but more is missing than they explain."
    UNEXPLAINED = "The declared model is wrong, and nothing in the library explains how."
    NOTHING_MISSING = "With its derivatives re-estimated the declared model explains the flight down to the noise."
    NOT_EXCITED = "The manoeuvre does not excite the aircraft enough to show anything."
    INCONSISTENT_DATA = "The measured channels contradict one another; no aerodynamic model can follow them all."


@dataclass(frozen=True)
class Parameter:
    """One number of an effect that has several."""

    value: float
    std_error: float | None
    unit: str


@dataclass(frozen=True)
class Evidence:
    """Why an effect is believed.

    Attributes
    ----------
    correlation : float or None
        |rho| of the model error d(t) with the candidate, both through the same estimator (Parameswaran & Raol 1994,
        table 3); None for an effect that is no term.
    p_value : float
        Of the effect being none, coloured residuals and the number of candidates counted.
    validation_gain : float or None
        before/after of the root-mean-square error on the validation logs, median over channels; None without one.
    likelihood_gain : float
        Rise of -2 ln L when the effect is struck out again.
    """

    correlation: float | None
    p_value: float
    validation_gain: float | None
    likelihood_gain: float


@dataclass(frozen=True)
class Effect:
    """One effect that the declared model lacks, as result.json names it."""

    rank: int
    kind: str
    where: str
    term: str
    value: float
    std_error: float
    unit: str
    evidence: Evidence
    time: float | None = None
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    instead_of: str = ""
    """For an alternative: the chosen effect that it could replace."""


@dataclass(frozen=True)
class DerivativeRow:
    """One line of the derivative table; None where a number does not exist."""

    coefficient: str
    term: str
    declared: float | None
    refitted: float | None
    value: float
    std_error: float | None
    std_error_white: float | None
    rls: float | None
    rls_std_error: float | None
    correlation_max: float | None
    shown: bool


@dataclass(frozen=True)
class CoefficientRow:
    """Share of a measured coefficient's variance that the model explains, before and after."""

    coefficient: str
    log: str
    r2_before: float
    r2_after: float


@dataclass(frozen=True)
class ErrorRow:
    """Root-mean-square of measured minus simulated (open loop) of one channel on one log; None where it diverged."""

    log: str
    role: str
    channel: str
    unit: str
    declared: float | None
    before: float | None
    after: float | None
    trimmed: float | None
    noise: float
    r2_trimmed: float | None = None
    """Share of the measured variance that the trimmed simulation explains."""


@dataclass(frozen=True)
class Simulated:
    """Open-loop responses on one log, all in SI; NaN where a simulation left its range.

    `measured`, `declared`, `before`, `after`, `trimmed`: channel -> (N,).
    """

    log: FlightLog
    role: str
    measured: Mapping[str, FloatArray]
    declared: Mapping[str, FloatArray]
    before: Mapping[str, FloatArray]
    after: Mapping[str, FloatArray]
    trimmed: Mapping[str, FloatArray]


@dataclass(frozen=True)
class ScreeningRow:
    """One candidate in the screening of d(t).

    `correlation` with d(t) as the paper has it, `partial` after the terms already there took their share, both of
    candidate and error through the same estimator; `gain` the likelihood gain of the score test; `chosen` whether
    it entered the model.
    """

    coefficient: str
    term: str
    correlation: float
    partial: float
    gain: float
    independence: float
    chosen: bool


@dataclass(frozen=True)
class ErrorHistory:
    """The model error d(t) of one equation on one identification log, and the chosen terms over it.

    `coefficient` names the equation (C_X, C_Z, C_m); `d` (N,) is d(t) in units of that coefficient from the structure
    without the found terms; `explained` (N,) the found terms' share through the same estimator; `correlation` of both;
    `deviation` (N,) the standard deviation of d, None where d is the filter's, as for an aircraft that runs away.
    """

    log: str
    coefficient: str
    time: FloatArray
    d: FloatArray
    explained: FloatArray
    correlation: float
    terms: tuple[str, ...]
    deviation: FloatArray | None = None


@dataclass(frozen=True)
class PrefilterNote:
    """The prefilter that fed the model-error recursion, and what it does to the estimates."""

    kind: str
    cut_off_hz: float | None
    reason: str
    effect_on_estimates: str


@dataclass(frozen=True)
class ClosedLoop:
    """Everything that one run of the loop found; the writers turn it into files."""

    version: str
    seed: int
    aircraft: Aircraft
    completed_aircraft: Aircraft
    identification: tuple[FlightLog, ...]
    validation: tuple[FlightLog, ...]
    verdict: Verdict
    summary: str
    effects: tuple[Effect, ...]
    alternatives: tuple[Effect, ...]
    derivatives: tuple[DerivativeRow, ...]
    coefficients: tuple[CoefficientRow, ...]
    errors: tuple[ErrorRow, ...]
    simulated: tuple[Simulated, ...]
    screening: tuple[ScreeningRow, ...]
    model_error: tuple[ErrorHistory, ...]
    prefilter: PrefilterNote
    notes: tuple[str, ...]
    """What was assumed and what a reader must know, one sentence each."""
