"""From the recorder's file to the report: one flight of JSBSim in every format that can represent a manoeuvre."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import recorder_files as files
import recorder_flights as recorded

import aerosid
from aerosid.cli.main import main
from aerosid.logs.flight_log import FlightLog

UNDECLARED = -1.7  # C_m alpha^2
INPUTS = [("doublet", 6.0, 1.0, (1, 1)), ("3211", 26.0, 0.6, (3, 2, 1, 1))]  # kind, start s, unit s, pattern


def _elevator(folder: Path) -> Path:
    """The inputs with ramps of a tenth of a second, as a log to fly."""
    time = np.arange(0.0, 44.0, 0.004)
    angle = np.zeros(time.size)
    for _, start, unit, pattern in INPUTS:
        edges = start + unit * np.cumsum([0, *pattern])
        for sign, begin, end in zip((1, -1, 1, -1), edges[:-1], edges[1:], strict=False):
            angle[(time >= begin) & (time < end)] = 0.03 * sign
    smooth = np.hanning(27)
    angle = np.convolve(angle, smooth / smooth.sum(), mode="same")
    path = folder / "input.csv"
    rows = "".join(f"{t:.3f},{a:.7f}\n" for t, a in zip(time, angle, strict=True))
    path.write_text(f"time [s],delta_e [rad]\n{rows}")
    return path


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The native log; the declared aircraft is in the same folder and lacks C_m alpha^2."""
    folder = tmp_path_factory.mktemp("flown")
    words = ["fly", "light_transport", "--input", str(_elevator(folder)), "--interval", "0.004", "--seed", "3"]
    effect = f"aero_term:C_m:alpha^2={UNDECLARED}"
    assert main([*words, "--effect", effect, "--out", str(folder / "flight.csv")]) == 0
    return folder / "flight.csv"


def shows_the_inputs(found: Sequence[Any], zero: float, tolerance: float) -> bool:
    """Whether exactly the flown manoeuvres were found, each at its start."""
    dynamic = [entry for entry in found if not entry.is_condition]
    same = [entry.kind for entry in dynamic] == [kind for kind, *_ in INPUTS]
    return same and all(
        abs(entry.start - zero - start) < tolerance for entry, (_, start, *_) in zip(dynamic, INPUTS, strict=True)
    )


