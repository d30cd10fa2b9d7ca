"""Plans from the options of the command line, with presets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from aerosid.aircraft import load_aircraft
from aerosid.errors import UsageError
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.studies.jsbsim.polynomial import driven_by
from aerosid.studies.monte_carlo.elevator import RecordedInput, read_input
from aerosid.studies.monte_carlo.plan import FlownInput, Snr, StudyPlan
from aerosid.studies.monte_carlo.planted import parse_planted


@dataclass(frozen=True)
class StudyWords:
    """Options of the command line; None where one was not given. As the fields of `StudyPlan` and `FlownInput`."""

    aircraft: str | None = None
    input: str | None = None
    amplitude: float | None = None
    unit: float | None = None
    airspeed: float | None = None
    density: float | None = None
    interval: float | None = None
    samples: int | None = None
    base: Path | None = None
    channels: Path | None = None
    validate: str | None = None
    measure: str | None = None
    elevator_noise: float | None = None
    snr: str | None = None
    noise_colour: str | None = None
    effects: Sequence[str] = ()
    runs: int | None = None
    seed: int | None = None
    catalogue: str | None = None


PRESETS: dict[str, StudyWords] = {
    "accuracy": StudyWords(
        aircraft="light_transport",
        input="doublet",
        amplitude=0.06,
        airspeed=100.0,
        interval=0.03,
        samples=470,
        measure="V,alpha,q,theta,a_x,a_z",
        elevator_noise=0.0002,
        snr="20,10",
        noise_colour="0,0.8",
        effects=("C_X:alpha^2=3.6089", "C_m:alpha^2=-1.715"),
        runs=2000,
        catalogue="known",
    ),
    "structure": StudyWords(
        aircraft="light_transport",
        input="doublet",
        snr="50,20,10",
        effects=("C_X:alpha^2=3.6089", "C_m:alpha^2=-1.715"),
        runs=1000,
        catalogue="terms",
    ),
}
"""`accuracy`: efficiency of the estimates and coverage of the intervals, with known structure.
`structure`: the search among aerodynamic terms, on the paper's aircraft."""


def plan_of(words: StudyWords, preset: str | None = None) -> StudyPlan:
    """The plan for the options; those not given are taken from the preset, then from the defaults.

    Raises
    ------
    UsageError
        Where a text cannot be read, or an option has no effect with another.
    """
    if words.base is not None:  # before the preset, which nobody typed
        _require_none_of_a_simulated_flight(words)
    if preset is not None:
        if preset not in PRESETS:
            raise UsageError(f"--preset is {preset!r}; give one of {', '.join(PRESETS)}.")
        given = {name: value for name, value in vars(words).items() if value not in (None, (), [])}
        words = replace(PRESETS[preset], **given)
    if words.aircraft is None:
        raise UsageError("--aircraft is missing; give an aircraft file, or the name of a bundled one.")
    base = None if words.base is None else read_log(words.base, words.channels)
    aircraft = load_aircraft(words.aircraft)
    flown = _flown(words)
    if words.samples is None and base is None and isinstance(flown.shape, str):
        flown = replace(flown, samples=flown.samples * max(1, len(driven_by(aircraft))))
    plan = StudyPlan(aircraft, flown=flown, base=base)
    if base is not None:
        plan = replace(plan, snrs=("recorded",))
    changes: dict[str, Any] = {
        "measured": None if words.measure is None else _words(words.measure),
        "elevator_noise": words.elevator_noise,
        "snrs": None if words.snr is None else tuple(_snr(word) for word in _words(words.snr)),
        "colours": None if words.noise_colour is None else tuple(_numbers("--noise-colour", words.noise_colour)),
        "effects": tuple(parse_planted(text) for text in words.effects) or None,
        "runs": words.runs,
        "seed": words.seed,
        "catalogue": words.catalogue,
        "validation": _validation(words, plan.flown),
    }
    return replace(plan, **{name: value for name, value in changes.items() if value is not None})


OF_A_SIMULATED_FLIGHT = ("input", "amplitude", "unit", "airspeed", "density", "interval", "samples", "noise_colour")
"""Options that say how a flight is simulated; a base log has its own."""


def _require_none_of_a_simulated_flight(words: StudyWords) -> None:
    given = [name for name in OF_A_SIMULATED_FLIGHT if getattr(words, name) is not None]
    if given:
        option = f"--{given[0].replace('_', '-')}"
        raise UsageError(
            f"{option} has no effect with --base {words.base}: input, condition and noise are that log's; leave one "
            "of the two out."
        )


def _flown(words: StudyWords) -> FlownInput:
    given = {
        "amplitude": words.amplitude,
        "unit": words.unit,
        "airspeed": words.airspeed,
        "density": words.density,
        "interval": words.interval,
        "samples": words.samples,
    }
    flown = FlownInput(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    if words.input is None:
        return flown
    if not _is_file(words.input):
        return replace(flown, shape=words.input)
    recorded = read_input(Path(words.input), flown.interval)
    return replace(flown, shape=recorded, samples=words.samples or max(len(recorded.deviation), 50))


def _validation(words: StudyWords, flown: FlownInput) -> str | RecordedInput | FlightLog | None:
    """The base log, the file with an elevator only, or the shape named by a text."""
    if words.validate is None:
        return "doublet" if words.input == "3211" else None
    if not _is_file(words.validate):
        return words.validate
    path = Path(words.validate)
    log = read_log(path, words.channels)
    return log if "V" in log else read_input(path, flown.interval)


def _is_file(word: str) -> bool:
    """Steps such as 0.8@1 contain a dot too, and are not files."""
    return Path(word).is_file() or (bool(Path(word).suffix) and "@" not in word)


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(",") if word.strip())


def _numbers(option: str, text: str) -> list[float]:
    try:
        return [float(word) for word in _words(text)]
    except ValueError:
        raise UsageError(f"{option} is {text!r}; give numbers, as in 20,10.") from None


def _snr(word: str) -> Snr:
    if word == "recorded":
        return "recorded"
    (value,) = _numbers("--snr", word)
    return None if math.isinf(value) and value > 0.0 else value
