"""Each effect of the catalogue in a simulated flight: the search names its kind and place, with the right value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles.effects import fly_separating, fly_through_air
from oracles.flight import Airframe
from problems import BOTH_SQUARES, LIGHT, NOISE, SILENT, Problem, terms_of, with_channels
from scipy.signal import lsim

from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.maximum_likelihood import refine
from aerosid.flight_model.axes import LONGITUDINAL
from aerosid.flight_model.simulation import fly, steps, trim
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.identification import identify
from aerosid.loop.verdict import Verdict, judge
from aerosid.search.attribution import Attribution
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.multi_start import search_without_disturbances
from aerosid.search.separation_search import search_separation_first
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch

USUAL = AttributionSettings()

Array = NDArray[np.float64]
FRAME = Airframe(LIGHT.wing_area, LIGHT.mean_chord, LIGHT.I_yy, LIGHT.airspeed, 100.0)
FLIGHT = Problem(duration=14.1, elevator="3211", amplitude=0.045)
"""470 samples of 30 ms."""


class Levels(Problem):
    """Steps of several sizes: with one size only, a dead band is indistinguishable from a weaker elevator."""

    @property
    def deflection(self) -> Array:
        levels = [(0.9, 0.045), (0.9, -0.045), (0.9, 0.02), (0.9, -0.02), (0.6, 0.03), (0.6, -0.03)]
        return steps(self.time, 1.0, levels)


LEVELS = Levels(duration=14.1)


def flown(problem: Problem, seed: int, act: Callable[[Array, Array], Array]) -> FlightLog:
    """The log of a flight with elevator `act(time, commanded)`; the command is recorded."""
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    surface = act(problem.time, problem.deflection)
    body = {"density": LIGHT.density, "mass": LIGHT.mass, "noise": NOISE, "seed": seed}
    log = fly(problem.truth, level, problem.time, surface, **body)
    command = log["delta_e"] - surface + problem.deflection
    return with_channels(log, delta_e=command, thrust=np.full(log.time.size, level.thrust))


def recorded(problem: Problem, seed: int, channel: str, sense: Callable[[Array, Array], Array]) -> FlightLog:
    """The log of a flight whose sensor of one channel reads `sense(time, true)`, with the usual noise."""
    clean = replace(problem, noise=dict.fromkeys(NOISE, 0.0)).fly()
    log = problem.fly(seed)
    noise = log[channel] - clean[channel]
    return with_channels(log, **{channel: sense(problem.time, clean[channel]) + noise})


def placed(problem: Problem, seed: int, channel: str, ahead: float) -> FlightLog:
    """The log of a flight whose vane or vertical accelerometer sits `ahead` m of the centre of gravity."""
    clean = replace(problem, noise=SILENT).fly()
    shown = {"alpha": -clean["q"] / clean["V"], "a_z": -clean["q_dot"]}
    return recorded(problem, seed, channel, lambda _t, y: y + ahead * shown[channel])


def sampled(problem: Problem, seed: int, outputs: Array, thrust: float, elevator: Array) -> FlightLog:
    """Outputs (N, 8) of an independent simulation as a log, with the usual noise."""
    generator = np.random.default_rng(seed)
    truth = {**dict(zip(LONGITUDINAL.outputs, outputs.T, strict=True)), "delta_e": elevator}
    channels = {name: truth[name] + s * generator.standard_normal(problem.time.size) for name, s in NOISE.items()}
    template = problem.fly()
    return FlightLog("flight", problem.time, {**channels, "thrust": np.full(problem.time.size, thrust)}, template.units)


def lag(time: Array, values: Array, constant: float) -> Array:
    system = ([[-1.0 / constant]], [[1.0 / constant]], [[1.0]], [[0.0]])
    return np.asarray(lsim(system, values, time, X0=[values[0]], interp=True)[1])


def limited(time: Array, values: Array, rate: float) -> Array:
    surface = [float(values[0])]
    for step, wanted in zip(np.diff(time), values[1:], strict=True):
        away = float(wanted) - surface[-1]
        surface.append(surface[-1] + np.sign(away) * min(abs(away), rate * step))
    return np.array(surface)


def dead(_time: Array, values: Array) -> Array:
    return np.asarray(values - np.clip(values, -0.012, 0.012))


def jumping(problem: Problem, seed: int, jump: float, moment: float) -> FlightLog:
    """The pitching moment changes within one sample: an unrecorded input."""
    changed = replace(problem, undeclared={("C_m", "vane_2"): 1.0})
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    vane = jump * np.clip((problem.time - moment) / problem.interval + 0.5, 0.0, 1.0)
    body = {"density": LIGHT.density, "mass": LIGHT.mass, "noise": NOISE, "seed": seed}
    log = fly(changed.truth, level, problem.time, problem.deflection, further_inputs={"vane_2": vane}, **body)
    return with_channels(log, vane_2=None, thrust=np.full(log.time.size, level.thrust))


def gusty(problem: Problem, seed: int, sigma: float, length: float) -> FlightLog:
    """Flight through exponentially correlated vertical gusts."""
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    generator = np.random.default_rng(1000 + seed)
    remembered = np.exp(-100.0 * problem.interval / length)
    air = [sigma * generator.standard_normal()]
    for shock in generator.standard_normal(problem.time.size - 1):
        air.append(remembered * air[-1] + sigma * np.sqrt(1.0 - remembered**2) * shock)
    elevator = level.delta_e + problem.deflection
    driving = {"rho": LIGHT.density, "mass": LIGHT.mass, "thrust": level.thrust, "delta_e": elevator}
    start = [100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha), 0.0, level.alpha, 1500.0]
    outputs = fly_through_air(start, problem.time, driving, terms_of(problem.truth), FRAME, np.array(air))
    return sampled(problem, seed, outputs, level.thrust, elevator)


SEPARATION = {"alpha_star": 0.11, "sharpness": 25.0, "delay": 0.15, "relaxation": 0.2, "C_X": -0.05, "C_m": -0.03}


def separating(problem: Problem, seed: int) -> FlightLog:
    level = trim(problem.truth, 100.0, LIGHT.density, LIGHT.mass)
    elevator = level.delta_e + problem.deflection
    driving = {"rho": LIGHT.density, "mass": LIGHT.mass, "thrust": level.thrust, "delta_e": elevator}
    start = [100.0 * np.cos(level.alpha), 100.0 * np.sin(level.alpha), 0.0, level.alpha, 1500.0]
    outputs, point = fly_separating(start, problem.time, driving, terms_of(problem.truth), FRAME, SEPARATION)
    assert point.min() < 0.5 < 0.95 < point.max()
    return sampled(problem, seed, outputs, level.thrust, elevator)


def searched(log: FlightLog) -> tuple[Attribution, Verdict]:
    """The loop's findings and verdict."""
    identified = identify([log], LIGHT)
    assert identified.found is not None
    return identified.found, judge(identified.found, identified.manoeuvres).verdict


