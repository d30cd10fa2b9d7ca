"""Each effect shown by rolling and yawing motion, in a flight of independent equations: the loop names it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest
from lateral_flights import INERTIA, PITCH, SIDE, SPEED, Lateral, aircraft, level
from numpy.typing import NDArray
from scipy.signal import lsim

from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict

Array = NDArray[np.float64]
QUICK = LoopSettings(paper_chain=False, linear_analysis=False, next_flight=False)
BOTH = {**PITCH, **SIDE}
TIME = Lateral().time


def closed(flight: Lateral, declared: Mapping[tuple[str, str], float], *, validated: bool = False) -> ClosedLoop:
    """The loop on a flight, and on request on a second one of other inputs."""
    other = [replace(flight, seed=flight.seed + 100).log(mirrored=True, name="other")] if validated else []
    return close_loop([flight.log()], aircraft(declared, flight.factor), other, QUICK)


def lagging(constant: float, time: Array, values: Array) -> Array:
    system = ([[-1.0 / constant]], [[1.0 / constant]], [[1.0]], [[0.0]])
    return np.asarray(lsim(system, values, time, X0=[values[0]], interp=True)[1])


def late(delay: float, time: Array, values: Array) -> Array:
    return np.interp(time - delay, time, values)


def limited(rate: float, time: Array, values: Array) -> Array:
    surface = [float(values[0])]
    for step, wanted in zip(np.diff(time), values[1:], strict=True):
        away = float(wanted) - surface[-1]
        surface.append(surface[-1] + np.sign(away) * min(abs(away), rate * step))
    return np.array(surface)


def jump(size: float, moment: float) -> Array:
    return size * np.clip((TIME - moment) / 0.04 + 0.5, 0.0, 1.0)


@dataclass(frozen=True)
class Planted:
    """The simulated effect, its flight, and the finding expected of the loop: kind, place, term, value, tolerance."""

    name: tuple[str, str, str]
    value: float
    flight: Lateral
    declared: Mapping[tuple[str, str], float]
    slow: bool = True


CATALOGUE = [
    Planted(("aero_term", "C_n", "beta^3"), 1.2, Lateral(extra={("C_n", "beta^3"): 1.2}, factor=0.9), SIDE, slow=False),
    Planted(("aero_term", "C_Y", "p_hat"), -0.3, Lateral(extra={("C_Y", "p_hat"): -0.3}), SIDE),
    Planted(("aero_term", "C_m", "beta^2"), -0.5, Lateral(extra={("C_m", "beta^2"): -0.5}), BOTH),
    Planted(("control_delay", "delta_a", ""), 0.06, Lateral(surfaces={"delta_a": lambda t, x: late(0.06, t, x)}), SIDE),
    Planted(("control_lag", "delta_r", ""), 0.1, Lateral(surfaces={"delta_r": lambda t, x: lagging(0.1, t, x)}), SIDE),
    Planted(
        ("control_rate_limit", "delta_a", ""), 0.3, Lateral(surfaces={"delta_a": lambda t, x: limited(0.3, t, x)}), SIDE
    ),
    Planted(("sensor_bias", "r", ""), 0.01, Lateral(sensors={"r": lambda _t, y: y + 0.01}), SIDE),
    Planted(("sensor_scale", "beta", ""), 1.1, Lateral(sensors={"beta": lambda _t, y: 1.1 * y}), SIDE),
    Planted(("sensor_lag", "beta", ""), 0.1, Lateral(sensors={"beta": lambda t, y: lagging(0.1, t, y)}), SIDE),
    Planted(("sensor_delay", "phi", ""), 0.1, Lateral(sensors={"phi": lambda t, y: late(0.1, t, y)}), SIDE),
    Planted(("sensor_position", "beta", ""), 4.5, Lateral(positions={"beta": (4.5, 0.0, -0.3)}), SIDE, slow=False),
    Planted(("sensor_position", "a_y", ""), 0.6, Lateral(positions={"a_y": (0.0, 0.0, 0.6)}), SIDE),
    Planted(
        ("step_change", "C_n", ""), 0.002, Lateral(extra={("C_n", "x_1"): 1.0}, inputs={"x_1": jump(0.002, 7.5)}), SIDE
    ),
    Planted(("cg_shift", "y", ""), 0.05, Lateral(inputs={"cg_y": np.full(TIME.size, 0.05)}), BOTH),
    Planted(
        ("aero_term", "C_l", "C_T"),
        0.02,
        Lateral(extra={("C_l", "C_T"): 0.02}, inputs={"thrust": level()[2] * (1.0 + 0.4 * np.sin(0.7 * TIME))},
                recorded_inputs=("thrust",)),
        BOTH,
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    "planted", [pytest.param(p, id=" ".join(p.name), marks=[pytest.mark.slow] if p.slow else []) for p in CATALOGUE]
)
def test_a_missing_effect_is_named_with_its_value(planted: Planted) -> None:
    result = closed(planted.flight, planted.declared)
    assert [(each.kind, each.where, each.term) for each in result.effects] == [planted.name]
    (effect,) = result.effects
    assert abs(effect.value - planted.value) < max(4.0 * effect.std_error, 0.02 * abs(planted.value))
    assert effect.std_error < 0.3 * abs(planted.value)
    assert result.verdict is Verdict.EXPLAINED


@pytest.mark.slow
@pytest.mark.parametrize("declared", [SIDE, BOTH], ids=["lateral", "six degrees of freedom"])
def test_lateral_turbulence_is_named_as_such(declared: Mapping[tuple[str, str], float]) -> None:
    generator, remembered = np.random.default_rng(5), np.exp(-SPEED * 0.04 / 150.0)
    air = [0.0]
    for shock in generator.standard_normal(TIME.size - 1):
        air.append(remembered * air[-1] + 0.8 * np.sqrt(1.0 - remembered**2) * shock)
    result = closed(Lateral(inputs={"side_gust": np.array(air)}), declared)
    assert [each.kind for each in result.effects] == ["side_gust"]
    assert result.verdict is Verdict.EXPLAINED
    assert result.effects[0].value == pytest.approx(0.8, rel=0.5)  # 9 scale lengths: 24 % is one standard deviation


@pytest.mark.slow
def test_a_product_of_inertia_is_an_alternative_to_the_commoner_name() -> None:
    """Aileron rolling moment coupled into yaw by I_xz is C_n delta_a except in fast rolls."""
    declared = {entry: value for entry, value in SIDE.items() if entry != ("C_n", "delta_a")}
    flight = Lateral(extra={("C_n", "delta_a"): 0.0}, inertia=(*INERTIA[:3], INERTIA[3] + 3000.0))
    result = closed(flight, declared)
    assert [(each.kind, each.where, each.term) for each in result.effects] == [("aero_term", "C_n", "delta_a")]
    others = {(each.kind, each.where): each.value for each in result.alternatives}
    assert others["inertia", "I_xz"] == pytest.approx(3000.0, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("declared", [SIDE, BOTH], ids=["lateral", "six degrees of freedom"])
def test_nothing_is_named_where_nothing_is_missing(declared: Mapping[tuple[str, str], float]) -> None:
    for seed in range(3):
        result = closed(Lateral(seed=seed, factor=0.85), declared, validated=True)
        assert not result.effects
        assert result.verdict is Verdict.NOTHING_MISSING
