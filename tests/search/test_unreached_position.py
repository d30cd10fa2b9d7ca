"""Of a control that never reaches its recorded position, the derivative that the declared limit is taken from."""

from __future__ import annotations

from dataclasses import replace

from problems import LIGHT

from aerosid.aircraft import Derivative
from aerosid.flight_model.terms import parse_term
from aerosid.search.settings import UnreachedPositionSettings
from aerosid.search.unreached_position import derivative_of_moment

SETTINGS = UnreachedPositionSettings()
RUDDER = parse_term("delta_r")


def chosen(*derivatives: Derivative) -> str | None:
    """The coefficient of the chosen derivative by the rudder."""
    found = derivative_of_moment(replace(LIGHT, derivatives=(*LIGHT.derivatives, *derivatives)), "delta_r", SETTINGS)
    return None if found is None else found.coefficient


def test_it_is_the_one_known_best_in_relation_to_its_size_whether_its_deviation_is_declared_or_usual() -> None:
    usual, doubted, known = (
        Derivative("C_l", RUDDER, 0.02),
        Derivative("C_n", RUDDER, -0.06, 0.12),
        Derivative("C_n", RUDDER, -0.06, 0.003),
    )
    assert chosen(usual, doubted) == "C_l"
    assert chosen(usual, known) == "C_n"


def test_a_derivative_declared_as_zero_tells_no_limit() -> None:
    assert chosen(Derivative("C_n", RUDDER, 0.0, 0.5)) is None
    assert chosen(Derivative("C_n", RUDDER, 0.0, 0.5), Derivative("C_l", RUDDER, 0.001)) == "C_l"
