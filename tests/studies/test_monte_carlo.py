"""Studies: their noise, their statistics, and results independent of workers and interruptions."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from lateral_problems import PITCH, SIDE, commuter
from numpy.typing import NDArray
from problems import LIGHT

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.errors import AerosidError, UsageError
from aerosid.flight_model.input_shapes import Multisine, patterns
from aerosid.reporting.paper import page_pdf
from aerosid.studies.monte_carlo import FlownInput, StudyPlan, parse_planted, run_study, write_study
from aerosid.studies.monte_carlo.elevator import SHAPES, RecordedInput, deflection, in_turn
from aerosid.studies.monte_carlo.noise_draw import ColouredNoise, redrawn
from aerosid.studies.monte_carlo.page import drawn_figures, page_html
from aerosid.studies.monte_carlo.run import JOURNAL, Study
from aerosid.studies.monte_carlo.statistics import level_statistics
from aerosid.studies.monte_carlo.trial import Trials, run_trial
from aerosid.studies.monte_carlo.truth import make_truth
from aerosid.studies.monte_carlo.words import StudyWords, plan_of
from aerosid.studies.source_digest import source_state
from aerosid.studies.workers import FAILURE, Workers

Array = NDArray[np.float64]
SQUARES = (parse_planted("C_X:alpha^2=3.6089"), parse_planted("C_m:alpha^2=-1.715"))
SMALL = StudyPlan(
    LIGHT, FlownInput(samples=240), effects=SQUARES, snrs=(None, 20.0), colours=(0.0, 0.8), runs=3, catalogue="known"
)
FILES = ("study.json", "runs.parquet", "study.html", "study.pdf")
HERE = Path(__file__).parents[1]


def study_in(folder: Path, plan: StudyPlan, workers: Workers) -> Study:
    study = run_study(plan, folder, workers)
    write_study(study, folder)
    return study


def written(folder: Path) -> list[bytes]:
    return [(folder / name).read_bytes() for name in FILES]


def test_one_worker_or_two_write_the_same_bytes(tmp_path: Path) -> None:
    study = study_in(tmp_path / "one", SMALL, Workers(1))
    assert [level.runs for level in study.levels] == [1, 3, 3]
    study_in(tmp_path / "two", SMALL, Workers(2))
    assert written(tmp_path / "one") == written(tmp_path / "two")
    table = pq.read_table(tmp_path / "one" / "runs.parquet").to_pylist()
    content = json.loads((tmp_path / "one" / "study.json").read_text(encoding="utf-8"))
    for level, label, colour in ((1, "20", 0.0), (2, "20", 0.8)):
        rows = [row for row in table if (row["snr"], row["noise_colour"]) == (label, colour)]
        for derivative in content["levels"][level]["derivatives"]:
            name = f"{derivative['coefficient']} {derivative['term']}"
            errors = [row[name] - derivative["true"] for row in rows]
            assert derivative["bias"] == pytest.approx(np.mean(errors), rel=1e-9, abs=1e-15)
            covered = [abs(e) < 1.96 * row[f"{name} std_error"] for e, row in zip(errors, rows, strict=True)]
            assert derivative["coverage95"] == pytest.approx(np.mean(covered))
    # Without noise the estimates equal the truth, and no intervals are reported.
    for derivative in content["levels"][0]["derivatives"]:
        assert abs(derivative["bias"]) < 1e-3 * abs(derivative["true"])
        assert derivative["crlb"] is None
        assert derivative["coverage95"] is None


@pytest.mark.slow
def test_more_runs_are_added_to_those_that_are_there(tmp_path: Path) -> None:
    run_study(SMALL, tmp_path / "grown", Workers(1))
    grown = replace(SMALL, runs=6)
    announced: list[tuple[int, int]] = []
    run_study(grown, tmp_path / "grown", Workers(2), lambda items, done: announced.append((items, done)))
    assert announced == [(13, 7)]
    study_in(tmp_path / "grown", grown, Workers(4))
    study_in(tmp_path / "fresh", grown, Workers(4))
    assert written(tmp_path / "grown") == written(tmp_path / "fresh")
    with pytest.raises(UsageError, match="other settings"):
        run_study(replace(grown, seed=1), tmp_path / "grown", Workers(1))


COMMAND = [
    *(sys.executable, "-m", "aerosid", "study", "--aircraft", "light_transport", "--catalogue", "known"),
    *("--effect", "C_m:alpha^2=-1.715", "--samples", "240", "--snr", "20", "--runs", "16", "--workers", "2"),
]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is a signal of POSIX systems")
def test_killed_three_times_it_ends_as_if_it_had_run_through(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE.parent), os.environ.get("PYTHONPATH", "")])}

    def start(name: str) -> "subprocess.Popen[bytes]":
        words = [*COMMAND, "--out", str(tmp_path / name)]
        return subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL)

    assert start("through").wait() == 0
    journal = tmp_path / "killed" / JOURNAL
    for least in (0, 3, 9):
        process = start("killed")
        deadline = time.monotonic() + 300.0
        while not journal.exists() or journal.read_bytes().count(b"\n") - 1 < least:
            assert process.poll() is None or least == 0
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert not (tmp_path / "killed" / "study.json").exists()
    assert start("killed").wait() == 0
    assert written(tmp_path / "through") == written(tmp_path / "killed")


@pytest.mark.slow
def test_a_dask_cluster_of_two_workers_gives_the_same_bytes(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the optional extra 'cluster' is not installed")
    study_in(tmp_path / "here", SMALL, Workers(2))
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        study_in(tmp_path / "there", SMALL, Workers(scheduler=cluster.scheduler_address))
    assert written(tmp_path / "here") == written(tmp_path / "there")


@pytest.mark.slow
def test_the_search_finds_what_is_planted_and_nothing_else(tmp_path: Path) -> None:
    plan = replace(SMALL, flown=FlownInput(), snrs=(20.0,), colours=(0.0,), runs=40, catalogue="terms")
    study = run_study(plan, tmp_path, Workers(2))
    (level,) = study.levels
    assert level.detected == 1.0
    assert level.false_alarms is not None
    assert level.false_alarms <= 0.05
    for row in level.prediction:
        assert row.before is not None
        assert row.after is not None
        assert row.after < 0.2 * row.before
    for row in level.derivatives:
        assert row.rmse_over_crlb is not None
        assert 0.7 < row.rmse_over_crlb < 1.4  # of 40 runs, the ratio scatters by 11 %


@pytest.mark.slow
def test_a_log_as_the_base_is_flown_again_with_its_own_noise(tmp_path: Path) -> None:
    flights = HERE.parent / "flight_data"
    words = StudyWords("light_transport", base=flights / "light_transport_doublet.csv", runs=12)
    study = run_study(plan_of(words), tmp_path, Workers(2))
    (level,) = study.levels
    assert level.snr == "recorded"
    assert {(row.where, row.term) for row in level.named if row.true is not None} == {
        ("C_X", "alpha^2"),
        ("C_m", "alpha^2"),
    }
    made_with = {"V": 0.15, "alpha": 0.0015, "q": 0.0012, "theta": 0.0012, "a_x": 0.02, "a_z": 0.05, "h": 0.3}
    for name, deviation in made_with.items():
        assert level.noise[name] == pytest.approx(deviation, rel=0.15)


def test_statistics_are_those_of_the_runs() -> None:
    """Rows made by the test, with known errors and standard errors, against sums over single rows."""
    trials = Trials(make_truth(SMALL), SMALL.levels, 0, "terms")
    truth = trials.truth
    true = [truth.model.value(entry) for entry in truth.free]
    rng = np.random.default_rng(5)
    rows, count, last = [], 400, len(true) - 1
    bound = np.array([0.1 * abs(value) for value in true])
    another = [["sensor_bias", "V", "", 1.0, 0.1]]
    planted = [["aero_term", e.where, e.term, e.value, 0.1] for e in SQUARES]
    for run in range(count):
        errors = 0.1 * rng.standard_normal(len(true))
        values: list[float | None] = [v + e for v, e in zip(true, errors, strict=True)]
        lacking = run % 4 == 0
        if lacking:
            values[last] = None
        rows.append(
            {
                "values": values,
                "own": [0.1] * last + [None if lacking else 0.1],
                "published": [0.05] * last + [None if lacking else 0.05],
                "plain": [0.01] * last + [None if lacking else 0.01],
                "found": planted[:1] if lacking else [*planted, *(another if run == 1 else [])],
                "before": [2.0] * 6,
                "after": [1.0] * 5 + [None],
            }
        )
    failed = {FAILURE: "nothing came of it."}
    level = level_statistics(trials, 1, [*rows, failed], bound)
    assert (level.runs, level.failed) == (count, 1)
    assert level.detected == 0.75
    assert level.false_alarms == 1 / count
    assert [(row.kind, row.share) for row in level.named] == [
        ("aero_term", 1.0), ("aero_term", 0.75), ("sensor_bias", 1 / count)
    ]  # fmt: skip
    assert [row.after for row in level.prediction] == [1.0] * 5 + [None]
    assert level.prediction[5].departed == 1.0
    for n, row in enumerate(level.derivatives):
        errors = np.array([(r["values"][n] or 0.0) - true[n] for r in rows])
        assert row.bias == pytest.approx(errors.mean())
        assert row.median_error == pytest.approx(np.median(errors))
        assert row.rmse == pytest.approx(np.sqrt(np.mean(errors**2)))
        assert row.rmse_over_crlb == pytest.approx(row.rmse / bound[n])
        inside = [r["values"][n] is not None and abs(e) < 0.1959964 for r, e in zip(rows, errors, strict=True)]
        assert row.coverage95 == pytest.approx(np.mean(inside))
        assert row.std_error == pytest.approx(0.1)
        assert row.coverage95_plain is not None
        assert row.coverage95_plain < 0.2
    assert level.derivatives[last].found == 0.75


def test_a_run_depends_on_its_own_number_alone() -> None:
    trials = Trials(make_truth(SMALL), SMALL.levels, 7, "known")
    other = Trials(make_truth(replace(SMALL, runs=9)), SMALL.levels, 7, "known")
    np.testing.assert_array_equal(trials.log(1, 2)["q"], other.log(1, 2)["q"])
    drawn = [trials.log(level, run)["alpha"] for level, run in ((1, 0), (1, 1), (2, 0))]
    noise = [values - trials.log(0, 0)["alpha"] for values in drawn]
    relation = np.corrcoef(noise)
    assert np.max(np.abs(relation - np.eye(3))) < 0.3
    assert noise[0].std() == pytest.approx(trials.truth.signal[1] / 20.0, rel=0.15)
    spawned = np.random.SeedSequence(7).spawn(3)[1].spawn(3)[2]
    again = np.random.default_rng(spawned).standard_normal((240, 6))
    expected = trials.truth.identification.outputs[:, 2] + trials.truth.signal[2] / 20.0 * again[:, 2]
    np.testing.assert_allclose(trials.log(1, 2)["q"], expected, rtol=1e-12)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_noise_has_the_covariance_that_the_bound_is_told(memory: float) -> None:
    source = ColouredNoise(memory)
    generator = np.random.default_rng(1)
    drawn = np.array([source.draw(generator, 12, 2) for _ in range(40_000)])
    expected = source.autocovariance(12, 2)
    for first in (0, 5):
        for lag in (0, 1, 4):
            measured = np.einsum("ri,rj->ij", drawn[:, first], drawn[:, first + lag]) / len(drawn)
            np.testing.assert_allclose(measured, expected[:, :, lag], atol=0.025)


def test_redrawn_noise_has_the_covariance_that_the_bound_is_told() -> None:
    generator = np.random.default_rng(2)
    shared = ColouredNoise(0.9).draw(generator, 300, 1)
    residuals = np.column_stack([2.0 * shared[:, 0], 0.5 * shared[:, 0] + 0.3 * generator.standard_normal(300)])
    residuals[7, 0] = np.nan
    source, deviation = redrawn(residuals)
    assert deviation == pytest.approx(np.nanstd(residuals, axis=0), rel=0.01)
    assert 10 < source.block < 75
    drawn = np.array([source.draw(generator, 40, 2) for _ in range(40_000)])
    expected = source.autocovariance(40, 2)
    for first in (0, 11):
        for lag in (0, 1, 9, 28):
            measured = np.einsum("ri,rj->ij", drawn[:, first], drawn[:, first + lag]) / len(drawn)
            np.testing.assert_allclose(measured, expected[:, :, lag], atol=0.03)


def test_an_effect_that_is_no_term_is_flown_and_estimated() -> None:
    others = (parse_planted("control_lag:delta_e=0.1"), parse_planted("sensor_bias:q=0.01"))
    plan = replace(SMALL, effects=(*SQUARES, *others))
    trials = Trials(make_truth(plan), plan.levels, 0, "known")
    plain = Trials(make_truth(SMALL), SMALL.levels, 0, "known")
    late = trials.truth.identification.outputs[:, 2] - 0.01
    corner = int(np.flatnonzero(np.abs(np.diff(trials.log(0, 0)["delta_e"])) > 1e-3)[0])
    assert np.abs(late[: corner + 1]).max() < 1e-6
    assert abs(late[corner + 2]) < 0.5 * abs(plain.truth.identification.outputs[corner + 2, 2])
    row = run_trial(trials, "0/0")
    np.testing.assert_allclose(row["values"], [trials.truth.model.value(e) for e in trials.truth.free], rtol=1e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"effects": ("C_m=3",)}, "--effect"),
        ({"effects": ("C_m:alpha^^2=3",)}, "alpha"),
        ({"effects": ("control_lag:alpha=0.1",)}, "control surface"),
        ({"effects": ("control_lag:delta_r=0.1",)}, "no term uses that"),
        ({"effects": ("step_change:C_m=0.1",)}, "--effect"),
        ({"effects": ("sensor_bias:delta_e=0.1",)}, "cannot|can be flown"),
        ({"effects": ("nonsense:alpha=1",)}, "Kinds"),
        ({"snr": "20,ten"}, "--snr"),
        ({"snr": "-3"}, "not positive"),
        ({"snr": "recorded"}, "--base"),
        ({"noise_colour": "1"}, "--noise-colour"),
        ({"input": "wobble"}, "--input"),
        ({"input": "0.8@1,0.6"}, "seconds at a level"),
        ({"input": "0.8@1,0.6@-2"}, "between -1 and 1"),
        ({"input": "9@1,9@-1"}, "--samples"),
        ({"input": "staircase", "unit": 0.01}, "--unit"),
        ({"input": "nowhere.csv"}, "nowhere.csv"),
        ({"amplitude": 3.0}, "--amplitude"),
        ({"samples": 3}, "--samples"),
        ({"interval": 0.0}, "--interval"),
        ({"runs": 0}, "--runs"),
        ({"measure": "V,alpha"}, "lacks q"),
        ({"measure": "V,alpha,q,psi"}, "psi"),
        ({"catalogue": "some"}, "--catalogue"),
        ({"aircraft": None}, "--aircraft"),
        ({"base": Path("a.csv"), "input": "3211"}, "--input has no effect with --base a.csv"),
        ({"base": Path("a.csv"), "noise_colour": "0.8"}, "--noise-colour has no effect"),
    ],
)
def test_wrong_words_are_refused_with_a_sentence(words: dict[str, object], message: str) -> None:
    with pytest.raises(AerosidError, match=message):
        make_truth(plan_of(StudyWords(**{"aircraft": "light_transport", **words})))  # type: ignore[arg-type]


def test_a_preset_is_the_issue_it_stands_for_and_words_win_over_it() -> None:
    plan = plan_of(StudyWords(runs=7), "accuracy")
    assert (plan.runs, plan.snrs, plan.colours) == (7, (20.0, 10.0), (0.0, 0.8))
    assert len(make_truth(plan).free) == 12
    with pytest.raises(UsageError, match="--preset"):
        plan_of(StudyWords(), "precision")


def test_texts_of_files_stay_texts_in_the_page(tmp_path: Path) -> None:
    named = replace(LIGHT, name="<img src=x onerror=alert(1)>", path="<b>.toml")
    plan = replace(SMALL, aircraft=named)
    trials = Trials(make_truth(plan), plan.levels, 0, "known")
    rows = [run_trial(trials, "1/0")]
    levels = tuple(level_statistics(trials, level, rows, None) for level in range(3))
    study = Study(plan, trials, levels, {"<i>why</i>": 1}, tmp_path, {})
    groups = drawn_figures(study)
    page = page_html(study, groups)
    assert page_pdf(page, [drawn.figure for _, drawings in groups for drawn in drawings], "0").startswith(b"%PDF")
    assert "<img" not in page
    assert "<b>" not in page.replace("<b>Figure", "")
    assert "<i>why" not in page
    assert "&lt;img src=x" in page


def test_a_declared_derivative_may_fly_with_another_value_and_is_then_not_to_be_found() -> None:
    plan = replace(SMALL, effects=(*SQUARES, parse_planted("C_m:alpha=-0.6")))
    truth = make_truth(plan)
    assert truth.planted == SQUARES
    assert [truth.model.value(e) for e in truth.free if (e[0], str(e[1])) == ("C_m", "alpha")] == [-0.6]
    assert len(truth.free) == 12


def flown(words: StudyWords) -> tuple[Array, Array]:
    """Time and the elevator's deviation from trim of a study's true flight."""
    flight = make_truth(plan_of(words)).identification.manoeuvre.flight
    return flight.time, flight.inputs[:, 8] - flight.inputs[0, 8]


def test_every_named_input_is_flown_and_every_pattern_has_a_name() -> None:
    time = np.arange(470.0) * 0.03
    for shape in SHAPES:
        found = deflection(shape, time, 0.05, None)
        assert np.all(found[time < 1.0] == 0.0)
        assert 0.049 < np.max(np.abs(found)) < 0.0501
        smaller = deflection(shape, time, -0.02, None)
        np.testing.assert_allclose(smaller, -0.4 * found, atol=1e-12)
    named = {shape.name.replace(" ", "-") for shape in patterns((1.0,), 20.0)}
    assert named - {"3-2-1-1"} <= set(SHAPES)  # that one is called 3211
    assert any(isinstance(shape, Multisine) for shape in patterns((1.0,), 20.0))


def test_steps_that_are_written_out_are_flown_as_written() -> None:
    time, elevator = flown(StudyWords("light_transport", input="0.9@1,0.6@-0.5,1.2@0.25", amplitude=0.04))
    for moment, level in ((0.5, 0.0), (1.5, 1.0), (2.2, -0.5), (3.0, 0.25), (5.0, 0.0)):
        assert elevator[np.argmin(np.abs(time - moment))] == pytest.approx(0.04 * level, abs=1e-12)


def test_an_input_that_was_designed_is_flown_from_its_file(tmp_path: Path) -> None:
    """As written by close-loop: deviation from trim, linear between rows; here with a corner between two samples."""
    path = tmp_path / "next_input.csv"
    corners = [(0.0, 0.0), (1.0, 0.0), (1.3, 0.03), (3.0, 0.03), (3.6, -0.03), (5.0, -0.03), (5.3, 0.0), (12.0, 0.0)]
    grid = np.round(np.arange(121) * 0.1, 1)
    rows = "".join(f"{t:g},{d:.9g}\n" for t, d in zip(grid, np.interp(grid, *np.array(corners).T), strict=True))
    path.write_text(
        f"# staircase; delta_e is the deviation from trim\ntime [s],delta_e [rad]\n{rows}", encoding="utf-8"
    )
    words = StudyWords("light_transport", input=str(path), interval=0.05)
    time, elevator = flown(words)
    assert time[-1] == pytest.approx(12.0)
    np.testing.assert_allclose(elevator, np.interp(time, *np.array(corners).T), atol=1e-12)
    predicted = make_truth(replace(plan_of(words), validation=plan_of(words).flown.shape)).validation
    assert predicted is not None
    before = plan_of(words).identity
    path.write_text(path.read_text(encoding="utf-8").replace("0.03\n", "0.02\n"), encoding="utf-8")
    assert plan_of(words).identity != before
    assert json.dumps(plan_of(words).describe())


def test_results_of_an_edited_package_are_not_mixed(tmp_path: Path) -> None:
    """The sources are part of the journal's key, so that a study begun before an edit is refused after it."""
    package = tmp_path / "package"
    (package / "deep").mkdir(parents=True)
    (package / "a.py").write_text("x = 1\n", encoding="utf-8")
    (package / "deep" / "b.py").write_text("y = 2\n", encoding="utf-8")
    states = [source_state.__wrapped__(package)]
    (package / "deep" / "__pycache__").mkdir()
    (package / "deep" / "__pycache__" / "b.pyc").write_bytes(b"3")
    assert source_state.__wrapped__(package) == states[0]
    for path, content in (
        (package / "a.py", "x = 2\n"),
        (package / "c.py", ""),
        (package / "deep" / "b.py", "y = 3\n"),
    ):
        path.write_text(content, encoding="utf-8")
        states.append(source_state.__wrapped__(package))
    assert len(set(states)) == 4


