"""A wrong product of inertia, which the flights show only by derivatives that miss their declared values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from lateral_flights import INERTIA, PITCH, SIDE, Lateral, aircraft

from aerosid.aircraft import Aircraft
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.search.declared_inertia import Estimates, InertiaChange, inertia_change
from aerosid.search.settings import DeclaredInertiaSettings

QUICK = LoopSettings(paper_chain=False, linear_analysis=False, next_flight=False)
USUAL = DeclaredInertiaSettings()
I_XX, I_ZZ, I_XZ = INERTIA[0], INERTIA[2], INERTIA[3]


def estimated(declared: Aircraft, change: float, error: float = 1e-4) -> Estimates:
    """Derivatives with which the declared I_xz has the accelerations of a greater one with the declared derivatives."""
    wrong = np.array([[I_XX, -I_XZ], [-I_XZ, I_ZZ]])
    right = np.array([[I_XX, -I_XZ - change], [-I_XZ - change, I_ZZ]])
    values = {(d.coefficient, d.term): d.value for d in declared.derivatives}
    found = {}
    for coefficient, term in values:
        moments = [values.get((name, term), 0.0) for name in ("C_l", "C_n")]
        seen = dict(zip(("C_l", "C_n"), wrong @ np.linalg.solve(right, moments), strict=True))
        found[coefficient, term] = float(seen.get(coefficient, values[coefficient, term])), error
    return found


@pytest.mark.parametrize("change", [4000.0, 9000.0, -6000.0])
def test_the_change_is_that_with_which_the_accelerations_are_the_same(change: float) -> None:
    declared = aircraft(SIDE)
    found = inertia_change(estimated(declared, change), declared, USUAL)
    assert isinstance(found, InertiaChange)
    assert found.change == pytest.approx(change, rel=1e-6)
    assert ("C_n", "p_hat") in [(coefficient, str(term)) for coefficient, term in found.explained]


def test_other_differences_from_declared_values_are_no_product_of_inertia() -> None:
    """A common factor, one wrong derivative, and derivatives as wrong as they are declared to be."""
    declared = aircraft(SIDE)
    exact = {(d.coefficient, d.term): (d.value, 1e-4) for d in declared.derivatives}
    assert inertia_change(exact, declared, USUAL) is None
    assert (
        inertia_change({entry: (2.5 * value, error) for entry, (value, error) in exact.items()}, declared, USUAL)
        is None
    )
    for name in SIDE:
        one = {e: (4.0 * v if (e[0], str(e[1])) == name else v, s) for e, (v, s) in exact.items()}
        assert inertia_change(one, declared, USUAL) is None
    generator = np.random.default_rng(11)
    for _ in range(300):
        off = {e: (v * (1.0 + 0.5 * generator.standard_normal()), s) for e, (v, s) in exact.items()}
        assert inertia_change(off, declared, USUAL) is None


def test_nothing_is_said_without_the_inertias_of_roll_and_yaw() -> None:
    declared = aircraft(SIDE)
    seen = estimated(declared, 9000.0)
    assert inertia_change(seen, replace(declared, I_xx=None), USUAL) is None
    assert inertia_change({}, declared, USUAL) is None


@pytest.mark.parametrize(
    "terms", [SIDE, pytest.param({**PITCH, **SIDE}, marks=pytest.mark.slow)], ids=["lateral", "six degrees of freedom"]
)
def test_a_wrong_product_of_inertia_is_listed_and_stated_in_the_summary(terms: dict[tuple[str, str], float]) -> None:
    flight = Lateral(seed=23, inertia=(*INERTIA[:3], I_XZ + 8000.0), factor=0.95)
    other = replace(flight, seed=123).log(mirrored=True, name="other")
    result = close_loop([flight.log()], aircraft(terms, flight.factor), [other], QUICK)
    assert not [effect for effect in result.effects if effect.kind != "inertia"]
    (listed,) = [each for each in (*result.effects, *result.alternatives) if each.kind == "inertia"]
    assert (listed.where, listed.unit) == ("I_xz", "kg m^2")
    assert listed.value == pytest.approx(8000.0, abs=max(4.0 * listed.std_error, 800.0))
    # In six axes the pitching moment I_xz (p^2 - r^2) shows it as well, and it is identified.
    assert listed in (result.effects if ("C_m", "alpha") in terms else result.alternatives)
    assert ("of I_xz (" if listed in result.effects else "with an I_xz of") in result.summary
    # The sign conventions of a derivative that I_xz explains are not questioned.
    assert "check the sign conventions" not in result.summary
    right = close_loop([Lateral(seed=23, factor=0.95).log()], aircraft(terms, 0.95), settings=QUICK)
    assert not [each for each in (*right.effects, *right.alternatives) if each.kind == "inertia"]
    assert "I_xz" not in right.summary
