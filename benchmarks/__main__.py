"""Measure aerosid against other tools, against plain C, and against its own growth; all in one run.

    python -m benchmarks [--page FOLDER] [--report FILE] [--only SECTION ...] [--most SAMPLES]

Times are the best of several runs, those that are compared taken in turn. Machines differ, ratios less.
"""

from __future__ import annotations

import argparse
import platform
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from aerosid.reporting.figures.numbered import FigureBook
from benchmarks.contest_section import contest_section
from benchmarks.growth import MINUTES, hour_section, loop_section
from benchmarks.kernel import kernel_section
from benchmarks.many_logs import batch_section
from benchmarks.page import write_page
from benchmarks.sections import Section, markdown
from benchmarks.timing import machine

SIZES = (500, 5_000, 50_000, 500_000)
SECTIONS = ("tools", "kernel", "hour", "loop", "batch")
COMPARED = ("numpy", "scipy", "numba", "pysindy", "filterpy")


def main() -> int:
    """Measure, print, and write the page or the report where they are wanted."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--page", type=Path, help="write index.html into this folder")
    parser.add_argument("--report", type=Path, help="write the measurements to this file, as Markdown")
    parser.add_argument("--only", choices=SECTIONS, action="append", help="measure this section alone; repeatable")
    parser.add_argument("--most", type=int, default=SIZES[1], help="samples of the longest loop (%(default)s)")
    arguments = parser.parse_args()
    sizes = tuple(size for size in SIZES if size <= arguments.most)
    facts = _facts()
    texts = ["# Benchmark\n", *(f"{fact}\n" for fact in facts)]
    sys.stdout.write("\n".join(texts) + "\n")
    sections = []
    for section in _measure(arguments.only or SECTIONS, sizes):
        sections.append(section)
        texts.append(markdown(section))
        sys.stdout.write(texts[-1] + "\n")
        sys.stdout.flush()
        if arguments.page is not None:  # at once: a run that is stopped leaves what it measured
            write_page(sections, facts, arguments.page)
    if arguments.report is not None:
        arguments.report.parent.mkdir(parents=True, exist_ok=True)
        arguments.report.write_text("\n".join(texts), encoding="utf-8")
    return 0


def _measure(wanted: list[str] | tuple[str, ...], sizes: tuple[int, ...]) -> Iterator[Section]:
    """The sections, as they come about."""
    book = FigureBook()
    with tempfile.TemporaryDirectory() as folder:
        if "tools" in wanted:
            yield contest_section(Path(folder), book)
        if "kernel" in wanted:
            yield kernel_section(SIZES, Path(folder))
    if "hour" in wanted:
        yield hour_section(MINUTES, book, MINUTES[0])
    if "loop" in wanted:
        yield loop_section(sizes)
    if "batch" in wanted:
        yield batch_section()


def _facts() -> tuple[str, ...]:
    """The machine and the versions of what is compared."""
    found = [f"Python {platform.python_version()}"]
    for name in COMPARED:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} not installed")
    return f"{machine()}.", f"{', '.join(found)}."


if __name__ == "__main__":
    sys.exit(main())
