"""The result of a closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.compatibility import KinematicConsistency
from aerosid.logs.flight_log import FlightLog
from aerosid.loop import frames
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.effect_rows import Effect
from aerosid.loop.flying_qualities.linear_analysis import LinearRow
from aerosid.loop.model_error_pictures import PrefilterNote
from aerosid.loop.model_validation.goodness import CorrelationMatrix, FitRow, InnovationRow
from aerosid.loop.model_validation.open_loop_errors import ErrorRow, Simulated
from aerosid.loop.model_validation.predictions import PredictionRow
from aerosid.loop.next_flight.planned_flight import NextFlight
from aerosid.loop.provenance import NOBODY, Provenance
from aerosid.loop.roles import ROLES
from aerosid.loop.second_opinion import SecondOpinion
from aerosid.loop.settings import USUAL, LoopSettings, Method
from aerosid.loop.verdict import Verdict
from aerosid.model_error.aircraft_error.force_history import ErrorHistory
from aerosid.model_error.paper_chain.coefficient_match import CoefficientRow
from aerosid.model_error.paper_chain.screening import RegressorPicture, ScreeningRow
from aerosid.search.other_derivatives import OtherDerivative

if TYPE_CHECKING:
    import pandas as pd

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
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
    """Assumptions and remarks, one sentence each."""
    linear: tuple[LinearRow, ...] = ()
    """The declared and the completed model linearised at the flight's condition; a model without a trim is left out."""
    next_flight: NextFlight | None = None
    """What to fly next, where something is left to decide."""
    regressors: tuple[RegressorPicture, ...] = ()
    """The model error against the identified terms and their closest competing terms."""
    kinematics: KinematicConsistency | None = None
    """Whether the instruments agree with each other; None where too few channels are there."""
    hold_out: tuple[FlightLog, ...] = ()
    """Logs that no decision touched: predicted by the completed model after everything else."""
    decided_by_validation: tuple[str, ...] = ()
    """Effects confirmed and refuted by the validation logs, a few words each; empty without any."""
    second_opinion: SecondOpinion | None = None
    """Cross-check by the model error d(t) alone; None where it was not requested, decided itself, or finds nothing on
    flights whose d(t) cannot be estimated."""
    decided_by: Method = "likelihood"
    """The method that decided: with the default, the one that turbulence and recorder allow."""
    predictions: tuple[PredictionRow, ...] = ()
    """What of each channel the models explain one step and five seconds ahead, and in open loop."""
    other_derivatives: tuple[OtherDerivative, ...] = ()
    """Derivatives that differ on a validation log, most significant first."""
    provenance: Provenance = NOBODY
    """Day, settings that are not the usual ones, command line, analyst."""
    settings: LoopSettings = USUAL
    """All settings."""

    @property
    def identified(self) -> bool:
        """Whether the aerodynamics were identified; not where the channels contradict each other."""
        return self.verdict is not Verdict.INCONSISTENT_DATA

    def __repr__(self) -> str:
        """One line: verdict, logs, effects. The numbers are in the frames, in files, and in the attributes."""
        logs = ", ".join(log.name for role in ROLES for log in getattr(self, role))
        named = ", ".join(f"{e.kind} {e.where} {e.term}".strip() for e in self.effects) or "no effect"
        return f"<{type(self).__name__} {self.verdict.name.lower()}: {named}; {self.aircraft.name} on {logs}>"

    def derivatives_frame(self) -> pd.DataFrame:
        """The derivative table, one row a derivative, indexed by coefficient and term."""
        return frames.derivatives_frame(self.derivatives)

    def errors_frame(self) -> pd.DataFrame:
        """The errors, one row a log and channel, indexed by both."""
        return frames.errors_frame(self.errors)

    def effects_frame(self) -> pd.DataFrame:
        """The missing effects, one row each, indexed by rank."""
        return frames.effects_frame(self.effects)
