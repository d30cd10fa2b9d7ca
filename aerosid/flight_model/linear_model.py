"""Linearisation at a trimmed flight condition: x' = A x + B u in the states that anything depends on.

The matrices are the exact partial derivatives that the compiled kernel evaluates. python-control is imported only where
its objects are asked for: it takes a second to import beside what the loop has imported, which the loop does without.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from aerosid.errors import EstimationError
from aerosid.flight_model.aerodynamics import AerodynamicModel, controls_of
from aerosid.flight_model.axes import coupled_of, fed_of
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.simulation import SPEED_OF_SOUND, Trim, trim, trimmed_inputs, trimmed_state
from aerosid.flight_model.workspace import Workspace, make_workspace

if TYPE_CHECKING:
    from control import StateSpace

FloatArray = NDArray[np.float64]


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
        Inputs that terms name beside those that are trimmed, and the angle of attack where the case measures it, SI;
        zero where not given.
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
        Angles, surfaces and thrust of the condition.
    states : tuple of str
        The n states of the case that something depends on.
    inputs : tuple of str
        The controls, I of them: every `delta_` channel that a term names.
    A : ndarray, shape (n, n)
        d(rates)/d(states).
    B : ndarray, shape (n, I)
        d(rates)/d(controls).
    air_states : tuple of str
        The n outputs that determine the states: V, alpha and beta in place of u, w and v.
    air : ndarray, shape (n, n)
        d(air states)/d(states).
    """

    trimmed: Trim
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    A: FloatArray
    B: FloatArray
    air_states: tuple[str, ...]
    air: FloatArray

    @property
    def air_axes(self) -> tuple[FloatArray, FloatArray]:
        """A (n, n) and B (n, I) in the air states.

        Exact at a trim, where the rates are zero and the change of states adds nothing to A.
        """
        return self.air @ self.A @ np.linalg.inv(self.air), self.air @ self.B

    def state_space(self) -> StateSpace:
        """The model as a python-control object: states and outputs as `states`, inputs the controls."""
        import control

        outputs = np.eye(len(self.states)), np.zeros_like(self.B)
        names = {"inputs": list(self.inputs), "outputs": list(self.states), "states": list(self.states)}
        return control.ss(self.A, self.B, *outputs, **names)

    def step_response(self, time: FloatArray, control_input: str, size: float) -> dict[str, FloatArray]:
        """Deviations of the air states after a step of one control, each (N,), SI.

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
        response = _step_response(a, column[:, 0], time)
        return dict(zip(self.air_states, response, strict=True))


def _step_response(a: FloatArray, b: FloatArray, time: FloatArray) -> FloatArray:
    """The states (n, N) of x' = A x + b from rest, exact at evenly spaced times.

    Notes
    -----
    exp([A b; 0 0] h) = [F g; 0 1] holds the step (Van Loan 1978): x_(m+j) = F^m x_j + x_m, which doubles what is known.
    """
    states = b.size
    if time.size < 2:
        return np.zeros((states, time.size))
    block = np.zeros((states + 1, states + 1))
    block[:states, :states], block[:states, states] = a, b
    step = expm(block * (time[1] - time[0]))
    known, carried = np.zeros((states, 1)), step[:states, :states]
    after = step[:states, states]
    while known.shape[1] < time.size:
        known = np.concatenate([known, carried @ known + after[:, None]], axis=1)
        after = carried @ after + after
        carried = carried @ carried
    return known[:, : time.size]


def linearise(model: AerodynamicModel, condition: FlightCondition) -> LinearModel:
    """The linear model of level flight at a condition.

    Parameters
    ----------
    model : AerodynamicModel
        Where its case pitches, some term must name delta_e, or nothing holds the moment balance.
    condition : FlightCondition
        Thrust is what level flight needs, and does not change with airspeed.

    Raises
    ------
    EstimationError
        Where a model that pitches has no elevator, or no trim at the condition.
    """
    controls = controls_of(model)
    if "q" in model.axes.integrated and "delta_e" not in controls:
        raise EstimationError("no term names delta_e, without which no level flight is in balance; add C_m delta_e.")
    trimmed = trim(
        model,
        condition.airspeed,
        condition.density,
        condition.mass,
        speed_of_sound=condition.speed_of_sound,
        further_inputs=condition.inputs,
    )
    row = trimmed_inputs(model, trimmed, condition.density, condition.mass, condition.speed_of_sound, condition.inputs)
    work = evaluated(model, trimmed_state(model, trimmed), row)
    states, air_states = coupled_of(model.axes), fed_of(model.axes)
    places = [model.extra_place(name) for name in controls]
    rows = [model.axes.integrated.index(name) for name in states]
    seen = [model.axes.outputs.index(name) for name in air_states]
    return LinearModel(
        trimmed=trimmed,
        states=states,
        inputs=controls,
        A=work.rates_x[np.ix_(rows, rows)],
        B=work.rates_u[np.ix_(rows, places)],
        air_states=air_states,
        air=work.outputs_x[np.ix_(seen, rows)],
    )


def evaluated(model: AerodynamicModel, state: FloatArray, inputs: FloatArray) -> Workspace:
    """Rates and outputs of a model at a state (n,) and inputs (I,), sensors at the centre, with their derivatives."""
    work = make_workspace(len(model.extra_columns), model.table, model.constants.layout)
    positions = np.zeros((len(model.axes.outputs), 3))
    evaluate(state, inputs, np.array(model.values), model.table, model.constants, positions, work, True, True)
    return work
