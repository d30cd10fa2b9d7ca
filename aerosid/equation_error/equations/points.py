"""A point of the search: what acts with which numbers, and the equations of every recording there, in the band."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.channels import COEFFICIENT, KINEMATIC, LATERAL_COEFFICIENTS, MEASURED_BY, VANE_OF
from aerosid.equation_error.equations.coefficient import CoefficientEquations
from aerosid.equation_error.equations.height_random_walk import height_random_walk
from aerosid.equation_error.equations.instrumental_variables import instrumental_variables
from aerosid.equation_error.equations.integrated_noise import integral_modes
from aerosid.equation_error.equations.kinematic import (
    Motion,
    inconsistent_heading,
    predicted_records,
    reconstruct,
    with_height,
)
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.sensors import as_read, corrected
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.flight_model.aerodynamics import CONSTANT, AerodynamicModel, Entry
from aerosid.flight_model.axes import ACCELERATIONS
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.terms import parse_term

Array = NDArray[np.float64]


Unknown = tuple[object, ...]
"""What a column stands for: ("constant" | "drift", equation, recording), ("term", entry), ("one", entry, recording),
("gust", equation) or ("effect", number of the effect, number of its parameter)."""

KEPT = 24
"""Numerical: motions of each recording that are kept; a Gauss-Newton step over ten sensors' numbers asks for as
many."""

KEPT_PATHS = 512
"""Numerical: points of which the kinematic equations of each recording are kept, in the band and so small; a search
asks some again with one fault more and one less."""

SIDESLIP = parse_term("beta")
"""What a sideslip that no vane shows is wrong by acts through this derivative."""

HEIGHT = "h"
"""Integrated twice from the accelerometers."""

_Sensors = tuple[object, ...]
_Made = TypeVar("_Made")


@dataclass(frozen=True)
class Point:
    """A structure with its numbers.

    Attributes
    ----------
    model : AerodynamicModel
        With the current values.
    free : tuple of Entry
        Terms that are estimated.
    effects : tuple of ActiveEffect
        Held and free ones; those with `values` are free.
    """

    model: AerodynamicModel
    free: tuple[Entry, ...]
    effects: tuple[ActiveEffect, ...]

    def with_effects(self, effects: Sequence[ActiveEffect]) -> Point:
        """The point with other effects, and the input columns that they fill."""
        return replace(self, model=with_columns_of(self.model, effects), effects=tuple(effects))


@dataclass(frozen=True)
class Segment:
    """One equation of one recording, in the band.

    Attributes
    ----------
    recording : int
        Its place.
    equation : str
    target : ndarray, shape (n,)
        Measured less what is known.
    columns : mapping of Entry to ndarray, shape (n,)
        What one unit of each free term adds, where it adds anything.
    time : ndarray, shape (n,)
        From the middle of the record, s.
    floor : float
        Least size of a residual that the recorder's resolution allows.
    instruments : ndarray, shape (n, K), optional
        The space in which the equation is compared; None for all of it.
    wander : ndarray, shape (n, K), optional
        Slow errors of an integrated path in it, each of unit standard deviation.
    gust : ndarray, shape (n,), optional
        What the vane of its plane shows beyond the flow angle of the terms; None where it shows nothing more.
    drifts : bool
        Whether a line in time is left out of what it is compared with: a flow angle that no vane shows has one.
    """

    recording: int
    equation: str
    target: Array
    columns: dict[Entry, Array]
    time: Array
    floor: float
    instruments: Array | None = None
    gust: Array | None = None
    wander: Array | None = None
    drifts: bool = False


class Equations:
    """The equations of some recordings, at one point after another.

    What depends on the sensors alone is kept from the last few points: most points of a search differ in something
    else.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        settings: EquationErrorSettings,
        kinds: Sequence[str],
        *,
        all_fitted: bool = False,
    ) -> None:
        self._recordings, self._settings = recordings, settings
        self._instruments = instrumental_variables(recordings, settings)
        self._kinematic = any(kind in kinds for kind in KINEMATIC)
        self._coefficient = any(kind in kinds for kind in COEFFICIENT)
        self._fitted = [recording.fitted or all_fitted for recording in recordings]
        self._left_out = [inconsistent_heading(recording, settings) for recording in recordings]
        self._wandering: dict[int, Array] = {}
        self._drifting: dict[int, Array] = {}
        self._motions: list[dict[_Sensors, Motion]] = [{} for _ in recordings]
        self._paths: list[dict[_Sensors, list[Segment]]] = [{} for _ in recordings]

    def at(self, point: Point) -> list[Segment]:
        """The equations of all recordings; coefficients on those that are fitted alone."""
        segments = []
        for n, recording in enumerate(self._recordings):
            if self._kinematic:
                segments.extend(self._path(n, recording, point.effects))
            if self._coefficient and self._fitted[n]:
                motion = self._motion(n, recording, point.effects)
                segments.extend(self._coefficients(n, point, recording, motion))
        return segments

    def residuals(self, point: Point, values: Mapping[Unknown, float]) -> Array:
        """Residuals (R,) of the coefficient equations alone where the terms have some values; no column is made."""
        parts: list[Array] = []
        for n, recording in enumerate(self._recordings):
            if not self._fitted[n]:
                continue
            motion = self._motion(n, recording, point.effects)
            known = {entry: values.get(value_of(entry, n), 0.0) for entry in point.free}
            equations = CoefficientEquations(recording, point.model, point.effects, motion, point.free, known)
            residuals = equations.columns(())[1]
            for place, name in enumerate(equations.names):
                if share := values.get(("gust", name), 0.0):
                    residuals[:, place] -= share * _gust(name, recording, point.effects, motion)
            banded = recording.band(residuals)
            for name, wander in self._sideslip_errors(n, recording, point.model, motion).items():
                place = equations.names.index(name)
                banded[:, place] -= values.get(("drift", name, n), 0.0) * recording.from_middle
                for k, astray in enumerate(wander.T):
                    banded[:, place] -= values.get(("wander", name, n, k), 0.0) * astray
            parts.extend(banded.T)
        return np.concatenate(parts)

    def _coefficients(self, n: int, point: Point, recording: Recording, motion: Motion) -> list[Segment]:
        """The coefficient equations of one recording in the band, with the columns of the free terms."""
        equations = CoefficientEquations(recording, point.model, point.effects, motion, point.free)
        touching, columns = equations.columns(point.free)
        banded = recording.band(columns)
        wander = self._sideslip_errors(n, recording, point.model, motion)
        segments, place = [], 0
        for name, entries in touching.items():
            target, *slopes = banded[:, place : place + 1 + len(entries)].T
            gust = None
            if motion.gusts[VANE_OF[name]].any():
                gust = recording.band(_gust(name, recording, point.effects, motion))
            own = dict(zip(entries, slopes, strict=True))
            segment = Segment(n, name, target, own, recording.from_middle, 0.0, gust=gust)
            if name in wander:
                segment = replace(segment, wander=wander[name], drifts=True)
            segments.append(segment)
            place += 1 + len(entries)
        return segments

    def _sideslip_errors(
        self, n: int, recording: Recording, model: AerodynamicModel, motion: Motion
    ) -> dict[str, Array]:
        """What usual errors of a sideslip that no vane shows do to each coefficient, in the band, (n, K) each."""
        if recording.manoeuvre.sideslip_measured:
            return {}
        if n not in self._drifting:
            speed = recording.manoeuvre.mean_airspeed
            shares = {"a_y": 1.0 / speed, "r": 1.0, "phi": GRAVITY / speed}
            self._drifting[n] = integral_modes(recording, recording.time_in_band, shares, self._settings)
        errors = np.column_stack([motion.astray_in_band, self._drifting[n]])
        return {name: model.value((name, SIDESLIP)) * errors for name in LATERAL_COEFFICIENTS}

    def _wander(self, n: int, recording: Recording) -> Array:
        """Slow errors of a recording's height, made once."""
        if n not in self._wandering:
            self._wandering[n] = height_random_walk(recording, recording.time_in_band, self._settings)
        return self._wandering[n]

    def _motion(self, n: int, recording: Recording, effects: Sequence[ActiveEffect]) -> Motion:
        """The motion that a recording's sensors show without their faults."""

        def made() -> Motion:
            return reconstruct(recording, other, corrected(recording, other), self._settings)

        def made_with_height() -> Motion:
            motion = _kept(self._motions[n], _sensors(other), KEPT, made)
            return with_height(motion, corrected(recording, effects)[HEIGHT])

        # The path in the air does not depend on what its height is compared with.
        is_measured = HEIGHT in recording.channels
        other = [active for active in effects if not (is_measured and _is_of_height(active))]
        return _kept(
            self._motions[n], _sensors(effects), KEPT, made if len(other) == len(effects) else made_with_height
        )

    def _path(self, n: int, recording: Recording, effects: Sequence[ActiveEffect]) -> list[Segment]:
        """The kinematic equations of a recording."""

        def made() -> list[Segment]:
            motion = self._motion(n, recording, effects)
            predicted = predicted_records(recording, effects, motion)
            names = [name for name in predicted if name not in self._left_out[n]]
            if not names:
                return []
            targets = recording.band(np.column_stack([recording.channels[name] - predicted[name] for name in names]))
            segments = []
            for name, target in zip(names, np.ascontiguousarray(targets.T), strict=True):
                wander = self._wander(n, recording) if name == HEIGHT else None
                floor = _floor(recording, name)
                segments.append(
                    Segment(n, name, target, {}, recording.from_middle, floor, self._instruments[n], wander=wander)
                )
            return segments

        return _kept(self._paths[n], _sensors(effects), KEPT_PATHS, made)


