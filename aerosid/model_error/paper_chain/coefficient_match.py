"""Measured coefficients against those of the model: explained variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, OutputEffect, StateEffect
from aerosid.estimation.effects_in_flight import acting_flight, acting_model
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.motion_loop import added_along
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import ACCELERATIONS, UNCOUPLED, Axes, coupled_of, input_columns_of, loads_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight, coefficients_along
from aerosid.model_error.aircraft_error.measured_states import measured_motion
from aerosid.model_error.paper_chain.chain import ChainSettings, Fed, feed
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
    """R^2 of each coefficient on one log for two models; one whose sensors are missing has no row.

    Parameters
    ----------
    before, after : (AerodynamicModel, sequence of ActiveEffect)
        Each model with its effects as they act on this log.

    Notes
    -----
    The forces come from the accelerometers, the moments from the angular accelerations or the derivatives of the rates,
    all channels low-passed alike; the model's coefficients from the measured motion and inputs through the same filter.
    What a model says of sensors and controls is part of it: channels are corrected for its faults first, controls act
    as it says, so that a late vane is not held against the derivatives. Disturbances explain nothing. Constants are
    fitted on the log: R^2 is about the mean.
    """
    fed = feed(manoeuvre, ChainSettings())
    pairs = [_pair(model, effects, manoeuvre, fed) for model, effects in (before, after)]
    rows = []
    for i, name in enumerate(manoeuvre.axes.coefficients):
        # Both models are judged on the same samples: a correction may not reach the ends of the record.
        present = np.all([np.isfinite(part[:, i]) for pair in pairs for part in pair], axis=0)
        if present.sum() < 10:
            continue
        shares = [
            1.0 - float(np.var((measured - modelled)[present, i]) / max(np.var(measured[present, i]), 1e-300))
            for measured, modelled in pairs
        ]
        rows.append(CoefficientRow(name, manoeuvre.log.name, *shares))
    return rows


def _pair(
    model: AerodynamicModel, effects: Sequence[ActiveEffect], manoeuvre: Manoeuvre, fed: Fed
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The coefficients (N, k) as measured and as the model gives them, where it is right about sensors and controls."""
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
        Those of the case.
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
        model = acting_model(model, effects)
        states = _states(acting, model.axes)
        for active in effects:
            if isinstance(active.effect, StateEffect) and active.acts_on(manoeuvre.name):
                added = added_along(active, model, acting, model.values, states, manoeuvre.ground)
                for column, change in added.items():
                    inputs[:, model.columns.index(column)] += change
        return cls(model, acting, states)

    @property
    def measured(self) -> NDArray[np.float64]:
        """The case's coefficients (N, k) of accelerometers and angular accelerations; NaN where one is missing."""
        return _measured(self.flight, self.model.constants, self.model.axes)

    def modelled(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """The case's coefficients (N, k) with these values of the model's entries."""
        found, axes = _modelled(self.model, values, self.flight, self.states), self.model.axes
        for place, name in enumerate(axes.coefficients):
            if name in _TURNED and not _has(self.flight, axes, f"{_TURNED[name]}_dot"):
                # The difference of a rate over two intervals is the mean between: the moment is averaged alike.
                middles = 0.5 * (found[1:, place] + found[:-1, place])
                found[:, place] = 0.5 * (np.append(middles[0], middles) + np.append(middles, middles[-1]))
        return found


_TURNED = {"C_l": "p", "C_m": "q", "C_n": "r"}
"""The rate that each moment turns."""


def _seen(flight: Flight, axes: Axes, output: str) -> NDArray[np.float64]:
    """The samples (N,) of an output."""
    return flight.measured[:, axes.outputs.index(output)]


def _has(flight: Flight, axes: Axes, output: str) -> bool:
    return bool(np.isfinite(_seen(flight, axes, output)).any())


def _modelled(
    model: AerodynamicModel, values: NDArray[np.float64], flight: Flight, states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The case's coefficients (N, k) at measured states; NaN where one is missing that a coefficient needs."""
    axes = model.axes
    motion = dict(zip(axes.integrated, states.T, strict=True))
    known = np.isfinite(sum(motion[name] for name in coupled_of(axes)))
    found = coefficients_along(
        np.where(np.isnan(states), 1.0, states), flight, np.array(values), model.table, model.constants
    )
    c = dict(zip(loads_of(axes), found.T, strict=True))
    if axes.wind_axes:
        alpha = np.arctan2(motion["w"], motion["u"])
        c["C_X"] = c["C_X"] + c["C_L"] * np.sin(alpha) - c["C_D"] * np.cos(alpha)
        c["C_Z"] = c["C_Z"] - c["C_L"] * np.cos(alpha) - c["C_D"] * np.sin(alpha)
    return np.where(known[:, None], np.column_stack([c[name] for name in axes.coefficients]), np.nan)


def _states(flight: Flight, axes: Axes) -> NDArray[np.float64]:
    """The states (N, n) as measured; NaN where one is missing that a coefficient needs.

    Attitude enters no coefficient but by alphadot, height none but by the ground: without their channels the flight is
    level and its height unknown.
    """
    measured, alpha, _ = measured_motion(flight, axes)
    motion = dict(zip(coupled_of(axes), measured.T, strict=True))
    motion |= {name: _seen(flight, axes, name) for name in axes.integrated if name in UNCOUPLED}
    for name, level in (("theta", alpha), ("phi", np.zeros_like(alpha))):
        if name in motion:
            motion[name] = np.where(np.isnan(motion[name]), level, motion[name])
    return np.column_stack([motion[name] for name in axes.integrated])


def _measured(flight: Flight, constants: Constants, axes: Axes) -> NDArray[np.float64]:
    """The case's coefficients (N, k) from the smooth sensors, NaN where one is missing."""
    seen = dict(zip(input_columns_of(axes), flight.inputs.T, strict=False))
    seen |= {name: _seen(flight, axes, name) for name in axes.outputs}
    density, thrust, mass, speed, p, q, r = (seen[name] for name in ("rho", "thrust", "mass", "V", "p", "q", "r"))
    turning = {name: np.zeros(flight.time.size) for name in ("p", "q", "r")}
    for name in turning:
        if f"{name}_dot" in axes.outputs:
            measured = _has(flight, axes, f"{name}_dot")
            turning[name] = seen[f"{name}_dot"] if measured else np.gradient(seen[name], flight.time)
    p_dot, q_dot, r_dot = turning.values()
    at = {name: flight.positions[axes.outputs.index(name)] for name in ("a_x", "a_y", "a_z") if name in axes.outputs}
    force = 0.5 * density * speed**2 * constants.wing_area
    found = {}
    if "a_x" in at:
        x, y, z = at["a_x"]
        a_x = seen["a_x"] + (q**2 + r**2) * x - (p * q - r_dot) * y - (q_dot + p * r) * z
        x, y, z = at["a_z"]
        a_z = seen["a_z"] - (p * r - q_dot) * x - (q * r + p_dot) * y + (p**2 + q**2) * z
        pitch = constants.I_yy * q_dot - thrust * constants.thrust_z_arm
        pitch += (constants.I_xx - constants.I_zz) * p * r + constants.I_xz * (p**2 - r**2)
        found["C_X"] = (mass * a_x - thrust * np.cos(constants.thrust_incidence)) / force
        found["C_Z"] = (mass * a_z + thrust * np.sin(constants.thrust_incidence)) / force
        found["C_m"] = pitch / (force * constants.mean_chord)
    if "a_y" in at:
        x, y, z = at["a_y"]
        a_y = seen["a_y"] - (p * q + r_dot) * x + (p**2 + r**2) * y - (q * r - p_dot) * z
        roll = constants.I_xx * p_dot - constants.I_xz * (r_dot + p * q) + (constants.I_zz - constants.I_yy) * q * r
        yaw = constants.I_zz * r_dot - constants.I_xz * (p_dot - q * r) + (constants.I_yy - constants.I_xx) * p * q
        found["C_Y"] = mass * a_y / force
        found["C_l"], found["C_n"] = roll / (force * constants.span), yaw / (force * constants.span)
    return np.column_stack([found[name] for name in axes.coefficients])
