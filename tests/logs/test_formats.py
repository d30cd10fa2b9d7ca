"""Readers: values, units, missing samples and formats; damaged files raise a single kind of error."""

from __future__ import annotations

import contextlib
import csv
import gzip
import hashlib
import io
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from broken_inputs import BARE, BROKEN, GOOD, HEADER, MAP, ROWS, Broken
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from recordings import recording

from aerosid.aircraft.bundled import bundled_folder
from aerosid.cli.main import main
from aerosid.errors import AerosidError, LogError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import FORMATS, read_log
from aerosid.logs.formats.units import UnitProblem, conversion

SHARED_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
numbers = st.floats(-1e12, 1e12).filter(lambda x: x == 0.0 or abs(x) > 1e-150)


def write(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_native_log_reads_as_the_csv_module_does(tmp_path: Path) -> None:
    path = write(tmp_path, "log.csv", GOOD)
    log = read_log(path)
    header, *rows = csv.reader(io.StringIO(GOOD))
    for column, field in enumerate(header):
        name = field.split()[0]
        expected = np.array([float(row[column]) for row in rows])
        assert_array_equal(log.time if name == "time" else log[name], expected)
    assert log.name == "log"
    assert log.path == str(path)
    assert log.sha256 == hashlib.sha256(GOOD.encode()).hexdigest()
    assert list(log.channels) == ["V", "alpha", "q", "delta_e"]


@pytest.mark.parametrize(
    "content",
    [
        GOOD.encode("utf-8-sig"),
        GOOD.replace("\n", "\r\n").encode(),
        GOOD.replace("\n", "\r").encode(),
        ("# one\n\n  # two [rad]\n" + GOOD).encode(),
        GOOD.replace(",", " , ").encode(),
        (GOOD + "\n\n  \n").encode(),
        GOOD.replace("\n", "\n\n").encode(),
        GOOD.replace("alpha [rad]", '"alpha [rad]"').encode(),
        gzip.compress(GOOD.encode()),
    ],
    ids=["BOM", "CRLF", "CR", "comments", "spaces", "blank end", "blank between", "quotes", "gzip"],
)
def test_native_log_in_the_spellings_of_other_programs(tmp_path: Path, content: bytes) -> None:
    plain = read_log(write(tmp_path, "plain.csv", GOOD))
    other = read_log(write(tmp_path, "other.csv", content))
    assert list(other.channels) == list(plain.channels)
    assert_array_equal(other.time, plain.time)
    for name in plain.channels:
        assert_array_equal(other[name], plain[name])


@SHARED_FOLDER
@given(st.lists(st.tuples(st.none() | numbers, st.none() | numbers), min_size=10, max_size=40))
def test_written_numbers_come_back(tmp_path: Path, samples: list[tuple[float | None, float | None]]) -> None:
    text = "time [s],alpha [rad],oil [widget]\n" + "".join(
        f"{k},{'' if a is None else repr(a)},{'' if b is None else repr(b)}\n" for k, (a, b) in enumerate(samples)
    )
    log = read_log(write(tmp_path, "log.csv", text))
    for column, name in enumerate(("alpha", "oil")):
        expected = np.array([math.nan if sample[column] is None else sample[column] for sample in samples])
        assert_allclose(log[name], expected, rtol=1e-15, atol=0.0)
    assert log.units["oil"] == "widget"


@pytest.mark.parametrize(
    ("unit", "wanted", "factor"),
    [
        ("deg", "rad", math.pi / 180),
        ("°", "rad", math.pi / 180),
        ("deg/s", "rad/s", math.pi / 180),
        ("DEG/S2", "rad/s^2", math.pi / 180),
        ("1", "rad", 1.0),
        ("1/s", "rad/s", 1.0),
        ("kt", "m/s", 1852 / 3600),
        ("km/h", "m/s", 1 / 3.6),
        ("ft/s", "m/s", 0.3048),
        ("ft/min", "m/s", 0.3048 / 60),
        ("g", "m/s^2", 9.80665),
        ("m/s²", "m/s^2", 1.0),
        ("M/S**2", "m/s^2", 1.0),
        ("m s^-2", "m/s^2", 1.0),
        ("ft/s^2", "m/s^2", 0.3048),
        ("hPa", "Pa", 100.0),
        ("lbf/ft^2", "Pa", 4.4482216152605 / 0.3048**2),
        ("PA", "Pa", 1.0),
        ("ft", "m", 0.3048),
        ("Kg/m3", "kg/m^3", 1.0),
        ("slug/ft^3", "kg/m^3", 14.59390293720636 / 0.3048**3),
        ("g", "kg", 1e-3),
        ("lb", "kg", 0.45359237),
        ("lbf", "N", 4.4482216152605),
        ("kN", "N", 1e3),
        ("%", "1", 0.01),
        ("--", "1", 1.0),
        ("ms", "s", 1e-3),
        ("rpm", "rad/s", 2 * math.pi / 60),
    ],
)
def test_units_against_their_definitions(unit: str, wanted: str, factor: float) -> None:
    found = conversion(unit, wanted)
    assert found.factor == pytest.approx(factor, rel=1e-9)
    assert found.shift == 0.0


@pytest.mark.parametrize(
    ("unit", "wanted"),
    [
        ("m", "rad"),
        ("%", "rad"),
        ("Hz", "rad/s"),
        ("deg", "1"),
        ("MPA", "Pa"),
        ("dB", "1"),
        ("m^99", "m"),
        ("m/", "m"),
        ("A0", "m"),
        ("m^0", "1"),
    ],
)
def test_units_of_another_kind_are_refused(unit: str, wanted: str) -> None:
    with pytest.raises(UnitProblem, match="unit"):
        conversion(unit, wanted)


@settings(deadline=None)
@given(st.text(max_size=30))
def test_any_unit_text_is_read_or_refused(unit: str) -> None:
    try:
        found = conversion(unit, "m")
    except UnitProblem:
        return
    assert math.isfinite(found.factor)
    assert found.factor != 0.0


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "   "])
@pytest.mark.parametrize(
    ("header", "by_name"),
    [
        ("", False),
        ("t a b\n", True),
        ("# t a b\n", True),
        ("a title of any length\n\nt a b\ns deg kt\n\n", True),
        ("3 VALUES FOLLOW, taken at noon; x\nt a b\n s deg kt\n", True),
    ],
)
def test_ascii_columns(tmp_path: Path, delimiter: str, header: str, by_name: bool) -> None:
    names = header.replace("t a b", delimiter.join("tab")).replace("s deg kt", delimiter.join(("s", "deg", "kt")))
    body = "".join(delimiter.join((f"{0.5 * k}", f"{k}", f"-{k}e1")) + "\n" for k in range(12))
    path = write(tmp_path, "log.txt", names + body)
    columns = ("t", "a", "b") if by_name else (1, 2, 3)
    a_unit = "" if "deg" in header else ', unit = "deg"'
    write(
        tmp_path,
        "channels.toml",
        f"""schema = 1
time = {{ column = {columns[0]!r}, unit = "s" }}
[channels]
alpha = {{ column = {columns[1]!r}{a_unit} }}
V = {{ column = {columns[2]!r}, unit = "m/s", sign = -1 }}
""",
    )
    log = read_log(path)
    k = np.arange(12)
    assert_array_equal(log.time, 0.5 * k)
    assert_allclose(log["alpha"], np.radians(k), rtol=1e-14)
    assert_array_equal(log["V"], 10.0 * k)


