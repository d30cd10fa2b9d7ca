"""The loop by method iebmee from end to end, and what it says beside the likelihood."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from problems import BOTH_SQUARES, LIGHT, Problem, native_csv

from aerosid.cli.main import main
from aerosid.errors import EstimationError, UsageError
from aerosid.estimation.manoeuvre import prepare
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.identification import declared_with_candidates
from aerosid.loop.identification_problem import IdentificationProblem
from aerosid.loop.methods import run_method
from aerosid.loop.result import ClosedLoop
from aerosid.loop.second_opinion import note_without_second_opinion, second_opinion
from aerosid.loop.settings import METHODS, LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.reporting.result_json import result_text

PLANTED = Problem(undeclared=BOTH_SQUARES)
FLIGHTS = PLANTED.fly(31, "identification"), replace(PLANTED, elevator="3211", amplitude=0.045).fly(32, "validation")
QUIET = LoopSettings(method="iebmee", paper_chain=False, next_flight=False)


@pytest.fixture(scope="module")
def result() -> ClosedLoop:
    return close_loop(FLIGHTS[:1], LIGHT, FLIGHTS[1:], QUIET)


def test_the_loop_by_d_alone_gives_everything_that_the_default_gives(result: ClosedLoop) -> None:
    assert result.verdict is Verdict.EXPLAINED
    assert {(effect.where, effect.term) for effect in result.effects} == set(BOTH_SQUARES)
    rows = [row for row in result.errors if row.role == "validation"]
    assert len(rows) == 7
    for row in rows:
        assert row.after is not None
        assert row.before is not None
        assert row.after < 1.25 * row.noise
    assert {(d.coefficient, str(d.term)) for d in result.completed_aircraft.derivatives} >= set(BOTH_SQUARES)
    assert result.second_opinion is None
    assert any("flow separation" in note for note in result.notes)
    document = json.loads(result_text(result))
    assert document["verdict"] == "explained"
    assert "second_opinion" not in document


def asked() -> IdentificationProblem:
    model, candidates = declared_with_candidates(FLIGHTS[:1], FLIGHTS[1:], LIGHT)
    flights = tuple(prepare(log, LIGHT, model.columns) for log in FLIGHTS)
    return IdentificationProblem(LIGHT, model, (), candidates, flights[:1], flights[1:])


def test_where_both_methods_name_the_same_one_line_says_so() -> None:
    question = asked()
    found = run_method(question, replace(QUIET, catalogue="terms", method="likelihood"), lambda _stage: None)
    opinion = second_opinion(question, found, replace(QUIET, catalogue="terms", method="likelihood"))
    assert opinion.agrees
    assert opinion.sentence.endswith("identifies C_X alpha^2 and C_m alpha^2 too.") or opinion.sentence.endswith(
        "identifies C_m alpha^2 and C_X alpha^2 too."
    )
    assert len(opinion.structures) == 1


def test_where_they_differ_both_stand_side_by_side_with_their_errors_on_the_unseen_flight() -> None:
    question = asked()
    terms = replace(QUIET, catalogue="terms", method="likelihood")
    lacking = replace(question, candidates=())
    found = run_method(lacking, terms, lambda _stage: None)
    opinion = second_opinion(question, found, terms)
    own, rival = opinion.structures
    assert not opinion.agrees
    assert opinion.role == "validation"
    assert (own.effects, set(rival.effects)) == ((), {"C_X alpha^2", "C_m alpha^2"})
    assert own.error is not None
    assert rival.error is not None
    assert rival.error < 1.15 < 5.0 < own.error
    # One measure for both, which needs no noise: below 1 the rival predicts better.
    assert opinion.error_ratio is not None
    assert opinion.error_ratio < 0.3
    assert f"{opinion.error_ratio:.3g} times that of the former" in opinion.sentence
    assert "the noise" not in opinion.sentence


def test_a_second_opinion_that_breaks_down_says_why_and_does_not_advise_what_was_done() -> None:
    error = EstimationError(
        "a log: the model leaves its range, so that no error can be stated; use the default method."
    )
    sentence = note_without_second_opinion(error)
    assert sentence.endswith("the model leaves its range, so that no error can be stated.")
    assert "default method" not in sentence


def test_every_method_is_one_of_the_command_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = tmp_path / "flight.csv", tmp_path / "out"
    path.write_text(native_csv(FLIGHTS[0]))
    command = ["close-loop", str(path), "--aircraft", "light_transport", "--out", str(out)]
    assert main([*command, "--method", "guess"]) == 2
    told = capsys.readouterr().err
    assert all(method in told for method in METHODS)
    assert not out.exists()


def test_a_wrong_method_is_a_usage_error() -> None:
    from aerosid.cli.close_loop import loop_settings

    with pytest.raises(UsageError, match="--method is 'x'"):
        loop_settings("off", None, False, 0, method="x")


def test_a_recursion_that_failed_is_no_witness_that_nothing_is_missing() -> None:
    """1.2 s of a flight: too short for the recursion of d(t), from which no effect is then reported to be absent."""
    log = read_log(Path(__file__).parents[2] / "flight_data" / "light_transport_doublet.csv")
    channels = {name: values[:40] for name, values in log.channels.items()}
    result = close_loop([replace(log, time=log.time[:40], channels=channels)], LIGHT)
    assert any("recursion failed" in note for note in result.notes)
    assert not any("identifies no effect either" in note for note in result.notes)
    assert result.second_opinion is None
