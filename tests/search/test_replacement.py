"""The comparison is fair: the rivals fly the same aircraft, agree among themselves, and are scored as is said."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from aerosid.aircraft.bundled import bundled_folder
from aerosid.logs.formats import read_log
from benchmarks.contest_section import contest_section
from benchmarks.page import page_html
from benchmarks.plain_c import find_compiler
from benchmarks.rivals import contest
from benchmarks.rivals.equations import simulate
from benchmarks.rivals.octave import OctaveOutputError, find_octave
from benchmarks.rivals.output_error import OutputError, by_solve_ivp
from benchmarks.rivals.plain_c_output_error import compiled
from benchmarks.rivals.task import SAMPLE_SEED, Answer, Record, Task, names_of, sample_flight, sample_task
from benchmarks.sections import Section, Table, markdown

Array = np.ndarray


@cache
def task() -> Task:
    return sample_task()


@cache
def bound() -> Array:
    return task().bound()


def sample() -> Record:
    return next(iter(task().flights(1)))


@cache
def scipys_answer() -> Answer:
    return OutputError()(task(), sample())


def test_the_first_flight_is_the_sample_flight_and_others_differ_in_noise_alone() -> None:
    path = bundled_folder("flight_data") / "light_transport_doublet.csv"
    log, made = read_log(str(path)), sample_flight(SAMPLE_SEED)
    for name in log.channels:
        assert np.max(np.abs(log[name] - made[name])) <= 1e-6 * np.max(np.abs(log[name]))  # seven digits are written
    clean = sample_flight(0, noisy=False)
    for seed in (1, 2):
        noise = sample_flight(seed)["q"] - clean["q"]
        assert np.std(noise) == pytest.approx(0.0012, rel=0.1)


def test_the_rivals_fly_the_same_aircraft() -> None:
    """Their equations, written anew, against aerosid's own flight; and scipy's integrator against the fixed steps."""
    clean = Record(sample_flight(0, noisy=False))
    V, alpha, q, theta, _, _, h = clean.measured[0]
    start = np.array([V * np.cos(alpha), V * np.sin(alpha), q, theta, h])
    flown = simulate(start, clean.time, clean.elevator, task().true, task().body)
    assert np.max(np.abs(flown - clean.measured) / task().deviations) < 1e-2
    integrated = by_solve_ivp(start, clean.time[:120], clean.elevator[:120], task().true, task().body)
    assert np.max(np.abs(flown[:120] - integrated) / task().deviations) < 1e-2


def test_scipys_estimate_is_near_its_bound() -> None:
    answer = scipys_answer()
    errors = (answer.values - task().true)[task().structure] / bound()
    assert 0.5 < np.sqrt(np.mean(errors**2)) < 2.0
    assert answer.std_errors is not None
    assert np.all(answer.std_errors[task().structure] < 1.5 * bound())


def _agrees_with_scipy(answer: Answer) -> None:
    mine, other = scipys_answer(), answer
    assert mine.std_errors is not None
    assert other.std_errors is not None
    places = task().structure
    assert np.max(np.abs(mine.values - other.values)[places] / bound()) < 0.01
    np.testing.assert_allclose(mine.std_errors[places], other.std_errors[places], rtol=0.005)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler on this machine")
def test_output_error_in_c_is_that_of_scipy(tmp_path: Path) -> None:
    tool = compiled(tmp_path)
    assert tool is not None
    _agrees_with_scipy(tool(task(), sample()))


@pytest.mark.slow
def test_output_error_in_octave_is_that_of_scipy() -> None:
    command = find_octave()
    if command is None:
        pytest.skip("GNU Octave is not installed")
    _agrees_with_scipy(OctaveOutputError(command)(task(), sample()))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "worst"), [("filterpy UKF", 3.0), ("PySINDy", 20.0), ("aerosid", 3.0)])
def test_every_other_tool_finds_the_derivatives(name: str, worst: float, tmp_path: Path) -> None:
    (rival,) = (rival for rival in contest.RIVALS if rival.name == name)
    tool = rival.make(tmp_path)
    if tool is None:
        pytest.skip(rival.lacking)
    errors = (tool(task(), sample()).values - task().true)[task().structure] / bound()
    assert np.max(np.abs(errors)) < worst


def _off_by(bounds: float, deviation: float, named: bool) -> contest.Tool:
    """A tool whose every answer is so many bounds too large, with that deviation, in bounds."""

    def tool(given: Task, _record: Record) -> Answer:
        values, errors = given.true.copy(), np.full(given.true.shape, np.nan)
        values[given.structure] += bounds * bound()
        errors[given.structure] = deviation * bound()
        missing = given.structure & (given.declared == 0.0)
        return Answer(values, errors, names_of(missing) if named else frozenset())

    return tool


def test_scores_follow_their_definitions(tmp_path: Path) -> None:
    made = (
        contest.Rival("near", False, "", lambda _folder: _off_by(0.5, 1.0, True)),
        contest.Rival("far", False, "", lambda _folder: _off_by(3.0, 1.0, False)),
        contest.Rival("absent", True, "", contest._lazily("no_such_module", "tool"), "not installed"),
    )
    near, far, absent = contest.compete(tmp_path, 2, made)
    assert (near.error, near.worst, near.covered, near.right) == (pytest.approx(0.5), pytest.approx(0.5), 1.0, 2)
    assert near.error_deviation == pytest.approx(0.0, abs=1e-12)
    assert (far.error, far.covered, far.right, far.flights) == (pytest.approx(3.0), 0.0, 0, 2)
    assert (absent.missing, absent.seconds) == ("not installed", None)


def test_the_page_holds_what_the_terminal_says_and_texts_stay_texts() -> None:
    hostile = "<img src=x onerror=alert(1)>"
    section = Section("one", hostile, ("A paragraph.", Table(("tool", "s"), ((hostile, "1.5"),), 1, "Times")))
    page = page_html([section], [hostile])
    assert "<img" not in page
    assert page.count("&lt;img src=x") >= 3
    assert '<td class="n">1.5</td>' in page
    assert f"| {hostile} | 1.5 |" in markdown(section)
    assert "http" not in page.replace("http-equiv", "")


@pytest.mark.slow
def test_a_tool_that_is_not_installed_has_its_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from aerosid.reporting.figures.numbered import FigureBook

    lacking = contest.Rival("a filter", True, "", lambda _folder: None, "not installed")
    own = [rival for rival in contest.RIVALS if rival.name in ("aerosid", "aerosid, aerodynamic terms")]
    monkeypatch.setattr("benchmarks.contest_section.RIVALS", (*own, lacking))
    monkeypatch.setattr(contest, "MOST_ROUNDS", 1)
    section = contest_section(tmp_path, FigureBook(), 1)
    text = markdown(section)
    assert "| a filter | not installed |" in text
