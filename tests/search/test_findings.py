"""Alternatives to a finding are listed once."""

from __future__ import annotations

from dataclasses import replace

from aerosid.search.findings import Finding, unique_alternatives

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
