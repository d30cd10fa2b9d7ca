"""The loop over a folder: broken logs are reported and stop nothing; repeats are combined correctly."""

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from problems import BOTH_SQUARES, LIGHT, Problem, native_csv
from scipy.stats import binom, chi2

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.aircraft.loading import at_own_loading
from aerosid.errors import LogError, UsageError
from aerosid.loop.settings import LoopSettings
from aerosid.studies.batch import Batch, LogFile, derivative_table, find_logs, run_batch, write_batch
from aerosid.studies.batch.one_log import CONDITION, _at_first
from aerosid.studies.batch.page import drawn_figure, page_html
from aerosid.studies.batch.table import conditions, homogeneity, measured, structure_of, structures
from aerosid.studies.batch.table_texts import structure_words, table_csv, table_latex, table_markdown
from aerosid.studies.journal import Row
from aerosid.studies.workers import Workers

QUICK = LoopSettings(catalogue="terms", paper_chain=False)
BROKEN = {
    "empty.csv": b"",
    "backwards.csv": b"time [s],V [m/s],alpha [rad],q [rad/s]\n" + b"".join(b"%d,90,0,0\n" % (9 - k) for k in range(9)),
    "no_alpha.csv": b"time [s],V [m/s],q [rad/s],delta_e [rad]\n" + b"".join(b"%d,90,0,0\n" % k for k in range(40)),
    "garbage.mat": bytes(range(256)) * 4,
    "still.csv": b"time [s],V [m/s],alpha [rad],q [rad/s],delta_e [rad]\n"
    + b"".join(b"%d,nan,nan,nan,0\n" % k for k in range(40)),
}


def flight(airspeed: float, seed: int) -> bytes:
    problem = Problem(undeclared=BOTH_SQUARES, airspeed=airspeed, duration=6.0)
    return native_csv(problem.fly(seed)).encode()


def fill(folder: Path, flights: dict[str, bytes]) -> Path:
    for name, content in flights.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def batch_of(folder: Path, out: Path, announced: list[tuple[int, int]] | None = None) -> Batch:
    logs = find_logs(folder, None, but_in=out)
    announce = (
        (lambda items, done: announced.append((items, done))) if announced is not None else lambda _items, _done: None
    )
    return run_batch(logs, LIGHT, out, settings=QUICK, reports=False, workers=Workers(1), announce=announce)


def test_broken_logs_are_named_and_stop_no_other(tmp_path: Path) -> None:
    folder = fill(tmp_path / "logs", {"deep/a.csv": flight(90.0, 1), **BROKEN})
    out = folder / "out"
    batch = batch_of(folder, out)
    assert set(batch.rows) == {"deep/a"}
    assert set(batch.failures) == {Path(name).stem for name in BROKEN}
    for name, reason in batch.failures.items():
        assert name in reason
        assert "unexpected" not in reason
    files = write_batch(batch, out)
    assert {path.name for path in files} >= {"derivative_table.csv", "derivative_table.tex", "derivative_table.md"}
    content = json.loads((out / "batch.json").read_text(encoding="utf-8"))
    assert [log["log"] for log in content["logs"]] == ["deep/a"]
    assert len(content["failures"]) == len(BROKEN)
    rows = list(csv.DictReader(io.StringIO((out / "derivative_table.csv").read_text(encoding="utf-8"))))
    (pitch,) = [row for row in rows if (row["coefficient"], row["term"]) == ("C_m", "alpha")]
    assert pitch["manoeuvres"] == "1"
    assert float(pitch["declared"]) == -0.729
    assert abs(float(pitch["value"]) + 0.729) < 4.0 * float(pitch["std_error"])


@pytest.mark.slow
def test_what_is_there_is_not_done_again_and_what_was_mended_is(tmp_path: Path) -> None:
    folder = fill(tmp_path / "logs", {"a.csv": flight(90.0, 1), "empty.csv": b""})
    batch = batch_of(folder, tmp_path / "out")
    fill(folder, {"empty.csv": flight(90.0, 3)})
    announced: list[tuple[int, int]] = []
    again = batch_of(folder, tmp_path / "out", announced)
    assert announced == [(2, 1)]
    assert set(again.rows) == {"a", "empty"}
    assert again.rows["a"] == batch.rows["a"]


