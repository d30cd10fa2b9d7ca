"""Start-up and first use, as ratios to Python's own import of numpy, scipy.signal and pandas, in one run.

    python -m benchmarks.first_use            what a user waits for every day, and the numerical part by itself
    python -m benchmarks.first_use --cold     and at first use: compilations, their seconds, warm-up on all cores

Each number is the least of several runs. Processor time stands beside wall time, since it says the same on a busy
machine; a copy of the process that writes the paper counts in it too.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import aerosid
from aerosid.compiled.cores import available, on_cores
from aerosid.loop.identification import identify
from aerosid.studies.monte_carlo.search import search, start_values

ROOT = Path(__file__).resolve().parents[1]
LIBRARIES = "import numpy, scipy.signal, pandas"
LOOP = (
    "close-loop", "flight_data/light_transport_doublet.csv", "--aircraft", "aircraft_models/light_transport.toml",
    "--validate", "flight_data/light_transport_3211.csv",
)  # fmt: skip
AEROSID = (sys.executable, "-m", "aerosid")

COUNTED = """
import sys
import numba.core.event as event

seconds, count, depth = 0.0, 0, 0

class Compilations(event.Listener):
    def on_start(self, happening):
        global count, depth, start
        count, depth = count + 1, depth + 1
        if depth == 1:
            import time
            start = time.process_time()

    def on_end(self, happening):
        global depth, seconds
        depth -= 1
        if depth == 0:
            import time
            seconds += time.process_time() - start

event.register("numba:compile", Compilations())
if sys.argv.pop(1) == "alone":
    import aerosid.compiled.merged_kernels as merged_kernels
    merged_kernels.merge_into_callers = lambda dispatcher, optimised: dispatcher
