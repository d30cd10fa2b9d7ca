"""Command `warm-up`: kernels compiled in advance."""

from __future__ import annotations

import sys
import time
from typing import Annotated

import typer

from aerosid.cli.options import WorkersOption
from aerosid.cli.output import headed, mode, tell
from aerosid.errors import UsageError


def warm_up_command(
    workers: WorkersOption = None,
    sample: Annotated[
        bool,
        typer.Option(
            "--sample",
            help="Only what the longitudinal sample flights need: a third of the time. Lateral and six-axis models and "
            "recordings in turbulence compile the rest when they first need it.",
        ),
    ] = False,
) -> None:
    """Compiles the numerical kernels in advance on all cores: once for this user, Python, numba and processor."""
    from aerosid.compiled.user_folder import user_folder
    from aerosid.loop.warm_up import SAMPLE_TASKS, TASKS, prepare_kernels

    if workers is not None and workers < 1:
        raise UsageError(f"--workers is {workers}; at least 1 is needed.")

    def say(text: str) -> None:
        if not mode().quiet:
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()

    say(f"Compiling the numerical kernels, once for this user, Python and processor, into {user_folder()}")
    start = time.perf_counter()
    count, parts = 0, SAMPLE_TASKS if sample else TASKS
    for number, done in enumerate(prepare_kernels(workers, parts), start=1):
        count += len(done.kernels)
        say(f"  {number} of {len(parts)}: {done.part}, {len(done.kernels)} compiled, {done.seconds:.0f} s")
    seconds = time.perf_counter() - start
    say(f"{count} kernels compiled in {seconds:.0f} s.")
    tell(lambda: headed("warm-up", {"kernels": count, "seconds": seconds}))
