"""Files of real recorders against the results of each format's reference library (facts.json)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from recordings import recorder, recorder_facts

from aerosid.errors import LogError
from aerosid.logs.formats import read_log, read_recording, read_segments
from aerosid.logs.recording import TICKS, AnyArray, Clock, Recording, Stream
from aerosid.logs.stamps import unusable

SEVEN_DIGITS = 6e-7


def same_values(values: AnyArray, facts: dict[str, Any]) -> None:
    """Number of samples, missing ones, least, greatest and mean, from the reference library."""
    values = np.asarray(values, dtype=np.float64)
    there = values[np.isfinite(values)]
    assert values.size == facts["n"]
    assert values.size - there.size == facts["nan"]
    found = [there.min(), there.max(), there.mean()]
    expected = [facts["min"], facts["max"], facts["mean"]]
    # The mean of single-precision samples, summed in either precision, agrees to fewer digits where it is near zero.
    np.testing.assert_allclose(found[:2], expected[:2], rtol=SEVEN_DIGITS)
    np.testing.assert_allclose(found[2], expected[2], rtol=SEVEN_DIGITS, atol=3e-7 * np.abs(there).max())


def same_clock(clock: Clock, facts: dict[str, Any], zero: float = 0.0) -> None:
    """First and last stamp, steps, repeats and steps back, exactly."""
    ticks = clock.ticks if facts["unit"] != "s" or clock.tick == 1.0 else clock.seconds(clock.ticks[0]) + zero
    steps = np.diff(ticks)
    assert ticks[0] == pytest.approx(facts["first"], rel=1e-15)
    assert ticks[-1] == pytest.approx(facts["last"], rel=1e-15)
    forward = steps[steps > 0] if facts["backward"] else steps
    assert np.median(steps) == pytest.approx(facts["median_step"], rel=1e-6)
    assert forward.max() == pytest.approx(facts["max_step"], rel=7e-6) if forward.size else True
    assert np.count_nonzero(steps < 0) == facts["backward"]
    assert np.count_nonzero(steps == 0) == facts["repeated"]


def stream_of(recording: Recording, label: str) -> Stream:
    return next(stream for stream in recording.streams if label in (stream.label, stream.name))


ULOGS = [
    "px4/motor_failure.ulg",
    "px4/sample.ulg",
    "px4/sample_px4_events.ulg",
    "../flight_data/px4/sample_log_small.ulg",
]


@pytest.mark.parametrize("name", ULOGS)
def test_ulog(name: str) -> None:
    facts, recording = recorder_facts(name), read_recording(recorder(name))
    assert len(recording.streams) == facts["topics"]
    drops = [[round(at * 1e6), round(length * 1e3)] for at, length in recording.drop_outs]
    assert drops == facts["dropouts"]
    stamps = {stream.label: stream.clock("timestamp") for stream in recording.streams}
    dead = sorted(label for label, clock in stamps.items() if clock is not None and unusable(clock) is not None)
    assert dead == facts["topics_whose_clock_is_unusable"]
    long = [clock.ticks for clock in stamps.values() if clock is not None and clock.ticks.size >= 20]
    long = [ticks for ticks in long if ticks.min() != ticks.max()]
    assert [min(t.min() for t in long), max(t.max() for t in long)] == facts[
        "span_of_topics_with_20_samples_or_more_us"
    ]
    for label, signals in facts["signals"].items():
        clock = stamps[label]
        assert clock is not None
        same_clock(clock, signals.pop("time"))
        for field, expected in signals.items():
            same_values(stream_of(recording, label).columns[field].load(), expected)


@pytest.mark.parametrize("name", ["pymavlink_test.BIN", "center_0003.bin", "jd_21-19-07.bin", "nan.log"])
def test_dataflash(name: str) -> None:
    facts, recording = recorder_facts(f"ardupilot/{name}"), read_recording(recorder(f"ardupilot/{name}"))
    assert recording.messages == facts["messages"]
    assert len(recording.counts) == facts["types"]
    assert {kind: recording.counts[kind] for kind in facts["count"]} == facts["count"]
    over = facts["bytes_left_over"]
    notes = [note for note in recording.notes if "inside a message" in note]
    assert notes == ([f"the file ends inside a message ({over} bytes over); the complete part is read"] if over else [])
    order = np.concatenate([stream.order for stream in recording.streams if stream.order is not None])
    stamps = np.concatenate([stream.clocks[0].seconds() for stream in recording.streams])
    in_file = stamps[np.argsort(order, kind="stable")]
    assert np.count_nonzero(np.diff(in_file) < 0) == facts["backward_steps_across_types"]
    for label, signals in facts["signals"].items():
        stream = stream_of(recording, label)
        same_clock(stream.clocks[0], signals.pop("time"))
        for field, expected in signals.items():
            same_values(stream.columns[field].load(), expected)


@pytest.mark.parametrize("name", ["eaics_flight.tlog", "vtol.tlog"])
def test_tlog(name: str) -> None:
    pytest.importorskip("pymavlink")
    facts, recording = recorder_facts(f"mavlink/{name}"), read_recording(recorder(f"mavlink/{name}"))
    assert recording.messages == facts["messages"]
    assert len(recording.counts) == facts["types"]
    assert {kind: recording.counts[kind] for kind in facts["count"]} == facts["count"]
    for sender, count in facts["sources"].items():
        assert len(facts["sources"]) == 1 or any(f"{sender} ({count} messages)" in note for note in recording.notes)
    arrivals = [(s.order, s.clock("arrival")) for s in recording.streams]
    order = np.concatenate([order for order, _ in arrivals if order is not None])
    ticks = np.concatenate([clock.ticks for _, clock in arrivals if clock is not None])[np.argsort(order)]
    same_clock(Clock("arrival", ticks, 1e-6), facts["arrival"], zero=facts["arrival"]["first"])
    for label, signals in facts["signals"].items():
        stream = stream_of(recording, label)
        own, arrival = stream.clocks[0], stream.clock("arrival")
        assert arrival is not None
        same_clock(own, signals.pop("time_boot"))
        late = arrival.ticks * 1e-6 - own.ticks * 1e-3
        expected = signals.pop("arrival_minus_boot_s")
        found = {"min": late.min(), "median": np.median(late), "max": late.max()}
        assert found == pytest.approx(expected, abs=1.1e-3)
        for field, values in signals.items():
            same_values(stream.columns[field].load(), values)


def test_mdf4() -> None:
    pytest.importorskip("asammdf")
    facts = recorder_facts("mdf4/ASAP2_Demo_V171.mf4")
    recording = read_recording(recorder("mdf4/ASAP2_Demo_V171.mf4"))
    assert len(recording.streams) == facts["groups_with_samples"]
    assert recording.utc_of_zero is not None
    assert recording.utc_of_zero.isoformat() == "2018-11-22T14:26:35.439737+00:00"
    for label, signal in facts["signals"].items():
        name, _, group = label.rstrip(")").rpartition(" (")
        stream = stream_of(recording, group)
        same_clock(stream.clocks[0], signal["time"])
        assert stream.columns[name].unit == signal["unit"]
        same_values(stream.columns[name].load(), signal["value"])


def test_mdf4_of_a_bus_logger_is_frames_and_no_signals() -> None:
    pytest.importorskip("asammdf")
    facts = recorder_facts("mdf4/css_94C49784_2.MF4")
    recording = read_recording(recorder("mdf4/css_94C49784_2.MF4"))
    assert len(recording.streams) == facts["groups_with_samples"]
    signal = facts["signals"]["CAN_DataFrame.ID (group 0)"]
    (stream,) = recording.streams
    same_clock(stream.clocks[0], signal["time"])
    same_values(stream.columns["CAN_DataFrame.ID"].load(), signal["value"])
    assert any("DBC" in note for note in recording.notes)


@pytest.mark.parametrize("name", ["raw1", "big_endian", "Digital_Input", "sample_tdms_file_v4713"])
def test_tdms(name: str) -> None:
    pytest.importorskip("nptdms")
    facts, recording = recorder_facts(f"tdms/{name}.tdms"), read_recording(recorder(f"tdms/{name}.tdms"))
    assert sum(len(stream.columns) for stream in recording.streams) == facts["channels"]
    assert len({stream.name for stream in recording.streams}) == facts["groups"]
    for label, signal in facts["signals"].items():
        group, _, channel = label.rpartition("/") if name != "Digital_Input" else label.rpartition("/Dev")
        channel = channel if name != "Digital_Input" else f"Dev{channel}"
        stream = next(s for s in recording.streams if s.name == group and channel in s.columns)
        same_values(stream.columns[channel].load(), signal["value"])
        assert stream.columns[channel].unit == signal["unit"]
        if signal["increment_s"] is None:
            assert stream.clocks == ()
        else:
            np.testing.assert_allclose(np.diff(stream.clocks[0].ticks), signal["increment_s"], rtol=1e-9)
        without = signal["start"] in ("None", "1904-01-01T00:00:00.000000")
        start = recording.utc_of_zero
        assert without == (start is None)
        assert start is None or f"{start:%Y-%m-%dT%H:%M:%S.%f}" == signal["start"]


def test_matlab73() -> None:
    pytest.importorskip("h5py")
    for name in ("matlab73/mat73_testfile4.mat", "matlab73/mat73_testfile12.mat"):
        columns = {
            label: column
            for stream in read_recording(recorder(name)).streams
            for label, column in stream.columns.items()
        }
        for label, signal in recorder_facts(name)["signals"].items():
            # Text is not a channel, nor is an array that MATLAB calls empty and writes as its dimensions.
            empty = label == "rec_img/current_params"
            assert (label in columns) == (signal["matlab_class"] != "char" and not empty)
            if label in columns:
                same_values(columns[label].load(), signal["value"])


def test_hdf5() -> None:
    pytest.importorskip("h5py")
    recording = read_recording(recorder("hdf5/gdr_1.h5"))
    facts = recorder_facts("hdf5/gdr_1.h5")["signals"]
    (stream,) = recording.streams
    stamps = stream.columns["DasRawData/DasTimeArray"].load()
    assert stamps.dtype == np.uint64
    assert set(np.diff(stamps.astype(np.int64))) <= {999_936, 1_000_192, 1_000_000, 999_680, 1_000_448}
    matrix = np.column_stack([stream.columns[f"DasRawData/RawData[{k}]"].load() for k in range(10)])
    same_values(matrix.ravel(), facts["DasRawData/RawData"]["value"])


def test_parquet() -> None:
    facts = recorder_facts("parquet/adsb_ezy158t.parquet")
    (stream,) = read_recording(recorder("parquet/adsb_ezy158t.parquet")).streams
    clock = stream.clock("time")
    assert clock is not None
    assert clock.ticks.size == facts["rows"]
    assert np.count_nonzero(np.diff(clock.ticks) < 0) == facts["time"]["backward"]
    for name in ("first_row", "last_row"):
        at = {"first_row": 0, "last_row": -1}[name]
        seconds = np.datetime64(facts["time"][name][:19], "s").astype(np.int64)
        assert clock.seconds()[at] == seconds
    reports = stream.columns["lastposupdate"].load()
    assert reports.size - np.unique(reports).size == facts["rows_whose_position_report_is_not_new"]
    for name, expected in facts["signals"].items():
        same_values(stream.columns[name].load(), expected)


@pytest.mark.parametrize("name", ["discrete.c10", "c10tools_1.c10"])
def test_irig106(name: str) -> None:
    pytest.importorskip("chapter10")
    facts, recording = recorder_facts(f"chapter10/{name}"), read_recording(recorder(f"chapter10/{name}"))
    assert recording.messages == facts["packets"]
    assert {label: recording.counts[label] for label in facts["by_channel"]} == facts["by_channel"]
    for label, count in facts["messages"].items():
        assert stream_of(recording, label).clocks[0].ticks.size == count
    packets = stream_of(recording, "packets").clocks[0].ticks
    rtc = facts["rtc"]
    steps = np.diff(packets)
    assert (packets[0], packets[-1]) == (rtc["first"], rtc["last"])
    assert np.count_nonzero(steps < 0) == rtc["backward"]
    assert np.count_nonzero(steps == 0) == rtc["repeated"]
    assert facts["time_packets"] == sum(count for label, count in recording.counts.items() if ":Time" in label)
    assert facts.get("rtc_minus_absolute_drift_ppm") != 0.3 or any("0.3 ppm" in note for note in recording.notes)
    assert recording.utc_of_zero is None


@pytest.mark.parametrize("name", ["olsztyn", "new_date_format", "skytraxx21-2023-04-15"])
def test_igc(name: str) -> None:
    pytest.importorskip("aerofiles")
    facts = recorder_facts(f"igc/{name}.igc")
    (stream,) = read_recording(recorder(f"igc/{name}.igc")).streams
    clock = stream.clocks[0]
    same_clock(clock, facts["time"])
    assert clock.ticks.size == facts["fixes"]
    assert np.datetime64(int(clock.ticks[0]), "ms").astype("datetime64[D]").astype(str) == facts["date"]
    assert str(np.datetime64(int(clock.ticks[0]), "ms").astype("datetime64[s]")) == facts["first"][:19].replace(
        " ", "T"
    )
    same_values(stream.columns["pressure_alt"].load(), facts["pressure_alt_m"])
    same_values(stream.columns["gps_alt"].load(), facts["gps_alt_m"])
    assert list(stream.columns)[4:] == facts["extra"]


@pytest.mark.parametrize("name", ["garmin/log_110812_095915_KCKN.csv", "garmin/log_20260327_152821_KOAK.csv"])
def test_garmin(name: str) -> None:
    facts, recording = recorder_facts(name), read_recording(recorder(name))
    (stream,) = recording.streams
    assert len(stream.columns) == facts["columns"]
    clock = stream.clocks[0]
    same_clock(clock, facts["time"])
    assert clock.ticks.size == facts["rows"]
    for label, expected in facts["signals"].items():
        values = stream.columns[stream.aliases.get(label, label)].load()
        same_values(values, expected)
        assert np.flatnonzero(np.isfinite(values))[0] == expected["first_row_with_a_value"]


def test_jsbsim() -> None:
    facts = recorder_facts("simulators/JSBout172B.csv")
    (stream,) = read_recording(recorder("simulators/JSBout172B.csv")).streams
    assert len(stream.columns) == facts["columns"]
    same_clock(stream.clocks[0], facts["time"])
    for label, expected in facts["signals"].items():
        same_values(stream.columns[stream.aliases[label]].load(), expected)


def test_station_csv() -> None:
    facts = recorder_facts("station_csv/ch47_wind.csv")
    (stream,) = read_recording(recorder("station_csv/ch47_wind.csv")).streams
    assert len(stream.columns) == facts["columns"]
    clock = stream.clocks[0]
    np.testing.assert_array_equal(clock.seconds()[[0, -1]], [facts["time"]["first"], facts["time"]["last"]])
    assert set(np.diff(clock.seconds())) == {0.5}
    for label, expected in facts["signals"].items():
        same_values(stream.columns[label].load(), expected)


TOPICS = ["airspeed_0", "vehicle_attitude_0", "actuator_controls_0_0", "vehicle_gps_position_0", "wind_estimate_0"]


@pytest.mark.parametrize("topic", TOPICS)
def test_topics_as_csv(topic: str) -> None:
    from aerosid.logs.stamps import StampSettings, holes

    name = f"px4/proto_flt09/Proto_FLT09_{topic}.csv.gz"
    facts = recorder_facts(name)
    (stream,) = read_recording(recorder(name)).streams
    clock = stream.clocks[0]
    assert clock.tick == TICKS["us"]
    same_clock(clock, facts["time"])
    assert (clock.ticks.size, len(stream.columns)) == (facts["rows"], facts["columns"])
    found = holes(clock.seconds(), StampSettings(hole=8.0))
    assert found.shape[0] == facts["holes"]
    for (low, high), (at, length) in zip(found, facts["holes_over_8_median"], strict=False):
        assert (round(low * 1e6), round(high - low, 4)) == (at, pytest.approx(length, abs=1.1e-4))
    for label, expected in facts["signals"].items():
        same_values(stream.columns[label].load(), expected)


def test_truncated_hdf5_is_refused_in_one_sentence(tmp_path: Any) -> None:
    pytest.importorskip("h5py")
    whole = recorder("hdf5/gdr_1.h5").read_bytes()
    path = tmp_path / "log.h5"
    path.write_bytes(whole[: 2 * len(whole) // 3])
    with pytest.raises(LogError, match=r"log\.h5: the HDF5 file is damaged or truncated .*copy or save it again\.$"):
        read_recording(path)


def test_a_folder_of_topics_is_one_recording() -> None:
    """Every topic is interrupted for 0.7 to 0.8 s at seven places: eight segments or more, no sample in a gap."""
    folder = recorder("px4/proto_flt09/Proto_FLT09_airspeed_0.csv.gz").parent
    parts = read_segments(folder)
    for hole in (355.92, 440.9, 608.57, 682.86, 831.2):
        assert not any(np.any(np.abs(part.time - hole - 0.35) < 0.2) for part in parts)
    assert sum(part.time[-1] - part.time[0] for part in parts) > 500.0
    log = read_log(folder)
    assert {"V", "p", "q", "r", "theta", "phi", "delta_e"} <= set(log.channels)
    assert 12.0 < np.nanmean(log["V"]) < 20.0
    rate = log["q"] * np.cos(log["phi"]) - log["r"] * np.sin(log["phi"])
    pitch = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(log.time))])
    level = np.abs(log["theta"]) < 1.0
    assert np.corrcoef(np.gradient(log["theta"])[level], np.gradient(pitch)[level])[0, 1] > 0.8