from aerosid.cli.main import main
main(sys.argv[1:])
print(f"COMPILED {count} {seconds:.1f}")
"""


class Run(NamedTuple):
    """One command: wall s, wall s to the first line of its output, processor s of it and its children, its output."""

    wall: float
    verdict: float
    processor: float
    output: str


def run(command: tuple[str, ...], cache: str | None = None) -> Run:
    """What a command took, from the folder of the checkout; `cache`: where its kernels are kept."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"} | ({"AEROSID_CACHE_DIR": cache} if cache else {})
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # the libraries have their bytecode; ours is kept as theirs is
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    process = subprocess.Popen(
        command, cwd=ROOT, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout is not None
    first = process.stdout.readline()
    verdict = time.perf_counter() - start
    rest = process.stdout.read()
    process.wait()
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Run(wall, verdict, processor, first + rest)


def least(command: tuple[str, ...], times: int) -> Run:
    """The least of each number over several runs."""
    runs = [run(command) for _ in range(times)]
    return Run(min(r.wall for r in runs), min(r.verdict for r in runs), min(r.processor for r in runs), runs[-1].output)


def every_day(times: int) -> None:
    """Prints start-up, refusals and a warm loop beside the import of the libraries."""
    bare = least((sys.executable, "-c", "pass"), times)
    libraries = least((sys.executable, "-c", LIBRARIES), times)
    ours = least((sys.executable, "-c", "import aerosid"), times)
    with tempfile.TemporaryDirectory() as folder:
        wrong = Path(folder) / "wrong.toml"
        wrong.write_text((ROOT / "aircraft_models" / "light_transport.toml").read_text().replace("wing_area", "area"))
        torn = Path(folder) / "torn.csv"
        torn.write_text((ROOT / "flight_data" / "light_transport_doublet.csv").read_text()[:-40])
        log = LOOP[1]
        commands = {
            "--help": (*AEROSID, "--help"),
            "no such log": (*AEROSID, "close-loop", "absent.csv", "--aircraft", "light_transport"),
            "no such aircraft": (*AEROSID, "close-loop", log, "--aircraft", "absent"),
            "a torn log": (*AEROSID, "close-loop", str(torn), "--aircraft", "light_transport"),
            "a wrong key": (*AEROSID, "close-loop", log, "--aircraft", str(wrong)),
            "close-loop with report": (*AEROSID, *LOOP, "--out", str(Path(folder) / "out")),
        }
        run(commands["close-loop with report"])  # compiles what is not there yet
        _say(f"{'':28}{'wall s':>8}{'cpu s':>8}{'wall':>8}{'cpu':>8}   (the last two: to {LIBRARIES})")
        _say(f"{LIBRARIES[7:]:28}{libraries.wall:8.2f}{libraries.processor:8.2f}{1:8.2f}{1:8.2f}")
        for name, command in commands.items():
            took = least(command, times)
            ratios = took.wall / libraries.wall, took.processor / libraries.processor
            _say(f"{name:28}{took.wall:8.2f}{took.processor:8.2f}{ratios[0]:8.2f}{ratios[1]:8.2f}")
        _say(f"{'  its verdict on the terminal':28}{took.verdict:8.2f}{'':8}{took.verdict / libraries.wall:8.2f}")
    _say(f"import aerosid: {ours.wall / bare.wall:.2f} times bare Python ({1e3 * ours.wall:.0f} ms)")


def once_warm(times: int) -> None:
    """Prints what the numerical part takes by itself, in this process, with all that is imported and compiled there."""
    log, unseen = (aerosid.read_log(ROOT / LOOP[n]) for n in (1, 5))
    aircraft = aerosid.load_aircraft(ROOT / LOOP[3])
    start = start_values(log, aircraft)

    def looped() -> object:
        with on_cores(available()):
            return aerosid.close_loop([log], aircraft, [unseen])

    parts: dict[str, Callable[[], object]] = {
        "identification, one core": lambda: identify([log], aircraft, [unseen]),
        "close_loop, all cores": looped,
        "a study's run (terms)": lambda: search(log, aircraft, "terms", start),
    }
    _say(f"{'without report, warm':28}{'wall s':>8}{'cpu s':>8}")
    for name, part in parts.items():
        part()
        runs = [_timed(part) for _ in range(2 * times)]
        _say(f"{name:28}{min(wall for wall, _ in runs):8.3f}{min(processor for _, processor in runs):8.3f}")


def _timed(part: Callable[[], object]) -> tuple[float, float]:
    """Wall s, and processor s of this process and of its copies."""

    def used() -> float:
        here, copies = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        return here.ru_utime + here.ru_stime + copies.ru_utime + copies.ru_stime

    before, start = used(), time.perf_counter()
    part()
    return time.perf_counter() - start, used() - before


def first_use() -> None:
    """Prints compilations of a first close-loop, as numba does them and as they are done here, and warm-up."""
    for name, how in (("helpers compiled alone", "alone"), ("helpers merged", "merged")):
        with tempfile.TemporaryDirectory() as folder:
            loop = (sys.executable, "-c", COUNTED, how, *LOOP, "--out", f"{folder}/out")
            cold = run(loop, f"{folder}/cache")
            again = run(loop, f"{folder}/cache")
            files = list(Path(folder, "cache").glob("*.nbc"))
            size = sum(path.stat().st_size for path in files) / 1e6
        _say(
            f"{name}: {_compiled(cold)}; verdict after {cold.verdict:.0f} s, all after {cold.wall:.0f} s "
            f"(processor {cold.processor:.0f} s); {len(files)} files, {size:.0f} MB; again: {_compiled(again)}"
        )
    for words, of_whom in ((("warm-up", "--sample"), "as `make install` does"), (("warm-up",), "for every model")):
        with tempfile.TemporaryDirectory() as folder:
            ahead = run((*AEROSID, *words), f"{folder}/cache")
            loop = (sys.executable, "-c", COUNTED, "merged", *LOOP, "--out", f"{folder}/out")
            after = run(loop, f"{folder}/cache")
        _say(
            f"{' '.join(words)} ({of_whom}): {ahead.wall:.0f} s (processor {ahead.processor:.0f} s); then close-loop: "
            f"{_compiled(after)}; verdict after {after.verdict:.1f} s: {ahead.wall + after.verdict:.0f} s from the end "
            "of pip to the verdict"
        )


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _compiled(took: Run) -> str:
    if "Written: " not in took.output:
        raise SystemExit("first_use: close-loop wrote no report; run it by itself to see why.")
    count, seconds = took.output.rsplit("COMPILED ", 1)[1].split()
    return f"{count} functions lowered or compiled in {seconds} s of processor time"


def main() -> None:
    """Runs what the words ask for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cold", action="store_true", help="also compile everything anew, which takes minutes")
    parser.add_argument("--times", type=int, default=3, help="runs of each command (default 3)")
    words = parser.parse_args()
    every_day(words.times)
    once_warm(words.times)
    if words.cold:
        first_use()


if __name__ == "__main__":
    main()
