"""Each effect that rolling and yawing motion shows, planted in a flight of independent equations: the loop names it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest
from lateral_flights import PITCH, SIDE, Lateral, aircraft

from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict

QUICK = LoopSettings(paper_chain=False, linear_analysis=False, next_flight=False)
BOTH = {**PITCH, **SIDE}


Named = dict[tuple[str, str, str], float]


def named(flight: Lateral, declared: Mapping[tuple[str, str], float]) -> tuple[Named, Verdict]:
    """The value of each effect that is named, by kind, place and term, and the verdict."""
    other = replace(flight, seed=flight.seed + 100).log(mirrored=True, name="other")
    result = close_loop([flight.log()], aircraft(declared, flight.factor), [other], QUICK)
    return {(each.kind, each.where, each.term): each.value for each in result.effects}, result.verdict


def test_a_term_that_stiffens_the_weathercock_is_named_with_its_number() -> None:
    found, verdict = named(Lateral(extra={("C_n", "beta^3"): 1.2}, factor=0.9), SIDE)
    assert set(found) == {("aero_term", "C_n", "beta^3")}
    assert found["aero_term", "C_n", "beta^3"] == pytest.approx(1.2, rel=0.1)
    assert verdict is Verdict.EXPLAINED


@pytest.mark.slow
@pytest.mark.parametrize("declared", [SIDE, BOTH], ids=["lateral", "six degrees of freedom"])
def test_nothing_is_named_where_nothing_is_missing(declared: Mapping[tuple[str, str], float]) -> None:
    for seed in range(3):
        found, verdict = named(Lateral(seed=seed, factor=0.85), declared)
        assert not found
        assert verdict is Verdict.NOTHING_MISSING
