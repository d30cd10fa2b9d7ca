"""The staged kernel against a rigid body written by vectors: values, slopes by complex step, and whole flights."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles import rigid_body
from oracles.rigid_body import Body, slopes

from aerosid.flight_model.air import air_at, air_slopes
from aerosid.flight_model.axes import (
    COEFFICIENTS,
    LATERAL,
    LONGITUDINAL,
    MOTION,
    OUTPUTS,
    SIX,
    Axes,
    input_columns_of,
    loads_of,
    state_vector,
)
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.flight import Flight, simulate_outputs
from aerosid.flight_model.layout import CoefficientsThere, MotionThere, OutputsThere, layout_of
from aerosid.flight_model.terms import build_table, input_columns, parse_term
from aerosid.flight_model.workspace import Workspace, make_workspace

Array = NDArray[np.float64]

EXTRA = ("gust", "side_gust", "thrust_change", "cg_x", "cg_y", "cg_z")
PITCHING = {
    ("C_X", "1"): -0.05, ("C_X", "alpha^2"): 3.6, ("C_Z", "alpha"): -5.7, ("C_Z", "q_hat"): -4.3,
    ("C_Z", "V_hat*delta_e"): -0.6, ("C_m", "alpha"): -0.7, ("C_m", "q_hat"): -16.3, ("C_m", "delta_e"): -1.9,
    ("C_m", "C_T"): 0.02, ("C_X", "mach^2"): -0.3, ("C_L", "alpha"): 0.4, ("C_D", "alpha^2*V_hat"): 0.7,
    ("C_m", "theta"): 0.03, ("C_Z", "theta*alpha"): -0.4,
}  # fmt: skip
LATERAL_TERMS = {
    ("C_Y", "beta"): -0.9, ("C_Y", "r_hat"): 0.6, ("C_Y", "delta_r"): 0.36, ("C_l", "beta"): -0.13,
    ("C_l", "p_hat"): -0.55, ("C_l", "r_hat*alpha"): 1.9, ("C_l", "delta_a"): -0.23, ("C_n", "beta"): 0.08,
    ("C_n", "p_hat"): -0.06, ("C_n", "r_hat"): -0.2, ("C_n", "delta_r"): -0.15, ("C_n", "beta^3"): 0.6,
    ("C_n", "p*phi"): 0.01, ("C_l", "theta*phi"): 0.02,
}  # fmt: skip
CROSSED = {("C_m", "beta^2"): -0.3, ("C_Z", "p_hat*beta"): 0.8, ("C_l", "alpha*delta_e"): 0.2, ("C_n", "C_T*beta"): 0.4}
APPARENT = {("C_Z", "alpha_dot_hat"): -1.5, ("C_m", "alpha_dot_hat"): -5.0, ("C_L", "alpha*alpha_dot_hat"): 0.7}

POLARS = {
    "lift and drag": {
        ("C_D", "C_L^2"): 0.06, ("C_D", "C_L*V_hat"): 0.4, ("C_m", "C_L*alpha"): -0.3, ("C_L", "delta_e"): 0.4,
        ("C_L", "V_hat*q_hat"): 3.0,
    },
    "body axes": {("C_X", "C_Z^2"): -0.05, ("C_m", "C_Z*V_hat"): 0.2, ("C_X", "C_Z*delta_e"): 0.1},
}  # fmt: skip
"""Terms that hold lift."""


def terms_of(axes: Axes, implicit: bool = False) -> dict[tuple[str, str], float]:
    terms = {LONGITUDINAL: PITCHING, LATERAL: LATERAL_TERMS, SIX: PITCHING | LATERAL_TERMS | CROSSED}[axes]
    return terms | APPARENT if implicit else terms


class Case:
    """One model of a case at a drawn state with drawn inputs, for the kernel and for the oracle."""

    def __init__(
        self, axes: Axes, terms: dict[tuple[str, str], float], seed: int, rate_airspeed: float | None = None
    ) -> None:
        rng = np.random.default_rng(seed)
        self.axes, self.terms = axes, terms
        self.body = Body(
            wing_area=39.0, chord=1.98, span=19.8, inertia=(27500.0, 32600.0, 51000.0, 1600.0),
            rate_airspeed=rate_airspeed, reference_airspeed=80.0, incidence=0.04, arm=0.3,
            positions={name: rng.normal(size=3) for name in axes.outputs if name[0] == "a" or name == "beta"},
        )  # fmt: skip
        parsed = [(coefficient, parse_term(text)) for coefficient, text in terms]
        self.columns = (*input_columns([term for _, term in parsed], axes), *EXTRA)
        self.table = build_table(parsed, self.columns, loads_of(axes))
        self.values = np.array(list(terms.values()))
        self.leading = len(input_columns_of(axes))
        places = {name: self.columns.index(name) - self.leading for name in EXTRA}
        i_xx, i_yy, i_zz, i_xz = self.body.inertia
        self.constants = Constants(
            wing_area=39.0, mean_chord=1.98, I_yy=i_yy, thrust_incidence=0.04, thrust_z_arm=0.3,
            airspeed_of_rates=rate_airspeed or 0.0, airspeed_of_V_hat=80.0, span=19.8, I_xx=i_xx, I_zz=i_zz, I_xz=i_xz,
            layout=layout_of(axes), **places,
        )  # fmt: skip
        speed, alpha, beta = 75.0 + 8.0 * rng.normal(), 0.15 * rng.normal(), 0.15 * rng.normal()
        plane = speed * np.cos(beta)
        drawn = {name: 0.3 * rng.normal() for name in ("p", "q", "r", "phi", "theta", "psi")} | {"h": 1500.0}
        drawn |= {"u": plane * np.cos(alpha), "v": speed * np.sin(beta), "w": plane * np.sin(alpha)}
        self.state = state_vector(axes, drawn)
        inputs = {"rho": 1.02, "thrust": 8000.0, "mass": 4650.0, "speed_of_sound": 330.0}
        inputs |= {"V": speed, "alpha": alpha, "beta": beta, **drawn}
        inputs |= {name: 0.1 * rng.normal() for name in self.columns[self.leading :]}
        inputs |= {"gust": 0.0, "side_gust": 0.0, "thrust_change": 300.0}
        self.u = np.array([inputs[name] for name in self.columns])
        self.positions = np.array([self.body.positions.get(name, (0.0, 0.0, 0.0)) for name in axes.outputs])

    def kernel(self, differentiate: bool = True) -> Workspace:
        work = make_workspace(len(self.columns) - self.leading, self.table, self.constants.layout)
        arguments = (self.table, self.constants, self.positions, work)
        evaluate(self.state, self.u, self.values, *arguments, differentiate, True)
        return work

    def oracle(self, x: Any = None, extra: Any = None, values: Any = None) -> NDArray[np.complex128]:
        """Rates, then outputs; at the case's own state, extra inputs and values where no others are given."""
        x, values = self.state if x is None else x, self.values if values is None else values
        u = [*self.u[: self.leading], *(self.u[self.leading :] if extra is None else extra)]
        inputs = dict(zip(self.columns, u, strict=True))
        terms = dict(zip(self.terms, values, strict=True))
        found = rigid_body.answer(self.axes.integrated, x, inputs, terms, self.body)
        return np.array([*found.rates, *(found.outputs[name] for name in self.axes.outputs)])

    def jacobians(self) -> tuple[Array, Array, Array]:
        """Slopes of the oracle by states, extra inputs and terms."""
        return (
            slopes(lambda at: self.oracle(x=at), self.state),
            slopes(lambda at: self.oracle(extra=at), self.u[self.leading :]),
            slopes(lambda at: self.oracle(values=at), self.values),
        )


