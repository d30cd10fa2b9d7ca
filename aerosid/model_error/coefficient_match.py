"""Measured coefficients against those of the model: explained variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, OutputEffect, StateEffect
from aerosid.estimation.effects_in_flight import acting_flight
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import added_along
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import ACCELERATIONS, LONGITUDINAL, coupled_of, input_columns_of, loads_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight, coefficients_along
from aerosid.model_error.aircraft_error import measured_motion
from aerosid.model_error.paper_chain import ChainSettings, Fed, feed
from aerosid.signals import prefilter


@dataclass(frozen=True)
class CoefficientRow:
    """Share of a measured coefficient's variance that the model explains, before and after."""

    coefficient: str
    log: str
    r2_before: float
    r2_after: float


_Model = tuple[AerodynamicModel, Sequence[ActiveEffect]]


def explained_shares(before: _Model, after: _Model, manoeuvre: Manoeuvre) -> list[CoefficientRow]:
    """R^2 of C_X, C_Z and C_m on one log for two models; a coefficient whose sensors are missing has no row.

    Parameters
    ----------
    before, after : (AerodynamicModel, sequence of ActiveEffect)
        Each model with its effects as they act on this log.

    Notes
    -----
    C_X and C_Z come from the accelerometers, C_m from q_dot or the derivative of q, all channels low-passed alike;
    the model's coefficients from the measured V, alpha, q and inputs through the same filter. What a model says of
    sensors and controls is part of it: channels are corrected for its faults first, controls act as it says, so that a
    late vane is not held against the derivatives. Disturbances explain nothing. Constants are fitted on the log: R^2
    is about the mean.
    """
    fed = feed(manoeuvre, ChainSettings())
    pairs = [_pair(model, effects, manoeuvre, fed) for model, effects in (before, after)]
    rows = []
    for i, name in enumerate(LONGITUDINAL.coefficients):
        # Both models are judged on the same samples: a correction may not reach the ends of the record.
        held = np.all([np.isfinite(part[:, i]) for pair in pairs for part in pair], axis=0)
        if held.sum() < 10:
            continue
        shares = [
            1.0 - float(np.var((measured - modelled)[held, i]) / max(np.var(measured[held, i]), 1e-300))
            for measured, modelled in pairs
        ]
        rows.append(CoefficientRow(name, manoeuvre.log.name, *shares))
    return rows


