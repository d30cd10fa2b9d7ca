"""Output error in GNU Octave: the same Gauss-Newton, the flights of a Jacobian side by side in one matrix.

Given: what `output_error` is given. The time is taken inside Octave, without its start.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.rivals.output_error import problem_size
from benchmarks.rivals.task import Answer, Record, Task, table_of

SOURCE = Path(__file__).with_name("output_error.m")


def find_octave() -> str | None:
    """GNU Octave's command; None where it is not installed."""
    return shutil.which("octave-cli") or shutil.which("octave")


@dataclass
class OctaveOutputError:
    """Octave's command; `seconds` of the last estimate."""

    command: str
    seconds: float = float("nan")

    def __call__(self, task: Task, record: Record) -> Answer:
        """Estimate.

        Raises
        ------
        RuntimeError
            Where Octave stops with an error.
        """
        free = task.structure
        begin, size = problem_size(task, record, free)
        count = begin.size - record.start.size
        numbers = [
            np.array([record.time.size, count], dtype=np.float64), np.array(task.body), 1.0 / task.deviations,
            np.flatnonzero(free.ravel()).astype(np.float64), size, begin, record.time, record.elevator,
            record.measured.ravel(),
        ]  # fmt: skip
        with tempfile.TemporaryDirectory() as folder:
            np.savetxt(Path(folder) / "input.txt", np.concatenate(numbers), fmt="%.17g")
            words = [self.command, "--norc", "--quiet", str(SOURCE), folder]
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(f"Octave: {done.stderr.strip()[:300]}")
            answer = np.loadtxt(Path(folder) / "answer.txt")
        self.seconds = float(answer[0])
        unknown, deviation = np.split(answer[1:], 2)
        return Answer(table_of(unknown[:count], free, 0.0), table_of(deviation[:count], free, np.nan), None)