@pytest.mark.slow
def test_each_log_has_its_report_and_two_workers_say_the_same(tmp_path: Path) -> None:
    folder = fill(tmp_path / "logs", {"a.csv": flight(90.0, 1), "b.csv": flight(110.0, 2)})
    logs = find_logs(folder, None)
    for count in (1, 2):
        out = tmp_path / str(count)
        write_batch(run_batch(logs, LIGHT, out, settings=QUICK, workers=Workers(count)), out)
        assert (out / "manoeuvres" / "a" / "result.json").is_file()
        assert 'href="manoeuvres/b/report.html"' in (out / "batch.html").read_text(encoding="utf-8")
    for name in ("batch.json", "batch.html", "derivative_table.csv", "manoeuvres.csv"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


@pytest.mark.slow
def test_a_dask_cluster_writes_the_same_bytes(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the optional extra 'cluster' is not installed")
    logs = find_logs(fill(tmp_path / "logs", {"a.csv": flight(90.0, 1), "b.csv": flight(110.0, 2)}), None)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        for name, workers in (("here", Workers(1)), ("there", Workers(scheduler=cluster.scheduler_address))):
            out = tmp_path / name
            write_batch(run_batch(logs, LIGHT, out, settings=QUICK, reports=False, workers=workers), out)
    for name in ("batch.json", "batch.html", "derivative_table.csv", "manoeuvres.csv"):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


def test_two_logs_of_the_same_samples_are_refused(tmp_path: Path) -> None:
    logs = find_logs(fill(tmp_path / "logs", {"a.csv": b"3", "b.csv": b"4", "copy.csv": b"3"}), None)
    with pytest.raises(UsageError, match=r"copy\.csv holds the samples of .*a\.csv"):
        run_batch(logs, LIGHT, tmp_path / "out", settings=QUICK)
    assert not (tmp_path / "out").exists()


def test_a_list_names_logs_and_a_folder_holds_them(tmp_path: Path) -> None:
    folder = fill(tmp_path, {"x/a.csv": b"1", "x/a.mat": b"2", "x/notes.md": b"", "b.csv": b"3", "out/c.csv": b"4"})
    assert [log.name for log in find_logs(folder, None, but_in=folder / "out")] == ["b", "x/a.csv", "x/a.mat"]
    listed = folder / "logs.txt"
    listed.write_text("# flights of Tuesday\nb.csv\n\n  x/a.mat   # the second\nmissing.csv\n", encoding="utf-8")
    assert [log.name for log in find_logs(listed, None)] == ["b", "x/a", "missing"]
    before = find_logs(listed, None)[0]
    (folder / "b.channels.toml").write_text("schema = 1\n", encoding="utf-8")
    assert find_logs(listed, None)[0].key != before.key
    for content, message in (("", "no log"), ("b.csv\nb.csv\n", "twice")):
        listed.write_text(content, encoding="utf-8")
        with pytest.raises(UsageError, match=message):
            find_logs(listed, None)
    with pytest.raises(UsageError, match="neither"):
        find_logs(folder / "nowhere", None)
    (folder / "bare").mkdir()
    with pytest.raises(UsageError, match="no log"):
        find_logs(folder / "bare", None)


@pytest.mark.slow
def test_not_one_usable_log_is_an_error(tmp_path: Path) -> None:
    folder = fill(tmp_path / "logs", {"empty.csv": b""})
    with pytest.raises(LogError, match="none of the 1 logs"):
        batch_of(folder, tmp_path / "out")


def row(value: float, std_error: float | None, shown: bool = True, **condition: float) -> Row:
    entry = {"coefficient": "C_m", "term": "alpha", "declared": -0.7, "value": value, "std_error": std_error}
    return {
        "verdict": "explained",
        "condition": dict.fromkeys(CONDITION) | condition,
        "effects": [{"kind": "sensor_bias", "where": "V", "term": "", "value": 1.0, "std_error": 0.1}],
        "derivatives": [{**entry, "std_error_white": 0.1, "shown": shown}],
    }


ROWS = {
    "slow1": row(-0.70, 0.01, V=90.0, h=1000.0, alpha=0.05),
    "slow2": row(-0.74, 0.02, V=91.0, h=1100.0, alpha=0.051),
    "slow3": row(-9.00, 4.00, shown=False, V=90.5, h=1050.0, alpha=0.05),
    "none": row(-0.70, None, V=90.0, h=1000.0, alpha=0.05),
    "fast": row(-0.60, 0.01, V=120.0, h=1000.0, alpha=0.02),
    "high": row(-0.65, 0.01, V=121.0, h=4000.0, alpha=0.021),
}


def test_repeats_are_put_together_and_their_scatter_told() -> None:
    groups = conditions(ROWS)
    assert groups == {"slow1": 1, "slow2": 1, "slow3": 1, "none": 1, "fast": 2, "high": 3}
    slow, fast, high = derivative_table(ROWS)
    assert (slow.manoeuvres, slow.left_out) == (2, 1)
    # By hand: weights 1/0.01^2 and 1/0.02^2 are as 4 to 1.
    assert slow.value == pytest.approx((4.0 * -0.70 + -0.74) / 5.0)
    assert slow.std_error == pytest.approx(np.sqrt((0.01**2 + 0.02**2) / 2.0))
    assert slow.scatter == pytest.approx(0.04 / np.sqrt(2.0))
    assert slow.condition == pytest.approx({"V": 90.5, "h": 1050.0, "mach": None, "alpha": 0.0505, "mass": None})
    assert (fast.group, fast.value, fast.scatter) == (2, -0.60, None)
    assert (high.group, high.manoeuvres) == (3, 1)
    assert derivative_table(dict(reversed(ROWS.items()))) == (slow, fast, high)


TERM = {"kind": "aero_term", "where": "C_m", "term": "alpha^2", "value": 1.0, "std_error": 0.1}


def test_estimates_beside_different_structures_are_never_averaged() -> None:
    """-.284 and -.250 beside the declared structure, -.947 beside another: two rows, no -.387."""
    rows = {"a": row(-0.284, 0.03, V=90.0), "b": row(-0.250, 0.03, V=90.0), "c": row(-0.947, 0.09, V=90.0)}
    rows["c"] = {**rows["c"], "effects": [*rows["c"]["effects"], TERM]}
    common, other = derivative_table(rows)
    assert (common.structure, common.manoeuvres, common.value) == (1, 2, pytest.approx(-0.267))
    assert (other.structure, other.manoeuvres, other.value) == (2, 1, -0.947)
    assert structures(rows) == {structure_of(rows["a"]): 1, structure_of(rows["c"]): 2}
    assert structure_words(structure_of(rows["c"])) == "declared + C_m alpha^2 + sensor bias of V"
    lines = list(csv.DictReader(io.StringIO(table_csv([common, other]))))
    assert [line["structure"] for line in lines] == ["1", "2"]


def test_cochrans_q_is_that_of_the_book_and_marks_what_is_not_one_number() -> None:
    alike, apart = [row(-0.70, 0.01, V=90.0), row(-0.71, 0.02, V=90.0)], [row(v, 0.01, V=90.0) for v in (-0.7, -0.8)]
    (one,) = derivative_table(dict(zip("ab", alike, strict=True)))
    # By hand: the mean is -.702, so that Q = (.002/.01)^2 + (.008/.02)^2.
    assert one.heterogeneity == pytest.approx(0.2)
    assert one.p_value == pytest.approx(chi2.sf(0.2, 1))
    (two,) = derivative_table(dict(zip("ab", apart, strict=True)))
    assert (one.homogeneous, two.homogeneous) == (True, False)
    assert "!" in table_markdown([two]).splitlines()[2]
    assert "!" not in table_markdown([one]).splitlines()[2]


def test_the_test_of_homogeneity_alarms_as_often_as_it_says() -> None:
    rng = np.random.default_rng(11)
    errors = rng.uniform(0.01, 0.05, (2000, 5))
    alarms = sum(homogeneity(-0.7 + error * rng.standard_normal(5), error)[1] < 0.05 for error in errors)
    # Binomial with 2000 draws at 0.05, two tails of one in a thousand each.
    assert binom.isf(0.999, 2000, 0.05) <= alarms <= binom.isf(0.001, 2000, 0.05)


def test_scatter_over_deviation_is_one_where_deviations_are_true() -> None:
    rng = np.random.default_rng(4)
    rows = {str(n): row(-0.7 + 0.02 * rng.standard_normal(), 0.02, V=90.0) for n in range(400)}
    (found,) = derivative_table(rows)
    assert found.honest == pytest.approx(1.0, abs=0.12)
    assert found.value == pytest.approx(-0.7, abs=0.004)


def test_tables_hold_the_same_numbers_in_every_format() -> None:
    table = derivative_table(ROWS)
    lines = list(csv.DictReader(io.StringIO(table_csv(table))))
    assert [float(line["value"]) for line in lines] == [entry.value for entry in table]
    assert lines[1]["scatter"] == ""
    markdown = table_markdown(table).splitlines()
    assert markdown[2].startswith("| C_m alpha | −0.7000 | −0.708 ± 0.016 | 0.028 |")
    assert len({line.count("|") for line in markdown[:5]}) == 1
    latex = table_latex(table)
    assert r"$C_{m}$ $\alpha$ & $-$0.7000 & $-$0.708 $\pm$ 0.016 & 0.028" in latex
    assert latex.count(r"\\") == 4


def test_texts_of_files_stay_texts() -> None:
    hostile = "<img src=x onerror=alert(1)>|&_%$#{}~^\\"
    rows = {f"{hostile}{name}": {**entry, "verdict": "explained"} for name, entry in ROWS.items()}
    first = next(iter(rows.values()))
    first["derivatives"] = [{**first["derivatives"][0], "term": "input_<b>|&"}]
    logs = tuple(LogFile(name, name, "") for name in rows)
    batch = Batch(replace(LIGHT, name=hostile), logs, rows, {f"{hostile}!": f"{hostile} is broken"}, reports=True)
    page = page_html(batch, drawn_figure(batch, "alpha"))
    assert "<img" not in page
    assert "<b>|" not in page
    assert 'href="manoeuvres/<' not in page
    markdown, latex = table_markdown(batch.table), table_latex(batch.table)
    assert r"input_<b>\|&" in markdown
    assert r"input\_<b>|\&" in latex
    assert len(measured(rows)) == 5


def test_the_condition_is_that_before_the_manoeuvre() -> None:
    problem = Problem(duration=9.0, amplitude=0.09)
    log = problem.fly()
    assert _at_first(log, "V") == pytest.approx(100.0, abs=0.2)
    assert abs(float(log["V"].mean()) - 100.0) > 1.0
    assert _at_first(log, "mach") is None


def test_the_page_writes_symbols_and_no_names_of_a_program() -> None:
    logs = tuple(LogFile(name, name, "") for name in ROWS)
    batch = Batch(LIGHT, logs, ROWS, {}, reports=False)
    page = page_html(batch, drawn_figure(batch))
    body = re.sub(r"<style>.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL)
    words = {word.strip(".,;:()") for word in body.split() if "_" in word}
    assert words <= {"light_transport"}
    assert "sensor bias of V" in " ".join(body.split())
    assert "alpha" not in body


def test_every_manoeuvre_of_a_flight_is_listed_at_its_own_mass(tmp_path: Path) -> None:
    """Fifty cuts of one flight, with 20 kg of fuel used between successive ones: tables show the mass of each."""
    path = tmp_path / "aircraft.toml"
    bare = (bundled_folder("aircraft_models") / "light_transport.toml").read_text(encoding="utf-8")
    table = "\n[fuel]\nused = [0.0, 1000.0]\nmass = [2280.0, 1280.0]\nI_yy = [6940.0, 5940.0]\n"
    path.write_text(bare + table, encoding="utf-8")
    declared = load_aircraft(path)
    cut = Problem(duration=3.0).fly()
    for burnt in np.arange(0.0, 1000.0, 20.0):
        used = {**cut.channels, "fuel_used": np.full(cut.samples, burnt)}
        log = replace(cut, channels=used, units={**cut.units, "fuel_used": "kg"})
        loaded, (flown,), _ = at_own_loading(declared, [log])
        assert _at_first(flown, "mass") == pytest.approx(2280.0 - burnt)
        assert loaded.I_yy == pytest.approx(6940.0 - burnt)