def test_ascii_empty_fields_are_missing_and_units_may_stand_in_brackets(tmp_path: Path) -> None:
    rows = [f"{k};{'' if k in (0, 4) else k};{'' if k == 11 else 2 * k}" for k in range(12)]
    path = write(tmp_path, "log.csv", "t [s];angle (deg);load [%]\n" + "\n".join(rows) + "\n")
    write(
        tmp_path,
        "log.csv.channels.toml",
        'schema = 1\nformat = "ascii"\ntime = { column = "t" }\n[channels]\nalpha = { column = "angle" }\n'
        'load = { column = "load" }\n',
    )
    log = read_log(path)
    assert_array_equal(np.flatnonzero(np.isnan(log["alpha"])), [0, 4])
    assert_array_equal(np.flatnonzero(np.isnan(log["load"])), [11])
    assert log["alpha"][1] == pytest.approx(math.radians(1))
    assert log.units["load"] == "%"


def test_a_tab_at_the_end_is_a_missing_sample(tmp_path: Path) -> None:
    write(tmp_path, "channels.toml", MAP)
    log = read_log(write(tmp_path, "log.tsv", "\n".join(f"{k}\t1\t{'' if k > 9 else k}" for k in range(12)) + "\n"))
    assert_array_equal(np.flatnonzero(np.isnan(log["alpha"])), [10, 11])