def test_a_px4_log_by_a_map_that_a_person_corrected(
    flown: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, kept = recorded.ulog(aerosid.read_log(flown), tmp_path / "flight.ulg"), tmp_path / "px4.toml"
    assert main(["channels", str(log), "--out", str(kept)]) == 0
    proposed = kept.read_text()
    unconfirmed = '# confirm: alpha = { column = "sensor_vane[0].alpha" }  # by its name'
    command = '{ column = "vehicle_torque_setpoint.xyz[1]", unit = "1", sign = -1'
    assert unconfirmed in proposed
    corrected = proposed.replace(unconfirmed, 'alpha = { column = "sensor_vane[0].alpha", unit = "deg" }')
    corrected = corrected.replace(command, command.replace('"1"', '"deg", scale = 25'))
    kept.write_text(corrected.replace("schema = 1\n", "schema = 1\nraster = 25\n"))

    capsys.readouterr()
    assert main(["find", str(log), "--channels", str(kept), "--json"]) == 0
    listing = json.loads(capsys.readouterr().out)["manoeuvres"]
    dynamic = [entry for entry in listing if entry["kind"] != "trim"]
    assert [entry["kind"] for entry in dynamic] == ["doublet", "3211"]
    for entry, (_, start, *_) in zip(dynamic, INPUTS, strict=True):
        assert entry["start"] == pytest.approx(recorded.BOOT + start, abs=0.15)
        assert entry["expected"]

    out = tmp_path / "report"
    words = ["close-loop", str(log), "--channels", str(kept), "--find", "--aircraft"]
    assert main([*words, str(flown.parent / "flight.aircraft.toml"), "--out", str(out)]) == 0
    result = json.loads((out / "result.json").read_text())
    effect = result["effects"][0]
    assert (effect["where"], effect["term"]) == ("C_m", "alpha^2")
    assert abs(effect["value"] - UNDECLARED) < 3.0 * effect["std_error"] < 0.15
    notes = " ".join(result["notes"])
    page = (out / "report.html").read_text()
    for words_of_the_clocks in (
        "raster: 25 Hz, as set in the map",
        "low-passed above 7.5 Hz and resampled from 249.7 to 25 Hz",
        "Hz: kept at the instants nearest its own samples, missing between",
        "h: interpolated between its own samples, of the same rate",
        "timestamp is later by 0.4 ms",
    ):
        assert words_of_the_clocks in notes
        assert words_of_the_clocks in page


def test_the_slowest_motion_channel_is_named_with_what_keeps_the_rest(flown: Path, tmp_path: Path) -> None:
    log = aerosid.read_log(recorded.ulog(aerosid.read_log(flown), tmp_path / "flight.ulg"))
    assert any("raster: 10" in note and "the stamps of V" in note for note in log.notes)
    assert any("V alone is this slow: `raster = 50`" in note for note in log.notes), log.notes


PLAIN = {name: name for name in recorded.TABLE}
UNITS = dict(zip(recorded.TABLE, ("m/s", "rad", "rad/s", "rad", "m/s^2", "m/s^2", "m", "rad"), strict=True))
IN_A_TABLE = {
    "schema": 1,
    "time": {"column": "t_ns", "unit": "ns"},
    "channels": {name: {"column": name, "unit": unit} for name, unit in UNITS.items()},
}
STREAMS = {"schema": 1, "channels": IN_A_TABLE["channels"]}
PX4 = {
    "V": {"column": "airspeed_validated.true_airspeed_m_s", "unit": "m/s"},
    "q": {"column": "vehicle_angular_velocity.xyz[1]", "unit": "rad/s"},
    "a_z": {"column": "vehicle_acceleration.xyz[2]", "unit": "m/s^2"},
    "h": {"column": "vehicle_air_data.baro_alt_meter", "unit": "m"},
    "alpha": {"column": "sensor_vane.alpha", "unit": "deg"},
    "delta_e": {"column": "vehicle_torque_setpoint.xyz[1]", "unit": "deg", "scale": 25, "sign": -1},
}
LINK = {
    "V": {"column": "VFR_HUD.airspeed", "unit": "m/s"},
    "q": {"column": "ATTITUDE.pitchspeed", "unit": "rad/s"},
    "theta": {"column": "ATTITUDE.pitch", "unit": "rad"},
    "h": {"column": "VFR_HUD.alt", "unit": "m"},
    "delta_e": {"column": "SERVO_OUTPUT_RAW.servo2_raw", "unit": "deg", "scale": -0.05, "offset": 75.0},
}


@pytest.mark.parametrize(
    ("name", "write", "channels", "tolerance"),
    [
        ("flight.ulg", recorded.ulog, {"schema": 1, "raster": 50, "channels": PX4}, 0.15),
        ("flight.bin", recorded.dataflash, "ardupilot", 0.15),
        ("flight.tlog", recorded.tlog, LINK, 0.2),
        ("flight.parquet", recorded.arrow, IN_A_TABLE, 0.15),
        ("flight.feather", recorded.arrow, IN_A_TABLE, 0.15),
        ("flight.h5", recorded.hdf5, IN_A_TABLE, 0.15),
        ("flight.mat", recorded.hdf5, IN_A_TABLE, 0.15),
        ("flight.mf4", recorded.mdf4, STREAMS, 0.15),
        ("flight.tdms", recorded.tdms, STREAMS, 0.15),
    ],
)
def test_the_manoeuvres_are_found_whatever_the_recorder(
    flown: Path,
    tmp_path: Path,
    name: str,
    write: Callable[[FlightLog, Path], Path],
    channels: str | dict[str, Any],
    tolerance: float,
) -> None:
    path = write(aerosid.read_log(flown), tmp_path / name)
    log = aerosid.read_log(path, channels=channels)
    found = aerosid.find_manoeuvres(log)
    assert shows_the_inputs(found, recorded.BOOT, tolerance)
    scale = np.radians(recorded.TRAVEL) if channels == "ardupilot" else 1.0
    moved = next(entry for entry in found if entry.kind == "doublet").moved[0]
    assert moved.greatest * scale == pytest.approx(0.03, rel=0.08)


@pytest.mark.parametrize(
    ("name", "content", "channels", "lacks"),
    [
        (
            "glider.igc",
            files.igc("HFDTE150423", range(36_000, 36_100), range(600, 700), range(610, 710)),
            {"h": {"column": "pressure_alt", "unit": "m"}},
            ("V", "q"),
        ),
        (
            "discretes.ch10",
            files.irig106(range(0, 2_000_000_000, 20_000_000), [k % 2 for k in range(100)]),
            {"gear": {"column": "bits", "unit": "1", "held": True}},
            ("V", "q"),
        ),
    ],
)
def test_where_no_motion_is_recorded_that_is_said(
    tmp_path: Path, name: str, content: bytes, channels: dict[str, Any], lacks: tuple[str, ...]
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    found = aerosid.find_manoeuvres(aerosid.read_log(path, channels=channels))
    assert len(found) == 0
    assert found.lacking == lacks