@pytest.mark.slow
def test_a_study_begun_before_an_edit_is_refused_after_it(tmp_path: Path) -> None:
    package = tmp_path / "aerosid"
    shutil.copytree(HERE.parent / "aerosid", package, ignore=shutil.ignore_patterns("__pycache__"))
    for data in ("aircraft_models", "flight_data"):
        shutil.copytree(HERE.parent / data, tmp_path / data)
    code = "from aerosid.studies.monte_carlo.words import *; print(plan_of(StudyWords('light_transport')).identity)"

    def identity() -> str:
        words = [sys.executable, "-c", code]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    before = identity()
    assert identity() == before
    with (package / "likelihood.py").open("a", encoding="utf-8") as file:
        file.write("# edited\n")
    assert identity() != before


NAVION = ("delta_e", "delta_a", "delta_r")


def test_surfaces_fly_the_shape_in_turn_and_one_alone_as_ever() -> None:
    time = 0.03 * np.arange(600.0)
    moved = in_turn(NAVION, "doublet", time, 0.05, 1.0)
    spans = [time[np.flatnonzero(moved[name])][[0, -1]] for name in NAVION]
    np.testing.assert_allclose(spans, [[1.02 + 6.0 * n, 2.99 + 6.0 * n] for n in range(3)], atol=0.04)
    alone = in_turn(("delta_e",), "3211", time, 0.05, 0.6)
    assert (alone["delta_e"] == deflection("3211", time, 0.05, 0.6)).all()
    with pytest.raises(UsageError, match="holds an elevator, but this aircraft is flown by delta_e, delta_a, delta_r"):
        in_turn(NAVION, RecordedInput("next_input.csv", 0.03, (0.0, 0.1)), time, 0.05, None)


