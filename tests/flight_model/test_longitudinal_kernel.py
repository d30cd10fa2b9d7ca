"""The flight model's kernel against its plain transcription, its slopes against differences, its integrator's order."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from oracles.flight import INPUTS, Airframe, central_difference, sensed, simulate, state_rates
from problems import LIFT_AND_DRAG, LIGHT, NOISE, Problem
from strategies import NAMES

from aerosid.estimation import prediction
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model import flight as simulated
from aerosid.flight_model.axes import LONGITUDINAL, input_columns_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.equations_of_motion import evaluate
from aerosid.flight_model.layout import layout_of
from aerosid.flight_model.sampling_interval import advance, make_step
from aerosid.flight_model.terms import COEFFICIENTS, build_table, input_columns, parse_term
from aerosid.flight_model.workspace import Workspace, make_workspace

POSITIONS = {"alpha": (4.1, 0.7, -0.5), "a_x": (1.2, -0.3, 0.6), "a_z": (-0.8, 0.4, 0.3)}
LAYOUT = layout_of(LONGITUDINAL)
OUTPUTS, LEADING = LONGITUDINAL.outputs, len(input_columns_of(LONGITUDINAL))
SMOOTH = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.filter_too_much])


class Case:
    """One model at one state with one set of inputs, for the kernel and for the oracle."""

    def __init__(
        self,
        terms: dict[tuple[str, str], float],
        state: list[float],
        inputs: dict[str, float],
        frame: Airframe,
        positions: dict[str, tuple[float, float, float]] | None = None,
    ) -> None:
        self.terms, self.inputs, self.frame, self.positions = terms, inputs, frame, positions or {}
        parsed = [(coefficient, parse_term(text)) for coefficient, text in terms]
        self.columns = input_columns([term for _, term in parsed])
        self.table = build_table(parsed, self.columns)
        self.theta = np.array(list(terms.values()))
        self.state = np.array(state)
        self.u = np.array([inputs[name] for name in self.columns])
        self.places = np.array([self.positions.get(name, (0.0, 0.0, 0.0)) for name in OUTPUTS])
        self.constants = Constants(
            frame.wing_area,
            frame.mean_chord,
            frame.I_yy,
            frame.thrust_incidence,
            frame.thrust_z_arm,
            frame.rate_airspeed or 0.0,
            frame.reference_airspeed,
        )

    def kernel(self, differentiate: bool = True) -> Workspace:
        work = make_workspace(self.u.size - LEADING, self.table, LAYOUT)
        evaluate(self.state, self.u, self.theta, self.table, self.constants, self.places, work, differentiate, True)
        return work

    def rates(
        self, state: NDArray[np.float64], extra: NDArray[np.float64], theta: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Rates and outputs of the oracle, (13,)."""
        inputs = self.inputs | dict(zip(self.columns[8:], extra, strict=True))
        terms = dict(zip(self.terms, theta, strict=True))
        return np.concatenate(
            [state_rates(state, inputs, terms, self.frame), sensed(state, inputs, terms, self.frame, self.positions)]
        )

    @property
    def extra(self) -> NDArray[np.float64]:
        return self.u[8:]

    def near_corner(self) -> bool:
        """Whether some abs() or pos() has its corner so close that a difference would straddle it."""
        work = self.kernel()
        for f in range(self.table.variable.size):
            x = work.values[self.table.variable[f]] - self.table.offset[f]
            if self.table.shape[f] != 0 and abs(x) < 2e-3 * (1.0 + abs(self.table.offset[f])):
                return True
        return False


@st.composite
def term_texts(draw: st.DrawFn, names: tuple[str, ...]) -> str:
    """Products of one to three factors that stay of ordinary size and whose corners are met."""
    factors = []
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(names))
        shape = draw(st.sampled_from(["{}", "{}", "abs({})", "pos({})", "pos({} - 0.1)", "pos({} + 0.2)"]))
        factors.append(shape.format(name) + draw(st.sampled_from(["", "^2", "^3"])))
    return "*".join(factors)


