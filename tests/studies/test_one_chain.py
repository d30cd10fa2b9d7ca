"""A study's run, a batch's row and `close_loop` use the same chain: the same log gives equal numbers, bit for bit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from problems import LIGHT, Problem, native_csv

from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.studies.batch.one_log import BatchTask, close_one, summary_row
from aerosid.studies.journal import Row
from aerosid.studies.monte_carlo import FlownInput, StudyPlan, parse_planted
from aerosid.studies.monte_carlo.trial import Trials, run_trial
from aerosid.studies.monte_carlo.truth import make_truth

PLAN = StudyPlan(
    LIGHT,
    FlownInput(samples=240),
    effects=(parse_planted("C_m:alpha^2=-1.715"), parse_planted("sensor_bias:alpha=0.01")),
    snrs=(20.0,),
    runs=1,
)


def named(row: Row) -> list[tuple[object, ...]]:
    return [tuple(found) for found in row["found"]]


def reported(result: ClosedLoop) -> list[tuple[object, ...]]:
    return [(e.kind, e.where, e.term, e.value, e.std_error) for e in result.effects]


@pytest.mark.parametrize(
    ("catalogue", "settings"),
    [("all", LoopSettings()), ("terms", LoopSettings(catalogue="terms"))],
)
def test_a_study_s_run_is_the_loop_on_the_same_log(catalogue: str, settings: LoopSettings) -> None:
    plan = replace(PLAN, catalogue=catalogue)
    truth = make_truth(plan)
    trials = Trials(truth, plan.levels, plan.seed, plan.catalogue)
    row = run_trial(trials, "0/0")
    result = close_loop([trials.log(0, 0)], LIGHT, settings=settings)
    assert reported(result)
    assert named(row) == reported(result)
    values = {(r.coefficient, r.term): (r.value, r.std_error) for r in result.derivatives}
    study = {
        (coefficient, str(term)): (value, error)
        for (coefficient, term), value, error in zip(truth.free, row["values"], row["own"], strict=True)
    }
    assert {entry: values[entry] for entry in study} == study


def test_a_batch_s_row_is_the_loop_on_the_same_log(tmp_path: Path) -> None:
    path = tmp_path / "doublet.csv"
    path.write_text(native_csv(Problem(undeclared={("C_m", "alpha^2"): -1.7}, duration=6.0).fly(3)), encoding="utf-8")
    task = BatchTask({"doublet": (str(path), "doublet")}, LIGHT, None, None, LoopSettings(next_flight=False))
    alone = summary_row(close_loop([read_log(path)], LIGHT))
    assert alone["effects"]
    assert close_one(task, "doublet") == alone