@pytest.mark.parametrize(
    ("aircraft", "measured"),
    [
        (commuter(SIDE), ("beta", "p", "r", "phi", "a_y")),
        (commuter(PITCH | SIDE), ("V", "alpha", "beta", "p", "q", "r", "phi", "theta", "a_x", "a_y", "a_z")),
        (commuter(PITCH), ("V", "alpha", "q", "theta", "a_x", "a_z")),
    ],
    ids=["lateral", "six", "longitudinal"],
)
def test_a_study_records_what_the_case_has_and_gives_back_the_truth_without_noise(
    aircraft: Aircraft, measured: tuple[str, ...]
) -> None:
    flown = FlownInput(airspeed=72.0, interval=0.04, samples=400, amplitude=0.04)
    plan = StudyPlan(aircraft, flown=flown, snrs=(None,), catalogue="known", runs=1)
    assert plan.measured == measured
    truth = make_truth(plan)
    row = run_trial(Trials(truth, plan.levels, 0, "known"), "0/0")
    wanted = [truth.model.value(entry) for entry in truth.free]
    np.testing.assert_allclose(row["values"], wanted, rtol=1e-4, atol=1e-7)
    assert max(row["after"]) < 1e-6


def test_what_a_case_has_no_place_for_is_not_flown() -> None:
    for effect in ("sensor_bias:beta=0.01", "C_n:beta^2=0.1"):
        with pytest.raises(UsageError, match="cannot be flown: commuter has no such"):
            StudyPlan(commuter(PITCH), effects=(parse_planted(effect),))
    with pytest.raises(UsageError, match="--measure alpha: no output of the flight model"):
        StudyPlan(commuter(SIDE), measured=("alpha", "p", "r"))