def agree(found: Array, wanted: Array, tolerance: float) -> None:
    """Row by row, relative to the largest entry of the row."""
    scale = 1.0 + (np.abs(wanted).max(axis=-1, keepdims=True) if wanted.ndim > 1 else np.abs(wanted))
    assert_allclose(found / scale, wanted / scale, rtol=0.0, atol=tolerance)


EVERY = [(axes, implicit) for axes in (LONGITUDINAL, LATERAL, SIX) for implicit in (False, True)][:-3]
EVERY += [(SIX, False), (SIX, True)]
WHICH = [f"{axes.name}{', implicit' if implicit else ''}" for axes, implicit in EVERY]


@pytest.mark.parametrize("rate_airspeed", [None, 70.0])
@pytest.mark.parametrize(("axes", "implicit"), EVERY, ids=WHICH)
def test_values_and_slopes_are_those_of_the_rigid_body(axes: Axes, implicit: bool, rate_airspeed: float | None) -> None:
    # Where the equations are implicit a gust is followed without the inertial part of alphadot; no gust moves what a
    # case measures.
    gusts = () if implicit else {"longitudinal": ("gust",), "lateral": ("side_gust",)}.get(axes.name, EXTRA[:2])
    for seed in range(6):
        case = Case(axes, terms_of(axes, implicit), seed, rate_airspeed)
        work = case.kernel()
        by_state, by_input, by_term = case.jacobians()
        agree(np.concatenate([work.rates, work.outputs]), np.real(case.oracle()), 1e-12)
        agree(np.vstack([work.rates_x, work.outputs_x]), by_state, 1e-11)
        agree(np.vstack([work.rates_p, work.outputs_p]), by_term, 1e-11)
        extra = case.columns[case.leading :]
        places = [place for place, name in enumerate(extra) if "gust" not in name or name in gusts]
        agree(np.vstack([work.rates_u, work.outputs_u])[:, places], by_input[:, places], 1e-11)