MATLAB_MAP = """schema = 1
time = {{ column = {0}, unit = "s" }}
[channels]
alpha = {{ column = {1}, unit = "deg" }}
"""
K = np.arange(15.0)


@pytest.mark.parametrize(
    ("variables", "columns"),
    [
        ({"data": np.column_stack([K, 2 * K])}, ("1", "2")),
        ({"data": np.vstack([K, 2 * K])}, ("1", "2")),
        ({"t": K, "al": 2 * K, "note": "text", "rate": 10.0}, ('"t"', '"al"')),
        ({"t": K[:, None], "al": 2 * K[None, :]}, ('"t"', '"al"')),
        ({"flight": {"t": K, "al": 2 * K, "pilot": "A"}}, ('"t"', '"al"')),
        ({"flight": {"t": K, "air": {"al": 2 * K}}}, ('"t"', '"air.al"')),
        ({"one": {"t": K}, "two": {"al": 2 * K}}, ('"one.t"', '"two.al"')),
        ({"t": K, "m": np.column_stack([3 * K, 2 * K])}, ('"t"', "2")),
        ({"t": np.arange(15, dtype=np.int16), "al": (2 * K).astype(np.float32)}, ('"t"', '"al"')),
    ],
    ids=["matrix", "wide", "vectors", "rows", "struct", "nested", "two structs", "mixed", "integers"],
)
@pytest.mark.parametrize("compressed", [False, True])
def test_matlab_layouts(tmp_path: Path, variables: dict[str, Any], columns: tuple[str, str], compressed: bool) -> None:
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, variables, do_compression=compressed)
    log = read_log(path, write(tmp_path, "map.toml", MATLAB_MAP.format(*columns)))
    assert_array_equal(log.time, K)
    assert_allclose(log["alpha"], np.radians(2 * K), rtol=1e-14)


@pytest.mark.parametrize(
    "variables",
    [{"name": "no numbers"}, {"x": np.array([1.0 + 2j] * 20)}, {"x": np.column_stack([K, np.full(15, np.inf)])}],
)
def test_matlab_without_channels(tmp_path: Path, variables: dict[str, Any]) -> None:
    scipy.io.savemat(tmp_path / "log.mat", variables)
    with pytest.raises(AerosidError, match=r"log\.mat: (the file holds|sample 1, column 2 is)"):
        read_log(tmp_path / "log.mat", write(tmp_path, "map.toml", MATLAB_MAP.format(1, 2)))


@pytest.mark.parametrize("broken", BROKEN, ids=str)
def test_broken_input_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str], broken: Broken) -> None:
    path = tmp_path / broken.file
    if broken.content is not None:
        path.write_bytes(broken.content)
    if broken.channel_map is not None:
        write(tmp_path, "channels.toml", broken.channel_map)
    before = sorted(tmp_path.iterdir())
    code = main(["check", str(path)])
    captured = capsys.readouterr()
    assert code == broken.code, captured.err
    assert captured.err.count("\n") == 1
    assert captured.err.rstrip().endswith(".")
    assert len(captured.err) < 600 + len(str(path)) * 3
    assert "Traceback" not in captured.err
    for words in broken.names:
        assert words in captured.err
    assert captured.out == ""
    assert sorted(tmp_path.iterdir()) == before


