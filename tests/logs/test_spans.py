"""Spans of recordings and segment files: their meaning, and one-sentence errors where they are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from broken_inputs import GOOD
from hypothesis import example, given
from hypothesis import strategies as st

from aerosid.errors import LogError, UsageError
from aerosid.logs.spans import Span, expand, parse_span, read_segment_file, read_span

ENDS = st.one_of(st.none(), st.floats(-1e6, 1e6, allow_nan=False))


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "flight.csv"
    path.write_text(GOOD)
    return path


@given(ENDS, ENDS)
@example(1e6, 999999.9999999999)
def test_a_span_reads_back_what_it_writes(start: float | None, stop: float | None) -> None:
    if start is not None and stop is not None and not start < stop:
        start, stop = stop, start
    if start is not None and stop == pytest.approx(start, rel=1e-14, abs=0.0):  # the same in the digits written
        stop = None
    again = parse_span(str(Span(Path("folder/flight.csv.gz"), start, stop)))
    assert again.path == Path("folder/flight.csv.gz")
    for wanted, found in ((start, again.start), (stop, again.stop)):
        assert (wanted is None) == (found is None)
        assert found == pytest.approx(wanted, rel=1e-14) if wanted is not None else found is None


def test_a_span_is_cut_and_named(log: Path) -> None:
    cut = read_span(f"{log}@0.5:1.5", None)
    assert (cut.time[0], cut.time[-1]) == (pytest.approx(0.5), pytest.approx(1.5))
    assert cut.name == "flight_0.5-1.5"
    assert read_span(str(log), None).name == "flight"
    assert read_span(f"{log}@1:", None).time[0] == pytest.approx(1.0)
    assert read_span(f"{log}@:1", None).time[-1] == pytest.approx(1.0)


def test_a_file_whose_name_looks_like_a_span_is_itself(tmp_path: Path) -> None:
    path = tmp_path / "run@1:2"
    path.write_text(GOOD)
    assert parse_span(path) == Span(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("flight.csv@a:2", "'a' is not a time"),
        ("flight.csv@3:2", "earlier time first"),
        ("flight.csv@2:2", "earlier time first"),
        ("flight.csv@nan:2", "a number of seconds"),
        ("flight.csv@1:inf", "a number of seconds"),
    ],
)
def test_a_wrong_span_is_refused_in_one_sentence(text: str, words: str) -> None:
    with pytest.raises(UsageError) as caught:
        parse_span(text)
    assert words in str(caught.value)


def test_a_span_outside_the_recording_is_refused(log: Path) -> None:
    with pytest.raises(LogError, match="the log runs from"):
        read_span(f"{log}@100:200", None)


TOML = """
[[segment]]
log = "flight.csv"
from = 0.5
to = 1.5
role = "identification"
name = "doublet"
[[segment]]
log = "flight.csv"
from = 1.6
role = "validation"
"""

CSV = """# two of one flight
log,from,to,role,name
flight.csv,0.5,1.5,identification,doublet
flight.csv,1.6,,validation,
"""


@pytest.mark.parametrize(("suffix", "content"), [("toml", TOML), ("csv", CSV)])
def test_segment_files_say_the_same_in_both_forms(log: Path, suffix: str, content: str) -> None:
    path = log.parent / f"segments.{suffix}"
    path.write_text(content)
    spans = expand([path])
    assert spans == (
        Span(log, 0.5, 1.5, "identification", "doublet"),
        Span(log, 1.6, None, "validation", ""),
    )
    assert read_span(spans[0], None).name == "doublet"


def test_a_log_is_no_segment_file(log: Path) -> None:
    assert expand([log]) == (Span(log),)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[[segment]]\nfrom = 1\n", "names no log"),
        ('[[segment]]\nlog = "a.csv"\nform = 1\n', "'form'"),
        ('[[segment]]\nlog = "a.csv"\nrole = "fit"\n', "expected one of identification, validation, hold_out"),
        ('[[segment]]\nlog = "a.csv"\nfrom = "soon"\n', "expected a time in s"),
        ('[[segment]]\nlog = "a.csv"\nfrom = true\n', "expected a time in s"),
        ('[[segment]]\nlog = "a.csv"\nfrom = 3\nto = 2\n', "earlier time first"),
        ('[[segment]]\nlog = "a.csv"\nname = "../up"\n', "not a file name"),
        ('[[segment]]\nlog = "a"\nname = "x"\n[[segment]]\nlog = "a"\nname = "x"\n', "two segments"),
        ("[segment]\n", "double brackets"),
        ("", "lists no segment"),
        ("[[segments]]\n", "'segments'"),
        ("[[segment\n", "not valid TOML"),
    ],
)
def test_a_wrong_segment_file_is_refused_in_one_sentence(tmp_path: Path, content: str, words: str) -> None:
    path = tmp_path / "segments.toml"
    path.write_text(content)
    with pytest.raises(UsageError) as caught:
        read_segment_file(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
