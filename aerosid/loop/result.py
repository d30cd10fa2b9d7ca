"""What one closed loop reports: frozen rows with the names of result.json, and the histories behind the figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.compatibility import KinematicConsistency
from aerosid.logs.flight_log import FlightLog
from aerosid.model_error.coefficient_match import CoefficientRow
from aerosid.model_error.force_history import ErrorHistory
from aerosid.model_error.screening import RegressorPicture, ScreeningRow

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
    """One number with its standard deviation, None where that is unknown, and its unit."""

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
    variance_inflation: float | None = None
    """By how much the other parameters widen its variance: what it would be if all others were known is 1."""
    scatter: float | None = None
    """Standard deviation of the estimates from each identification log alone, where there are several."""
    filter_error: float | None = None
    """The estimate among forces of any shape, where the flight shows more than the structure explains."""
    filter_error_std_error: float | None = None
    """Its standard deviation; `std_error` is no smaller."""


SHOWN = 0.3
"""A derivative known to worse than this share of its size (its own or the declared, the greater) is not shown."""


def is_shown(value: float, declared: float | None, std_error: float) -> bool:
    """Whether a record holds enough information on a derivative to put it into a table unflagged."""
    return bool(std_error <= SHOWN * max(abs(value), abs(declared or 0.0)))


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
class FitRow:
    """How well one channel of one log is simulated, by one of the variants `before`, `after`; None where it diverged.

    `theil` is Theil's inequality coefficient, with the shares `bias`, `variance` and `covariance` of the mean square
    error; `r2` the explained share of the measured variance; `autocorrelation` of the residual at the lags 0, 1, ...;
    `whiteness` the p-value of Ljung and Box's test.
    """

    log: str
    role: str
    channel: str
    variant: str
    theil: float | None
    bias: float | None
    variance: float | None
    covariance: float | None
    r2: float | None
    autocorrelation: tuple[float, ...]
    whiteness: float | None


@dataclass(frozen=True)
class InnovationRow:
    """The whitened residuals of one channel of an identification log, beside the completed model.

    `ratio` of their root-mean-square to what the estimate took for noise; `autocorrelation` at the lags 0, 1, ...;
    `whiteness` the p-value of Ljung and Box's test.
    """

    log: str
    channel: str
    ratio: float
    autocorrelation: tuple[float, ...]
    whiteness: float | None


@dataclass(frozen=True)
class CorrelationMatrix:
    """Correlations of the estimated derivatives, from the covariance corrected for coloured residuals.

    `parameters` name coefficient and term; `rows` one tuple a parameter.
    """

    parameters: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]


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
class ModeRow:
    """One mode of a linear model.

    `name` is short_period, phugoid, third_oscillatory, real_root_1 or real_root_2; `numbers` holds those of frequency
    (undamped, natural), damping, period, time_to_half and time_to_double that the mode has.
    """

    name: str
    numbers: Mapping[str, Parameter]


@dataclass(frozen=True)
class LinearRow:
    """A model linearised at level flight, its modes, flying qualities and elevator step.

    Attributes
    ----------
    model : str
        declared or completed.
    airspeed, density, mass : float
        The condition: the mean of the first identification log; m/s, kg/m^3, kg.
    trim : mapping of str to Parameter
        alpha, delta_e, thrust of level flight.
    inputs : tuple of str
        The I controls.
    A : ndarray, shape (4, 4)
        d(rates)/d(u, w, q, theta), SI.
    B : ndarray, shape (4, I)
        d(rates)/d(controls), SI.
    modes : tuple of ModeRow
        The fastest first.
    qualities : mapping of str to Parameter
        n_alpha and, where there is a short period, cap.
    category, aircraft_class : str
        What the levels were judged for (MIL-F-8785C).
    short_period_level, phugoid_level : int or None
        1 to 3, 4 where worse; None where there is no such mode. Of a short period that has become a divergence, that
        of the divergence.
    short_period_level_range : (int, int) or None
        Best and worst level within two deviations; None where the deviations are unknown.
    step_size : float
        Of the elevator step, rad.
    step_time : ndarray, shape (N,)
        s.
    step : mapping of str to ndarray, shape (N,)
        Deviations of V, alpha, q and theta from trim after the step, SI.
    step_deviation : mapping of str to ndarray, shape (N,)
        Standard deviations of these; empty where unknown.
    """

    model: str
    airspeed: float
    density: float
    mass: float
    trim: Mapping[str, Parameter]
    inputs: tuple[str, ...]
    A: FloatArray
    B: FloatArray
    modes: tuple[ModeRow, ...]
    qualities: Mapping[str, Parameter]
    category: str
    aircraft_class: str
    short_period_level: int | None
    short_period_level_range: tuple[int, int] | None
    phugoid_level: int | None
    step_size: float
    step_time: FloatArray
    step: Mapping[str, FloatArray]
    step_deviation: Mapping[str, FloatArray]


@dataclass(frozen=True)
class PrefilterNote:
    """The prefilter that fed the model-error recursion, and what it does to the estimates."""

    kind: str
    cut_off_hz: float | None
    reason: str
    effect_on_estimates: str


@dataclass(frozen=True)
class PlannedStep:
    """One level of a planned input: from `start` s, the ramp counted in, for `duration` s; `deflection` rad."""

    start: float
    duration: float
    deflection: float


@dataclass(frozen=True)
class PlannedPeak:
    """Least and greatest expected value of one quantity, and its limits; None where it has none.

    `given`: the limit was given in the aircraft file or the call; otherwise it follows from what was flown.
    """

    name: str
    unit: str
    trim: float
    lowest: float
    highest: float
    limit_low: float | None
    limit_high: float | None
    given: bool


@dataclass(frozen=True)
class PlannedHistory:
    """What one channel is expected to show, SI: by the chosen model, and by the closest alternative where there is one.

    `chosen`, `rival`: (N,) at the times of the input.
    """

    unit: str
    chosen: FloatArray
    rival: FloatArray | None


@dataclass(frozen=True)
class PlannedInput:
    """A control input to be flown, as a deflection of the elevator from trim.

    Attributes
    ----------
    name : str
        What a pilot calls it: doublet, 3-2-1-1, multistep, multisine.
    steps : tuple of PlannedStep
        Empty for a multisine.
    amplitude, rate : float
        Greatest deflection from trim, rad; greatest rate, rad/s.
    time, delta_e : ndarray, shape (N,)
        s; deflection from trim, rad, linear between samples.
    peaks : tuple of PlannedPeak
        Of the motion that is expected, over all models in question.
    airspeed : float
        m/s, at which it begins, in steady flight.
    density : float
        kg/m^3 there.
    expected : mapping of str to PlannedHistory
        By channel.
    rival : str
        The closest alternative; empty where none is in question.
    """

    name: str
    steps: tuple[PlannedStep, ...]
    amplitude: float
    rate: float
    time: FloatArray
    delta_e: FloatArray
    peaks: tuple[PlannedPeak, ...]
    airspeed: float
    density: float
    expected: Mapping[str, PlannedHistory]
    rival: str


@dataclass(frozen=True)
class Question:
    """Something that the flights leave open, and what the planned input would answer.

    Attributes
    ----------
    kind : str
        `alternative`: the chosen effect or another; `derivative`: one that is not shown.
    subject, rival : str
        The chosen effect and the other one; the derivative, and nothing.
    present, expected, needed : float or None
        Of alternatives: by how much -2 ln L favours the chosen one now, the difference that the input is expected to
        bring whichever is true, and the one from which they count as told apart. Of a derivative: its standard
        deviation now (None: unknown), after the input, and the one from which it is shown.
    probability : float or None
        Of telling the alternatives apart with one flight, in the worse of the two cases.
    repeats : int or None
        Flights of the planned input that decide it; None where many do not.
    elsewhere : str
        What would decide it where this input does not; else empty.
    """

    kind: str
    subject: str
    rival: str
    present: float | None
    expected: float | None
    needed: float
    probability: float | None
    repeats: int | None
    elsewhere: str


@dataclass(frozen=True)
class NextFlight:
    """What to fly next; `input` is None where no elevator input within the limits decides anything, and `note` why."""

    input: PlannedInput | None
    questions: tuple[Question, ...]
    tried: int
    note: str


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
    fit: tuple[FitRow, ...]
    innovations: tuple[InnovationRow, ...]
    correlation: CorrelationMatrix
    notes: tuple[str, ...]
    """What was assumed and what a reader must know, one sentence each."""
    linear: tuple[LinearRow, ...] = ()
    """The declared and the completed model linearised at the flight's condition; a model without a trim is left out."""
    next_flight: NextFlight | None = None
    """What to fly next, where something is left to decide."""
    regressors: tuple[RegressorPicture, ...] = ()
    """The model error against the found terms and their closest rivals."""
    kinematics: KinematicConsistency | None = None
    """Whether the instruments agree with each other; None where too few channels are there."""
