"""A term that the validation flight alone determines is no finding of the identification flights."""

from __future__ import annotations

from dataclasses import replace

from problems import Problem

from aerosid.loop.closed_loop import close_loop
from aerosid.loop.settings import LoopSettings


def test_what_only_the_validation_flight_reaches_is_not_reported_as_estimated() -> None:
    """A kink of the moment at an angle of attack that the identification flight does not reach: it was 0 +- 0."""
    gentle = Problem(undeclared={("C_m", "pos(alpha-0.16)"): -1.2}, elevator="3211", amplitude=0.02, duration=24.0)
    steep = replace(gentle, amplitude=-0.1)
    logs = [gentle.fly(61, "gentle"), steep.fly(62, "steep")]
    assert float(logs[0]["alpha"].max()) < 0.14
    assert float(logs[1]["alpha"].max()) > 0.19
    settings = LoopSettings(method="equations", paper_chain=False, next_flight=False, linear_analysis=False)
    result = close_loop(logs[:1], gentle.aircraft, logs[1:], settings)
    assert all(effect.std_error > 0.0 for effect in result.effects)
    assert not any("pos(" in effect.term for effect in result.effects)
    assert any("Near-significant: C_m pos(alpha" in note for note in result.notes)
