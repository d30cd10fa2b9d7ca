"""Plan of a Monte Carlo study: aircraft, manoeuvre, noise, number of runs, and scope of the search."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from aerosid import __version__
from aerosid.aircraft import Aircraft
from aerosid.errors import UsageError
from aerosid.flight_model.axes import loads_of
from aerosid.logs.flight_log import FlightLog
from aerosid.studies.monte_carlo.elevator import RecordedInput
from aerosid.studies.monte_carlo.planted import Planted
from aerosid.studies.source_digest import source_state

Catalogue = Literal["known", "terms", "all"]
CATALOGUES: tuple[Catalogue, ...] = ("known", "terms", "all")
USUAL = ("V", "alpha", "beta", "p", "q", "r", "phi", "theta", "a_x", "a_y", "a_z")
"""Output channels that flight-test sensors record; altitude, heading and angular accelerations are left out."""
Snr = float | None | Literal["recorded"]


MOST_SAMPLES = 1_000_000
"""Numerical: maximum number of samples of a simulated manoeuvre: nearly three hours at 100 Hz; more is a typo."""


@dataclass(frozen=True)
class FlownInput:
    """A simulated manoeuvre from trim.

    Attributes
    ----------
    shape : str or RecordedInput
        Of the elevator, or of each surface in turn, as for `elevator.deflection`.
    amplitude : float
        rad; a recorded input contains its own.
    unit : float or None
        s, base time of the shape; None: its own.
    airspeed, density : float or None
        m/s, kg/m^3; None: the aircraft file's.
    interval : float
        s.
    samples : int
    """

    shape: str | RecordedInput = "doublet"
    amplitude: float = 0.06
    unit: float | None = None
    airspeed: float | None = None
    density: float | None = None
    interval: float = 0.03
    samples: int = 470

    def __post_init__(self) -> None:
        if not 50 <= self.samples <= MOST_SAMPLES:
            raise UsageError(f"--samples is {self.samples}; a manoeuvre needs at least 50, and at most {MOST_SAMPLES}.")
        for option, value in (("--airspeed", self.airspeed), ("--density", self.density)):
            if value is not None and not value > 0.0:
                raise UsageError(f"{option} is {value:g}; give a positive number.")
        if not 0.0 < self.interval <= 1.0:
            raise UsageError(f"--interval is {self.interval:g} s; give one above 0 and up to 1 s.")
        if not 0.0 < abs(self.amplitude) <= 0.6:
            raise UsageError(f"--amplitude is {self.amplitude:g} rad; give one up to 0.6 rad that is not zero.")
        if self.unit is not None and not 2.0 * self.interval <= self.unit <= 100.0:
            raise UsageError(f"--unit is {self.unit:g} s; give at least two samples and up to 100 s.")

    @property
    def name(self) -> str:
        """The shape in words."""
        return self.shape.name if isinstance(self.shape, RecordedInput) else self.shape

    def describe(self) -> dict[str, Any]:
        """All fields, as a JSON object."""
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return fields | ({"shape": self.shape.describe()} if isinstance(self.shape, RecordedInput) else {})


@dataclass(frozen=True)
class StudyPlan:
    """A study.

    Attributes
    ----------
    aircraft : Aircraft
        The declared model.
    flown : FlownInput
        The simulated manoeuvre, where the study is not based on a log.
    base : FlightLog or None
        A log whose inputs are flown again, and whose residuals are resampled as noise.
    validation : str, RecordedInput or FlightLog
        The input, or the log with the inputs, of the flight used for prediction only.
    measured : tuple of str
        Recorded output channels, by default those of `USUAL` in the aircraft's case; of a base log those that it
        contains.
    elevator_noise : float
        rad per sample of each recorded surface that moves.
    snrs : tuple of float, None or "recorded"
        Ratio of a channel's standard deviation about its mean to that of its noise; None: no noise at all, surfaces
        included; "recorded": the noise of the base log.
    colours : tuple of float
        Correlation of neighbouring samples of the outputs' noise, AR(1); 0 is white. Not used with a base log.
    effects : tuple of Planted
        Effects flown in addition to the declared model.
    runs : int
        Runs at each level; one where there is no noise.
    seed : int
        Seed of every draw.
    catalogue : "known", "terms" or "all"
        Scope of the search: none, with known structure; aerodynamic terms; everything.
    """

    aircraft: Aircraft
    flown: FlownInput = field(default_factory=FlownInput)
    base: FlightLog | None = None
    validation: str | RecordedInput | FlightLog = "3211"
    measured: tuple[str, ...] = ()
    elevator_noise: float = 0.0002
    snrs: tuple[Snr, ...] = (None, 50.0, 20.0, 10.0, 5.0)
    colours: tuple[float, ...] = (0.0,)
    effects: tuple[Planted, ...] = ()
    runs: int = 1000
    seed: int = 0
    catalogue: Catalogue = "terms"

    def __post_init__(self) -> None:
        if self.runs < 1:
            raise UsageError(f"--runs is {self.runs}; at least 1 is needed.")
        if self.catalogue not in CATALOGUES:
            raise UsageError(f"--catalogue is {self.catalogue!r}; give one of {', '.join(CATALOGUES)}.")
        for colour in self.colours:
            if not 0.0 <= colour < 1.0:
                raise UsageError(f"--noise-colour {colour:g} is not a correlation from 0 to below 1.")
        for snr in self.snrs:
            if isinstance(snr, float) and not snr > 0.0:
                raise UsageError(f"--snr {snr:g} is not positive.")
            if snr == "recorded" and self.base is None:
                raise UsageError("--snr recorded needs a log as the base; give one with --base.")
        outputs = self.aircraft.axes.outputs
        if not self.measured:
            object.__setattr__(self, "measured", tuple(name for name in USUAL if name in outputs))
        for name in self.measured:
            if name not in outputs:
                raise UsageError(f"--measure {name}: no output of the flight model; choose from {', '.join(outputs)}.")
        needed = [name for name in self.aircraft.axes.required if name in outputs]
        if missing := [name for name in needed if name not in self.measured]:
            raise UsageError(f"--measure lacks {', '.join(missing)}, without which nothing can be estimated.")
        self._check_effects()
        if self.seed < 0 or not 0.0 <= self.elevator_noise < 1.0:
            raise UsageError("--seed and --elevator-noise may not be negative.")

    def _check_effects(self) -> None:
        """Refuse channels and controls that this aircraft's case does not have."""
        axes = self.aircraft.axes
        for effect in self.effects:
            of_sensor = effect.kind.startswith("sensor_")
            places = axes.outputs if of_sensor else loads_of(axes) if effect.where.startswith("C_") else ()
            if places and effect.where not in places:
                raise UsageError(
                    f"--effect {effect.kind}:{effect.where} cannot be flown: {self.aircraft.name} has no such "
                    f"{'sensor' if of_sensor else 'coefficient'}; give one of {', '.join(places)}."
                )

    @property
    def levels(self) -> tuple[tuple[Snr, float], ...]:
        """Signal-to-noise ratio and colour of each level; without noise there is no colour."""
        pairs = [(snr, 0.0 if snr is None else colour) for colour in self.colours for snr in self.snrs]
        return tuple(dict.fromkeys(pairs))

    def runs_at(self, level: int) -> int:
        """Number of runs of a level."""
        return 1 if self.levels[level][0] is None else self.runs

    @property
    def keys(self) -> list[str]:
        """Every run as level/number."""
        return [f"{level}/{run}" for level in range(len(self.levels)) for run in range(self.runs_at(level))]

    def describe(self) -> dict[str, Any]:
        """All inputs that determine a result except the number of runs, as a JSON object."""
        return {
            "aircraft": {"path": self.aircraft.path, "sha256": self.aircraft.sha256},
            "base": _named(self.base) if self.base is not None else None,
            "flown": self.flown.describe() if self.base is None else None,
            "validation": _described(self.validation),
            "measured": list(self.measured),
            "elevator_noise": self.elevator_noise,
            "levels": [{"snr": snr, "noise_colour": colour} for snr, colour in self.levels],
            "effects": [asdict(effect) for effect in self.effects],
            "seed": self.seed,
            "catalogue": self.catalogue,
        }

    @property
    def identity(self) -> str:
        """Identification of the results of this study: runs may be added, nothing else may change."""
        state = {"aerosid": __version__, "sources": source_state(), "study": self.describe()}
        text = json.dumps(state, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _described(validation: str | RecordedInput | FlightLog) -> str | dict[str, str]:
    if isinstance(validation, FlightLog):
        return _named(validation)
    return validation if isinstance(validation, str) else validation.describe()


def _named(log: FlightLog) -> dict[str, str]:
    content = hashlib.sha256(log.time.tobytes())  # a channel map or a span changes the log of the same file
    for name, values in log.channels.items():
        content.update(name.encode() + values.tobytes())
    return {"path": log.path or log.name, "sha256": log.sha256, "content": content.hexdigest()}
