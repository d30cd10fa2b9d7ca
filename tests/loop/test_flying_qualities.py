"""Levels of lateral modes: the tables of MIL-F-8785C, and levels within two deviations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lateral_problems import PITCH, SIDE, commuter

from aerosid.aircraft.declared_model import declared_model
from aerosid.flight_model.linear_model import FlightCondition
from aerosid.loop.flying_qualities.carried_deviations import TermCovariance
from aerosid.loop.flying_qualities.linear_analysis import analyse
from aerosid.loop.flying_qualities.mil_f_8785c import (
    CLASSES,
    Requirement,
    dutch_roll_level,
    roll_level,
    roll_spiral_level,
    spiral_level,
)

CONDITION = FlightCondition(72.0, 1.02, 4650.0, inputs={"alpha": 0.034})


@pytest.mark.parametrize(
    ("category", "aircraft_class", "numbers", "level"),
    [
        ("A", "I", (2.0, 0.19, 1.0), 1),  # table VI: damping 0.19, product 0.35, frequency 1.0
        ("A", "I", (2.0, 0.18, 1.0), 2),
        ("A", "IV", (0.9, 0.50, 1.0), 2),  # slower than 1 rad/s
        ("A", "II", (0.9, 0.50, 1.0), 1),
        ("A", "II", (1.0, 0.34, 1.0), 2),  # product 0.34
        ("B", "II", (2.0, 0.08, 1.0), 1),
        ("B", "II", (2.0, 0.07, 1.0), 2),
        ("B", "IV", (1.0, 0.14, 1.0), 2),  # product 0.14
        ("B", "I", (0.39, 0.90, 1.0), 4),
        ("C", "I", (1.5, 0.09, 1.0), 2),  # product 0.135
        ("C", "II", (1.5, 0.09, 1.0), 1),
        ("C", "II-C", (0.9, 0.50, 1.0), 2),
        ("C", "III", (0.5, 0.20, 1.0), 1),
        ("B", "II", (2.0, 0.02, 1.0), 3),  # product 0.04 where level 2 asks 0.05
        ("B", "II", (2.0, 0.0, 1.0), 3),
        ("B", "II", (2.0, -0.01, 1.0), 4),
        ("B", "II", (4.0, 0.08, 1.25), 1),  # frequency^2 |phi/beta| is 20: nothing is added
        ("B", "II", (4.0, 0.08, 2.5), 2),  # 40: 0.15 + 0.28 is asked, 0.05 + 0.18 of level 2
        ("B", "II", (4.0, 0.05, 2.5), 3),  # 0.20; level 3 asks 0.10
        ("B", "II", (4.0, 0.02, 2.5), 4),
        ("B", "II", (4.0, 0.70, 20.0), 2),  # 0.15 + 4.2 is asked: damping 1.09
        ("B", "III", (4.0, 0.70, 20.0), 1),  # of class III no more than 0.7
    ],
)
def test_dutch_roll_levels_are_those_of_table_vi(
    category: str, aircraft_class: str, numbers: tuple[float, float, float], level: int
) -> None:
    assert dutch_roll_level(*numbers, Requirement(category, aircraft_class)) == level


@pytest.mark.parametrize(
    ("category", "aircraft_class", "longest"),
    [
        ("A", "I", (1.0, 1.4, 10.0)),
        ("A", "IV", (1.0, 1.4, 10.0)),
        ("A", "II-C", (1.4, 3.0, 10.0)),
        ("A", "III", (1.4, 3.0, 10.0)),
        ("B", "I", (1.4, 3.0, 10.0)),
        ("C", "II-C", (1.0, 1.4, 10.0)),
        ("C", "II", (1.4, 3.0, 10.0)),
    ],
)
def test_roll_levels_are_those_of_table_vii(
    category: str, aircraft_class: str, longest: tuple[float, float, float]
) -> None:
    requirement = Requirement(category, aircraft_class)
    assert [roll_level(-1.0 / (0.99 * constant), requirement) for constant in longest] == [1, 2, 3]
    assert [roll_level(-1.0 / (1.01 * constant), requirement) for constant in longest] == [2, 3, 4]
    assert roll_level(0.1, requirement) == 4


@pytest.mark.parametrize(("category", "shortest"), [("A", (12.0, 8.0, 4.0)), ("B", (20.0, 8.0, 4.0))])
def test_spiral_levels_are_those_of_table_viii(category: str, shortest: tuple[float, float, float]) -> None:
    requirement = Requirement(category)
    assert [spiral_level(np.log(2.0) / (1.01 * time), requirement) for time in shortest] == [1, 2, 3]
    assert [spiral_level(np.log(2.0) / (0.99 * time), requirement) for time in shortest] == [2, 3, 4]
    assert spiral_level(-0.1, requirement) == 1


def test_coupled_roll_and_spiral() -> None:
    assert [roll_spiral_level(1.0, zeta, Requirement("B")) for zeta in (0.5, 0.3, 0.15, 0.14)] == [1, 2, 3, 4]
    assert roll_spiral_level(1.0, 0.9, Requirement("A")) == 4


@given(st.floats(0.1, 8.0), st.floats(-0.2, 1.2), st.floats(0.0, 8.0), st.sampled_from("ABC"), st.sampled_from(CLASSES))
def test_more_damping_is_never_worse_and_b_never_asks_more_than_a(
    frequency: float, damping: float, ratio: float, category: str, aircraft_class: str
) -> None:
    requirement = Requirement(category, aircraft_class)
    level = dutch_roll_level(frequency, damping, ratio, requirement)
    assert dutch_roll_level(frequency, damping + 0.05, ratio, requirement) <= level
    strict, mild = (dutch_roll_level(frequency, damping, ratio, Requirement(c, aircraft_class)) for c in "AB")
    assert mild <= strict


def test_every_mode_is_judged_and_its_span_follows_the_deviations() -> None:
    model = declared_model(commuter(PITCH | SIDE), 72.0)
    entries = tuple(entry for entry in model.entries if entry[0] in ("C_l", "C_n"))
    sizes = np.array([0.3 * abs(model.value(entry)) for entry in entries])
    vague = TermCovariance.independent(entries, sizes.tolist())
    row = analyse("completed", model, CONDITION, vague, Requirement("A", "I"))
    assert set(row.levels) == {"short_period", "phugoid", "dutch_roll", "roll", "spiral"}
    spans = {name: level.span for name, level in row.levels.items() if level.span is not None}
    assert set(spans) == {"dutch_roll", "roll", "spiral"}  # the short period does not depend on these
    assert spans["dutch_roll"][0] < spans["dutch_roll"][1]
    assert all(best <= row.levels[name].level <= worst for name, (best, worst) in spans.items())
    sharp = analyse(
        "completed", model, CONDITION, TermCovariance.independent(entries, (1e-6 * sizes).tolist()), Requirement()
    )
    assert all(level.span is None or level.span == (level.level,) * 2 for level in sharp.levels.values())


def test_deviations_of_lateral_modes_are_the_scatter_of_whole_analyses() -> None:
    model = declared_model(commuter(SIDE), 72.0)
    sizes = np.array([0.01 * abs(model.value(entry)) for entry in model.entries])
    spread = TermCovariance.independent(model.entries, sizes.tolist())
    row = analyse("completed", model, CONDITION, spread, Requirement())
    generator = np.random.default_rng(3)
    drawn = []
    nothing = TermCovariance((), np.zeros((0, 0)))
    for values in np.array(model.values) + sizes * generator.standard_normal((250, sizes.size)):
        modes = {
            m.name: m.numbers
            for m in analyse("drawn", model.with_values(values), CONDITION, nothing, Requirement()).modes
        }
        dutch_roll = modes["dutch_roll"]
        drawn.append(
            [
                dutch_roll["frequency"].value,
                dutch_roll["damping"].value,
                modes["roll"]["root"].value,
                modes["spiral"]["root"].value,
            ]
        )
    modes = {mode.name: mode.numbers for mode in row.modes}
    stated = [
        modes["dutch_roll"]["frequency"].std_error,
        modes["dutch_roll"]["damping"].std_error,
        modes["roll"]["root"].std_error,
        modes["spiral"]["root"].std_error,
    ]
    # A standard deviation from 250 draws is known to 4.5 %; four of those.
    np.testing.assert_allclose(np.std(drawn, axis=0, ddof=1), stated, rtol=0.18)


def test_steps_are_of_the_surface_and_its_own_motion() -> None:
    nothing = TermCovariance((), np.zeros((0, 0)))
    row = analyse("declared", declared_model(commuter(PITCH | SIDE), 72.0), CONDITION, nothing, Requirement())
    assert [(step.control, tuple(step.response)) for step in row.steps] == [
        ("delta_e", ("V", "alpha", "q", "theta")),
        ("delta_a", ("beta", "p", "r", "phi")),
        ("delta_r", ("beta", "p", "r", "phi")),
    ]
    aileron = row.steps[1].response
    # Right trailing edge down lifts the right wing; after the roll mode the rate is -C_l_delta_a/C_l_p times delta.
    assert aileron["p"][20] < 0.0
    assert row.trim.keys() == {"alpha", "delta_e", "thrust", "beta", "delta_a", "delta_r"}
