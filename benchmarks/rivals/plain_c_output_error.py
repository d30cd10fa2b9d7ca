"""Output error in plain C, estimation included: the limit of what simulating the whole flight can cost."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.plain_c import compile_library, pointer
from benchmarks.rivals.output_error import problem_size
from benchmarks.rivals.task import Answer, Record, Task, table_of

SOURCE = Path(__file__).with_name("output_error.c")


@dataclass(frozen=True)
class PlainCOutputError:
    """The compiled library."""

    library: ctypes.CDLL

    def __call__(self, task: Task, record: Record) -> Answer:
        """Estimate.

        Raises
        ------
        RuntimeError
            Where it does not converge.
        """
        free = task.structure
        begin, size = problem_size(task, record, free)
        count = int(np.count_nonzero(free))
        unknown, deviation = begin.copy(), np.empty(begin.size)
        arrays = [
            np.ascontiguousarray(values)
            for values in (record.time, record.elevator, record.measured, 1.0 / task.deviations, np.array(task.body))
        ]
        places = np.flatnonzero(free.ravel()).astype(np.int64)
        steps = self.library.fit(
            ctypes.c_int64(record.time.size), *(pointer(values) for values in arrays), ctypes.c_int64(count),
            *(pointer(values) for values in (places, size, unknown, deviation)),
        )  # fmt: skip
        if steps < 1:
            raise RuntimeError("output error in C does not converge")
        return Answer(table_of(unknown[:count], free, 0.0), table_of(deviation[:count], free, np.nan), None)


def compiled(folder: Path) -> PlainCOutputError | None:
    """`output_error.c` compiled into `folder`; None where the machine has no C compiler."""
    made = compile_library(SOURCE, folder)
    if made is None:
        return None
    made[0].fit.restype = ctypes.c_int64
    return PlainCOutputError(made[0])