@st.composite
def cases(draw: st.DrawFn, names: tuple[str, ...] = tuple(n for n in NAMES if n != "alpha_dot_hat")) -> Case:
    """A drawn aircraft at a drawn state, banked and sideslipping, with one to six terms in any coefficient."""
    number = st.floats(-1.0, 1.0).map(lambda value: round(value, 4))

    def between(low: float, high: float) -> float:
        return low + (high - low) * 0.5 * (1.0 + draw(number))

    terms = {
        (draw(st.sampled_from(COEFFICIENTS)), str(parse_term(draw(term_texts(names))))): 2.0 * draw(number)
        for _ in range(draw(st.integers(1, 6)))
    }
    airspeed, alpha = between(25.0, 160.0), between(-0.5, 0.7)
    state = [airspeed * np.cos(alpha), airspeed * np.sin(alpha), between(-0.8, 0.8), between(-1.0, 1.0), 800.0]
    inputs = {
        "rho": between(0.3, 1.3),
        "thrust": between(-2e3, 2e4),
        "mass": between(300.0, 9000.0),
        "speed_of_sound": between(290.0, 345.0),
        "phi": between(-1.0, 1.0),
        "p": between(-0.5, 0.5),
        "r": between(-0.3, 0.3),
        "beta": between(-0.3, 0.3),
        "delta_e": between(-0.4, 0.4),
        "delta_f": between(0.0, 0.7),
        "vane_2": between(-2.0, 2.0),
    }
    frame = Airframe(
        wing_area=between(8.0, 60.0),
        mean_chord=between(0.8, 3.0),
        I_yy=between(800.0, 60_000.0),
        rate_airspeed=draw(st.sampled_from([None, 60.0, 100.0])),
        reference_airspeed=between(40.0, 120.0),
        thrust_incidence=between(-0.1, 0.1),
        thrust_z_arm=between(-0.5, 0.5),
    )
    return Case(terms, state, inputs, frame, draw(st.sampled_from([{}, POSITIONS])))


def agree(found: NDArray[np.float64], wanted: NDArray[np.float64], tolerance: float) -> None:
    """Row by row, relative to the largest entry of the row."""
    scale = np.abs(wanted).max(axis=-1, keepdims=True) if wanted.ndim > 1 else np.abs(wanted)
    assert_allclose(found / (1.0 + scale), wanted / (1.0 + scale), rtol=0.0, atol=tolerance)


@SMOOTH
@given(cases())
def test_rates_and_outputs_are_the_equations_of_motion(case: Case) -> None:
    work = case.kernel()
    agree(np.concatenate([work.rates, work.outputs]), case.rates(case.state, case.extra, case.theta), 1e-12)


def slopes_agree(case: Case, tolerance: float) -> None:
    work = case.kernel()
    found = {
        "states": np.vstack([work.rates_x, work.outputs_x]),
        "inputs": np.vstack([work.rates_u, work.outputs_u]),
        "terms": np.vstack([work.rates_p, work.outputs_p]),
    }
    state, extra, theta = case.state, case.extra, case.theta
    wanted = {
        "states": central_difference(
            lambda x: case.rates(x, extra, theta), state, np.array([1e-2, 1e-2, 1e-4, 1e-4, 1e-2])
        ),
        "terms": central_difference(lambda p: case.rates(state, extra, p), theta, np.full(theta.size, 1e-3)),
    }
    if extra.size:
        wanted["inputs"] = central_difference(lambda e: case.rates(state, e, theta), extra, np.full(extra.size, 2e-4))
    for name, slope in wanted.items():
        agree(found[name], slope, tolerance)


@SMOOTH
@given(cases())
def test_slopes_are_those_of_the_equations(case: Case) -> None:
    assume(not case.near_corner())
    slopes_agree(case, 2e-7)