@dataclass(frozen=True)
class Planted:
    """What was planted, and the log that holds it."""

    kind: str
    where: str
    value: float
    log: Callable[[], FlightLog]
    slow: bool = False


CATALOGUE = [
    Planted("control_lag", "delta_e", 0.15, lambda: flown(FLIGHT, 1, lambda t, x: lag(t, x, 0.15))),
    Planted("control_delay", "delta_e", 0.12, lambda: flown(FLIGHT, 2, lambda t, x: np.interp(t - 0.12, t, x))),
    Planted("control_rate_limit", "delta_e", 0.2, lambda: flown(FLIGHT, 3, lambda t, x: limited(t, x, 0.2)), slow=True),
    Planted("control_deadband", "delta_e", 0.012, lambda: flown(LEVELS, 4, dead), slow=True),
    Planted("sensor_bias", "alpha", 0.02, lambda: recorded(FLIGHT, 5, "alpha", lambda _t, y: y + 0.02)),
    Planted("sensor_scale", "q", 1.08, lambda: recorded(FLIGHT, 6, "q", lambda _t, y: 1.08 * y)),
    Planted("sensor_delay", "alpha", 0.1, lambda: recorded(FLIGHT, 7, "alpha", lambda t, y: np.interp(t - 0.1, t, y))),
    Planted("sensor_lag", "q", 0.1, lambda: recorded(FLIGHT, 8, "q", lambda t, y: lag(t, y, 0.1))),
    Planted("sensor_lag", "alpha", 0.1, lambda: recorded(FLIGHT, 9, "alpha", lambda t, y: lag(t, y, 0.1))),
    Planted("sensor_position", "alpha", 6.0, lambda: placed(FLIGHT, 13, "alpha", 6.0)),
    Planted("sensor_position", "a_z", 1.5, lambda: placed(FLIGHT, 14, "a_z", 1.5)),
    Planted("step_change", "C_m", -0.015, lambda: jumping(FLIGHT, 10, -0.015, 6.0)),
    Planted("gust", "", 0.8, lambda: gusty(replace(FLIGHT, duration=28.2), 11, 0.8, 180.0), slow=True),
    Planted(
        "flow_separation",
        "C_Z",
        SEPARATION["alpha_star"],
        lambda: separating(replace(FLIGHT, elevator="doublet", amplitude=-0.07), 12),
        slow=True,
    ),
]


@pytest.mark.parametrize(
    "planted",
    [pytest.param(p, id=f"{p.kind} {p.where}", marks=[pytest.mark.slow] if p.slow else []) for p in CATALOGUE],
)
def test_a_planted_effect_is_the_first_finding_with_its_value(planted: Planted) -> None:
    found, verdict = searched(planted.log())
    assert found.findings, verdict
    first = found.findings[0]
    assert (first.kind, first.where) == (planted.kind, planted.where)
    assert len(found.findings) == 1
    # The catalogue's separation acts on a sampled rate of alpha: what is left of that may exceed the noise.
    inexact = planted.kind == "flow_separation"
    assert verdict is Verdict.EXPLAINED or (inexact and verdict is Verdict.PARTLY_EXPLAINED)
    # A normal variable within four standard deviations: one false alarm in 16,000.
    assert abs(first.value - planted.value) < 4.0 * first.std_error
    assert first.std_error < 0.3 * abs(planted.value)
    if planted.kind == "step_change":
        assert first.time == pytest.approx(6.0, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.1, 0.3])
