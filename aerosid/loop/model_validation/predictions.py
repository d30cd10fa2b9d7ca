"""Predictions one step and five seconds ahead and in open loop: R^2 of each model.

In moving air, and where a motion diverges, no open-loop simulation follows a whole record whatever the model; a few
seconds ahead it does. Each prediction starts from the state as measured, with the model's own faults of the sensors
taken out, and is driven by the measured inputs; the next one starts where it ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import KINDS, ActiveEffect, StateEffect
from aerosid.estimation.effects_in_flight import acting_flight, acting_model, recorded
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import added_along
from aerosid.estimation.open_loop import on_log
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import UNCOUPLED
from aerosid.flight_model.flight import Flight
from aerosid.flight_model.restarted_simulation import predict_ahead
from aerosid.loop.model_validation.open_loop_errors import Simulated
from aerosid.model_error.paper_chain.chain import ChainSettings, Fed, feed
from aerosid.model_error.paper_chain.coefficient_match import Corrected
from aerosid.search.attribution import Attribution
from aerosid.signals.fit_statistics import explained_variance, theil
from aerosid.signals.resampling import across_gaps

FloatArray = NDArray[np.float64]

VARIANTS = ("declared", "before", "after")
"""The models that are compared: as declared, its derivatives re-estimated, completed."""

ONE_STEP, AHEAD, OPEN_LOOP = "one_step", "five_seconds", "open_loop"
SECONDS = 5.0
"""Numerical: horizon, s; some short periods of any aircraft but the largest, shorter than a phugoid; as reported."""

LEAST = 0.5
"""Numerical: share of the measured samples, 1, that a model must predict to be judged."""


@dataclass(frozen=True)
class PredictionRow:
    """What of one channel of one log each model explains over a horizon; None where it predicts too little of it.

    Attributes
    ----------
    horizon : str
        `one_step`, `five_seconds` or `open_loop`.
    seconds : float
        Its length, s: of `one_step` the sampling interval, of `open_loop` the record.
    predicted : float
        Share of the measured samples, 1, on which all models that are judged are compared.
    r2 : mapping of str to float or None
        Of the `VARIANTS`: 1 less the mean square error over the variance of the measurement.
    theil : mapping of str to float or None
        Theil's inequality coefficient of each: 0 is perfect, 1 the worst.
    """

    log: str
    role: str
    channel: str
    horizon: str
    seconds: float
    predicted: float
    r2: Mapping[str, float | None]
    theil: Mapping[str, float | None]


def prediction_rows(
    declared: AerodynamicModel,
    found: Attribution,
    manoeuvres: Sequence[Manoeuvre],
    simulated: Sequence[Simulated],
) -> tuple[PredictionRow, ...]:
    """Rows of every log, channel and horizon.

    Parameters
    ----------
    manoeuvres, simulated : sequence of Manoeuvre, sequence of Simulated
        The logs, with their open-loop simulations, in one order.
    """
    rows: list[PredictionRow] = []
    for manoeuvre, flown in zip(manoeuvres, simulated, strict=True):
        given = on_log(found.before, manoeuvre)
        models = {
            "declared": (declared, [each for each in given if each.effect.kind in KINDS]),
            "before": (found.before.model, given),
            "after": (found.completed.model, on_log(found.completed, manoeuvre)),
        }
        fed = feed(manoeuvre, ChainSettings())
        starting = {name: _Start.of(model, effects, manoeuvre, fed) for name, (model, effects) in models.items()}
        ahead = max(round(SECONDS / manoeuvre.interval), 1)
        for horizon, length in ((ONE_STEP, 1), (AHEAD, ahead)):
            outputs = {name: start.predicted(manoeuvre, length) for name, start in starting.items()}
            rows.extend(_rows(flown, horizon, length * manoeuvre.interval, outputs))
        opened = {name: _columns(getattr(flown, name), manoeuvre) for name in VARIANTS}
        rows.extend(_rows(flown, OPEN_LOOP, float(np.ptp(manoeuvre.flight.time)), opened))
    return tuple(rows)


@dataclass(frozen=True)
class _Start:
    """A model with the states (N, n) from which it predicts a log, and the inputs that act."""

    model: AerodynamicModel
    effects: Sequence[ActiveEffect]
    flight: Flight
    states: FloatArray

    @classmethod
    def of(cls, model: AerodynamicModel, effects: Sequence[ActiveEffect], manoeuvre: Manoeuvre, fed: Fed) -> _Start:
        states = _initial_states(Corrected.of(model, effects, manoeuvre, fed).states, manoeuvre)
        flight, _ = acting_flight(model, manoeuvre, effects)
        acting = acting_model(model, effects)
        inputs = flight.inputs.copy()
        for active in effects:
            if isinstance(active.effect, StateEffect) and active.acts_on(manoeuvre.name):
                along = across_gaps(states)
                added = added_along(active, acting, flight, acting.values, along, manoeuvre.ground)
                for column, change in added.items():
                    inputs[:, acting.columns.index(column)] += change
        return cls(acting, tuple(effects), flight._replace(inputs=inputs), states)

    def predicted(self, manoeuvre: Manoeuvre, length: int) -> dict[str, FloatArray]:
        """Each channel (N,) predicted from the last start before it, as its sensor reads it; NaN where none is."""
        known = np.flatnonzero(np.isfinite(self.states).all(axis=1))
        starts, free = [], 0
        for k in known.tolist():
            if k >= free:
                starts.append(k)
                free = k + length
        outputs = predict_ahead(
            np.array(starts, dtype=np.int64),
            length,
            self.states,
            self.flight,
            np.array(self.model.values),
            self.model.table,
            self.model.constants,
        )
        gone = np.isnan(outputs)
        read = across_gaps(outputs)
        recorded(read, manoeuvre, self.effects)
        read[gone] = np.nan
        return {name: read[:, manoeuvre.row(name)] for name in manoeuvre.outputs}


def _initial_states(states: FloatArray, manoeuvre: Manoeuvre) -> FloatArray:
    """The states to start from; height and heading that no channel shows are zero, for the others do not need them."""
    initial = states.copy()
    for n, name in enumerate(manoeuvre.axes.integrated):
        if name in UNCOUPLED and not np.isfinite(states[:, n]).any():
            initial[:, n] = 0.0
    return initial


def _columns(outputs: Mapping[str, FloatArray], manoeuvre: Manoeuvre) -> dict[str, FloatArray]:
    return {name: outputs[name] for name in manoeuvre.outputs}


def _rows(
    flown: Simulated, horizon: str, seconds: float, outputs: Mapping[str, Mapping[str, FloatArray]]
) -> list[PredictionRow]:
    """The rows of one log and horizon; all models that predict enough are judged on the same samples."""
    rows = []
    for channel, measured in flown.measured.items():
        present = np.isfinite(measured)
        if not present.any():
            continue
        there = {name: present & np.isfinite(each[channel]) for name, each in outputs.items()}
        judged = [name for name in outputs if there[name].sum() >= LEAST * present.sum()]
        common = np.logical_and.reduce([present, *(there[name] for name in judged)])
        r2: dict[str, float | None] = dict.fromkeys(outputs)
        coefficient: dict[str, float | None] = dict.fromkeys(outputs)
        for name in judged:
            seen = outputs[name][channel][common]
            inequality = theil(measured[common], seen)
            r2[name] = explained_variance(measured[common], seen)
            coefficient[name] = inequality.coefficient if inequality else 0.0
        share = float(common.sum() / present.sum()) if judged else 0.0
        rows.append(PredictionRow(flown.log.name, flown.role, channel, horizon, seconds, share, r2, coefficient))
    return rows