@pytest.mark.parametrize("polar", POLARS)
@pytest.mark.parametrize(("axes", "implicit"), [(LONGITUDINAL, False), (LONGITUDINAL, True), (SIX, False), (SIX, True)])
def test_values_and_slopes_with_a_drag_polar(axes: Axes, implicit: bool, polar: str) -> None:
    for seed in range(4):
        case = Case(axes, terms_of(axes, implicit) | POLARS[polar], seed, rate_airspeed=None)
        work = case.kernel()
        by_state, by_input, by_term = case.jacobians()
        agree(np.concatenate([work.rates, work.outputs]), np.real(case.oracle()), 1e-12)
        agree(np.vstack([work.rates_x, work.outputs_x]), by_state, 1e-11)
        agree(np.vstack([work.rates_p, work.outputs_p]), by_term, 1e-11)
        places = [n for n, name in enumerate(case.columns[case.leading :]) if "gust" not in name]
        agree(np.vstack([work.rates_u, work.outputs_u])[:, places], by_input[:, places], 1e-11)


@pytest.mark.parametrize("axes", [LONGITUDINAL, LATERAL, SIX], ids=lambda axes: axes.name)
def test_a_body_without_forces_turns_as_euler_says(axes: Axes) -> None:
    """The stage of Newton's and Euler's equations alone."""
    case = Case(axes, {(axes.coefficients[0], "1"): 0.0}, seed=3)
    case.u[case.columns.index("thrust")] = case.u[case.columns.index("thrust_change")] = 0.0
    work = case.kernel()
    agree(work.rates, np.real(case.oracle())[: work.rates.size], 1e-12)
    agree(np.vstack([work.rates_x, work.outputs_x]), case.jacobians()[0], 1e-12)


@pytest.mark.parametrize("axes", [LONGITUDINAL, LATERAL, SIX], ids=lambda axes: axes.name)
def test_air_data_and_their_slopes(axes: Axes) -> None:
    """The stage of the air-relative motion alone."""
    case = Case(axes, terms_of(axes), seed=5)
    inputs = dict(zip(case.columns, case.u, strict=True))

    def oracle(x: NDArray[np.complex128]) -> NDArray[np.complex128]:
        z = rigid_body.motion(axes.integrated, x, inputs)
        speed = np.sqrt(z["u"] ** 2 + z["v"] ** 2 + z["w"] ** 2)
        angles = rigid_body.arctan2(z["w"], z["u"]), rigid_body.arctan2(z["v"], np.sqrt(z["u"] ** 2 + z["w"] ** 2))
        return np.array([speed, *angles, z["u"], z["v"], z["w"]])

    motion, air = air_at(case.state, case.u, case.constants.layout)
    found = np.array([air.speed, air.alpha, air.beta, motion.u, motion.v, motion.w])
    agree(found, np.real(oracle(case.state.astype(complex))), 1e-13)
    by = air_slopes(motion, air, case.constants.layout)
    table = {
        "u": (by.V_u, by.alpha_u, by.beta_u, 1.0, by.v_u, 0.0),
        "v": (by.V_v, 0.0, by.beta_v, by.u_v, 1.0, by.w_v),
        "w": (by.V_w, by.alpha_w, by.beta_w, 0.0, by.v_w, 1.0),
    }
    wanted = slopes(oracle, case.state)
    for name in set("uvw") & set(axes.integrated):
        assert_allclose(table[name], wanted[:, axes.integrated.index(name)], rtol=0.0, atol=1e-14)


