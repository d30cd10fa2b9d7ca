"""Derived channels against published tables and against the motion they are derived from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from aerosid.errors import ChannelMapError
from aerosid.logs import derived_channels as laws
from aerosid.logs import standard_atmosphere as atmosphere
from aerosid.logs.formats import read_log

# U.S. Standard Atmosphere 1976, table I, and ISO 2533: altitude m, temperature K, pressure Pa, density kg/m^3.
ATMOSPHERE = [
    (0.0, 288.150, 101325.0, 1.22500),
    (2000.0, 275.150, 79495.0, 1.00649),
    (5000.0, 255.650, 54020.0, 0.736116),
    (11000.0, 216.650, 22632.0, 0.363918),
    (15000.0, 216.650, 12044.6, 0.193674),
]


@pytest.mark.parametrize(("altitude", "temperature", "pressure", "density"), ATMOSPHERE)
def test_the_standard_atmosphere(altitude: float, temperature: float, pressure: float, density: float) -> None:
    assert atmosphere.pressure(np.array(altitude)) == pytest.approx(pressure, rel=2e-5)
    assert atmosphere.density(np.array(altitude), np.array(temperature)) == pytest.approx(density, rel=2e-5)


@pytest.mark.parametrize("row", ATMOSPHERE)
@pytest.mark.parametrize("calibrated", [30.0, 130.0, 180.0])
def test_true_airspeed_has_the_impact_pressure_of_calibrated(row: tuple[float, ...], calibrated: float) -> None:
    """The Mach number by bisection on Saint-Venant's law with the printed table's pressure."""
    altitude, temperature, pressure, _ = row
    sound = np.sqrt(1.4 * 287.05287 * temperature)

    def impact(static: float, mach: float) -> float:
        return static * ((1.0 + 0.2 * mach**2) ** 3.5 - 1.0)

    wanted = impact(101325.0, calibrated / 340.294)
    mach = brentq(lambda m: impact(pressure, m) - wanted, 1e-6, 2.0)
    found = atmosphere.true_airspeed(np.array(calibrated), np.array(altitude), np.array(temperature))
    assert found == pytest.approx(mach * sound, rel=3e-5)


def test_true_airspeed_at_low_speed_is_the_root_of_the_density_ratio() -> None:
    altitude, temperature = np.array(3000.0), np.array(280.0)
    ratio = np.sqrt(1.225 / atmosphere.density(altitude, temperature))
    assert atmosphere.true_airspeed(np.array(20.0), altitude, temperature) == pytest.approx(20.0 * ratio, rel=1e-3)


angles = st.floats(-1.2, 1.2)


@settings(deadline=None)
@given(angles, angles, st.floats(-3.0, 3.0))
def test_angles_of_a_quaternion_are_scipys(phi: float, theta: float, psi: float) -> None:
    x, y, z, w = Rotation.from_euler("ZYX", [psi, theta, phi]).as_quat()
    parts = [np.array([part]) for part in (w, x, y, z)]
    assert laws.pitch_of_quaternion(*parts)[0] == pytest.approx(theta, abs=1e-9)
    assert laws.bank_of_quaternion(*parts)[0] == pytest.approx(phi, abs=1e-9)
    assert laws.heading_of_quaternion(*parts)[0] == pytest.approx(psi, abs=1e-9)


@settings(deadline=None)
@given(st.floats(-0.2, 0.4), st.floats(-0.3, 0.3), st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_a_vane_moved_to_the_centre_of_gravity(alpha: float, beta: float, p: float, q: float, r: float) -> None:
    """The air's velocity at the vane is that at the centre of gravity plus omega cross the vane's position."""
    at = np.array([4.0, 0.7, -0.5])
    velocity = 80.0 * np.array([np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)])
    u, v, w = velocity + np.cross([p, q, r], at)
    vane, speed = np.arctan2(w, u), np.hypot(u, w)
    found = laws.alpha_at_centre_of_gravity(np.array([vane]), np.array([speed]), np.array([p]), np.array([q]), *at)
    # The neglected term is the yaw rate's part of u at the vane, r y over V.
    assert found[0] == pytest.approx(alpha, abs=1.1 * abs(r * at[1] / 80.0) * (abs(alpha) + 0.1) + 1e-9)
    side = laws.beta_at_centre_of_gravity(
        np.array([np.arcsin(v / 80.0)]), np.array([80.0]), np.array([p]), np.array([r]), at[0], at[2]
    )
    assert side[0] == pytest.approx(beta, abs=1e-9)


MAP = """schema = 1
format = "ascii"
time = {{ column = 1, unit = "s" }}
[channels]
h = {{ column = 2, unit = "ft" }}
temperature = {{ column = 3, unit = "{unit}" }}
[derived]
rho = {{ law = "density"{more} }}
"""


def write(folder: Path, text: str) -> Path:
    (folder / "channels.toml").write_text(text)
    path = folder / "log.txt"
    np.savetxt(path, np.column_stack([np.arange(12.0), np.full(12, 5000.0 / 0.3048), np.full(12, -17.5)]), fmt="%.12g")
    return path


def test_a_map_derives_density_from_pressure_altitude_and_temperature(tmp_path: Path) -> None:
    log = read_log(write(tmp_path, MAP.format(unit="degC", more="")))
    assert_allclose(log["rho"], 0.736116, rtol=2e-5)
    assert log.units["rho"] == "kg/m^3"
    assert log.sources["rho"].columns == ("h", "temperature")
    assert any(note.startswith("rho: computed from h, temperature (density)") for note in log.notes)


@pytest.mark.parametrize(
    ("more", "unit", "words"),
    [
        (', from = ["h", "oat"]', "degC", "[derived] rho needs 'oat', but"),
        (', from = ["h"]', "degC", "`from` names 2 channels: h, temperature"),
        ("", "kg", "[derived] rho: temperature has the unit 'kg'"),
    ],
)
def test_a_wrong_derivation_is_one_sentence(tmp_path: Path, more: str, unit: str, words: str) -> None:
    with pytest.raises(ChannelMapError) as error:
        read_log(write(tmp_path, MAP.format(unit=unit, more=more)))
    assert words in str(error.value)
    assert str(error.value).endswith(".")


def test_a_law_that_is_not_known_lists_those_that_are(tmp_path: Path) -> None:
    text = MAP.format(unit="degC", more="").replace('"density"', '"gravity"')
    with pytest.raises(ChannelMapError, match=r"key 'derived\.rho' is wrong: `law` is one of density, true airspeed"):
        read_log(write(tmp_path, text))