def test_a_rate_limit_of_any_size_is_named(rate: float) -> None:
    found, _ = searched(flown(FLIGHT, 3, lambda t, x: limited(t, x, rate)))
    assert [(finding.kind, finding.where) for finding in found.findings] == [("control_rate_limit", "delta_e")]
    assert found.findings[0].value == pytest.approx(rate, rel=0.05)


@pytest.mark.slow
def test_an_effect_outside_the_catalogue_is_not_named_as_a_sensor_error() -> None:
    """Elevator power falls with pitch rate with a memory: less by 40 % for 0.4 s after each fast pitch-up."""
    problem = replace(FLIGHT, undeclared={("C_m", "vane_2*delta_e"): 0.8})
    level = trim(Problem().truth, 100.0, LIGHT.density, LIGHT.mass)
    quiet = replace(FLIGHT, noise=dict.fromkeys(NOISE, 0.0)).fly()
    loss, last = np.zeros(quiet.time.size), -np.inf
    for k, (t, q) in enumerate(zip(quiet.time, quiet["q"], strict=True)):
        last = float(t) if q > 0.04 else last
        loss[k] = 1.0 if t - last < 0.4 else 0.0
    assert 0.1 < loss.mean() < 0.7
    body = {"density": LIGHT.density, "mass": LIGHT.mass, "noise": NOISE, "seed": 13}
    log = fly(problem.truth, level, problem.time, problem.deflection, further_inputs={"vane_2": loss}, **body)
    log = with_channels(log, vane_2=None, thrust=np.full(log.time.size, level.thrust))
    found, verdict = searched(log)
    assert verdict in (Verdict.PARTLY_EXPLAINED, Verdict.UNEXPLAINED)
    assert not [finding.where for finding in found.findings if finding.kind.startswith("sensor")]


def stalling_with_a_slow_gyro() -> tuple[Problem, FlightLog]:
    problem = replace(FLIGHT, elevator="doublet", amplitude=-0.07)
    log = separating(problem, 12)
    noise = NOISE["q"] * np.random.default_rng(21).standard_normal(problem.time.size)
    return problem, with_channels(log, q=lag(problem.time, log["q"], 0.12) + noise)


@pytest.mark.slow
def test_flow_separation_is_found_together_with_a_rate_gyro_lag() -> None:
    """Six parameters are tried late: a spline of alpha together with the lag must not keep them out."""
    found, _ = searched(stalling_with_a_slow_gyro()[1])
    kinds = {(finding.kind, finding.where): finding.value for finding in found.findings}
    assert set(kinds) == {("flow_separation", "C_Z"), ("sensor_lag", "q")}
    assert kinds["sensor_lag", "q"] == pytest.approx(0.12, abs=0.01)


def test_other_effects_are_found_after_separation_entered_first() -> None:
    """Effects that imitate a stall, once entered, keep it out: where it is the main effect it enters first."""
    problem, log = stalling_with_a_slow_gyro()
    model, manoeuvre = problem.prepared(log)
    before = refine(model, [manoeuvre], model.entries, settings=WRONG_STRUCTURE)
    hypotheses = (
        *term_hypotheses(problem.candidates(log)),
        *effect_hypotheses(model, [manoeuvre], LIGHT.coefficients),
    )
    search = StructureSearch((manoeuvre,), hypotheses, LIGHT.coefficients, before, USUAL)
    found, _ = search_separation_first(search, before)
    values = {active.name: active.values[0] for active in found.effects}
    assert set(values) == {("flow_separation", "C_Z"), ("sensor_lag", "q")}
    assert values["flow_separation", "C_Z"] == pytest.approx(SEPARATION["alpha_star"], rel=0.1)
    assert values["sensor_lag", "q"] == pytest.approx(0.12, abs=0.01)


def test_a_search_without_disturbances_is_doubted_where_a_stall_leaves_the_model_inadequate() -> None:
    """No sum of terms follows it; terms that are missing leave no doubt."""
    stalled = separating(replace(FLIGHT, elevator="doublet", amplitude=-0.07), 12)
    lacking = Problem(undeclared=BOTH_SQUARES)
    doubts: list[bool] = []
    for problem, log, ends in ((lacking, lacking.fly(31), True), (FLIGHT, stalled, False)):
        model, manoeuvre = problem.prepared(log)
        before = refine(model, [manoeuvre], model.entries, settings=WRONG_STRUCTURE)
        hypotheses = term_hypotheses(problem.candidates(log))
        search = StructureSearch((manoeuvre,), hypotheses, LIGHT.coefficients, before, USUAL)
        found = search_without_disturbances(search, before, (), moving_air=False, doubted=lambda: doubts.append(True))
        assert (found is not None) == ends
        assert len(doubts) == (0 if ends else 1)