@SMOOTH
@given(cases(), st.sampled_from(COEFFICIENTS), st.floats(-6.0, 6.0))
def test_alpha_dot_is_solved_for_where_terms_hold_it(case: Case, coefficient: str, value: float) -> None:
    """The implicit equation against its fixed point, and the implicit function's slopes against differences."""
    assume(not case.near_corner())
    terms = case.terms | {(coefficient, "alpha_dot_hat"): value, (coefficient, "alpha*alpha_dot_hat"): 0.5 * value}
    case = Case(terms, list(case.state), case.inputs, case.frame, case.positions)
    # The oracle's iteration contracts only for a light apparent mass, which is also the physical case.
    half_chord = 0.5 * case.frame.mean_chord / (case.frame.rate_airspeed or 25.0)
    speed = np.hypot(*case.state[:2]) / 0.9
    force = 0.5 * case.u[0] * speed * case.frame.wing_area / case.u[2]
    assume(force * half_chord * 3.0 * abs(value) < 0.5)
    work = case.kernel()
    agree(np.concatenate([work.rates, work.outputs]), case.rates(case.state, case.extra, case.theta), 1e-11)
    slopes_agree(case, 1e-6)


@SMOOTH
@given(cases(), st.floats(-6.0, 6.0), st.booleans())
def test_rates_are_the_same_without_their_slopes(case: Case, value: float, acts: bool) -> None:
    """Also where alphadot is in a candidate alone, and need not be solved for."""
    terms = case.terms | {("C_m", "alpha_dot_hat"): value if acts else 0.0}
    case = Case(terms, list(case.state), case.inputs, case.frame, case.positions)
    plain, differentiated = case.kernel(differentiate=False), case.kernel()
    np.testing.assert_array_equal(plain.rates, differentiated.rates)
    np.testing.assert_array_equal(plain.outputs, differentiated.outputs)


LIGHT_FRAME = Airframe(23.23, 1.5875, 6940.0, 100.0, 100.0)
LIGHT_TERMS = {(d.coefficient, str(d.term)): d.value for d in LIGHT.derivatives}
LIGHT_INPUTS = {
    "rho": 0.9077,
    "thrust": 5580.0,
    "mass": 2280.0,
    "speed_of_sound": 340.0,
    "phi": 0.0,
    "p": 0.0,
    "r": 0.0,
    "beta": 0.0,
    "delta_e": 0.02,
}


def test_a_light_apparent_mass_is_a_nonlinear_term_of_alpha_dot() -> None:
    terms = LIGHT_TERMS | {("C_Z", "alpha_dot_hat^2"): 20.0, ("C_m", "alpha_dot_hat"): -6.0}
    case = Case(terms, [99.0, 9.0, 0.3, 0.05, 0.0], LIGHT_INPUTS, LIGHT_FRAME)
    agree(case.kernel().rates, state_rates(case.state, case.inputs, terms, LIGHT_FRAME), 1e-9)


def test_level_trimmed_flight_reads_minus_one_g() -> None:
    """Interfaces: level flight reads a_z = -9.81 m/s^2, positive elevator pitches down."""
    alpha = 0.0145831
    case = Case(LIGHT_TERMS, [100 * np.cos(alpha), 100 * np.sin(alpha), 0.0, alpha, 1500.0], LIGHT_INPUTS, LIGHT_FRAME)
    work = case.kernel()
    assert work.outputs[5] == pytest.approx(-9.81, abs=0.25)
    assert work.rates[4] == pytest.approx(0.0, abs=1e-9)
    assert work.rates_u[2, 0] < 0.0


def one_interval(substeps: int, terms: dict[tuple[str, str], float], end: dict[str, float]) -> NDArray[np.float64]:
    case = Case(terms, [98.0, 7.0, 0.2, 0.1, 1000.0], LIGHT_INPUTS | end, LIGHT_FRAME)
    before = Case(terms, [98.0, 7.0, 0.2, 0.1, 1000.0], LIGHT_INPUTS, LIGHT_FRAME)
    extra, count = case.u.size - 8, case.theta.size
    work, step = make_workspace(extra, case.table, LAYOUT), make_step(extra, count, LAYOUT)
    advance(
        case.state,
        before.u,
        case.u,
        0.4,
        substeps,
        case.theta,
        case.table,
        case.constants,
        case.places,
        work,
        step,
        True,
    )
    return step.state.copy()


