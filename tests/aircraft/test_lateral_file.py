"""Aircraft files with lateral coefficients: what they say, what they may not leave out."""

from __future__ import annotations

import pytest

from aerosid.aircraft.declared_model import declared_model
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.errors import AircraftError
from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, SIX, Axes

HEAD = """
schema = 1
[aircraft]
name = "commuter"
[reference]
wing_area = 39.0
mean_chord = 1.98
span = 19.8
[mass]
mass = 4650.0
I_xx = 27500.0
I_yy = 32600.0
I_zz = 51000.0
I_xz = 1600.0
"""
SIDE = """
[derivatives.C_Y]
"beta" = { value = -0.9 }
[derivatives.C_l]
"p_hat" = { value = -0.55 }
"delta_a" = { value = -0.23, sigma = 0.02 }
[derivatives.C_n]
"r_hat" = { value = -0.2 }
"delta_r" = { value = -0.15 }
"""
PITCH = """
[derivatives.C_X]
[derivatives.C_Z]
"alpha" = { value = -5.5 }
[derivatives.C_m]
"delta_e" = { value = -1.9 }
"""
LIFT = PITCH.replace("C_X]", 'C_D]\n"1" = { value = 0.03 }').replace("C_Z", "C_L")


@pytest.mark.parametrize(
    ("text", "axes", "coefficients"),
    [
        (SIDE, LATERAL, ("C_Y", "C_l", "C_n")),
        (PITCH + SIDE, SIX, ("C_X", "C_Z", "C_m", "C_Y", "C_l", "C_n")),
        (LIFT + SIDE, SIX, ("C_D", "C_L", "C_m", "C_Y", "C_l", "C_n")),
        (PITCH, LONGITUDINAL, ("C_X", "C_Z", "C_m")),
    ],
)
def test_the_coefficients_say_which_motion_is_integrated(text: str, axes: Axes, coefficients: tuple[str, ...]) -> None:
    aircraft = aircraft_from_text(HEAD + text, "commuter.toml", "0" * 64)
    assert aircraft.axes is axes
    assert aircraft.coefficients == coefficients
    model = declared_model(aircraft, 75.0)
    assert model.axes is axes
    assert model.columns[4 : 4 + len(axes.measured)] == axes.measured
    assert (model.constants.span, model.constants.I_xx, model.constants.I_zz) == (19.8, 27500.0, 51000.0)
    assert model.constants.I_xz == 1600.0
    assert [coefficient for coefficient, _ in model.entries] == [d.coefficient for d in aircraft.derivatives]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD.replace("span = 19.8\n", "") + SIDE, ["reference.span [m]", "missing"]),
        (HEAD.replace("I_xx = 27500.0\n", "") + SIDE, ["mass.I_xx [kg m^2]", "missing"]),
        (HEAD.replace("I_zz = 51000.0\n", "") + PITCH + SIDE, ["mass.I_zz [kg m^2]", "missing"]),
        (HEAD.replace("I_xz = 1600.0", "I_xz = 40000.0") + SIDE, ["mass.I_xz is 40000", "I_xz^2 below I_xx I_zz"]),
        (HEAD + SIDE.replace("[derivatives.C_Y]", "[derivatives.C_X]"), ["derivatives.C_Z", "missing"]),
    ],
)
def test_what_rolling_and_yawing_needs_may_not_be_left_out(text: str, words: list[str]) -> None:
    with pytest.raises(AircraftError) as caught:
        aircraft_from_text(text, "commuter.toml", "0" * 64)
    for word in ("commuter.toml", *words):
        assert word in str(caught.value)