def test_a_folder_is_no_log(tmp_path: Path) -> None:
    folder = tmp_path / "log.csv"
    folder.mkdir()
    with pytest.raises(AerosidError, match="cannot be opened"):
        read_log(folder)


@pytest.mark.parametrize("row", [0, 19_999, 20_000, 44_999])
def test_the_bad_line_of_a_long_log_is_named(tmp_path: Path, row: int) -> None:
    rows = [f"{0.01 * k:.2f},100,0,0,0" for k in range(45_000)]
    rows[row] = rows[row].replace("100", "1o0")
    with pytest.raises(AerosidError, match=rf"line {row + 2}, column 2 holds '1o0'"):
        read_log(write(tmp_path, "log.csv", HEADER + "\n".join(rows)))


def test_a_long_log_with_missing_last_fields_keeps_every_sample(tmp_path: Path) -> None:
    rows = [f"{0.01 * k:.2f},100,0,0,{'' if k % 3 else k}" for k in range(45_000)]
    log = read_log(write(tmp_path, "log.csv", HEADER + "\n".join(rows)))
    k = np.arange(45_000)
    assert_array_equal(log["delta_e"], np.where(k % 3 == 0, k, np.nan))


def _outcome(path: Path) -> FlightLog | None:
    with contextlib.suppress(AerosidError):
        return read_log(path)
    return None


@SHARED_FOLDER
@given(st.data())
def test_damaged_files_are_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    scipy.io.savemat(tmp_path / "good.mat", {"t": K, "al": {"b": 2 * K}})
    sources = {"log.csv": GOOD.encode(), "log.asc": BARE.encode(), "log.mat": (tmp_path / "good.mat").read_bytes()}
    write(tmp_path, "log.asc.channels.toml", MAP)
    write(tmp_path, "log.mat.channels.toml", MATLAB_MAP.format('"t"', '"al.b"'))
    name = data.draw(st.sampled_from(sorted(sources)))
    content = bytearray(sources[name])
    start = data.draw(st.integers(0, len(content) - 1))
    patch = data.draw(st.binary(max_size=12))
    content[start : start + data.draw(st.integers(0, 12))] = patch
    del content[data.draw(st.integers(start, len(content))) :]
    log = _outcome(write(tmp_path, name, bytes(content)))
    if log is not None:
        assert log.samples >= 10
        assert not any(np.isinf(values).any() for values in log.channels.values())


def test_a_matlab_file_whose_sizes_do_not_fit_what_it_holds_is_refused(tmp_path: Path) -> None:
    """A library that followed such lengths read outside the file's memory, and the interpreter crashed."""
    scipy.io.savemat(tmp_path / "log.mat", {"t": K, "al": {"b": 2 * K}})
    write(tmp_path, "log.mat.channels.toml", MATLAB_MAP.format('"t"', '"al.b"'))
    whole = (tmp_path / "log.mat").read_bytes()
    sizes = whole.index(struct.pack("<4I", 5, 8, 1, K.size))
    name = whole.index(b"b", whole.index(b"al"))
    for place, wrong in ((sizes + 8, b"\x09"), (sizes + 4, b"\xff"), (sizes + 15, b"\x7f"), (name - 4, b"\x40")):
        content = bytearray(whole)
        content[place : place + 1] = wrong
        with pytest.raises(AerosidError, match=r"log\.mat: the MATLAB file is damaged or truncated \("):
            read_log(write(tmp_path, "log.mat", bytes(content)))


@SHARED_FOLDER
@given(st.binary(max_size=300), st.sampled_from(["log.csv", "log.csv.gz"]))
def test_random_bytes_are_refused(tmp_path: Path, content: bytes, name: str) -> None:
    assert _outcome(write(tmp_path, name, content)) is None


def test_uninitialised_words_are_missing_and_noted(tmp_path: Path) -> None:
    text = GOOD.replace(ROWS[2], "0.2,2.5823e-304,0,0,0")
    log = read_log(write(tmp_path, "log.csv", text))
    assert_array_equal(np.flatnonzero(np.isnan(log["V"])), [2])
    assert any("V: 1 uninitialised" in note for note in log.notes)


