"""Streams of different rates on one raster: its source, and which channels are low-passed, held, marked, aligned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import recorder_files as files
from numpy.testing import assert_allclose, assert_array_equal

from aerosid.errors import ChannelMapError, LogError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.logs.raster import Track, onto_one_raster

FIELDS = "uint64_t timestamp;float x;"


def stream(name: str, time: np.ndarray, values: np.ndarray) -> tuple[str, int, str, list[tuple[int, float]]]:
    return name, 0, FIELDS, [(round(1e6 * t), float(v)) for t, v in zip(time, values, strict=True)]


def write(folder: Path, *streams: tuple[str, int, str, list[tuple[int, float]]]) -> Path:
    path = folder / "log.ulg"
    path.write_bytes(files.ulog(streams))
    return path


def notes_contain(log: FlightLog, *words: str) -> bool:
    return any(all(word in note for word in words) for note in log.notes)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


JITTER = ("uniform", "normal")


def jittered(kind: str, step: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Stamps that deviate from uniform ones by 20 % of the step: at most, or as a standard deviation."""
    off = 0.2 * step * (rng.uniform(-1.0, 1.0, count) if kind == "uniform" else rng.normal(size=count))
    return np.sort(1.0 + step * np.arange(count) + off)


def resampled(folder: Path, kind: str, frequency: float, rng: np.random.Generator) -> FlightLog:
    """A sine at 250 Hz resampled to the 50 Hz of an attitude."""
    fast, slow = jittered(kind, 0.004, 5000, rng), jittered(kind, 0.02, 1000, rng)
    channels = {"q": {"column": "gyro.x", "unit": "rad/s"}, "theta": {"column": "att.x", "unit": "rad"}}
    sine = np.sin(2 * np.pi * frequency * fast)
    return read_log(write(folder, stream("gyro", fast, sine), stream("att", slow, np.cos(slow))), channels)


@pytest.mark.parametrize("kind", JITTER)
def test_a_sine_keeps_amplitude_and_time_as_it_comes_down_in_rate(
    tmp_path: Path, rng: np.random.Generator, kind: str
) -> None:
    """3 Hz from jittered 250 Hz onto jittered 50 Hz: amplitude within .5 %, delay within 1 ms."""
    log = resampled(tmp_path, kind, 3.0, rng)
    turn = 2 * np.pi * 3.0 * log.time
    along, across = np.linalg.lstsq(np.column_stack([np.sin(turn), np.cos(turn)]), log["q"], rcond=None)[0]
    assert abs(np.hypot(along, across) - 1.0) < 0.005
    assert abs(np.arctan2(across, along)) / (2 * np.pi * 3.0) < 1e-3
    assert_allclose(log["theta"], np.cos(log.time), atol=1e-6)
    assert notes_contain(log, "raster: 50", "the stamps of theta")
    assert notes_contain(log, "q: low-passed above 15 Hz and resampled from 2", "delay of 0.18 s is compensated")


@pytest.mark.parametrize("kind", JITTER)
def test_what_would_alias_is_gone(tmp_path: Path, rng: np.random.Generator, kind: str) -> None:
    """40 Hz sampled at 50 Hz would alias to 10 Hz; near the ends, where the filter is cut off, some remains."""
    log = resampled(tmp_path, kind, 40.0, rng)
    inside = (log.time > 1.2) & (log.time < 20.8)
    assert np.abs(log["q"][inside]).max() < 0.01
    assert np.sqrt(np.mean(log["q"] ** 2)) < 0.02
    assert log.time[0] < 1.05
    assert log.time[-1] > 20.95


def test_a_table_is_resampled_to_the_raster_of_its_map(tmp_path: Path, rng: np.random.Generator) -> None:
    """The same for one table: its switch is held, its sine low-passed."""
    time = jittered("uniform", 0.004, 5000, rng)
    rows = np.column_stack([time, np.sin(6 * np.pi * time) + np.sin(80 * np.pi * time), time > 10.0])
    path = tmp_path / "fast.csv"
    path.write_text("t,rate,gear\n" + "\n".join(",".join(f"{x:.7g}" for x in row) for row in rows) + "\n")
    channels = {"q": {"column": "rate", "unit": "rad/s"}, "gear": {"column": 3, "unit": "1", "held": True}}
    log = read_log(path, {"schema": 1, "raster": 50, "time": {"column": "t", "unit": "s"}, "channels": channels})
    assert_allclose(np.diff(log.time), 0.02, rtol=1e-9)
    inside = slice(10, -10)
    assert_allclose(log["q"][inside], np.sin(6 * np.pi * log.time[inside]), atol=0.011)
    assert_array_equal(log["gear"], log.time >= time[time > 10.0][0])
    assert notes_contain(log, "raster: 50 Hz, as set in the map")