def test_integrator_is_of_fourth_order_and_agrees_with_dop853() -> None:
    end = {"delta_e": 0.12, "thrust": 9000.0, "phi": 0.3, "q": 0.0}
    terms = LIGHT_TERMS | {("C_m", "alpha^2"): -1.715, ("C_X", "alpha^2"): 3.6}
    inputs = {name: np.array([LIGHT_INPUTS[name], (LIGHT_INPUTS | end)[name]]) for name in (*INPUTS, "delta_e")}
    states, _ = simulate([98.0, 7.0, 0.2, 0.1, 1000.0], np.array([0.0, 0.4]), inputs, terms, LIGHT_FRAME)
    counts = np.array([16, 32, 64])
    errors = np.array([np.abs(one_interval(int(n), terms, end)[:4] - states[1, :4]).max() for n in counts])
    slope = np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(-4.0, abs=0.15)
    assert_allclose(one_interval(256, terms, end), states[1], rtol=1e-10)


@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("implicit", [False, True])
def test_sensitivities_of_a_step_are_those_of_the_discrete_solution(substeps: int, implicit: bool) -> None:
    terms = LIGHT_TERMS | {("C_m", "alpha*delta_f"): -0.4, ("C_Z", "delta_f^2"): -0.5, ("C_X", "alpha^2"): 3.6}
    if implicit:
        terms = terms | {("C_Z", "alpha_dot_hat"): -1.5, ("C_m", "alpha_dot_hat"): -5.0}
    inputs = LIGHT_INPUTS | {"delta_f": 0.3}
    case = Case(terms, [98.0, 7.0, 0.2, 0.1, 1000.0], inputs, LIGHT_FRAME)
    extra, count = case.u.size - 8, case.theta.size

    def solve(point: NDArray[np.float64]) -> NDArray[np.float64]:
        x, theta = point[:5].copy(), point[5 + 2 * extra :].copy()
        start, end = case.u.copy(), case.u.copy()
        start[8:], end[8:] = point[5 : 5 + extra], point[5 + extra : 5 + 2 * extra]
        work, step = make_workspace(extra, case.table, LAYOUT), make_step(extra, count, LAYOUT)
        advance(x, start, end, 0.06, substeps, theta, case.table, case.constants, case.places, work, step, False)
        return step.state.copy()

    work, step = make_workspace(extra, case.table, LAYOUT), make_step(extra, count, LAYOUT)
    end = case.u.copy()
    end[8] = 0.15
    point = np.concatenate([case.state, case.u[8:], end[8:], case.theta])
    advance(
        case.state, case.u, end, 0.06, substeps, case.theta, case.table, case.constants, case.places, work, step, True
    )
    found = np.hstack([step.transition, step.start, step.end, step.terms])
    widths = np.concatenate([[1e-2, 1e-2, 1e-4, 1e-4, 1e-2], np.full(2 * extra, 1e-3), np.full(count, 1e-3)])
    agree(found, central_difference(solve, point, widths), 1e-8)
    assert_allclose(step.state, solve(point), rtol=0.0, atol=0.0)


KERNELS = (evaluate, advance, prediction.predict_stretch, simulated.simulate_outputs)


def test_a_new_aircraft_with_new_terms_compiles_nothing() -> None:
    def use(problem: Problem) -> None:
        log = problem.fly()
        model, manoeuvre = problem.prepared(log)
        refine(model, [manoeuvre], model.entries[:2])

    use(Problem(duration=4.0))
    compiled = {kernel.__name__: len(kernel.signatures) for kernel in KERNELS}
    use(Problem(LIFT_AND_DRAG, {("C_m", "alpha_dot_hat"): -4.0, ("C_L", "pos(alpha - 0.05)^2"): -3.0}, duration=4.0))
    use(Problem(duration=5.0, noise=NOISE | {"q_dot": 0.01}, interval=0.02))
    assert {kernel.__name__: len(kernel.signatures) for kernel in KERNELS} == compiled


def test_compiled_code_comes_from_the_disk_the_second_time() -> None:
    here = Path(__file__).parents[1]
    code = (
        f"import sys; sys.path.insert(0, {str(here)!r}); from problems import Problem; Problem(duration=4.0).fly(); "
        "from aerosid.flight_model import equations_of_motion, flight; "
        "counts = [(len(k.stats.cache_hits), len(k.stats.cache_misses)) for k in "
        "(equations_of_motion.evaluate, flight.simulate_outputs)]; print(counts)"
    )
    Problem(duration=4.0).fly()  # compiled or loaded here: on the disk either way
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    hits, misses = np.array(re.findall(r"\((\d+), (\d+)\)", run.stdout), dtype=int).T
    assert (misses == 0).all()
    assert (hits > 0).all()