def _pair(
    model: AerodynamicModel, effects: Sequence[ActiveEffect], manoeuvre: Manoeuvre, fed: Fed
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """C_X, C_Z, C_m (N, 3) as measured and as the model gives them, where it is right about sensors and controls."""
    corrected = Corrected.of(model, effects, manoeuvre, fed)
    return corrected.measured, corrected.modelled(model.values)


@dataclass(frozen=True)
class Corrected:
    """A log as it would be read where a model is right about sensors and controls.

    Attributes
    ----------
    model : AerodynamicModel
    flight : Flight
        The smooth channels, corrected for the sensors' faults, and the inputs that act.
    states : ndarray, shape (N, n)
        u, w, q, theta, h.
    """

    model: AerodynamicModel
    flight: Flight
    states: NDArray[np.float64]

    @classmethod
    def of(cls, model: AerodynamicModel, effects: Sequence[ActiveEffect], manoeuvre: Manoeuvre, fed: Fed) -> Corrected:
        """A log, `fed` to the chain, as it is with a model's effects."""
        time = manoeuvre.flight.time

        def smooth(values: NDArray[np.float64]) -> NDArray[np.float64]:
            if fed.butterworth is None or not np.ptp(values) > 0.0:
                return values
            return prefilter.apply(fed.butterworth, time, values)

        measured = fed.flight.measured.copy()
        for i in (manoeuvre.row(name) for name in manoeuvre.axes.outputs if name in ACCELERATIONS):
            # They do not enter the chain, which has not filtered them.
            if np.isfinite(measured[:, i]).any():
                measured[:, i] = smooth(measured[:, i])
        for active in reversed(effects):
            if isinstance(active.effect, OutputEffect) and active.acts_on(manoeuvre.name):
                i = manoeuvre.row(active.effect.where)
                measured[:, i] = active.effect.corrected(time, measured[:, i], active.numbers)
        flight, _ = acting_flight(model, manoeuvre, effects)
        inputs = np.column_stack([smooth(column) for column in flight.inputs.T])
        acting = flight._replace(measured=measured, inputs=inputs)
        states = _states(acting)
        for active in effects:
            if isinstance(active.effect, StateEffect) and active.acts_on(manoeuvre.name):
                added = added_along(active, model, acting, model.values, states, manoeuvre.ground)
                for column, change in added.items():
                    inputs[:, model.columns.index(column)] += change
        return cls(model, acting, states)

    @property
    def measured(self) -> NDArray[np.float64]:
        """C_X, C_Z, C_m (N, 3) of the accelerometers and the pitch acceleration; NaN where one is missing."""
        return _measured(self.flight, self.model.constants)

    def modelled(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """C_X, C_Z, C_m (N, 3) with these values of the model's entries."""
        found = _modelled(self.model, values, self.flight, self.states)
        pitch = LONGITUDINAL.coefficients.index("C_m")
        if not _has_q_dot(self.flight):
            # The difference of q over two intervals is the mean of q_dot between: the model's moment is averaged alike.
            middles = 0.5 * (found[1:, pitch] + found[:-1, pitch])
            found[:, pitch] = 0.5 * (np.append(middles[0], middles) + np.append(middles, middles[-1]))
        return found


def _seen(flight: Flight, output: str) -> NDArray[np.float64]:
    """The samples (N,) of an output of the longitudinal case."""
    return flight.measured[:, LONGITUDINAL.outputs.index(output)]


def _has_q_dot(flight: Flight) -> bool:
    return bool(np.isfinite(_seen(flight, "q_dot")).any())


def _modelled(
    model: AerodynamicModel, values: NDArray[np.float64], flight: Flight, states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """C_X, C_Z, C_m (N, 3) of the model at measured states; NaN where one is missing that a coefficient needs."""
    motion = dict(zip(LONGITUDINAL.integrated, states.T, strict=True))
    known = np.isfinite(sum(motion[name] for name in coupled_of(LONGITUDINAL)))
    found = coefficients_along(
        np.where(np.isnan(states), 1.0, states), flight, np.array(values), model.table, model.constants
    )
    alpha = np.arctan2(motion["w"], motion["u"])
    c = dict(zip(loads_of(LONGITUDINAL), found.T, strict=True))
    c_x = c["C_X"] + c["C_L"] * np.sin(alpha) - c["C_D"] * np.cos(alpha)
    c_z = c["C_Z"] - c["C_L"] * np.cos(alpha) - c["C_D"] * np.sin(alpha)
    return np.where(known[:, None], np.column_stack([c_x, c_z, c["C_m"]]), np.nan)


def _states(flight: Flight) -> NDArray[np.float64]:
    """u, w, q, theta, h (N, n) as measured; NaN where V, alpha or q is missing.

    Attitude enters no coefficient but by alphadot, height none but by the ground: without their channels the flight is
    level and its height unknown.
    """
    measured, alpha, _ = measured_motion(flight)
    motion = dict(zip(coupled_of(LONGITUDINAL), measured.T, strict=True)) | {"h": _seen(flight, "h")}
    motion["theta"] = np.where(np.isnan(motion["theta"]), alpha, motion["theta"])
    return np.column_stack([motion[name] for name in LONGITUDINAL.integrated])


def _measured(flight: Flight, constants: Constants) -> NDArray[np.float64]:
    """C_X, C_Z, C_m (N, 3) from the smooth sensors, NaN where one is missing."""
    columns = dict(zip(input_columns_of(LONGITUDINAL), flight.inputs.T, strict=False))
    density, thrust, mass, p, r = (columns[name] for name in ("rho", "thrust", "mass", "p", "r"))
    speed, q = _seen(flight, "V"), _seen(flight, "q")
    force = 0.5 * density * speed**2 * constants.wing_area
    q_dot = _seen(flight, "q_dot") if _has_q_dot(flight) else np.gradient(q, flight.time)
    x_x, x_y, x_z = flight.positions[LONGITUDINAL.outputs.index("a_x")]
    z_x, z_y, z_z = flight.positions[LONGITUDINAL.outputs.index("a_z")]
    a_x = _seen(flight, "a_x") + (q**2 + r**2) * x_x - p * q * x_y - (q_dot + p * r) * x_z
    a_z = _seen(flight, "a_z") - (p * r - q_dot) * z_x - q * r * z_y + (p**2 + q**2) * z_z
    thrust_x = thrust * np.cos(constants.thrust_incidence)
    thrust_z = -thrust * np.sin(constants.thrust_incidence)
    return np.column_stack(
        [
            (mass * a_x - thrust_x) / force,
            (mass * a_z - thrust_z) / force,
            (constants.I_yy * q_dot - thrust * constants.thrust_z_arm) / (force * constants.mean_chord),
        ]
    )
