"""Proposed channel maps: names, and units and signs from physical relations, on a simulated pitching motion."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import recorder_files as files
from recordings import recording

from aerosid.cli.main import main
from aerosid.errors import LogError
from aerosid.logs.channel_listing import list_channels, sparkline
from aerosid.logs.formats import read_log, read_recording, ready_maps
from aerosid.logs.formats.channel_map import load_channel_map
from aerosid.logs.map_proposal import Proposal, propose_map
from aerosid.nomenclature import CHANNELS

DEG, FT, KT = 180.0 / np.pi, 1.0 / 0.3048, 3600.0 / 1852.0


def motion() -> dict[str, np.ndarray]:
    """A short period driven by an elevator, its climb integrated: theta' = q, h' = V sin(theta - alpha)."""
    step = 0.02
    time = step * np.arange(1500)
    elevator = 0.05 * np.sign(np.sin(2 * np.pi * 0.25 * time)) * (time > 2)
    alpha, q, theta, h = (np.zeros(time.size) for _ in range(4))
    for k in range(time.size - 1):
        lift = 1.5 * alpha[k]
        alpha[k + 1] = alpha[k] + step * (q[k] - lift)
        q[k + 1] = q[k] + step * (-6.0 * alpha[k] - 2.5 * q[k] - 8.0 * elevator[k])
        theta[k + 1] = theta[k] + step * q[k]
        h[k + 1] = h[k] + step * 60.0 * np.sin(theta[k] - alpha[k])
    a_z = -9.80665 - 60.0 * 1.5 * alpha
    return {"t": time, "V": np.full(time.size, 60.0), "alpha": alpha, "theta": theta, "q": q, "h": 500 + h, "a_z": a_z,
            "delta_e": elevator}  # fmt: skip


def table(folder: Path, columns: dict[str, np.ndarray]) -> Path:
    path = folder / "flight.txt"
    np.savetxt(path, np.column_stack(list(columns.values())), header=" ".join(columns), comments="", fmt="%.10g")
    return path


def proposed(path: Path) -> Proposal:
    return propose_map(read_recording(path, "ascii"), str(path))


@pytest.mark.parametrize(("angle", "rate"), [("rad", "rad/s"), ("deg", "deg/s"), ("deg", "rad/s"), ("rad", "deg/s")])
def test_theta_dot_against_q_tells_which_is_in_degrees(tmp_path: Path, angle: str, rate: str) -> None:
    flown = motion()
    scale = {"rad": 1.0, "rad/s": 1.0, "deg": DEG, "deg/s": DEG}
    path = table(tmp_path, {"time": flown["t"], "pitch": flown["theta"] * scale[angle], "q": flown["q"] * scale[rate]})
    found = proposed(path).channels
    assert (found["theta"].unit, found["q"].unit) == (angle, rate)
    assert any("theta' =" in reason for reason in found["q"].reasons)


def test_a_turned_rate_is_asked_for(tmp_path: Path) -> None:
    flown = motion()
    path = table(tmp_path, {"time": flown["t"], "theta_rad": flown["theta"], "q_rad_s": -flown["q"]})
    found = proposed(path).channels["q"]
    assert (found.sign, found.asked) == (-1, True)
    assert "# confirm: q = " in proposed(path).text


@pytest.mark.parametrize(
    ("recorded", "unit", "sign", "offset", "asked"),
    [
        (lambda a: a, "m/s^2", 1, 0.0, False),
        (lambda a: -a, "m/s^2", -1, 0.0, False),
        (lambda a: a / 9.80665, "g", 1, 0.0, True),
        (lambda a: -a / 9.80665, "g", -1, 0.0, True),
        (lambda a: -a / 9.80665 - 1.0, "g", -1, -1.0, True),
    ],
)
def test_the_mean_in_level_flight_tells_the_convention(
    tmp_path: Path, recorded: object, unit: str, sign: int, offset: float, asked: bool
) -> None:
    flown = motion()
    path = table(tmp_path, {"time": flown["t"], "nz": recorded(flown["a_z"])})  # type: ignore[operator]
    found = proposed(path).channels["a_z"]
    assert (found.unit, found.sign, found.offset, found.asked) == (unit, sign, offset, asked)


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("ft", FT)])
def test_altitude_rate_against_the_climb_tells_feet(tmp_path: Path, unit: str, factor: float) -> None:
    flown = motion()
    columns = {"time": flown["t"], "tas_kt": flown["V"] * KT, "theta_deg": flown["theta"] * DEG,
               "alpha_deg": flown["alpha"] * DEG, "altitude": flown["h"] * factor}  # fmt: skip
    found = proposed(table(tmp_path, columns)).channels["h"]
    assert found.unit == unit
    assert any("V sin(gamma)" in reason for reason in found.reasons)


@pytest.mark.parametrize(("sign", "expected"), [(1.0, 1), (-1.0, -1)])
def test_the_answer_to_the_elevator_tells_its_sign(tmp_path: Path, sign: float, expected: int) -> None:
    flown = motion()
    columns = {"time": flown["t"], "q_rad_s": flown["q"], "elevator_rad": sign * flown["delta_e"]}
    found = proposed(table(tmp_path, columns)).channels["delta_e"]
    assert (found.sign, found.asked) == (expected, expected == -1)


def test_the_proposed_map_is_written_read_and_used_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flown = motion()
    columns = {"time_s": flown["t"], "tas_kt": flown["V"] * KT, "theta_deg": flown["theta"] * DEG,
               "q_degps": flown["q"] * DEG, "elevator_deg": flown["delta_e"] * DEG}  # fmt: skip
    path = table(tmp_path, columns)
    assert main(["channels", str(path), "--out", str(tmp_path / "channels.toml")]) == 0
    assert "Proposed channel map" in capsys.readouterr().out
    log = read_log(path)
    for name, expected in (
        ("V", flown["V"]),
        ("theta", flown["theta"]),
        ("q", flown["q"]),
        ("delta_e", flown["delta_e"]),
    ):
        np.testing.assert_allclose(log[name], expected, atol=1e-8)


def test_json_lists_every_channel(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.arange(0.0, 10.0, 0.02)
    rows = [(round(1e6 * t), float(np.sin(t))) for t in time if not 4.0 < t < 5.0]
    path = tmp_path / "log.ulg"
    path.write_bytes(files.ulog([("gyro", 0, "uint64_t timestamp;float x;", rows)]))
    assert main(["channels", str(path), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    (stream,), (channel,) = printed["streams"], printed["channels"]
    assert (stream["samples"], stream["first"], stream["last"]) == (451, 0.0, 9.98)
    assert stream["rate"] == pytest.approx(50.0)
    assert stream["holes"] == [[4.0, pytest.approx(1.0)]]
    assert channel["name"] == "gyro[0].x"
    assert channel["minimum"] == pytest.approx(min(value for _, value in rows), rel=1e-6)
    assert len(channel["sparkline"]) == 24
    assert tomllib.loads(printed["map"])["schema"] == 1


def test_a_sparkline_is_its_course() -> None:
    assert sparkline(np.arange(8.0), 8) == "▁▂▃▄▅▆▇█"
    assert sparkline(np.array([0.0, np.nan, 1.0]), 3) == "▁ █"
    assert sparkline(np.full(5, 2.0), 5) == "▁▁▁▁▁"


@pytest.mark.parametrize("path", ready_maps().values(), ids=lambda path: path.stem)
def test_ready_maps_are_maps_of_the_glossary(path: Path) -> None:
    mapping = load_channel_map(path)
    own = {f"quaternion_{axis}" for axis in "wxyz"} | {"cas", "temperature"}
    assert set(mapping.channels) | set(mapping.derived) <= set(CHANNELS) | own
    assert all(entry.unit for alternatives in mapping.channels.values() for entry in alternatives)
    assert mapping.optional


@pytest.mark.parametrize(
    ("name", "channel_map"),
    [("citation/seg_ref_20180312_shortperiod.csv", "citation"), ("twin_otter/totter_demo_018.csv", "twin_otter")],
)
def test_proposals_for_recordings_agree_with_the_maps_that_people_wrote(name: str, channel_map: str) -> None:
    from aerosid.aircraft.bundled import bundled_folder

    path = recording(name)
    written = load_channel_map(bundled_folder("flight_data") / "channel_maps" / f"{channel_map}.toml").channels
    found = propose_map(read_recording(path), str(path)).channels
    for channel in ("alpha", "theta", "phi", "q", "V", "a_x", "a_z", "delta_e"):
        (by_hand,) = written[channel]
        same = found[channel]
        assert (same.column, same.unit) == (by_hand.column, by_hand.unit)
        assert (same.sign, same.offset) == (by_hand.sign, by_hand.offset)


def test_listing_leaves_damage_out_of_the_range(tmp_path: Path) -> None:
    rows = [(20_000 * k, 1e38 if k == 7 else float(k)) for k in range(1, 30)]
    path = tmp_path / "log.ulg"
    path.write_bytes(files.ulog([("gyro", 0, "uint64_t timestamp;float x;", rows)]))
    (channel,) = list_channels(read_recording(path)).channels
    assert channel.maximum == pytest.approx(1e38, rel=1e-6)


def test_a_table_of_a_known_recorder_is_refused_with_the_map_that_fits(tmp_path: Path) -> None:
    """JSBSim's own output: its brackets differ from aerosid's, so it is not a native log, and its map is bundled."""
    header = "Time,V_{Total} (ft/s),Alpha (deg),Q (deg/s),Theta (deg),Elevator Position (deg)"
    rows = "".join(f"{0.02 * k},{200 + k},{0.1 * k},{0.2 * k},{0.3 * k},{0.4 * k}\n" for k in range(30))
    path = tmp_path / "JSBout.csv"
    path.write_text(f"{header}\n{rows}", encoding="utf-8")
    with pytest.raises(LogError, match=r"Its columns are those of a map that comes with aerosid: --channels jsbsim\.$"):
        read_log(path)
    log = read_log(path, "jsbsim")
    assert log["delta_e"][-1] == pytest.approx(np.radians(0.4 * 29))
    assert 'format = "text"' in propose_map(read_recording(path), str(path)).text