def test_six_axes_with_the_lateral_motion_at_rest_are_the_longitudinal_ones() -> None:
    plane, whole = Case(LONGITUDINAL, PITCHING, 7), Case(SIX, PITCHING | LATERAL_TERMS, 7)
    places = [MOTION.index(name) for name in LONGITUDINAL.integrated]
    rows = [OUTPUTS.index(name) for name in LONGITUDINAL.outputs]
    for name in ("phi", "p", "r", "beta"):
        plane.u[plane.columns.index(name)] = 0.0
    for name in whole.columns[whole.leading :]:
        value = plane.u[plane.columns.index(name)] if name in plane.columns else 0.0
        whole.u[whole.columns.index(name)] = value
    for case in (plane, whole):
        case.u[case.columns.index("cg_y")] = 0.0
    whole.state[:] = 0.0
    whole.state[places] = plane.state
    whole.positions[rows] = plane.positions * [1.0, 0.0, 1.0]
    plane.positions *= [1.0, 0.0, 1.0]
    one, other = plane.kernel(), whole.kernel()
    agree(other.rates[places], one.rates, 1e-12)
    agree(other.outputs[rows], one.outputs, 1e-12)
    agree(other.rates_x[np.ix_(places, places)], one.rates_x, 1e-12)
    agree(other.outputs_x[np.ix_(rows, places)], one.outputs_x, 1e-12)
    lateral = np.setdiff1d(np.arange(len(MOTION)), places)
    assert_allclose(other.rates[lateral], 0.0, atol=1e-12)


@pytest.mark.parametrize("axes", [LATERAL, SIX], ids=lambda axes: axes.name)
def test_flights_are_those_of_an_independent_simulation(axes: Axes) -> None:
    """Aileron, rudder and elevator doublets, each output to 1e-5 of its peak to peak."""
    case = Case(axes, terms_of(axes), seed=11)
    time = np.arange(0.0, 8.0, 0.04)
    inputs = {name: np.full(time.size, value) for name, value in zip(case.columns, case.u, strict=True)}
    for name in ("thrust_change", "cg_x", "cg_y", "cg_z", "delta_a", "delta_r", "delta_e"):
        if name in inputs:
            inputs[name] = np.zeros(time.size)
    for name, begin in (("delta_a", 1.0), ("delta_r", 3.0), ("delta_e", 0.5)):
        if name in inputs:
            inputs[name] += 0.04 * ((time > begin) & (time < begin + 1.0))
            inputs[name] -= 0.04 * ((time > begin + 1.0) & (time < begin + 2.0))
    motion = {"u": 75.0, "w": 3.0, "theta": 0.04, "v": 0.8, "p": 0.02, "h": 1500.0}
    for name, value in (("V", 75.0), ("alpha", 0.04), ("q", 0.0), ("theta", 0.04)):
        if name in inputs:
            inputs[name] = value + 0.01 * np.sin(time) if name != "V" else value + np.sin(0.5 * time)
    start = state_vector(axes, motion)
    stacked = np.column_stack([inputs[name] for name in case.columns])
    m = len(axes.outputs)
    flight = Flight(time, stacked, np.zeros((0, m)), case.positions, 4, np.zeros(len(case.columns) - case.leading))
    outputs, states = simulate_outputs(start, flight, case.values, case.table, case.constants)
    path, seen = rigid_body.simulate(axes.integrated, start, time, inputs, case.terms, case.body)
    wanted = np.array([[np.real(row[name]) for name in axes.outputs] for row in seen])
    for found, sought in ((states, path), (outputs, wanted)):
        assert np.ptp(sought, axis=0).min() > 1e-3
        assert_allclose((found - sought) / np.ptp(sought, axis=0), 0.0, atol=1e-5)


def test_the_compiler_is_told_of_every_quantity_in_its_order() -> None:
    assert MotionThere._fields == MOTION
    assert OutputsThere._fields == OUTPUTS
    assert tuple(f"C_{name}" for name in CoefficientsThere._fields) == COEFFICIENTS
