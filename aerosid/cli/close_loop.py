"""Settings, log roles and progress display of the close-loop command."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from aerosid.cli.output import command_line, mode
from aerosid.cli.stage_progress import stages
from aerosid.errors import UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.spans import ROLES, Span, expand, files_given, read_span, require_samples
from aerosid.manoeuvres import elevator_manoeuvres

if TYPE_CHECKING:  # imported at run time once options and files are known to be valid
    from aerosid.aircraft import Aircraft
    from aerosid.loop.closed_loop import ResultCallback
    from aerosid.loop.provenance import Provenance
    from aerosid.loop.result import ClosedLoop
    from aerosid.loop.settings import LoopSettings, Method

_FILTERS = ("zero-phase", "causal", "off")

_ONCE = (
    "Compiling the numerical kernels: once for this user, Python and processor "
    "(`aerosid warm-up` does it in advance, on all cores)."
)


def loop_settings(
    prefilter: str,
    error_density: str | None,
    priors: bool,
    seed: int,
    flight_phase: str | None = None,
    aircraft_class: str | None = None,
    next_flight: bool = True,
    limits: Sequence[str] = (),
    method: str = "evidence",
) -> LoopSettings:
    """Loop settings from the command-line options.

    Raises
    ------
    UsageError
        Where an option's text is not one of its choices, not a number, or not a range, or has no effect with another.
    """
    if prefilter not in _FILTERS:
        raise UsageError(f"--prefilter is {prefilter!r}; give one of {', '.join(_FILTERS)}.")
    if limits and not next_flight:
        raise UsageError("--limit limits the next flight, which --no-next-flight leaves out; leave out one of the two.")
    density = _density(error_density)
    from aerosid.loop.next_flight.flight_limits import read_limit
    from aerosid.loop.settings import LoopSettings
    from aerosid.model_error.paper_chain.chain import ChainSettings

    return LoopSettings(
        method=_method(method),
        chain=ChainSettings(filtering=prefilter, error_density=density),
        priors=priors,
        seed=seed,
        flight_phase=flight_phase,
        aircraft_class=aircraft_class,
        next_flight=next_flight,
        limits=dict(read_limit(text) for text in limits),
    )


def _method(text: str) -> Method:
    from aerosid.loop.settings import METHODS

    for method in METHODS:
        if text == method:
            return method
    raise UsageError(f"--method is {text!r}; give one of {', '.join(METHODS)}.")


def provenance(words: Sequence[str], settings: LoopSettings, analyst: str, remarks: str) -> Provenance:
    """Provenance for the title block: date, changed settings, command line, analyst and remarks.

    Parameters
    ----------
    words : sequence of str
        The arguments after `aerosid`. Output paths are omitted: the same inputs give the same bytes anywhere.
    settings : LoopSettings
        As the words set them.
    analyst, remarks : str
        As given on the command line; empty where not given.

    Raises
    ------
    UsageError
        Where SOURCE_DATE_EPOCH is not a whole number of seconds.
    """
    from aerosid.loop.provenance import Provenance, unusual_settings
    from aerosid.loop.report_date import today

    return Provenance(today(), unusual_settings(settings), command_line(words), analyst, remarks)


def _density(text: str | None) -> tuple[float, float, float, float] | None:
    if text is None:
        return None
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 4 or not all(0.0 <= number < float("inf") for number in numbers):
        raise UsageError(f"--error-density is {text!r}; give four numbers, none negative, as in 1,1,0.01,0.")
    return numbers[0], numbers[1], numbers[2], numbers[3]


@dataclass(frozen=True)
class RoledLogs:
    """Logs of one call by role: identification, validation (confirms or refutes), hold-out (predicted only)."""

    identification: tuple[FlightLog, ...]
    validation: tuple[FlightLog, ...]
    hold_out: tuple[FlightLog, ...] = ()

    @property
    def every(self) -> tuple[FlightLog, ...]:
        """The logs of all roles, in this order."""
        return (*self.identification, *self.validation, *self.hold_out)


def read_roles(
    logs: Sequence[str],
    validate: Sequence[str],
    channels: Path | None,
    start: float | None = None,
    stop: float | None = None,
    *,
    hold_out: Sequence[str] = (),
    find: bool = False,
) -> RoledLogs:
    """Read the logs of a call, grouped by role.

    Parameters
    ----------
    logs, validate, hold_out : sequence of str
        Recordings, spans of them as LOG@FROM:TO, and segment files.
    channels : Path, optional
        The channel map.
    start, stop : float, optional
        s, in the time of the identification logs; not allowed together with spans.
    find : bool
        Replace each identification log by the longitudinal manoeuvres found in it.

    Raises
    ------
    UsageError
        Where --from or --to is combined with a span.
    LogError
        Where a log cannot be used, or no manoeuvre is found in it.
    """
    read_before: dict[Path, FlightLog] = {}
    roled: dict[str, list[FlightLog]] = {role: [] for role in ROLES}
    given = (spans_between(logs, start, stop), expand(validate), expand(hold_out))
    for usual, spans in zip(ROLES, given, strict=True):
        for span in spans:
            role = (usual == ROLES[0] and span.role) or usual
            log = read_span(span, channels, read_before, across_holes=find and role == ROLES[0])
            require_samples(log)
            roled[role] += elevator_manoeuvres(log) if find and role == ROLES[0] else (log,)
    if not roled[ROLES[0]]:
        raise UsageError(
            "no log is left to identify from: every segment has another role; give one for identification."
        )
    return RoledLogs(*(tuple(roled[role]) for role in ROLES))


def report_folder(directory: Path, logs: Sequence[str], aircraft: str, channels: Path | None) -> Path:
    """The folder of the report, which can be written and whose new files replace no input.

    Raises
    ------
    UsageError
        Where it cannot, or an input has the name of one of the files.
    """
    from aerosid.file_set import require_apart, require_writable
    from aerosid.reporting.file_names import FILES

    require_writable(directory)
    require_apart([directory / name for name in FILES], (*files_given(logs), aircraft, channels))
    return directory


def spans_between(words: Sequence[str], start: float | None, stop: float | None) -> tuple[Span, ...]:
    """Log spans from the command line, whole recordings cut to --from and --to where given.

    Raises
    ------
    UsageError
        Where --from or --to is not a time or is combined with a span, --from is not before --to, or a span or segment
        file is wrong.
    """
    for option, instant in (("--from", start), ("--to", stop)):
        if instant is not None and not math.isfinite(instant):
            raise UsageError(f"{option} is {instant}, expected seconds on the log's own clock; give a finite number.")
    if start is not None and stop is not None and not start < stop:
        raise UsageError(f"--from is {start:g} and --to {stop:g} s, expected the earlier time first; correct it.")
    spans = expand(words)
    if start is None and stop is None:
        return spans
    named = next((span for span in spans if not span.whole), None)
    if named is not None:
        raise UsageError(f"{named}: it names its span already; leave --from and --to away.")
    # The log keeps its name, since its span is not part of the name given on the command line.
    return tuple(
        replace(span, start=start, stop=stop, name=span.name or Path(span.path.name.removesuffix(".gz")).stem)
        for span in spans
    )


def with_progress(
    identification: Sequence[FlightLog],
    aircraft: Aircraft,
    validation: Sequence[FlightLog],
    settings: LoopSettings,
    judged: ResultCallback,
    hold_out: Sequence[FlightLog],
    provenance: Provenance,
) -> ClosedLoop:
    """Run the loop with a progress bar on standard error; silent with --quiet.

    The bar shows each kernel while it is compiled, below a line that explains the delay at first use.
    """
    from aerosid.compiled.cores import available, on_cores
    from aerosid.compiled.kernel_cache import compilation_announced
    from aerosid.loop.closed_loop import close_loop

    shown = nullcontext(_nothing) if mode().quiet else stages()
    with compilation_announced(_announce_compilation()), on_cores(available()), shown as progress:
        return close_loop(
            identification, aircraft, validation, settings, progress, judged, hold_out=hold_out, provenance=provenance
        )


def _nothing(_stage: str) -> None:
    """Progress callback that displays nothing."""


def _announce_compilation() -> Callable[[str], None]:
    """Callback that announces the first kernel compilation on an interactive terminal."""
    compiled: list[str] = []

    def say(kernel: str) -> None:
        if not compiled and sys.stderr.isatty() and not mode().quiet:
            sys.stderr.write(f"{_ONCE}\n")
            sys.stderr.flush()
        compiled.append(kernel)

    return say
