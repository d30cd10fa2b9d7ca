"""Alternatives to a finding are listed once, and findings carry what distinguishes them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from aerosid.effects import ActiveEffect
from aerosid.effects.sensor_position import sensor_place
from aerosid.search.findings import Finding, Part, finding_among, unique_alternatives

SHIFT = Finding(
    kind="cg_shift",
    where="x",
    term="",
    entry=None,
    value=-0.13,
    std_error=0.01,
    unit="m",
    time=40.0,
    p_value=1e-9,
    gain=-3.0,
    instead_of="C_m delta_h",
)


def test_an_alternative_at_two_instants_is_listed_once_at_the_likelier() -> None:
    likelier = replace(SHIFT, time=55.0, gain=-1.0)
    jump = replace(SHIFT, kind="step_change", where="C_m")
    elsewhere = replace(SHIFT, instead_of="C_m C_T")
    assert unique_alternatives([SHIFT, jump, likelier, elsewhere]) == (likelier, jump, elsewhere)


@pytest.mark.parametrize("axes", ["z", "xz"])
def test_a_position_is_named_with_its_axes(axes: str) -> None:
    """The equations named them, the likelihood did not: `the sensor position of beta is in error`."""
    active = ActiveEffect(sensor_place("beta", axes), (-1.3, 0.4)[: len(axes)])
    found = finding_among(Part(None, active, -1.3, 0.0, 0.1, (0.1, 0.1)[: len(axes)]), tested=20, gain=160.0)
    assert found.along == axes
    assert [name for name, *_ in found.parameters] == list(axes)