def test_a_raster_that_a_table_cannot_fill_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "slow.csv"
    path.write_text("t,rate\n" + "\n".join(f"{k},{k}" for k in range(30)) + "\n")
    with pytest.raises(LogError, match="no stretch of 10 samples"):
        read_log(
            path,
            {"schema": 1, "raster": 0.2, "time": {"column": "t", "unit": "s"},
             "channels": {"q": {"column": "rate", "unit": "rad/s"}}},
        )  # fmt: skip


def test_a_raster_told_by_rate(tmp_path: Path) -> None:
    time = np.arange(0.0, 20.0, 0.05)
    path = write(tmp_path, stream("gyro", time, np.sin(time)), stream("att", time + 0.02, np.cos(time + 0.02)))
    mapped = {"q": {"column": "gyro.x", "unit": "rad/s"}, "theta": {"column": "att.x", "unit": "rad"}}
    log = read_log(path, {"schema": 1, "raster": 25, "channels": mapped})
    assert_allclose(np.diff(log.time), 0.04, rtol=1e-9)
    assert_allclose(log["q"], np.sin(log.time), atol=4e-4)
    assert notes_contain(log, "raster: 25 Hz, as set in the map")
    assert notes_contain(log, "q, theta: interpolated from 20 to 25 Hz")


def test_a_slow_output_keeps_only_its_own_samples_and_a_slow_condition_is_interpolated(tmp_path: Path) -> None:
    fast, slow = np.arange(0.0, 20.0, 0.02), np.arange(0.01, 20.0, 1.0)
    path = write(
        tmp_path,
        stream("gyro", fast, np.sin(fast)),
        stream("baro", slow, 100 + 3 * slow),
        stream("fuel", slow, 900 - slow),
    )
    log = read_log(path, {
        "q": {"column": "gyro.x", "unit": "rad/s"}, "h": {"column": "baro.x", "unit": "m"},
        "mass": {"column": "fuel.x", "unit": "kg"},
    })  # fmt: skip
    there = np.isfinite(log["h"])
    assert 18 <= np.count_nonzero(there) <= 20
    assert_allclose(log["h"][there], 100 + 3 * log.time[there], rtol=1e-6)
    assert np.count_nonzero(np.isfinite(log["mass"])) > 900
    assert_allclose(log["mass"][100:900], 900 - log.time[100:900], rtol=1e-6)
    assert notes_contain(log, "h: 1 Hz: kept at the instants nearest its own samples")
    assert notes_contain(log, "mass: interpolated from 1 to 50 Hz as a slow quantity")


def test_switches_are_held(tmp_path: Path) -> None:
    fast, slow = np.arange(0.0, 20.0, 0.02), np.arange(0.0, 20.0, 2.5)
    path = write(tmp_path, stream("gyro", fast, np.sin(fast)), stream("gear", slow, np.arange(8) % 2))
    log = read_log(path, {
        "q": {"column": "gyro.x", "unit": "rad/s"}, "gear": {"column": "gear.x", "unit": "1", "held": True},
    })  # fmt: skip
    assert_array_equal(log["gear"], np.floor(log.time / 2.5 + 1e-9) % 2)
    assert notes_contain(log, "gear: held from each sample to the next")


@pytest.mark.parametrize(("rate", "fits"), [(24.0, False), (26.0, True)])
def test_a_control_slower_than_half_the_motion_is_refused(tmp_path: Path, rate: float, fits: bool) -> None:
    fast, slow = np.arange(0.0, 20.0, 0.02), np.arange(0.0, 20.0, 1.0 / rate)
    path = write(tmp_path, stream("gyro", fast, np.sin(fast)), stream("servo", slow, np.sin(slow)))
    channels = {"q": {"column": "gyro.x", "unit": "rad/s"}, "delta_e": {"column": "servo.x", "unit": "rad"}}
    if fits:
        assert read_log(path, channels).samples > 900
        return
    with pytest.raises(LogError, match=r"control delta_e is sampled at 24 Hz and the motion at 50 Hz.*`raster = 24`"):
        read_log(path, channels)
    assert read_log(path, {"schema": 1, "raster": 24, "channels": channels}).samples > 400


