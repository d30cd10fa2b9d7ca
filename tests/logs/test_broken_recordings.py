"""Faults of recordings met by users, C1 to C24: usable parts are read with a note, the rest is refused."""

from __future__ import annotations

import datetime as dt
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import recorder_files as files
from numpy.testing import assert_allclose, assert_array_equal
from recordings import recorder

from aerosid.cli.main import main
from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.channel_listing import Listing, list_channels
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log, read_recording, read_segments
from aerosid.logs.gps_time import leap_seconds, utc_of_gps
from aerosid.logs.map_proposal import propose_map
from aerosid.logs.recording import Recording, Stream, column

ULOG_FIELDS = "uint64_t timestamp;float x;"


def write(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def rows(start: float, stop: float, rate: float) -> list[tuple[int, float]]:
    """Stamps, us, and a sine of them."""
    time = np.arange(start, stop, 1.0 / rate)
    return [(round(1e6 * t), float(np.sin(t))) for t in time]


def topic(
    name: str, samples: list[tuple[int, float]], instance: int = 0
) -> tuple[str, int, str, list[tuple[int, float]]]:
    return name, instance, ULOG_FIELDS, samples


def listed(path: Path) -> Listing:
    return list_channels(read_recording(path))


def notes_contain(source: Listing | FlightLog | Recording, *words: str) -> bool:
    """Whether one note contains all the words."""
    return any(all(word in note for word in words) for note in source.notes)


def test_c1_spans_that_disagree_are_a_sentence_and_check_prints_each_topic(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content = files.ulog([topic("gyro", rows(10.0, 30.0, 100.0)), topic("gps", rows(20.0, 30.0, 5.0))])
    path = write(tmp_path, "log.ulg", content)
    assert notes_contain(listed(path), "gps[0] covers only 20 to", "of it")
    write(tmp_path, "channels.toml", 'schema = 1\n[channels]\nq = { column = "gyro.x", unit = "rad/s" }\n')
    assert main(["check", str(path)]) == 3  # the airspeed, needed by close-loop, is missing
    printed = capsys.readouterr().out
    for words in (("gyro[0]", "2000", "100", "10.000000", "29.990000"), ("gps[0]", "50", "5", "20.000000")):
        assert any(all(word in line for word in words) for line in printed.splitlines())


def test_c2_stray_stamps_do_not_stretch_the_axis(tmp_path: Path) -> None:
    strays = [(0, 0.0)], [(1_425_101, 0.0)], [(1_194_367_328, 0.0)]
    content = files.ulog([
        topic("gyro", rows(20.3, 26.8, 100.0)), *(topic(f"stray{k}", one) for k, one in enumerate(strays)),
    ])  # fmt: skip
    path = write(tmp_path, "log.ulg", content)
    assert notes_contain(listed(path), "lasts 6.49 s", "1 message is after it, 2 long before it")
    log = read_log(path, {"q": {"column": "gyro.x", "unit": "rad/s"}})
    assert (log.time[0], log.time[-1]) == pytest.approx((20.3, 26.79))


def test_c2_on_the_recording() -> None:
    path = recorder("../flight_data/px4/sample_log_small.ulg")
    assert notes_contain(listed(path), "lasts 6.5", "1 message is after it, 4 long before it")
    log = read_log(path)
    assert log.time[0] > 20.3
    assert log.time[-1] < 26.9
    assert max(len(one.time) for one in read_segments(path)) == log.samples


def test_c3_topics_without_a_clock_are_refused_by_name_and_the_rest_read(tmp_path: Path) -> None:
    dead = [(0, float(k)) for k in range(50)]
    path = write(tmp_path, "log.ulg", files.ulog([topic("gyro", rows(1.0, 3.0, 100.0)), topic("innovations", dead)]))
    assert notes_contain(listed(path), "innovations[0] cannot be used", "all 50 stamps (timestamp) are 0")
    with pytest.raises(LogError, match=r"innovations\[0\], mapped as a: all 50 stamps .* are 0"):
        read_log(path, {"a": {"column": "innovations.x", "unit": "1"}})
    assert read_log(path, {"q": {"column": "gyro.x", "unit": "rad/s"}}).samples == 200


def test_c3_on_the_recording() -> None:
    listing = listed(recorder("px4/sample.ulg"))
    refused = [note.split()[0] for note in listing.notes if "cannot be used" in note]
    assert refused == ["commander_state[0]", "ekf2_innovations[0]", "sensor_preflight[0]"]


def test_c4_the_stamp_is_found_by_name_and_nested_fields_have_their_parents(tmp_path: Path) -> None:
    samples = [(float(k), 10_000 * k, 2.0 * k) for k in range(1, 60)]
    nested = ["setpoint:float lat;"]
    content = files.ulog([("triplet", 0, "float x;uint64_t timestamp;setpoint current;", samples)], nested)
    log = read_log(write(tmp_path, "log.ulg", content), {
        "a": {"column": "triplet.x", "unit": "1"}, "b": {"column": "triplet.current.lat", "unit": "1"},
    })  # fmt: skip
    assert_allclose(log.time, 0.01 * np.arange(1, 60), rtol=1e-12)
    assert_array_equal(log["a"], np.arange(1.0, 60.0))
    assert_array_equal(log["b"], 2.0 * np.arange(1.0, 60.0))


def battery(folder: Path) -> Path:
    first, second = [(s, 12.0) for s, _ in rows(1, 9, 10)], [(s + 50_000, 24.0) for s, _ in rows(1, 9, 10)]
    return write(folder, "log.ulg", files.ulog([topic("battery", first, 0), topic("battery", second, 1)]))


def test_c5_instances_are_channels_of_their_own(tmp_path: Path) -> None:
    path = battery(tmp_path)
    log = read_log(path, {"one": {"column": "battery.x", "unit": "V"}, "two": {"column": "battery[1].x", "unit": "V"}})
    assert set(log["one"]) == {12.0}
    assert set(log["two"][np.isfinite(log["two"])]) == {24.0}
    assert notes_contain(log, "one: battery[0].x is used; the recording also holds battery[1]")


def test_c6_an_unknown_instance_or_name_lists_what_is_there(tmp_path: Path) -> None:
    path = battery(tmp_path)
    with pytest.raises(
        ChannelMapError, match=r"'battery\[2\]\.x', but the recording holds 'battery\[0\]', 'battery\[1\]'"
    ):
        read_log(path, {"a": {"column": "battery[2].x", "unit": "V"}})
    with pytest.raises(ChannelMapError, match=r"'actuator\.x', but the recording holds 'battery\[0\]', 'battery\[1\]'"):
        read_log(path, {"a": {"column": "actuator.x", "unit": "V"}})


RENAMED = """schema = 1
[channels]
delta_e = [
  { column = "vehicle_torque_setpoint.x", unit = "1", sign = -1 },
  { column = "actuator_controls_0.x", unit = "1", sign = -1 },
]
"""


@pytest.mark.parametrize("name", ["vehicle_torque_setpoint", "actuator_controls_0"])
def test_c7_one_map_reads_old_and_new_names_and_says_which(tmp_path: Path, name: str) -> None:
    path = write(tmp_path, "log.ulg", files.ulog([topic(name, rows(1, 5, 50))]))
    log = read_log(path, write(tmp_path, "map.toml", RENAMED))
    assert_allclose(log["delta_e"], -np.sin(log.time), atol=1e-6)
    assert notes_contain(log, f"delta_e: taken from {name}[0].x")


def test_a_folder_called_like_a_ready_map_does_not_hide_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fields = "uint64_t timestamp;float true_airspeed_m_s;"
    path = write(tmp_path, "log.ulg", files.ulog([("airspeed", 0, fields, rows(1, 5, 50))]))
    (tmp_path / "px4").mkdir()
    monkeypatch.chdir(tmp_path)
    for log in (read_log(path), read_log(path, "px4")):
        assert_allclose(log["V"], np.sin(log.time), atol=1e-6)


def test_c7_on_recordings_of_two_generations() -> None:
    old = read_log(recorder("px4/motor_failure.ulg"), "px4")
    new = read_log(recorder("px4/sample_px4_events.ulg"), "px4")
    assert notes_contain(old, "delta_e: taken from actuator_controls_0[0].control[1]")
    assert notes_contain(new, "delta_e: taken from vehicle_torque_setpoint[0].xyz[1]")


def test_c8_stamps_out_of_order_are_kept_counted_and_sorted(tmp_path: Path) -> None:
    late = rows(1.0, 5.0, 50.0)
    late[70], late[71] = late[71], late[70]
    later = rows(0.5, 5.0, 50.0)
    path = write(tmp_path, "log.ulg", files.ulog([topic("gyro", late), topic("other", later)]))
    log = read_log(path, {"q": {"column": "gyro.x", "unit": "rad/s"}})
    assert log.samples == 200
    assert_allclose(log["q"], np.sin(log.time), atol=1e-6)
    assert notes_contain(log, "q: 1 steps back in the stamps; the samples are sorted, none is left out")
    # The second topic begins before the first one ends: topics overlap in a file.
    assert not notes_contain(listed(path), "other", "back")


def test_c9_a_cut_file_is_read_up_to_its_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = files.ulog([topic("gyro", rows(1.0, 5.0, 50.0))])
    path = write(tmp_path, "log.ulg", whole[:-10])
    log = read_log(path, {"q": {"column": "gyro.x", "unit": "rad/s"}})
    assert log.samples == 199
    assert notes_contain(log, "the file ends inside a message")
    assert main(["channels", str(path)]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    assert "the file ends inside a message" in printed.out


def test_c9_on_the_recording(tmp_path: Path) -> None:
    whole = recorder("px4/sample.ulg").read_bytes()
    cut = read_recording(write(tmp_path, "cut.ulg", whole[:2_026_682]))
    stream = next(one for one in cut.streams if one.label == "sensor_combined[0]")
    assert (stream.clocks[0].ticks.size, stream.clocks[0].ticks[-1]) == (8462, 146_690_307)
    assert notes_contain(cut, "ends inside a message")
    zeroed = read_recording(write(tmp_path, "zeroed.ulg", whole[:2_000_000] + bytes(400) + whole[2_000_400:]))
    stream = next(one for one in zeroed.streams if one.label == "sensor_combined[0]")
    assert stream.clocks[0].ticks.size == 17067
    assert notes_contain(zeroed, "damaged at byte 200000", "bytes are skipped")


ATT: files.Fmt = (10, "ATT", "Qcc", "TimeUS,Roll,Pitch")
XKF: files.Fmt = (11, "XKF1", "Qc", "TimeUS,Pitch")


def test_c10_an_estimator_that_stamps_its_data_time_is_no_disorder(tmp_path: Path) -> None:
    content = files.flash_format(files.FMT_OF_FMT) + files.flash_format(ATT) + files.flash_format(XKF)
    for k in range(200):
        content += files.flash_message(ATT, 1_000_000 + 40_000 * k, 0, k)
        content += files.flash_message(XKF, 1_000_000 + 40_000 * k - 2_200, -k)
    log = read_log(write(tmp_path, "log.bin", content), {"theta": {"column": "XKF1.Pitch", "unit": "deg"}})
    assert_allclose(log.time, 1.0 - 0.0022 + 0.04 * np.arange(200), atol=1e-9)
    assert not notes_contain(log, "back")


def test_c10_on_the_recording() -> None:
    listing = listed(recorder("ardupilot/center_0003.bin"))
    assert not notes_contain(listing, "back")
    assert notes_contain(listing, "636 messages that it could not write")


def test_c11_messages_without_a_format_are_named_and_counted(tmp_path: Path) -> None:
    content = files.flash_format(files.FMT_OF_FMT) + files.flash_format(ATT)
    for k in range(50):
        content += files.flash_message(ATT, 20_000 * (k + 1), 0, k)
        content += files.flash_message(XKF, 20_000 * (k + 1), k)
    recording = read_recording(write(tmp_path, "log.bin", content))
    assert recording.counts["ATT"] == 50
    assert notes_contain(recording, "types 11 (50 times) have no format")


def test_c12_a_format_serves_what_comes_after_it_and_that_of_formats_is_presumed(tmp_path: Path) -> None:
    content = files.flash_format(ATT)
    for k in range(60):
        content += files.flash_message(ATT, 20_000 * (k + 1), 0, k)
        if k == 29:
            content += files.flash_format(XKF)
        content += files.flash_message(XKF, 20_000 * (k + 1), k)
    recording = read_recording(write(tmp_path, "log.bin", content + files.flash_format(files.FMT_OF_FMT)))
    assert (recording.counts["ATT"], recording.counts["XKF1"]) == (60, 31)
    assert notes_contain(recording, "types 11 (29 times)")


def test_c13_bad_bytes_are_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    content = files.flash_format(files.FMT_OF_FMT) + files.flash_format(ATT)
    content += b"".join(files.flash_message(ATT, 20_000 * (k + 1), 0, k) for k in range(1000))
    size = len(files.flash_message(ATT, 0, 0, 0))
    start = len(content) - 500 * size
    recording = read_recording(
        write(tmp_path, "log.bin", content[:start] + bytes(10 * size) + content[start + 10 * size :])
    )
    assert recording.counts["ATT"] == 990
    assert sum("damaged" in note for note in recording.notes) == 1
    assert capfd.readouterr().err == ""


def test_c13_on_the_recording(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    whole = recorder("ardupilot/center_0003.bin").read_bytes()
    recording = read_recording(write(tmp_path, "log.bin", whole[:300_000] + bytes(500) + whole[300_500:]))
    assert recording.messages == 17959
    assert sum("damaged" in note for note in recording.notes) == 1
    assert capfd.readouterr().err == ""


def test_c14_multipliers_bring_the_raw_number_to_the_unit(tmp_path: Path) -> None:
    ctun: files.Fmt = (12, "CTUN", "Qhc", "TimeUS,CRt,Alt")
    fmtu: files.Fmt = (13, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    unit: files.Fmt = (14, "UNIT", "QbZ", "TimeUS,Id,Label")
    mult: files.Fmt = (15, "MULT", "Qbd", "TimeUS,Id,Mult")
    content = b"".join(files.flash_format(form) for form in (files.FMT_OF_FMT, ctun, fmtu, unit, mult))
    content += files.flash_message(unit, 0, ord("n"), "m/s") + files.flash_message(unit, 0, ord("m"), "m")
    content += files.flash_message(mult, 0, ord("B"), float(np.float32(0.01)))
    content += files.flash_message(fmtu, 0, 12, "snm", "FBB")
    content += b"".join(files.flash_message(ctun, 20_000 * (k + 1), 250, 1234) for k in range(40))
    log = read_log(write(tmp_path, "log.bin", content), {"climb": "CTUN.CRt", "h": "CTUN.Alt"})
    assert set(log["climb"]) == {2.5}
    assert log.units["climb"] == "m/s"
    # The letter c implies a scale, which must not be applied twice.
    assert set(log["h"]) == {12.34}


def test_c15_a_dead_sample_clock_is_not_replaced_silently(tmp_path: Path) -> None:
    acc: files.Fmt = (12, "ACC", "QQf", "TimeUS,SampleUS,AccX")
    content = files.flash_format(files.FMT_OF_FMT) + files.flash_format(acc)
    content += b"".join(files.flash_message(acc, 20_000 * (k + 1), 0, float(k)) for k in range(40))
    path = write(tmp_path, "log.bin", content)
    with pytest.raises(LogError, match=r"all 40 stamps \(SampleUS\) are 0.*or name TimeUS as `clock`\.$"):
        read_log(path, {"a_x": {"column": "ACC.AccX", "unit": "m/s^2"}})
    log = read_log(path, {"a_x": {"column": "ACC.AccX", "unit": "m/s^2", "clock": "TimeUS"}})
    assert_allclose(log.time, 0.02 * np.arange(1, 41), rtol=1e-12)


def test_c16_two_boots_in_one_telemetry_log_are_two_runs(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    arrival = 1_600_000_000_000_000
    first = [(arrival + 250_000 * k, files.attitude(60_000 + 250 * k, 0.1)) for k in range(40)]
    second = [(arrival + 20_000_000 + 250_000 * k, files.attitude(5_000 + 250 * k, 0.2)) for k in range(300)]
    path = write(tmp_path, "log.tlog", files.tlog(first + second))
    log = read_log(path, {"theta": {"column": "ATTITUDE.pitch", "unit": "rad"}})
    assert (log.time[0], log.time[-1], log.samples) == (5.0, 79.75, 300)
    assert_allclose(log["theta"], 0.2, rtol=1e-6)
    assert notes_contain(log, "2 runs", "5 to 79.75 s", "others (60 to 69.75 s)")
    assert notes_contain(listed(path), "restarted within the file (2 runs): ATTITUDE at sample 41")


def test_c16_a_message_of_one_run_only_is_listed(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    arrival = 1_600_000_000_000_000
    first = [(arrival + 250_000 * k, files.attitude(60_000 + 250 * k, 0.1)) for k in range(40)]
    both = (files.attitude, files.inertial)
    second = [(arrival + 250_000 * k, both[k % 2](5_000 + 250 * (k - 40), 0.2)) for k in range(40, 340)]
    listing = listed(write(tmp_path, "log.tlog", files.tlog(first + second)))
    assert [stream.label for stream in listing.streams] == ["ATTITUDE", "SCALED_IMU2"]
    assert sum("restarted" in note for note in listing.notes) == 1


def test_c16_on_the_recording() -> None:
    pytest.importorskip("pymavlink")
    path = recorder("mavlink/vtol.tlog")
    stream = next(one for one in read_recording(path).streams if one.name == "ATTITUDE")
    arrival = stream.clock("arrival")
    assert stream.boots is not None
    assert arrival is not None
    cut = int(np.flatnonzero(np.diff(stream.boots))[0]) + 1
    assert arrival.ticks[cut] == 1_533_737_164_565_000
    log = read_log(path)
    assert notes_contain(log, "2 runs", "610.541 to 817.077 s", "others (608.582 to 611.941 s)")


@pytest.mark.parametrize(("status", "known"), [(1, False), (3, True)])
def test_c17_absolute_time_comes_from_a_valid_fix_only(tmp_path: Path, status: int, known: bool) -> None:
    gps: files.Fmt = (12, "GPS", "QBIH", "TimeUS,Status,GMS,GWk")
    content = files.flash_format(files.FMT_OF_FMT) + files.flash_format(gps)
    content += b"".join(
        files.flash_message(gps, 200_000 * (k + 1), status, 200 * (k + 1) + 86_400_000, 2200) for k in range(30)
    )
    recording = read_recording(write(tmp_path, "log.bin", content))
    start = dt.datetime(2022, 3, 6, tzinfo=dt.UTC) + dt.timedelta(days=1, seconds=-18)
    assert recording.utc_of_zero == (start if known else None)


def test_c18_a_map_names_the_stamp_and_their_difference_is_told(tmp_path: Path) -> None:
    fields = "uint64_t timestamp;uint64_t timestamp_sample;float x;"
    samples = [(10_400 * k + 400, 10_400 * k, float(k)) for k in range(1, 100)]
    path = write(tmp_path, "log.ulg", files.ulog([("gyro", 0, fields, samples)]))
    sampled = read_log(path, {"q": {"column": "gyro.x", "unit": "rad/s"}})
    assert sampled.time[0] == pytest.approx(0.0104)
    assert notes_contain(sampled, "q: stamps are timestamp_sample; timestamp is later by 0.4 ms")
    written = read_log(path, {"q": {"column": "gyro.x", "unit": "rad/s", "clock": "timestamp"}})
    assert written.time[0] == pytest.approx(0.0108)


def test_c18_radio_delay_is_told_with_its_drift(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    arrival = 1_600_000_000_000_000
    messages = [
        (arrival + round(250_100 * k) + 900_000 * (k % 7 == 3), files.attitude(250 * k, 0.1)) for k in range(1, 300)
    ]
    log = read_log(write(tmp_path, "log.tlog", files.tlog(messages)), {"theta": {"column": "ATTITUDE.pitch"}})
    assert notes_contain(log, "stamps are time_boot_ms; arrival runs within 0.9", "drifts by", "ppm")
    assert_allclose(log.time, 0.25 * np.arange(1, 300), rtol=1e-12)


@pytest.mark.parametrize(
    ("day", "offset"),
    [
        ("1980-12-31", 0),
        ("1999-01-01", 13),
        ("2005-12-31", 13),
        ("2012-07-01", 16),
        ("2016-12-31", 17),
        ("2017-01-01", 18),
    ],
)
def test_c19_leap_seconds_are_those_of_the_date(day: str, offset: int) -> None:
    date = dt.date.fromisoformat(day)
    assert leap_seconds(date) == offset
    noon = dt.datetime.combine(date, dt.time(12), dt.UTC)
    since = noon - dt.datetime(1980, 1, 6, tzinfo=dt.UTC) + dt.timedelta(seconds=offset)
    assert utc_of_gps(since.days // 7, since.total_seconds() - 604_800 * (since.days // 7)) == noon


def test_c20_channels_that_start_apart_stay_apart(tmp_path: Path) -> None:
    pytest.importorskip("nptdms")
    zero = np.datetime64("2020-01-02T03:04:05.000000")
    late = zero + np.timedelta64(3_000_301, "us")
    more = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    content = files.tdms([
        ("log", "q", np.arange(1000.0), more | {"wf_start_time": zero}),
        ("log", "r", np.arange(1000.0), more | {"wf_start_time": late}),
    ])  # fmt: skip
    recording = read_recording(write(tmp_path, "log.tdms", content))
    starts = [stream.clocks[0].ticks[0] for stream in recording.streams]
    assert starts == pytest.approx([0.0, 3.000301], abs=1e-9)
    log = read_log(tmp_path / "log.tdms", {n: {"column": f"log/{n}", "unit": "deg/s"} for n in "qr"})
    assert log.time[0] >= 3.000301 - 1e-9
    inside = slice(2, -2)
    assert_allclose(np.degrees(log["q"] - log["r"])[inside], 300.0301, atol=1e-6)


def test_c21_an_unfinished_mdf_file_is_finished_in_memory_or_refused(tmp_path: Path) -> None:
    pytest.importorskip("asammdf")
    time = 0.01 * np.arange(500)
    path = files.mdf4(tmp_path / "log.mf4", [{"q": (time, np.sin(time), "rad/s")}])
    whole = path.read_bytes()
    unfinished = write(tmp_path, "unfinished.mf4", b"UnFinMF " + whole[8:60] + b"\x01\x00\x00\x00" + whole[64:])
    before = unfinished.read_bytes()
    log = read_log(unfinished, {"q": "q"})
    assert_array_equal(log["q"], np.sin(time))
    assert notes_contain(log, "did not finalise")
    assert unfinished.read_bytes() == before
    cut = write(tmp_path, "cut.mf4", whole[: 2 * len(whole) // 3])
    with pytest.raises(LogError, match=r"cut\.mf4: the MDF file is damaged or truncated .*from the recorder\.$"):
        read_log(cut, {"q": "q"})
    assert cut.read_bytes() == whole[: 2 * len(whole) // 3]


def test_c22_no_union_of_rasters(tmp_path: Path) -> None:
    """Seven groups of three rates: native samples bit for bit, and never three times the file in memory."""
    pytest.importorskip("asammdf")
    rates = (1000.0, 1000.0, 1000.0, 100.0, 100.0, 10.0, 10.0)
    rng = np.random.default_rng(0)
    groups = []
    for k, rate in enumerate(rates):
        time = 1e-3 * k + np.arange(0.0, 60.0, 1.0 / rate)
        groups.append({f"c{k}_{j}": (time, rng.normal(size=time.size), "1") for j in range(6)})
    path = files.mdf4(tmp_path / "log.mf4", groups)
    size = path.stat().st_size
    read_recording(path)  # modules are loaded
    tracemalloc.start()
    recording = read_recording(path)
    for stream, group in zip(recording.streams, groups, strict=True):
        for name, (time, values, _) in group.items():
            assert_array_equal(stream.columns[name].load(), values)
            assert_array_equal(stream.clocks[0].ticks, time)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * size


def test_c23_no_sample_lies_inside_a_hole(tmp_path: Path) -> None:
    time = np.concatenate([np.arange(0.0, 10.0, 0.02), np.arange(25.4, 40.0, 0.02)])
    text = "time [s],q [rad/s]\n" + "".join(f"{t:.2f},{np.sin(t):.9f}\n" for t in time)
    parts = read_segments(write(tmp_path, "log.csv", text))
    assert [(part.time[0], part.time[-1]) for part in parts] == [(0.0, 9.98), (25.4, 39.98)]
    longest = read_log(tmp_path / "log.csv")
    assert longest.time[0] == 25.4
    assert notes_contain(longest, "1 gap", "15.4 s after 9.98 s", "2 segments")
    assert read_log(tmp_path / "log.csv", start=2.0, stop=8.0).time[0] == 2.0


@pytest.mark.parametrize(("first", "second", "start"), [(1.0, 0.0, 0.0), (1.0, 0.3, 25.4), (0.0, 0.0, 25.4)])
def test_the_stretch_with_the_manoeuvre_is_read(tmp_path: Path, first: float, second: float, start: float) -> None:
    """The longer one only where a control moves in it by a fifth of what it moves in the other, or in none."""
    time = np.concatenate([np.arange(0.0, 10.0, 0.02), np.arange(25.4, 40.0, 0.02)])
    size = np.where(time < 20.0, first, second)
    elevator = size * np.sin(time)
    text = "time [s],delta_e [rad]\n" + "".join(f"{t:.2f},{e:.9f}\n" for t, e in zip(time, elevator, strict=True))
    log = read_log(write(tmp_path, "log.csv", text))
    assert log.time[0] == start
    (note,) = (note for note in log.notes if "is used" in note)
    assert ("in which a control moves" in note) == (second == 0.0 < first)


def test_c23_streams_are_cut_together(tmp_path: Path) -> None:
    """A gap in one stream, a loss marked by the recorder elsewhere: three segments, no value inside a gap."""
    fast = [row for row in rows(0.0, 30.0, 100.0) if not 10_000_000 < row[0] < 12_000_000]
    slow = rows(0.0, 30.0, 20.0)
    content = files.ulog([topic("gyro", fast), topic("attitude", slow)], drop_outs={2100: 500})
    parts = read_segments(write(tmp_path, "log.ulg", content), {
        "q": {"column": "gyro.x", "unit": "rad/s"}, "theta": {"column": "attitude.x", "unit": "rad"},
    })  # fmt: skip
    marked = 1e-6 * fast[2099][0]
    assert len(parts) == 3
    for part in parts:
        assert not np.any((part.time > 10.0) & (part.time < 12.0))
        assert not np.any((part.time > marked + 1e-6) & (part.time < marked + 0.5))
        assert_allclose(part["q"], np.sin(part.time), atol=2e-3)


def test_c23_on_the_recording() -> None:
    parts = read_segments(recorder("ardupilot/nan.log"))
    assert [(round(part.time[0], 1), round(part.time[-1], 1)) for part in parts] == [(96.0, 100.0), (115.4, 125.2)]


def avionics(folder: Path, level: float) -> Path:
    """Rows at whole seconds, some twice; a load factor that is `level` in level flight."""
    stamps = [k - (k % 6 == 5) for k in range(240)]
    wave = 0.2 * np.sin(0.3 * np.arange(240))
    lines = []
    for k, moment in enumerate(stamps):
        clock = f"{9 + moment // 3600:02d}:{moment // 60 % 60:02d}:{moment % 60:02d}"
        numbers = f"861.5, {100 + k % 3:5.1f},   2.66,  -0.08, {level + wave[k]:.3f}"
        lines.append(f"2024-05-06, {clock},  -05:00,       ,   {numbers}")
    content = files.g1000(lines)
    return write(folder, "log.csv", content)


@pytest.mark.parametrize(
    ("level", "word", "verdict"),
    [(0.0, "incremental (0 in level flight)", "confirm it"), (1.0, "absolute (1 in level flight)", "DIFFERS")],
)
def test_c24_conventions_of_the_load_factor_are_told_apart_and_asked(
    tmp_path: Path, level: float, word: str, verdict: str
) -> None:
    path = avionics(tmp_path, level)
    proposal = propose_map(read_recording(path), str(path))
    first = proposal.text.splitlines()[0]
    assert word in first
    assert verdict in first


def test_c24_the_resolution_of_stamps_is_told(tmp_path: Path) -> None:
    log = read_log(avionics(tmp_path, 0.0), "garmin_g1000")
    assert notes_contain(log, "resolution of 1 s and 40 of 240 repeat")
    assert notes_contain(log, "read with the channel map garmin_g1000")
    assert np.all(np.diff(log.time) > 0.0)
    assert np.nanmean(log["a_z"]) == pytest.approx(-9.80665, rel=0.01)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("log_110812_095915_KCKN", "incremental (0 in level flight)"),
        ("log_20260327_152821_KOAK", "absolute (1 in level"),
    ],
)
def test_c24_on_the_recordings(name: str, word: str) -> None:
    path = recorder(f"garmin/{name}.csv")
    first = propose_map(read_recording(path), str(path)).text.splitlines()[0]
    assert word in first
    assert "confirm it" in first


def test_a_topic_without_a_stamp_is_one_sentence(tmp_path: Path) -> None:
    # Damage in its format: the samples behind its first one, of whatever topic, are lost to pyulog.
    renamed = ("state", 0, "uint64_t timestamq;float x;", rows(1.0, 3.0, 50.0))
    path = write(tmp_path, "log.ulg", files.ulog([renamed, topic("gyro", rows(1.0, 3.0, 100.0))]))
    with pytest.raises(LogError, match=r"log\.ulg: .* \(topic state has no field timestamp, .*; download it"):
        read_recording(path)


@pytest.mark.parametrize(
    ("unit", "content"), [(("QbZ", "TimeUS,Id,Lacel"), (0, ord("n"), "m/s")), (("QZb", "TimeUS,Id,Label"), (0, "n", 1))]
)
def test_a_damaged_description_of_units_is_one_sentence(
    tmp_path: Path, unit: tuple[str, str], content: tuple[int | str, ...]
) -> None:
    form: files.Fmt = (14, "UNIT", *unit)
    whole = b"".join(files.flash_format(one) for one in (files.FMT_OF_FMT, ATT, form))
    whole += files.flash_message(form, *content) + files.flash_message(ATT, 20_000, 0, 1)
    path = write(tmp_path, "log.bin", whole)
    with pytest.raises(LogError, match=r"log\.bin: message UNIT, .*; download the log") as caught:
        read_recording(path)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_number_are_listed_without_a_warning(tmp_path: Path) -> None:
    # A signalling NaN, as flipped bits leave it: numpy warns where it casts one, and warnings are errors here.
    signalling = np.full(20, 0x7F800001, dtype=np.uint32).view(np.float32)
    recording = Recording("ulog", (Stream("gyro", {"x": column(signalling)}),))
    (channel,) = list_channels(recording).channels
    assert (channel.samples, channel.missing) == (20, 20)
