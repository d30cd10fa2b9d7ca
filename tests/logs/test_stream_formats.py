"""Each format with several clocks on a file made by the test: stamps, units, values and names are restored."""

from __future__ import annotations

import contextlib
import datetime as dt
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import recorder_files as files
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from pyarrow import feather, parquet

from aerosid.errors import AerosidError, ChannelMapError, LogError
from aerosid.logs.channel_listing import list_channels
from aerosid.logs.formats import missing_library, read_log, read_recording, read_segments
from aerosid.logs.formats.missing_library import EXTRAS
from aerosid.logs.map_proposal import propose_map

N = 60
K = np.arange(N)


def write(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_ulog_and_the_pitch_of_its_quaternion(tmp_path: Path) -> None:
    """A sinusoidal pitch rate and the resulting quaternion, on one clock: theta' = q."""
    time = 5.0 + 0.02 * K
    theta = 0.1 * np.sin(2.0 * np.pi * 0.5 * (time - 5.0))
    rate = np.gradient(theta, time)
    stamps = (1e6 * time).astype(int)
    rows = [(s, 0.0, float(q), 0.0) for s, q in zip(stamps, rate, strict=True)]
    turned = [(s, float(np.cos(t / 2)), 0.0, float(np.sin(t / 2)), 0.0) for s, t in zip(stamps, theta, strict=True)]
    content = files.ulog(
        [
            ("sensor_combined", 0, "uint64_t timestamp;float g0;float g1;float g2;", rows),
            ("vehicle_attitude", 0, "uint64_t timestamp;float w;float x;float y;float z;", turned),
        ]
    )
    channels = {
        "schema": 1,
        "channels": {"q": {"column": "sensor_combined.g1", "unit": "rad/s"}}
        | {f"quaternion_{a}": {"column": f"vehicle_attitude.{a}", "unit": "1"} for a in "wxyz"},
        "derived": {"theta": {"law": "pitch of a quaternion"}},
    }
    log = read_log(write(tmp_path, "log.ulg", content), channels)
    assert_allclose(log.time, time, atol=1e-6)
    assert_allclose(log["theta"], theta, atol=1e-6)
    assert_allclose(log["q"], rate, atol=1e-6)


@pytest.mark.parametrize("form", ["parquet", "feather"])
def test_arrow(tmp_path: Path, form: str) -> None:
    zero = dt.datetime(2024, 5, 6, 7, 8, 9, tzinfo=dt.UTC)
    stamps = [zero + dt.timedelta(milliseconds=20 * int(k)) for k in K]
    values = [None if k == 7 else 100.0 + float(k) for k in K]
    fields = [
        pa.field("time", pa.timestamp("us", tz="UTC")),
        pa.field("tas", pa.float64(), metadata={"unit": "kt"}),
        pa.field("pilot", pa.string()),
    ]
    table = pa.table([stamps, values, ["A"] * N], schema=pa.schema(fields))
    path = tmp_path / f"log.{form}"
    parquet.write_table(table, path) if form == "parquet" else feather.write_feather(table, path)
    log = read_log(path, {"V": "tas"})
    assert_allclose(log.time, 0.02 * K, atol=1e-12)
    assert_array_equal(np.flatnonzero(np.isnan(log["V"])), [7])
    assert log["V"][8] == pytest.approx(108.0 * 1852 / 3600)
    assert any("2024-05-06 07:08:09" in note for note in log.notes)


@pytest.mark.parametrize("matlab", [False, True])
def test_hdf5_and_matlab_73(tmp_path: Path, matlab: bool) -> None:
    pytest.importorskip("h5py")
    zero = 1_457_458_829_000_000_000
    datasets = {
        "flight/t": (zero + 20_000_000 * K).astype(np.uint64),
        "flight/air": np.column_stack([100.0 + K, 0.01 * K]),
        "flight/note": np.array([[72], [105]], dtype=np.uint16),
    }
    path = files.hdf5(tmp_path / ("log.mat" if matlab else "log.h5"), datasets, matlab=matlab)
    channels = {
        "schema": 1,
        "time": {"column": "flight/t", "unit": "ns"},
        "channels": {
            "V": {"column": "flight/air[0]", "unit": "m/s"},
            "alpha": {"column": "flight/air[1]", "unit": "rad"},
        },
    }
    log = read_log(path, channels)
    # In float64 the stamps themselves have a resolution of 256 ns; their differences are exact only if taken first.
    assert_array_equal(np.round(1e9 * (log.time - log.time[0])), 20_000_000 * K)
    assert_array_equal(log["V"], 100.0 + K)
    assert_array_equal(log["alpha"], 0.01 * K)
    names = [name for stream in read_recording(path).streams for name in stream.columns]
    assert ("flight/note" in names) == (not matlab)


def test_mdf4_groups_keep_their_own_stamps(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    fast, slow = 0.013 + 0.001 * np.arange(1000), 0.113 + 0.1 * np.arange(10)
    path = files.mdf4(tmp_path / "log.mf4", [
        {"rate": (fast, np.sin(fast), "rad/s")}, {"stick": (slow, np.cos(slow), "V")},
    ])  # fmt: skip
    recording = read_recording(path)
    for stream, stamps, values, name in zip(
        recording.streams, (fast, slow), (np.sin(fast), np.cos(slow)), ("rate", "stick"), strict=True
    ):
        assert_array_equal(stream.clocks[0].ticks, stamps)
        assert_array_equal(stream.columns[name].load(), values)
    assert recording.streams[0].columns["rate"].unit == "rad/s"


def test_igc_passes_midnight(tmp_path: Path) -> None:
    pytest.importorskip("aerofiles")
    seconds = [86_380 + 5 * k for k in range(20)]
    path = write(tmp_path, "log.igc", files.igc("HFDTEDATE:030418,01", seconds, range(500, 520), range(560, 580)))
    log = read_log(path, {"h": "pressure_alt", "h_gnss": "gps_alt"})
    assert_array_equal(log.time, 5.0 * np.arange(20))
    assert_array_equal(log["h_gnss"] - log["h"], np.full(20, 60.0))
    assert any("time 0 is 2018-04-03 23:59:40" in note for note in log.notes)


def test_irig106_discretes(tmp_path: Path) -> None:
    pytest.importorskip("chapter10")
    stamps = [1_000_000 + 200_000 * k for k in range(40)]
    content = files.irig106(stamps, [k % 4 for k in range(40)])
    recording = read_recording(write(tmp_path, "log.ch10", content))
    stream = next(one for one in recording.streams if "bits" in one.columns)
    assert_array_equal(stream.clocks[0].ticks, stamps)
    assert_array_equal(stream.columns["bit 1"].load(), [(k % 4) >> 1 for k in range(40)])
    assert any("experimental" in note for note in recording.notes)
    log = read_log(tmp_path / "log.ch10", {"gear": {"column": "bit 0", "unit": "1", "held": True}})
    assert_allclose(np.diff(log.time), 0.02, rtol=1e-9)


# Names as written by X-Plane: padded with `_` and blanks, the elevator once for each half of the tail.
X_PLANE = ("_real,_time", "Vtrue,_ktas", "_elev,yoke1", "____Q,{rate}", "pitch,__deg", "Gload,norml", "rudr1,__deg")


@pytest.mark.parametrize(("rate", "turn"), [("rad/s", 1.0), ("deg/s", np.pi / 180.0)])
def test_x_plane_dialect(tmp_path: Path, rate: str, turn: float) -> None:
    k = np.arange(20)
    values = np.column_stack([0.1 * k, 100.0 + k, 0.01 * k, 0.02 * k, 0.5 * k, 1.0 + 0.0 * k, 2.0 + 0.0 * k])
    lines = ["".join(f"   {name.format(rate=rate)} |" for name in X_PLANE)]
    lines += ["".join(f"{value:14.5f} |" for value in row) for row in values]
    path = write(tmp_path, "Data.txt", "\n".join(lines) + "\n")
    log = read_log(path, "x_plane")
    assert_allclose(log.time, 0.1 * k, atol=1e-12)
    assert_allclose(log["V"], (100 + k) * 1852 / 3600)
    assert_allclose(log["q"], 0.02 * turn * k, atol=1e-15)
    assert_allclose(log["theta"], np.radians(0.5 * k), atol=1e-15)
    assert_allclose(log["a_z"], -9.80665)
    # Nose up is the elevator's trailing edge up; the rudder's degrees are positive to the right.
    assert_allclose(log["delta_e"], -0.01 * k, atol=1e-15)
    assert_allclose(log["delta_r"], np.radians(-2.0))
    assert any(note.startswith("delta_e: position of the yoke") for note in log.notes)
    assert propose_map(read_recording(path), str(path)).channels["q"].reasons == ["ready map x_plane"]
    with pytest.raises(ChannelMapError, match=r"a map that comes with aerosid: --channels x_plane\.$"):
        read_log(path)


@pytest.mark.parametrize(("name", "factor"), [("q-body", 1.0), ("q-rad_sec", 1.0), ("pitch-rate-degps", np.pi / 180.0)])
def test_flightgear_dialect(tmp_path: Path, name: str, factor: float) -> None:
    rows = "".join(f"{0.1 * k},{300 - k},{0.01 * k},{0.02 * k},{0.1 * k}\n" for k in range(20))
    header = f"Time,altitude-ft,elevator-pos-rad,{name},aileron\n"
    log = read_log(write(tmp_path, "fgfs.csv", header + rows), "flightgear")
    assert_allclose(log["h"], 0.3048 * (300 - np.arange(20)))
    assert_allclose(log["delta_e"], 0.01 * np.arange(20))
    assert_allclose(log["q"], 0.02 * factor * np.arange(20))
    # Right wing down is the right aileron's trailing edge up.
    assert_allclose(log["delta_a"], -0.1 * np.arange(20))
    assert any("Euler" in note for note in log.notes) == (name == "pitch-rate-degps")


# Autopilot commands are positive for right wing down, nose up and nose right: trailing edges up, up and right.
@pytest.mark.parametrize("travel", [None, 25.0])
def test_commands_in_shares_of_travel_have_the_surfaces_signs(tmp_path: Path, travel: float | None) -> None:
    fields = "uint64_t timestamp;float[3] xyz;"
    rows = [(20_000 * k + 1_000_000, 0.1, 0.2, 0.4) for k in range(100)]
    path = write(tmp_path, "log.ulg", files.ulog([("vehicle_torque_setpoint", 0, fields, rows)]))
    entry = {"unit": "deg", "scale": travel, "sign": -1}
    own = {name: {"column": f"vehicle_torque_setpoint.xyz[{at}]", **entry} for at, name in enumerate(SURFACES)}
    log = read_log(path) if travel is None else read_log(path, own)
    for name, command in zip(SURFACES, (0.1, 0.2, 0.4), strict=True):
        assert_allclose(log[name], -command * (1.0 if travel is None else np.radians(travel)), rtol=1e-6)
    assert any("parts of full travel, taken as rad" in note for note in log.notes) == (travel is None)


SURFACES = ("delta_a", "delta_e", "delta_r")


def test_decimal_commas_and_clock_times(tmp_path: Path) -> None:
    """A station's export: semicolons, 1,25 for a number and hh:mm:ss,mmm for a time; midnight on the way."""
    clock = [f"{h:02d}:{m:02d}:{s:02d},{ms:03d}" for h, m, s, ms in (
        ((86_398_000 + 250 * k) // 3_600_000 % 24, (86_398_000 + 250 * k) // 60_000 % 60,
         (86_398_000 + 250 * k) // 1000 % 60, (86_398_000 + 250 * k) % 1000) for k in range(20))]  # fmt: skip
    rows = "".join(f"{word};{str(0.5 * k).replace('.', ',')}\n" for k, word in enumerate(clock))
    path = write(tmp_path, "log.csv", "Zeit;Nick [deg]\n" + rows)
    channels = 'schema = 1\ntime = {column = "Zeit", unit = "HH:MM:SS"}\n[channels]\ntheta = {column = "Nick [deg]"}\n'
    write(tmp_path, "channels.toml", channels)
    log = read_log(path)
    assert_allclose(log.time - log.time[0], 0.25 * np.arange(20), atol=1e-9)
    assert_allclose(log["theta"], np.radians(0.5 * np.arange(20)), atol=1e-15)


def test_a_header_with_its_unit_named_whole(tmp_path: Path) -> None:
    rows = "".join(f"{0.1 * k:.1f} {50 + k} {k}\n" for k in range(20))
    path = write(tmp_path, "log.txt", "t[s] V[m/s] AoA(deg)\n" + rows)
    log = read_log(path, {"schema": 1, "format": "ascii", "time": {"column": "t [s]"}, "channels": {
        "V": {"column": "V [m/s]"}, "alpha": {"column": "AoA (deg)"}}})  # fmt: skip
    assert_array_equal(log["V"], 50.0 + np.arange(20))
    assert_allclose(log["alpha"], np.radians(np.arange(20)))


def test_rows_written_twice_are_left_out_and_coarse_stamps_spread(tmp_path: Path) -> None:
    whole = "time [s],V [m/s]\n"
    channels = {"schema": 1, "format": "ascii", "time": {"column": 1, "unit": "s"}, "channels": {"V": {"column": 2}}}
    twice = whole + "".join(f"{k},{50 + k}\n" * (2 if k == 5 else 1) for k in range(20))
    log = read_log(write(tmp_path, "twice.csv", twice), channels)
    assert log.samples == 20
    assert any("1 rows repeat" in note for note in log.notes)
    coarse = whole + "".join(f"{k // 4},{50 + k}\n" for k in range(40))
    log = read_log(write(tmp_path, "coarse.csv", coarse), channels)
    assert_allclose(log.time, 0.25 * np.arange(40))
    assert any("resolution of 1 s" in note for note in log.notes)
    wrong = whole + "".join(f"{5 if k == 6 else k},{50 + k}\n" for k in range(200))
    with pytest.raises(LogError, match="time repeats at line 8"):
        read_log(write(tmp_path, "wrong.csv", wrong), channels)


@pytest.mark.parametrize(("module", "extra"), sorted(EXTRAS.items()))
def test_a_missing_extra_is_one_sentence(monkeypatch: pytest.MonkeyPatch, module: str, extra: str) -> None:
    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(missing_library.importlib, "import_module", absent)
    with pytest.raises(LogError, match=rf"install it with `pip install 'aerosid\[{extra}\]'`\.$"):
        missing_library.library(module, "log.bin")


EXTRA_FILES = {
    "h5py": ("a.h5", b"\x89HDF\r\n\x1a\n"),
    "pymavlink.dialects.v20.ardupilotmega": ("a.tlog", b"\x00"),
    "asammdf": ("a.mf4", b"MDF     "),
    "nptdms": ("a.tdms", b"TDSm"),
    "chapter10": ("a.ch10", b"\x25\xeb"),
    "aerofiles.igc": ("a.igc", b"AXXX001"),
}


@pytest.mark.parametrize(("module", "extra"), sorted(EXTRAS.items()))
def test_a_file_whose_extra_is_missing_is_refused_before_its_map_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, extra: str
) -> None:
    name, content = EXTRA_FILES[module]
    (tmp_path / name).write_bytes(content)
    monkeypatch.setitem(sys.modules, module, None)
    for read in (read_log, read_recording):
        with pytest.raises(LogError, match=rf"{name}: .*install it with `pip install 'aerosid\[{extra}\]'`\.$"):
            read(tmp_path / name)


def test_a_map_that_names_nothing_that_is_there(tmp_path: Path) -> None:
    content = files.ulog([("sensor", 0, "uint64_t timestamp;float x;", [(20_000 * int(k), 1.0) for k in K])])
    path = write(tmp_path, "log.ulg", content)
    with pytest.raises(ChannelMapError, match=r"channel q of .* is mapped to 'sensor.y', but .* holds 'x'"):
        read_log(path, {"q": {"column": "sensor.y", "unit": "rad/s"}})
    with pytest.raises(ChannelMapError, match="holds none of the channels"):
        read_log(path)


def test_a_folder_of_topics(tmp_path: Path) -> None:
    folder = tmp_path / "flight"
    folder.mkdir()
    stamps = 1_000_000 + 20_000 * K
    attitude = "timestamp,q[0],q[1],q[2],q[3],pitchspeed\n"
    attitude += "".join(f"{s},1,0,0,0,{0.01 * k}\n" for k, s in enumerate(stamps))
    speed = "timestamp,true_airspeed_m_s\n" + "".join(f"{s},{15 + 0.1 * k}\n" for k, s in enumerate(stamps))
    write(folder, "FLT_vehicle_attitude_0.csv", attitude)
    write(folder, "FLT_airspeed_0.csv", speed)
    log = read_log(folder)
    assert_allclose(log.time, 1e-6 * stamps, rtol=1e-12)
    assert_allclose(log["q"], 0.01 * K)
    assert_allclose(log["V"], 15 + 0.1 * K)
    assert_allclose(log["theta"], 0.0)


ATT: files.Fmt = (10, "ATT", "Qcc", "TimeUS,Roll,Pitch")


def samples(folder: Path) -> dict[str, bytes]:
    """One small valid file of each format, by its name."""
    time = 0.01 * np.arange(200)
    rows = [(10_000 * int(k) + 1_000_000, float(k)) for k in range(200)]
    table = pa.table({"time": time, "q": np.sin(time)})
    parquet.write_table(table, folder / "good.parquet")
    feather.write_feather(table, folder / "good.feather")
    return {
        "log.ulg": files.ulog([("gyro", 0, "uint64_t timestamp;float x;", rows)]),
        "log.mf4": files.mdf4(folder / "good.mf4", [{"q": (time, np.sin(time), "rad/s")}]).read_bytes(),
        "log.tdms": files.tdms([("g", "q", np.sin(time), {"wf_increment": 0.01})]),
        "log.h5": files.hdf5(folder / "good.h5", {"time": time, "q": np.sin(time)}).read_bytes(),
        "log.igc": files.igc("HFDTEDATE:030418,01", range(100, 160), range(500, 560), range(500, 560)),
        "log.ch10": files.irig106(range(1_000_000, 5_000_000, 100_000), range(40)),
        "log.tlog": files.tlog([(10**15 + 10_000 * k, files.attitude(10 * k, 0.1)) for k in range(60)]),
        "log.bin": files.flash_format(files.FMT_OF_FMT)
        + files.flash_format(ATT)
        + b"".join(files.flash_message(ATT, 20_000 * (k + 1), 0, k) for k in range(60)),
        "log.log": b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format\nFMT, 1, 20, ATT, Icc, TimeMS,Roll,Pitch\n"
        + b"".join(b"ATT, %d, 1.0, 2.0\n" % (20 * k) for k in range(60)),
        "log.csv": files.g1000([f"2024-05-06, 09:00:{k:02d}, , , 861.5, 100, 2, -1, 0.1" for k in range(50)]).encode(),
        "log.parquet": (folder / "good.parquet").read_bytes(),
        "log.feather": (folder / "good.feather").read_bytes(),
    }


MAPS: dict[str, Any] = {
    "log.ulg": {"q": {"column": "gyro.x", "unit": "rad/s"}},
    "log.mf4": {"q": "q"},
    "log.igc": {"h": "gps_alt"},
    "log.ch10": {"bits": {"column": "bits", "unit": "1"}},
    "log.csv": "garmin_g1000",
} | {
    name: {"schema": 1, "time": {"column": "time", "unit": "s"}, "channels": {"q": {"column": "q", "unit": "rad/s"}}}
    for name in ("log.h5", "log.parquet", "log.feather")
}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60, derandomize=True)
@given(st.data())
def test_damaged_recordings_are_read_or_refused_in_one_sentence(tmp_path: Path, data: st.DataObject) -> None:
    for module in ("asammdf", "nptdms", "h5py", "aerofiles", "chapter10", "pymavlink"):
        pytest.importorskip(module)
    if not _SAMPLES:
        _SAMPLES.update(samples(tmp_path))
    good = _SAMPLES
    name = data.draw(st.sampled_from(sorted(good)))
    content = bytearray(good[name])
    start = data.draw(st.integers(0, len(content) - 1))
    content[start : start + data.draw(st.integers(0, 16))] = data.draw(st.binary(max_size=16))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(min(start, len(content)), len(content))) :]
    path = write(tmp_path, name, bytes(content))
    with contextlib.suppress(AerosidError):
        listing = list_channels(read_recording(path))
        json.dumps(listing.as_json(), allow_nan=False)
        propose_map(read_recording(path), str(path))
    with contextlib.suppress(AerosidError):
        for log in read_segments(path, MAPS.get(name)):
            assert log.samples >= 10
            assert not any(np.isinf(values).any() for values in log.channels.values())
    assert path.read_bytes() == bytes(content)


_SAMPLES: dict[str, bytes] = {}


def test_a_text_log_is_read_without_the_line_that_describes_its_descriptions(tmp_path: Path) -> None:
    path = tmp_path / "log.log"
    rows = "".join(f"ATT, {20 * k}, {k}.5, 2.0\n" for k in range(50))
    path.write_text(
        f"xMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format\nFMT, 1, 20, ATT, Icc, TimeMS,Roll,Pitch\n{rows}"
    )
    (stream,) = read_recording(path).streams
    assert stream.name == "ATT"
    assert {"Roll", "Pitch"} <= set(stream.columns)
