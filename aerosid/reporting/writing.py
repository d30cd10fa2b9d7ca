"""Writing of the files of one closed loop: all of them, or none under its final name."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

from aerosid.aircraft import save_aircraft
from aerosid.compiled.cores import available, begun, on_cores
from aerosid.errors import AircraftError, UsageError
from aerosid.file_set import require_apart, unfinished_folder
from aerosid.loop.result import ClosedLoop
from aerosid.reporting.file_names import (
    COMPLETED_AIRCRAFT,
    DERIVATIVES,
    FILES,
    NEXT_INPUT,
    PAGE,
    PAPER,
    RESIDUALS,
    RESULT,
)
from aerosid.reporting.page import Report, compose, report_html
from aerosid.reporting.result_json import result_text
from aerosid.reporting.tables import derivatives_csv, next_input_csv, residuals_csv

TEXTS: dict[str, Callable[[ClosedLoop], str | None]] = {
    RESULT: result_text,
    DERIVATIVES: derivatives_csv,
    RESIDUALS: residuals_csv,
    NEXT_INPUT: next_input_csv,
}
"""Every file with its text; None where it does not apply to the result."""


def write_report(
    result: ClosedLoop, directory: Path, *, interactive: bool = True, paper: Callable[[], bytes] | None = None
) -> tuple[Path, ...]:
    """The paths of the files written: result.json, tables, both reports, the completed aircraft, the next input.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop.
    directory : Path
        The output folder; created where it does not exist. Files of an earlier run are replaced, or removed where they
        do not apply to this result; others are kept.
    interactive : bool
        Whether the figures of report.html can be zoomed, which adds 5 MB to it.
    paper : callable, optional
        Returns the bytes of report.pdf where its printing was started before (`aerosid.reporting.printing`).

    Raises
    ------
    UsageError
        Where the folder cannot be created or written, or a file would replace an input of the result. On any failure no
        file is left half-written: all are written into a temporary folder on the same disk first and moved only when
        the last one is complete.
    """
    directory = Path(directory)
    logs = (*result.identification, *result.validation, *result.hold_out)
    inputs = (path for path in (result.aircraft.path, *(log.path for log in logs)) if path)
    require_apart((directory / name for name in FILES), inputs)
    made = _make(directory)
    try:
        with unfinished_folder(directory, "report") as temporary:
            report = compose(result)
            paper = paper or _beside(lambda: _printed(result, report))
            for name, text_of in TEXTS.items():
                text = text_of(result)
                if text is not None:
                    _write(temporary / name, text)
            _write(temporary / PAGE, report_html(result, report, interactive=interactive))
            (temporary / PAPER).write_bytes(paper())
            save_aircraft(result.completed_aircraft, temporary / COMPLETED_AIRCRAFT)
            written = _move(temporary, directory)
    except OSError as error:
        raise _unwritable(directory, error.strerror or str(error)) from None
    except AircraftError as error:
        raise _unwritable(directory, str(error)) from None
    finally:
        for folder in made:
            if not any(folder.iterdir()):
                folder.rmdir()
    return tuple(directory / name for name in written)


def _printed(result: ClosedLoop, report: Report) -> bytes:
    from aerosid.reporting.paper import report_pdf  # not at the top: with a printer, this process needs no fonts

    return report_pdf(result, report)


def _beside(task: Callable[[], bytes]) -> Callable[[], bytes]:
    """Starts a task in parallel to the block, where the platform can fork a process; its result."""
    alone = threading.active_count() == 1  # a forked process inherits locks of threads that it does not have
    with on_cores(max(available(), 2) if alone else 1):
        return begun(task)


def _write(path: Path, text: str) -> None:
    path.write_bytes(text.encode("utf-8", "backslashreplace"))


def _make(directory: Path) -> list[Path]:
    """Create the folder; return the folders created, innermost first."""
    missing = [folder for folder in (directory, *directory.parents) if not folder.exists()]
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise _unwritable(directory, "a file of that name is there") from None
    except OSError as error:
        raise _unwritable(directory, error.strerror or str(error)) from None
    return missing


def _move(source: Path, directory: Path) -> tuple[str, ...]:
    """Move every file to its final name, or none where one of the names is that of a folder; return their names."""
    for name in FILES:
        if (directory / name).is_dir():
            raise IsADirectoryError(0, f"{name} is a folder there", str(directory))
    written = tuple(name for name in FILES if (source / name).exists())
    for name in FILES:
        if name in written:
            os.replace(source / name, directory / name)
        else:
            # An input designed by an earlier run would be mistaken for one of this run.
            (directory / name).unlink(missing_ok=True)
    return written


def _unwritable(directory: Path, found: str) -> UsageError:
    return UsageError(
        f"{directory}: the report cannot be written there ({found}); give a folder that you may write to with --out."
    )
