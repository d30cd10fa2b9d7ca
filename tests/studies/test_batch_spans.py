"""Batches of spans: lists with LOG@FROM:TO, segment files, and the manoeuvres found in a flight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from problems import BOTH_SQUARES, LIGHT, Problem

from aerosid.cli.close_loop import read_roles
from aerosid.errors import LogError, UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.log_writing import native_csv
from aerosid.loop.settings import LoopSettings
from aerosid.studies.batch import LogFile, find_logs, run_batch
from aerosid.studies.batch.logs import find_manoeuvres_of
from aerosid.studies.workers import Workers

QUICK = LoopSettings(catalogue="terms", paper_chain=False)


def flight_of(parts: int) -> FlightLog:
    """Manoeuvres from one trim with half a minute of steady flight before and after each."""
    manoeuvre = Problem(undeclared=BOTH_SQUARES, duration=6.0).fly(1)
    interval = manoeuvre.interval
    random = np.random.default_rng(1)
    rest = np.arange(0.0, 30.0, interval)
    level = {name: float(np.mean(values[:20])) for name, values in manoeuvre.channels.items()}
    quiet = {name: float(np.std(np.diff(values[:20]))) for name, values in manoeuvre.channels.items()}
    blocks: dict[str, list[np.ndarray]] = {name: [] for name in manoeuvre.channels}
    samples = 0
    for n in range(parts + 1):
        for name in blocks:
            blocks[name].append(level[name] + quiet[name] * random.standard_normal(rest.size))
        samples += rest.size
        if n < parts:
            for name in blocks:
                blocks[name].append(manoeuvre[name])
            samples += manoeuvre.samples
    channels = {name: np.concatenate(values) for name, values in blocks.items()}
    return FlightLog("flight", interval * np.arange(samples), channels, manoeuvre.units)


@pytest.fixture(scope="module")
def flight_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("flight") / "flight.csv"
    path.write_text(native_csv(flight_of(2), "two manoeuvres from one trim", 9))
    return path


def test_lists_may_hold_spans(flight_file: Path) -> None:
    listing = flight_file.parent / "list.txt"
    listing.write_text("flight.csv@28:38  # the first\nflight.csv@64:74\n")
    logs = find_logs(listing, None)
    assert [log.name for log in logs] == ["flight_28-38", "flight_64-74"]
    assert len({log.content for log in logs}) == 2
    listing.write_text("flight.csv@28:38\nflight.csv@28:38\n")
    with pytest.raises(UsageError, match="this name"):
        find_logs(listing, None)


def test_a_segment_file_is_a_batch(flight_file: Path) -> None:
    segments = flight_file.parent / "segments.csv"
    segments.write_text("log,from,to,role,name\nflight.csv,28,38,,first\nflight.csv,64,74,validation,second\n")
    logs = find_logs(segments, None)
    assert [log.name for log in logs] == ["first", "second"]
    assert logs[0].path == f"{flight_file}@28:38"


def test_found_manoeuvres_are_a_batch(flight_file: Path) -> None:
    logs = find_manoeuvres_of([LogFile(str(flight_file), "flight", "")], None)
    assert len(logs) == 2
    # The inputs begin at 31 s and 67 s; 0.3 V/g of quiet flight before them, 3 s, is included.
    starts = [float(log.path.rpartition("@")[2].split(":")[0]) for log in logs]
    assert starts == pytest.approx([28.0, 64.0], abs=0.5)


def test_a_flight_without_manoeuvres_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cruise.csv"
    path.write_text(native_csv(flight_of(0), "cruise", 9))
    with pytest.raises(LogError, match="no elevator manoeuvre"):
        find_manoeuvres_of([LogFile(str(path), "cruise", "")], None)
    with pytest.raises(LogError, match="no elevator manoeuvre"):
        read_roles([str(path)], [], None, find=True)


def test_close_loop_takes_what_is_found_and_roles_of_segments(flight_file: Path) -> None:
    found = read_roles([str(flight_file)], [], None, find=True)
    assert len(found.identification) == 2
    assert all(log.samples < 0.4 * flight_of(2).samples for log in found.identification)
    segments = flight_file.parent / "roles.toml"
    entry = '[[segment]]\nlog = "flight.csv"\nfrom = {}\nto = {}\nrole = "{}"\n'
    segments.write_text(entry.format(28, 38, "identification") + entry.format(64, 74, "validation"))
    roled = read_roles([str(segments)], [f"{flight_file}@40:60"], None)
    assert [log.name for log in roled.identification] == ["flight_28-38"]
    assert [log.name for log in roled.validation] == ["flight_64-74", "flight_40-60"]
    segments.write_text(entry.format(28, 38, "validation"))
    with pytest.raises(UsageError, match="no log is left to identify from"):
        read_roles([str(segments)], [], None)


@pytest.mark.slow
def test_the_loop_closes_on_each_found_manoeuvre(flight_file: Path, tmp_path: Path) -> None:
    logs = find_manoeuvres_of([LogFile(str(flight_file), "flight", "")], None)
    batch = run_batch(logs, LIGHT, tmp_path, settings=QUICK, reports=False, workers=Workers(1))
    assert batch.failures == {}
    for row in batch.rows.values():
        (pitch,) = [each for each in row["derivatives"] if (each["coefficient"], each["term"]) == ("C_m", "alpha")]
        assert abs(pitch["value"] + 0.729) < 0.1


def test_a_single_recording_or_span_is_a_batch_of_one(flight_file: Path, tmp_path: Path) -> None:
    assert [log.name for log in find_logs(flight_file, None)] == ["flight"]
    (lone,) = find_logs(Path(f"{flight_file}@28:38"), None)
    assert (lone.name, lone.path) == ("flight_28-38", f"{flight_file}@28:38")
    # Bytes that are not text, and a text whose first line is not a path.
    (tmp_path / "garbage.mat").write_bytes(bytes(range(256)) * 4)
    (tmp_path / "long.txt").write_text("column " * 999 + "\n1 2\n")
    for name in ("garbage.mat", "long.txt"):
        assert [log.path for log in find_logs(tmp_path / name, None)] == [str(tmp_path / name)]
    # A list with one log is a list.
    (tmp_path / "list.txt").write_text("garbage.mat\n")
    assert [log.name for log in find_logs(tmp_path / "list.txt", None)] == ["garbage"]