def test_channels_of_one_stream_are_not_touched(tmp_path: Path, rng: np.random.Generator) -> None:
    time = np.cumsum(rng.uniform(0.01, 0.03, 400))
    values = rng.normal(size=400).astype(np.float32)
    rows = [(round(1e6 * t), float(v), float(2 * v)) for t, v in zip(time, values, strict=True)]
    path = tmp_path / "log.ulg"
    path.write_bytes(files.ulog([("imu", 0, "uint64_t timestamp;float a;float b;", rows)]))
    log = read_log(path, {"q": {"column": "imu.a", "unit": "rad/s"}, "r": {"column": "imu.b", "unit": "rad/s"}})
    assert_array_equal(log["q"], values.astype(float))
    assert_array_equal(log["r"], 2.0 * values.astype(float))
    assert not notes_contain(log, "raster")


def test_a_heading_that_passes_north_is_not_interpolated_through_south() -> None:
    slow, fast = np.arange(0.0, 20.0, 0.1), np.arange(0.05, 19.0, 0.1)
    heading = np.radians((350.0 + 4.0 * slow) % 360.0)
    segments, _ = onto_one_raster(
        [Track("q", fast, np.sin(fast)), Track("psi", slow, heading)], (), None, "log"
    )  # fmt: skip
    expected = np.radians((350.0 + 4.0 * segments[0].time) % 360.0)
    assert_allclose(segments[0].channels["psi"], expected, atol=1e-9)


def test_channels_without_a_common_stretch_are_refused() -> None:
    early, late = np.arange(0.0, 5.0, 0.1), np.arange(10.0, 15.0, 0.1)
    with pytest.raises(LogError, match=r"channel theta begins at 10 s, after q ends at 4\.9 s"):
        onto_one_raster([Track("q", early, early), Track("theta", late, late)], (), None, "log")


def aligned(folder: Path, rng: np.random.Generator, align: bool) -> FlightLog:
    """Two recorders of one pitch rate; the second's clock is ahead by 0.137 s and gains 40 ppm."""
    true = np.arange(5.0, 295.0, 0.02)
    motion = np.sin(2 * np.pi * 0.31 * true) * np.exp(-(((true % 60) - 30) ** 2) / 200) + 0.3 * np.sin(0.7 * true)
    other = true + 0.137 + 40e-6 * (true - 150.0)
    path = write(
        folder,
        stream("ahrs", true, motion + rng.normal(0, 0.01, true.size)),
        stream("logger", other, motion + rng.normal(0, 0.01, true.size)),
    )
    channels = {"q": {"column": "ahrs.x", "unit": "rad/s"}, "q_logger": {"column": "logger.x", "unit": "rad/s"}}
    return read_log(path, {"schema": 1, "channels": channels} | ({"align": {"q_logger": "q"}} if align else {}))


def test_clocks_are_laid_over_each_other_if_asked(tmp_path: Path, rng: np.random.Generator) -> None:
    apart, together = aligned(tmp_path, rng, False), aligned(tmp_path, rng, True)
    note = next(note for note in together.notes if "is ahead of that of q by" in note)
    assert "both are removed" in note
    left = next(note for note in apart.notes if "is ahead of that of q by" in note)
    assert '`q_logger = "q"` in [align] aligns them' in left
    words = note.replace("(", " ").split()
    offset, deviation = float(words[words.index("by") + 1]), float(words[words.index("+-") + 1])
    drift, drift_deviation = float(words[words.index("gains") + 1]), float(words[words.index("gains") + 3])
    assert abs(offset - 0.137) < 3.0 * deviation
    assert abs(drift - 40.0) < 3.0 * drift_deviation

    def difference(log: FlightLog) -> float:
        both = log["q"] - log["q_logger"]
        return float(np.nanstd(both))

    assert difference(together) < 0.02 < 0.05 < difference(apart)


def test_an_alignment_of_unlike_signals_is_refused(tmp_path: Path, rng: np.random.Generator) -> None:
    time = np.arange(0.0, 60.0, 0.05)
    path = write(tmp_path, stream("a", time, rng.normal(size=1200)), stream("b", time, rng.normal(size=1200)))
    channels = {"q": {"column": "a.x", "unit": "rad/s"}, "r": {"column": "b.x", "unit": "rad/s"}}
    with pytest.raises(LogError, match="r and q do not contain the same signal"):
        read_log(path, {"schema": 1, "channels": channels, "align": {"r": "q"}})
    still = write(tmp_path, stream("a", time, np.sin(time)), stream("b", time, np.ones(1200)))
    with pytest.raises(LogError, match="r and q do not contain the same signal"):
        read_log(still, {"schema": 1, "channels": channels, "align": {"r": "q"}})
    with pytest.raises(ChannelMapError, match="names w, which is not a channel of the map"):
        read_log(path, {"schema": 1, "channels": channels, "align": {"w": "q"}})
