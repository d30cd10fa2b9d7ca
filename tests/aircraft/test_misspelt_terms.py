"""Terms that all but name a known variable are refused with the nearest one; channels of one's own are not."""

from __future__ import annotations

import pytest

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError


def with_term(term: str) -> str:
    text = load_aircraft("light_transport").text
    return text.replace('"q_hat" = { value = -16.3', f'"{term}" = {{ value = -16.3')


@pytest.mark.parametrize(
    ("term", "nearest"),
    [
        ("qhat", "q_hat"),
        ("Alpha^2", "alpha"),
        ("deltae", "delta_e"),
        ("alfa", "alpha"),
        ("Vhat", "V_hat"),
        ("alpha*q_Hat", "q_hat"),
        ("abs(bet)", "beta"),
    ],
)
def test_a_misspelt_name_is_refused_with_the_nearest(term: str, nearest: str) -> None:
    with pytest.raises(AircraftError) as caught:
        aircraft_from_text(with_term(term), "file.toml", "")
    assert f"did you mean {nearest}?" in str(caught.value)
    assert "derivatives.C_m" in str(caught.value)


@pytest.mark.parametrize("term", ["alpha2", "delta_e_tab", "gear", "spoiler_left", "alpha*flap_lever"])
def test_channels_of_ones_own_may_stand_in_terms(term: str) -> None:
    assert aircraft_from_text(with_term(term), "file.toml", "").name == "Light transport"


@pytest.mark.parametrize(("written", "nearest"), [("C_M", "C_m"), ("C_x", "C_X"), ("c_z", "C_Z")])
def test_a_coefficient_that_differs_in_capitals_alone_is_the_nearest(written: str, nearest: str) -> None:
    text = load_aircraft("light_transport").text.replace(f"[derivatives.{nearest}]", f"[derivatives.{written}]")
    with pytest.raises(AircraftError, match=rf"did you mean {nearest}\?"):
        aircraft_from_text(text, "file.toml", "")