def test_states_and_outputs_keep_their_declared_order() -> None:
    assert LONGITUDINAL.integrated == ("u", "w", "q", "theta", "h")
    assert OUTPUTS == ("V", "alpha", "q", "theta", "a_x", "a_z", "q_dot", "h")


@SMOOTH
@given(cases(), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-2e3, 2e3))
def test_a_shifted_centre_and_another_thrust_are_rigid_body_mechanics(
    case: Case, ahead: float, below: float, further: float
) -> None:
    """Moments about the true centre by vector products, sensors where they are bolted, slopes by differences."""
    assume(not case.near_corner())
    names = (*case.columns, "cg_shift_x", "cg_shift_z", "thrust_change")
    place = len(case.columns) - 8
    constants = case.constants._replace(cg_x=place, cg_z=place + 1, thrust_change=place + 2)
    table = build_table([(coefficient, parse_term(text)) for coefficient, text in case.terms], names)
    given_inputs = np.concatenate([case.u, [ahead, below, further]])
    kernel = make_workspace(place + 3, table, LAYOUT)

    def answer(x: NDArray[np.float64], u: NDArray[np.float64], theta: NDArray[np.float64]) -> NDArray[np.float64]:
        evaluate(x, u, theta, table, constants, case.places, kernel, True, True)
        return np.concatenate([kernel.rates, kernel.outputs])

    found = answer(case.state, given_inputs, case.theta)
    pushed = case.u.copy()
    pushed[1] += further
    plain = make_workspace(place, case.table, LAYOUT)
    evaluate(case.state, pushed, case.theta, case.table, case.constants, np.zeros((8, 3)), plain, False, True)
    mass, (p, q, r) = case.u[2], (case.u[5], case.state[2], case.u[6])
    force = mass * np.array([plain.outputs[4], 0.0, plain.outputs[5]])
    centre = np.array([ahead, 0.0, below])
    q_dot = plain.rates[2] + np.cross(-centre, force)[1] / case.constants.I_yy
    assert_allclose(found[2], q_dot, atol=1e-10 * (1.0 + abs(q_dot)))
    turn, turned = np.array([p, q, r]), np.array([0.0, q_dot, 0.0])

    def at(sensor: int) -> NDArray[np.float64]:
        arm = case.places[sensor] - centre
        return force / mass + np.cross(turned, arm) + np.cross(turn, np.cross(turn, arm))

    size = 1.0 + np.abs(force).max() / mass
    assert_allclose(found[5 + 4], at(4)[0], atol=1e-9 * size)
    assert_allclose(found[5 + 5], at(5)[2], atol=1e-9 * size)
    plane = np.hypot(case.state[0], case.state[1])
    vane = np.array([case.state[0], plane * np.tan(case.u[7]), case.state[1]]) + np.cross(turn, case.places[1] - centre)
    assert_allclose(found[5 + 1], np.arctan2(vane[2], vane[0]), atol=1e-12)

    answer(case.state, given_inputs, case.theta)
    slopes = [np.vstack([kernel.rates_x, kernel.outputs_x]), np.vstack([kernel.rates_u, kernel.outputs_u])]
    slopes.append(np.vstack([kernel.rates_p, kernel.outputs_p]))
    slopes = [slope.copy() for slope in slopes]
    steps = np.array([1e-2, 1e-2, 1e-4, 1e-4, 1e-2])
    agree(slopes[0], central_difference(lambda x: answer(x, given_inputs, case.theta), case.state, steps), 2e-7)

    def moved(extra: NDArray[np.float64]) -> NDArray[np.float64]:
        return answer(case.state, np.concatenate([case.u[:8], extra]), case.theta)

    reach = np.array([2e-4] * place + [1e-3, 1e-3, 1.0])
    agree(slopes[1], central_difference(moved, given_inputs[8:], reach), 5e-7)
    wanted = central_difference(
        lambda theta: answer(case.state, given_inputs, theta), case.theta, np.full(case.theta.size, 1e-3)
    )
    agree(slopes[2], wanted, 2e-7)