def test_velocities_become_airspeed_and_angles(tmp_path: Path) -> None:
    k = np.arange(20)
    speed, alpha, beta = 80.0 + k, 0.01 * k, 0.002 * k
    u, v, w = speed * np.cos(alpha) * np.cos(beta), speed * np.sin(beta), speed * np.sin(alpha) * np.cos(beta)
    rows = "\n".join(f"{0.1 * i:.1f},{u[i]!r},{v[i]!r},{w[i]!r}" for i in k).replace("np.float64(", "").replace(")", "")
    log = read_log(write(tmp_path, "log.csv", "time [s],u [m/s],v [m/s],w [m/s]\n" + rows))
    assert_allclose(log["V"], speed, rtol=1e-13)
    assert_allclose(log["alpha"], alpha, atol=1e-14)
    assert_allclose(log["beta"], beta, atol=1e-14)
    assert log.sources["alpha"].columns == ("u", "v", "w")
    assert any(note.startswith("alpha: computed from") for note in log.notes)


def test_recorded_alpha_wins_over_velocities(tmp_path: Path) -> None:
    rows = "\n".join(f"{k},100,5,0.125" for k in range(12))
    log = read_log(write(tmp_path, "log.csv", "time [s],u [m/s],w [m/s],alpha [rad]\n" + rows))
    assert_array_equal(log["alpha"], np.full(12, 0.125))
    assert_allclose(log["V"], math.hypot(100, 5))


@pytest.mark.parametrize(
    ("name", "channel_map", "samples", "interval"),
    [
        ("hfb320/hfb320_1_10.asc", "hfb320", 601, 0.1),
        ("attas/fAttasElv1.mat", "attas_mat", 626, 0.04),
        ("attas/fAttas_qst01_withHeader.asc", "attas_stall", 3001, 0.04),
        ("twin_otter/totter_demo_018.csv", "twin_otter", 401, 0.02),
        ("twin_otter/totter_lon_020213f1_017.csv", "twin_otter", 301, 0.02),
        ("citation/seg_ref_20180312_shortperiod.csv", "citation", 401, 0.1),
        ("citation/phlab_ref_20180312_full_10Hz.csv.gz", "citation", 48321, 0.1),
    ],
)
def test_recordings_read_in_si(name: str, channel_map: str, samples: int, interval: float) -> None:
    """Physics that fails with a wrong unit or sign: theta' = q, mean of 1 g, elevator against pitch acceleration."""
    path = recording(name)
    log = read_log(path, bundled_folder("flight_data") / "channel_maps" / f"{channel_map}.toml")
    assert log.samples == samples
    assert log.interval == pytest.approx(interval)
    flying = log.between(3300.0, 3700.0) if samples > 40_000 else log
    rate = flying["q"] * np.cos(flying["phi"]) - flying["r"] * np.sin(flying["phi"])
    pitch = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(flying.time))])
    trend = np.polynomial.polynomial.Polynomial.fit(flying.time, flying["theta"] - pitch, 1)
    assert np.std(flying["theta"] - pitch - trend(flying.time)) < 0.2 * np.std(flying["theta"])
    assert -10.6 < np.mean(flying["a_z"]) < -9.0
    moment = np.gradient(flying["q"], flying.time)
    assert np.corrcoef(np.gradient(moment), np.gradient(flying["delta_e"]))[0, 1] < 0.0
    assert 60.0 < np.nanmean(flying["V"]) < 140.0
    assert -0.01 < np.mean(flying["alpha"]) < 0.2


def test_every_format_is_described() -> None:
    for entry in FORMATS.values():
        assert entry.description
        assert all(suffix.startswith(".") for suffix in entry.suffixes)


@pytest.mark.parametrize(("separator", "words"), [(";", "semicolons"), ("\t", "tabs")])
def test_a_header_with_other_separators_is_told_with_the_way_to_read_it(
    separator: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "flight.csv"
    path.write_text(separator.join(("time [s]", "V [m/s]")) + f"\n0,0{separator}100,5\n")
    with pytest.raises(LogError, match=f"separates its columns by {words}.* `aerosid channels` propose"):
        read_log(path)
