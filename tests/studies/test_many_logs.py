"""Two hundred logs, five of them broken in five ways: the batch reports the five and tabulates the others."""

from __future__ import annotations

import csv
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from aerosid.errors import LogError
from aerosid.logs.formats import read_log
from benchmarks.flights import UNDECLARED
from benchmarks.many_logs import BROKEN, LOGS, SHAPES, batch_command, write_logs

ROOT = Path(__file__).resolve().parents[2]


def test_the_folder_holds_different_flights_and_five_that_are_broken(tmp_path: Path) -> None:
    broken = write_logs(tmp_path, 30)
    assert sorted(broken.values()) == sorted(BROKEN)
    good = [read_log(path) for path in sorted(tmp_path.glob("*.csv")) if path.stem not in broken]
    assert len(good) == 25
    assert len({log["delta_e"].tobytes() for log in good}) == 25
    assert np.ptp([log["V"][0] for log in good]) > 30.0
    assert all(np.ptp(log["alpha"]) > 0.02 for log in good)
    for name, way in broken.items():
        if way == "no alpha":
            assert "alpha" not in read_log(tmp_path / f"{name}.csv")
        else:
            with pytest.raises(LogError, match=name):
                read_log(tmp_path / f"{name}.csv")


@pytest.mark.slow
def test_a_batch_of_two_hundred_names_the_five_and_tabulates_the_others(tmp_path: Path) -> None:
    logs, out = tmp_path / "logs", tmp_path / "out"
    logs.mkdir()
    broken = write_logs(logs)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}

    def batch(*further: str) -> subprocess.CompletedProcess[str]:
        words = batch_command(logs, out, 2, *further)
        return subprocess.run(words, env=environment, capture_output=True, text=True, check=False)

    done = batch()
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr + done.stdout
    content = json.loads((out / "batch.json").read_text(encoding="utf-8"))
    reasons = {row["log"]: row["reason"] for row in content["failures"]}
    assert set(reasons) == set(broken)
    for name, reason in reasons.items():
        assert f"{name}.csv" in reason
        assert "unexpected" not in reason
        assert name in done.stdout
    names = {f"flight_{number:03d}" for number in range(LOGS)} - set(broken)
    assert {row["log"] for row in content["logs"]} == names
    with (out / "manoeuvres.csv").open(encoding="utf-8", newline="") as file:
        assert {row["log"] for row in csv.DictReader(file)} == names
    page = (out / "batch.html").read_text(encoding="utf-8")
    assert all(name in page for name in [*names, *broken])
    with (out / "derivative_table.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert len(SHAPES) > 1
    for (coefficient, term), true in UNDECLARED.items():
        rows = [row for row in table if (row["coefficient"], row["term"]) == (coefficient, str(term))]
        assert sum(int(row["manoeuvres"]) for row in rows) > 0.9 * len(names)
        for row in rows:
            if int(row["manoeuvres"]) > 1:
                assert abs(float(row["value"]) - true) < 5.0 * float(row["scatter"])
    # Nothing is repeated; with --strict the broken ones are an error.
    assert batch("--strict").returncode == 1
