"""The verb warm-up: kernels compiled before they are needed."""

from __future__ import annotations

import json
import sys
import time
from typing import Annotated

import typer

from aerosid.cli.options import WorkersOption
from aerosid.cli.output import headed
from aerosid.errors import UsageError


def warm_up_command(
    workers: WorkersOption = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON at the end.")] = False,
) -> None:
    """Compiles the numerical kernels ahead, over all cores: once for this user, Python, numba and processor."""
    from aerosid.compiled.kernel_cache import user_folder
    from aerosid.loop.warm_up import TASKS, prepare_kernels

    if workers is not None and workers < 1:
        raise UsageError(f"--workers is {workers}; at least 1 is needed.")

    def say(text: str) -> None:
        if not quiet:
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()

    say(f"Compiling the numerical kernels, once for this user, Python and processor, into {user_folder()}")
    start = time.perf_counter()
    count = 0
    for number, done in enumerate(prepare_kernels(workers), start=1):
        count += len(done.kernels)
        say(f"  {number} of {len(TASKS)}: {done.part}, {len(done.kernels)} compiled, {done.seconds:.0f} s")
    seconds = time.perf_counter() - start
    say(f"{count} kernels compiled in {seconds:.0f} s.")
    if as_json:
        typer.echo(json.dumps(headed("warm-up", {"kernels": count, "seconds": seconds}), indent=2))
