"""Channel maps: signs, offsets, delays, positions, precedence."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from aerosid.aircraft.bundled import bundled_folder
from aerosid.errors import ChannelMapError
from aerosid.logs.formats import FORMATS, read_log
from aerosid.logs.formats.channel_map import load_channel_map
from aerosid.nomenclature import CHANNELS

SHARED_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=40)
finite = st.floats(-1e3, 1e3).filter(lambda x: x == 0.0 or abs(x) > 1e-100)


def write_log(folder: Path, time: np.ndarray, *columns: np.ndarray, name: str = "log.txt") -> Path:
    path = folder / name
    np.savetxt(path, np.column_stack([time, *columns]), fmt="%.17g")
    return path


def write_map(folder: Path, channels: str, name: str = "channels.toml") -> Path:
    path = folder / name
    path.write_text(f'schema = 1\nformat = "ascii"\ntime = {{ column = 1, unit = "s" }}\n[channels]\n{channels}\n')
    return path


@SHARED_FOLDER
@given(st.sampled_from([1, -1]), finite.filter(lambda x: x != 0.0), finite, st.lists(finite, min_size=10, max_size=12))
def test_value_is_sign_scale_x_plus_offset(
    tmp_path: Path, sign: int, scale: float, offset: float, values: list[float]
) -> None:
    path = write_log(tmp_path, np.arange(len(values)), np.array(values))
    write_map(tmp_path, f'V = {{ column = 2, unit = "kt", sign = {sign}, scale = {scale!r}, offset = {offset!r} }}')
    log = read_log(path)
    expected = [(sign * scale * x + offset) * 1852 / 3600 for x in values]
    assert_allclose(log["V"], expected, rtol=1e-12, atol=1e-9)
    source = log.sources["V"]
    assert (source.unit, source.sign, source.scale, source.offset) == ("kt", sign, scale, offset)


def test_incremental_load_factor_becomes_specific_force(tmp_path: Path) -> None:
    path = write_log(tmp_path, np.arange(12), np.zeros(12))
    write_map(tmp_path, 'a_z = { column = 2, unit = "g", sign = -1, offset = -1.0, position = [1.2, 0.0, 0.4] }')
    log = read_log(path)
    assert_allclose(log["a_z"], -9.80665, rtol=1e-15)
    assert log.positions == {"a_z": (1.2, 0.0, 0.4)}


def test_columns_are_summed_and_missing_in_one_is_missing_in_the_sum(tmp_path: Path) -> None:
    left, right = np.arange(12.0), np.full(12, 100.0)
    right[3] = np.nan
    path = write_log(tmp_path, np.arange(12), left, right)
    write_map(tmp_path, 'thrust = { columns = [2, 3], unit = "kN" }')
    thrust = read_log(path)["thrust"]
    assert math.isnan(thrust[3])
    assert_allclose(np.delete(thrust, 3), np.delete(1e3 * (left + 100.0), 3))


@pytest.mark.parametrize("delay", [0.037, 0.1, 0.55, -0.12])
def test_a_late_recording_is_moved_earlier(tmp_path: Path, delay: float) -> None:
    """The recording of a straight line, delayed by `delay`, is restored on a non-uniform time base."""
    time = np.cumsum(np.random.default_rng(1).uniform(0.03, 0.09, 60))
    path = write_log(tmp_path, time, 3.0 * (time - delay) + 1.0)
    write_map(tmp_path, f'theta = {{ column = 2, unit = "rad", delay = {delay} }}')
    log = read_log(path)
    there = np.isfinite(log["theta"])
    assert_allclose(log["theta"][there], 3.0 * time[there] + 1.0, atol=1e-12)
    assert_array_equal(there, (time + delay <= time[-1]) & (time + delay >= time[0]))
    assert_array_equal(log.time, np.loadtxt(path)[:, 0])
    assert any(note.startswith(f"theta: moved {abs(delay):g} s") for note in log.notes)
    assert log.sources["theta"].delay == delay


def test_a_moved_recording_bridges_no_gap(tmp_path: Path) -> None:
    time = np.arange(30) * 0.1
    values = time.copy()
    values[10:20] = np.nan
    path = write_log(tmp_path, time, values)
    write_map(tmp_path, 'theta = { column = 2, unit = "rad", delay = 0.05 }')
    theta = read_log(path)["theta"]
    assert np.isnan(theta[9:20]).all()
    assert np.isfinite(theta[[8, 20]]).all()


def test_which_map_wins(tmp_path: Path) -> None:
    """--channels, then LOG.channels.toml, then channels.toml of the folder."""
    path = write_log(tmp_path, np.arange(12), np.arange(12), np.arange(12) * 2, np.arange(12) * 3)
    write_map(tmp_path, 'q = { column = 2, unit = "rad/s" }')
    assert read_log(path)["q"][1] == 1.0
    write_map(tmp_path, 'q = { column = 3, unit = "rad/s" }', "log.channels.toml")
    assert read_log(path)["q"][1] == 2.0
    other = tmp_path / "elsewhere"
    other.mkdir()
    given_map = write_map(other, 'q = { column = 4, unit = "rad/s" }', "any name.toml")
    assert read_log(path, given_map)["q"][1] == 3.0
    write_map(tmp_path, 'q = { column = 4, unit = "rad/s" }', "log.txt.channels.toml")
    assert read_log(path)["q"][1] == 3.0


def test_an_uninitialised_word_is_missing_whatever_is_added_to_it(tmp_path: Path) -> None:
    used = np.arange(12.0)
    used[:3] = 2.58e-304
    path = write_log(tmp_path, np.arange(12), used, np.arange(12.0))
    write_map(tmp_path, 'mass = { columns = [2, 3], unit = "kg", sign = -1, offset = 5000 }')
    log = read_log(path)
    assert_array_equal(np.flatnonzero(np.isnan(log["mass"])), [0, 1, 2])
    assert log["mass"][5] == 4990.0


def test_an_unknown_channel_keeps_its_unit_and_is_not_converted(tmp_path: Path) -> None:
    path = write_log(tmp_path, np.arange(12), np.arange(12))
    write_map(tmp_path, 'stick = { column = 2, unit = "deg" }')
    log = read_log(path)
    assert_array_equal(log["stick"], np.arange(12.0))
    assert log.units["stick"] == "deg"


def test_a_name_that_stands_twice_needs_a_number(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text("t a a\n" + "".join(f"{k} {k} {2 * k}\n" for k in range(12)))
    write_map(tmp_path, 'q = { column = "a", unit = "rad/s" }')
    with pytest.raises(ChannelMapError, match="columns 2 and 3"):
        read_log(path)
    write_map(tmp_path, 'q = { column = 3, unit = "rad/s" }')
    assert read_log(path)["q"][1] == 2.0


def test_the_log_and_the_map_are_never_edited(tmp_path: Path) -> None:
    path = write_log(tmp_path, np.arange(12), np.arange(12))
    channel_map = write_map(tmp_path, 'q = { column = 2, unit = "deg/s", delay = 1.0 }')
    before = path.read_bytes(), channel_map.read_bytes()
    read_log(path)
    assert (path.read_bytes(), channel_map.read_bytes()) == before
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    "path", sorted((bundled_folder("flight_data") / "channel_maps").glob("*.toml")), ids=lambda path: path.stem
)
def test_bundled_maps_name_glossary_channels_and_a_known_format(path: Path) -> None:
    channel_map = load_channel_map(path)
    assert channel_map.format in FORMATS
    assert set(channel_map.channels) - set(CHANNELS) <= {"elevator_tab"}
    assert {"V", "alpha", "q", "delta_e"} <= set(channel_map.channels)
    assert all(entry.unit for alternatives in channel_map.channels.values() for entry in alternatives)


def test_a_position_of_two_numbers_lacks_the_third(tmp_path: Path) -> None:
    path = write_map(tmp_path, 'alpha = { column = 2, unit = "rad", position = [1.2, 0.0] }')
    with pytest.raises(ChannelMapError, match=r"position' has 2 entries, but entry 3 is needed"):
        load_channel_map(path)