@pytest.mark.slow
def test_six_axis_errors_are_those_of_the_bound(tmp_path: Path) -> None:
    """Of 40 runs a root-mean-square scatters by 11 %; the worst of 24 may deviate by three of these."""
    aircraft = load_aircraft("navion")
    plan = StudyPlan(aircraft, flown=FlownInput(samples=1410), snrs=(20.0,), catalogue="known", runs=40)
    study = run_study(plan, tmp_path, Workers(1, None))
    rows = study.levels[0].derivatives
    ratios = np.array([row.rmse_over_crlb for row in rows])
    assert ratios.size == 24
    assert ratios.min() > 0.65
    assert ratios.max() < 1.4


def test_a_term_of_a_channel_that_no_flight_moves_is_refused_with_what_is_possible() -> None:
    for words, channel in (
        ({"effects": ("C_m:foo^2=1",)}, "foo"),
        ({"effects": ("C_m:foo^2=1",), "catalogue": "known"}, "foo"),
        ({"effects": ("C_m:alpha*delta_f=1",)}, "delta_f"),
    ):
        with pytest.raises(
            UsageError, match=rf"{channel} is not part of the motion .*; give a term of alpha, .*, delta_e"
        ):
            make_truth(plan_of(StudyWords(aircraft="light_transport", **words)))  # type: ignore[arg-type]
    # Variables of the motion and the surfaces that are flown may be planted.
    truth = make_truth(plan_of(StudyWords(aircraft="light_transport", effects=("C_m:alpha*delta_e=0.1",))))
    assert ("C_m", "alpha*delta_e") in [(coefficient, str(term)) for coefficient, term in truth.free]
