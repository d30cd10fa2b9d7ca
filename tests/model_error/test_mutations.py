"""Each mistake that is easily made in the recursion must break a test: made in a copy of the package, one at a time."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TESTS = (
    "oracles/model_error.py",
    "model_error/estimators/test_estimators.py",
    "model_error/estimators/test_fixed_interval.py",
    "model_error/invariant_embedding/test_estimator_step.py",
)

MUTATIONS = {
    "the factor 2 of d and of the gain is dropped": (
        "invariant_embedding/estimator_step.py", "q = 2.0 * Q1[m, j]", "q = Q1[m, j]",
    ),
    "f_x is transposed in the discrete prediction (11)": (
        "invariant_embedding/estimator_step.py", "value += F[i, m] * S[m, j]", "value += F[m, i] * S[m, j]",
    ),
    "f_x is transposed in the continuous recursion": (
        "invariant_embedding/step_map.py", "A[i, j] = F[i, j] * down * scale[j]", "A[i, j] = F[j, i] * down * scale[j]",
    ),
    "the discrete d belongs to the step after": (
        "estimators/discrete.py", "d[k - 1] = correction", "d[min(k, N - 2)] = correction",
    ),
    "the continuous d is late by one sample": (
        "estimators/continuous.py", "residual, d[k + 1], scratch)", "residual, d[min(k + 2, N - 1)], scratch)",
    ),
    "half of Q2^-1 is forgotten to be halved": ("estimators/records.py", "W = 0.5 * weights", "W = 1.0 * weights"),
    "the costate's f_x is transposed": (
        "estimators/sweeps.py", "vector[i] += F[j, m, i] * costate[j, m]", "vector[i] += F[j, i, m] * costate[j, m]",
    ),
    "the response is taken of the sample before": (
        "estimators/response.py",
        "epsilon[i, j] = path[i, j] - epsilon[i, j] - columns2[i, j]", "epsilon[i, j] = path[i, j]",
    ),
    "missing samples count in full": (
        "invariant_embedding/residuals.py", "0.5 if first or last else 0.0)\n        r", "1.0)\n        r",
    ),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("mistake", list(MUTATIONS))
def test_a_mistake_breaks_a_test(mistake, tmp_path):
    name, right, wrong = MUTATIONS[mistake]
    shutil.copytree(ROOT / "aerosid", tmp_path / "aerosid", ignore=shutil.ignore_patterns("__pycache__"))
    for test in TESTS:
        (tmp_path / test).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / "tests" / test, tmp_path / test)
    file = tmp_path / "aerosid" / "model_error" / name
    text = file.read_text(encoding="utf-8")
    assert text.count(right) == 1, f"{name} no longer holds {right!r} once: bring the mutation up to date"
    file.write_text(text.replace(right, wrong), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *TESTS[1:]],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1, run.stdout[-2000:] + run.stderr[-2000:]
    assert "failed" in run.stdout