def _is_of_height(active: ActiveEffect) -> bool:
    return isinstance(active.effect, OutputEffect) and active.effect.where == HEIGHT


def _sensors(effects: Sequence[ActiveEffect]) -> _Sensors:
    """What of the effects changes what the sensors show of the motion."""
    return tuple(
        (active.name, getattr(active.effect, "axes", ""), active.numbers, active.log)
        for active in effects
        if isinstance(active.effect, OutputEffect | PositionEffect)
    )


def _kept(known: dict[_Sensors, _Made], key: _Sensors, most: int, made: Callable[[], _Made]) -> _Made:
    """What was made for a key; what was not asked for the longest makes room."""
    found = known.pop(key) if key in known else made()
    known[key] = found
    if len(known) > most:
        del known[next(iter(known))]
    return found


def value_of(entry: Entry, recording: int) -> Unknown:
    """The unknown that is a term's value on a recording: constants are each recording's own."""
    return ("one", entry, recording) if entry[1] == CONSTANT else ("term", entry)


def _gust(name: str, recording: Recording, effects: Sequence[ActiveEffect], motion: Motion) -> Array:
    """What the vane of an equation's plane shows beyond the path, (N,), as an accelerometer reads the answer to it.

    A gyro's is left as it comes: moments answer gusts within hundredths of a second, and on the ATTAS stall, whose gyro
    leads by .03 s, the search ended 60 lower in ln L with the lead put on it.
    """
    gust, channel = motion.gusts[VANE_OF[name]], MEASURED_BY[name]
    if channel not in ACCELERATIONS:
        return recording.in_rates(gust)
    return as_read(recording, effects, channel, gust[:, None])[:, 0]


def _floor(recording: Recording, channel: str) -> float:
    """Standard deviation of the rounding of a recorder, averaged over the samples that the band makes one of."""
    return float(recording.resolution.get(channel, 0.0) / np.sqrt(12.0 * recording.band.step))
