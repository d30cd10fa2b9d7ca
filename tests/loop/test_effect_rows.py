"""What is unseen has its say beside each effect: the mark of what predicts it no better, and where there is none."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from problems import entry
from problems_report import closed_loop

from aerosid.loop.effect_rows import Evidence, effect_row, improves_prediction
from aerosid.reporting.result_json import result_file, result_text
from aerosid.reporting.words import UNCONFIRMED, effect_sentence
from aerosid.search.findings import Finding, identity

TERM = Finding("aero_term", "C_m", "alpha^2", entry("C_m", "alpha^2"), -1.7, 0.1, "1", None, 1e-9, 40.0)
JUMP = replace(TERM, kind="step_change", term="", entry=None, time=6.0)


@pytest.mark.parametrize(
    ("gains", "held_out", "wanted"),
    [({}, {}, None), ({"v": 1.3}, {}, True), ({"v": 1.0}, {}, False), ({"v": 1.3}, {"v": 0.9}, False)],
)
def test_where_the_simulation_decides_the_open_loop_error_tells(
    gains: dict[str, float], held_out: dict[str, float], wanted: bool | None
) -> None:
    keyed = [{identity(TERM): value for value in each.values()} for each in (gains, held_out)]
    better = improves_prediction(TERM, *keyed, regressed=False)
    assert better is wanted
    row = effect_row(1, TERM, Evidence(None, 1e-9, None, 40.0, unseen_better=better))
    assert effect_sentence(row).endswith(UNCONFIRMED) is (wanted is False)


def test_where_the_equations_decide_their_vote_tells_and_a_jump_is_asked_nothing() -> None:
    voted = replace(TERM, unseen_better=False)
    assert improves_prediction(voted, {identity(TERM): 1.5}, {}, regressed=True) is False
    assert improves_prediction(JUMP, {identity(JUMP): 0.99}, {}, regressed=False) is None


def test_of_several_fitted_logs_a_step_change_tells_its_own() -> None:
    evidence, jump = Evidence(None, 1e-9, None, 40.0), replace(JUMP, log="flight 3")
    alone, one_of_two = (effect_row(1, jump, evidence, several=several) for several in (False, True))
    assert effect_sentence(alone) == "C_m changes in a step at 6.00 s"
    assert effect_sentence(one_of_two) == "C_m changes in a step at 6.00 s of flight 3"
    rows = json.loads(result_text(replace(closed_loop(), effects=(alone, one_of_two))))["effects"]
    assert [row.get("log") for row in rows] == [None, "flight 3"]


def test_the_mark_stands_in_result_json_where_it_was_asked() -> None:
    made = closed_loop()
    first, *others = made.effects
    marked = replace(first, evidence=replace(first.evidence, unseen_better=False))
    rows = result_file(replace(made, effects=(marked, *others))).effects
    assert rows[0].evidence.unseen_better is False
    assert rows[1].evidence.unseen_better is None
