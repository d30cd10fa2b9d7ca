"""Linearisation at a trimmed flight condition: x' = A x + B u in u, w, q, theta.

The matrices are the exact partial derivatives that the compiled kernel evaluates. python-control is imported only where
its objects are asked for: it takes a second to import beside what the loop has imported, which the loop does without.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.simulation import SPEED_OF_SOUND, Trim, input_row, level_state, trim
from aerosid.flight_model.workspace import make_workspace

if TYPE_CHECKING:
    from control import StateSpace

FloatArray = NDArray[np.float64]

LINEAR_STATES = ("u", "w", "q", "theta")
AIR_STATES = ("V", "alpha", "q", "theta")


@dataclass(frozen=True)
class FlightCondition:
    """Where a model is linearised: level, wings-level flight.

    Attributes
    ----------
    airspeed, density, mass : float
        m/s, kg/m^3, kg.
    speed_of_sound : float
        m/s; matters only to terms that hold `mach`.
    inputs : mapping of str to float
        Inputs that terms name beside the elevator, SI; zero where not given.
    """

    airspeed: float
    density: float
    mass: float
    speed_of_sound: float = SPEED_OF_SOUND
    inputs: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class LinearModel:
    """A flight model near a trimmed condition, deviations from trim in SI.

    Attributes
    ----------
    trimmed : Trim
        Angle of attack, elevator and thrust of the condition.
    inputs : tuple of str
        The controls, I of them: every `delta_` channel that a term names.
    A : ndarray, shape (4, 4)
        d(rates)/d(u, w, q, theta).
    B : ndarray, shape (4, I)
        d(rates)/d(controls).
    """

    trimmed: Trim
    inputs: tuple[str, ...]
    A: FloatArray
    B: FloatArray

    @property
    def air_axes(self) -> tuple[FloatArray, FloatArray]:
        """A (4, 4) and B (4, I) in the states V, alpha, q, theta.

        Exact at a trim, where the rates are zero and the change of states adds nothing to A.
        """
        speed, alpha = self.trimmed.airspeed, self.trimmed.alpha
        turn = np.eye(4)
        turn[0, :2] = np.cos(alpha), np.sin(alpha)
        turn[1, :2] = -np.sin(alpha) / speed, np.cos(alpha) / speed
        back = np.eye(4)
        back[0, :2] = np.cos(alpha), -speed * np.sin(alpha)
        back[1, :2] = np.sin(alpha), speed * np.cos(alpha)
        return turn @ self.A @ back, turn @ self.B

    def state_space(self) -> StateSpace:
        """The model as a python-control object: states and outputs u, w, q, theta, inputs the controls."""
        import control

        outputs = np.eye(4), np.zeros_like(self.B)
        names = {"inputs": list(self.inputs), "outputs": list(LINEAR_STATES), "states": list(LINEAR_STATES)}
        return control.ss(self.A, self.B, *outputs, **names)

    def step_response(self, time: FloatArray, control_input: str, size: float) -> dict[str, FloatArray]:
        """Deviations of V, alpha, q and theta after a step of one control, each (N,), SI.

        Parameters
        ----------
        time : ndarray, shape (N,)
            s, evenly spaced from 0.
        control_input : str
            One of `inputs`.
        size : float
            rad.
        """
        a, b = self.air_axes
        column = size * b[:, [self.inputs.index(control_input)]]
        _, response, _ = signal.lsim((a, column, np.eye(4), np.zeros((4, 1))), np.ones(time.size), time)
        return dict(zip(AIR_STATES, np.asarray(response, dtype=np.float64).T, strict=True))


def linearise(model: AerodynamicModel, condition: FlightCondition) -> LinearModel:
    """The linear model of level flight at a condition.

    Parameters
    ----------
    model : AerodynamicModel
        Some term must name delta_e, or nothing holds the moment balance.
    condition : FlightCondition
        Thrust is what level flight needs, and does not change with airspeed.

    Raises
    ------
    EstimationError
        Where the model has no elevator, or no trim at the condition.
    """
    acting = {name for _, term in model.entries for name in term.variables}
    if "delta_e" not in acting:
        raise EstimationError("no term names delta_e, without which no level flight is in balance; add C_m delta_e.")
    trimmed = trim(
        model,
        condition.airspeed,
        condition.density,
        condition.mass,
        speed_of_sound=condition.speed_of_sound,
        further_inputs=condition.inputs,
    )
    row = input_row(model, condition.density, trimmed.thrust, condition.mass, condition.speed_of_sound)
    for name, value in {**condition.inputs, "delta_e": trimmed.delta_e}.items():
        if name in model.columns:
            row[model.columns.index(name)] = value
    work = make_workspace(len(model.extra_columns), model.table, model.constants.layout)
    state = level_state(model, trimmed.airspeed, trimmed.alpha)
    positions = np.zeros((len(model.axes.outputs), 3))
    evaluate(state, row, np.array(model.values), model.table, model.constants, positions, work, True, False)
    controls = tuple(name for name in model.extra_columns if name.startswith("delta_") and name in acting)
    places = [model.extra_place(name) for name in controls]
    rows = [model.axes.integrated.index(name) for name in LINEAR_STATES]
    return LinearModel(trimmed, controls, work.rates_x[np.ix_(rows, rows)], work.rates_u[np.ix_(rows, places)])
