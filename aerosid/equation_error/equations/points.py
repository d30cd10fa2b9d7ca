"""A point of the search: a structure with parameter values, and the equations of every record there, in the band."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, OutputEffect
from aerosid.effects.kinds import PositionEffect
from aerosid.equation_error.equations.channels import (
    AIRSPEED,
    COEFFICIENT,
    HEIGHT,
    KINEMATIC,
    LATERAL_COEFFICIENTS,
    MEASURED_BY,
    VANE_OF,
)
from aerosid.equation_error.equations.coefficient import CoefficientEquations
from aerosid.equation_error.equations.derived_forces import is_derived, low_passed
from aerosid.equation_error.equations.height_random_walk import height_random_walk
from aerosid.equation_error.equations.instrumental_variables import instrumental_variables, orthonormal
from aerosid.equation_error.equations.integrated_noise import integral_modes
from aerosid.equation_error.equations.kinematic import (
    Motion,
    inconsistent_heading,
    path_as_measured,
    predicted_records,
    reconstruct,
    with_height,
)
from aerosid.equation_error.equations.mean_gust import airspeed_by_mean_gust
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.equations.rotary_gust import BY_GUST_IN_ROLL, ROTARY
from aerosid.equation_error.equations.sensors import as_read, corrected
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.flight_model.aerodynamics import CONSTANT, AerodynamicModel, Entry
from aerosid.flight_model.axes import ACCELERATIONS
from aerosid.flight_model.constants import GRAVITY
from aerosid.flight_model.terms import parse_term

Array = NDArray[np.float64]


Unknown = tuple[object, ...]
"""Name of a column: ("constant" | "drift" | "bend", equation, recording), ("term", entry), ("one", entry, recording),
("gust", equation), ("rotary_gust", equation), ("random_walk", equation, recording, mode) or ("effect", index of the
effect, index of its parameter)."""

CACHED_MOTIONS = 24
"""Numerical: cached motions of each record; a Gauss-Newton step over ten sensor parameters needs as many."""

CACHED_PATHS, CACHED_SAMPLES = 512, 1_000_000
"""Numerical: fewest points of which the kinematic equations of each record are cached, in the band and so small, and
samples of an equation up to which more are; a search revisits some with one error more and one less, of a short record
after a thousand others."""

SIDESLIP = parse_term("beta")
"""Derivative by which the error of a sideslip without a vane acts."""

_Sensors = tuple[object, ...]
_Computed = TypeVar("_Computed")


@dataclass(frozen=True)
class Point:
    """A structure with its parameter values.

    Attributes
    ----------
    model : AerodynamicModel
        With the current values.
    free : tuple of Entry
        Terms that are estimated.
    effects : tuple of ActiveEffect
        Fixed and free ones; those with `values` are free.
    """

    model: AerodynamicModel
    free: tuple[Entry, ...]
    effects: tuple[ActiveEffect, ...]

    def with_effects(self, effects: Sequence[ActiveEffect]) -> Point:
        """The point with other effects, and the input columns that they fill."""
        return replace(self, model=with_columns_of(self.model, effects), effects=tuple(effects))


@dataclass(frozen=True)
class Segment:
    """One equation of one record, in the band.

    Attributes
    ----------
    recording : int
        Its index.
    equation : str
    target : ndarray, shape (n,)
        Measured signal less the known part.
    columns : mapping of Entry to ndarray, shape (n,)
        Contribution of one unit of each free term that acts in it.
    time : ndarray, shape (n,)
        From the middle of the record, s.
    floor : float
        Least size of a residual that the recorder's resolution allows.
    instruments : ndarray, shape (n, K), optional
        Instrumental variables in whose space the equation is compared; None for all of it.
    random_walk : ndarray, shape (n, K), optional
        Low-frequency error modes of an integrated path in it, each of unit standard deviation.
    gust : ndarray, shape (n,), optional
        Difference of the vane of its plane from the flow angle of the terms; None where it is zero.
    rotary_gust : ndarray, shape (n,), optional
        Rotary gust of its plane by the vane, as q_hat or r_hat; None where it is left in the residual.
    drifts : bool
        Whether a line in time is fitted as well: a flow angle without a vane contains one.
    """

    recording: int
    equation: str
    target: Array
    columns: dict[Entry, Array]
    time: Array
    floor: float
    instruments: Array | None = None
    gust: Array | None = None
    rotary_gust: Array | None = None
    random_walk: Array | None = None
    drifts: bool = False


class Equations:
    """The equations of some records, at one point after another.

    What depends on the sensors alone is cached for the last few points: most points of a search differ in other
    effects.
    """

    def __init__(
        self,
        recordings: Sequence[Recording],
        settings: EquationErrorSettings,
        kinds: Sequence[str],
        *,
        all_fitted: bool = False,
        rotary_gusts: Collection[str] = (),
    ) -> None:
        self._recordings, self._settings = recordings, settings
        self._rotary = {name: vane for name, vane in ROTARY.items() if vane in rotary_gusts}
        self._kinematic = any(kind in kinds for kind in KINEMATIC)
        self._coefficient = any(kind in kinds for kind in COEFFICIENT)
        self._fitted = [recording.fitted or all_fitted for recording in recordings]
        # A side gust with a gradient along the flight has one across the span as well.
        self._rolls = self._coefficient and ROTARY["C_n"] in rotary_gusts
        fewer = replace(settings, laguerre_order=settings.regressor_order)
        self._responses = instrumental_variables(recordings, fewer) if self._rolls else ()
        # Of kinematic equations alone.
        self._instruments = instrumental_variables(recordings, settings) if self._kinematic else ()
        self._excluded = [inconsistent_heading(each, settings) for each in recordings if self._kinematic]
        self._path_modes: dict[tuple[int, str], Array | None] = {}
        self._sideslip_modes: dict[int, Array] = {}
        self._motions: list[dict[_Sensors, Motion]] = [{} for _ in recordings]
        self._paths: list[dict[_Sensors, list[Segment]]] = [{} for _ in recordings]

    def at(self, point: Point) -> list[Segment]:
        """The equations of all records; coefficients only on those that are fitted."""
        segments = []
        for n, recording in enumerate(self._recordings):
            if self._kinematic:
                segments.extend(self._path(n, recording, point.effects))
            if self._coefficient and self._fitted[n]:
                motion = self._motion(n, recording, point.effects)
                segments.extend(self._coefficients(n, point, recording, motion))
        return segments

    def residuals(
        self, point: Point, values: Mapping[Unknown, float], log: str = "", elsewhere: Array | None = None
    ) -> Array:
        """Residuals (R,) of the coefficient equations alone for given values of the terms; no column is computed.

        `log`: the only record whose residuals differ from those `elsewhere`, (R,); by default all.
        """
        parts: list[Array] = []
        first = 0
        for n, recording in enumerate(self._recordings):
            if not self._fitted[n]:
                continue
            if elsewhere is not None:
                rows = slice(first, first + recording.time_in_band.size * len(recording.manoeuvre.axes.coefficients))
                first = rows.stop
                if log and recording.name != log:
                    parts.append(elsewhere[rows])
                    continue
            motion = self._motion(n, recording, point.effects)
            known = {entry: values.get(value_of(entry, n), 0.0) for entry in point.free}
            equations = CoefficientEquations(recording, point.model, point.effects, motion, point.free, known)
            residuals = equations.columns(())[1]
            for index, name in enumerate(equations.names):
                if gain := values.get(("gust", name), 0.0):
                    residuals[:, index] -= gain * _gust(name, recording, point.effects, motion)
                if gain := values.get(("rotary_gust", name), 0.0):
                    residuals[:, index] -= gain * motion.rotary_gust(self._rotary[name], point.model.constants)
            for index, name in enumerate(equations.names):
                self._low_pass(recording, name, residuals[:, index : index + 1])
            filtered = recording.band(residuals)
            for name, modes in self._sideslip_errors(n, recording, point.model, motion).items():
                index = equations.names.index(name)
                filtered[:, index] -= values.get(("drift", name, n), 0.0) * recording.from_middle
                for k, mode in enumerate(modes.T):
                    filtered[:, index] -= values.get(("random_walk", name, n, k), 0.0) * mode
            parts.extend(filtered.T)
        return np.concatenate(parts)

    def _coefficients(self, n: int, point: Point, recording: Recording, motion: Motion) -> list[Segment]:
        """The coefficient equations of one record in the band, with the columns of the free terms."""
        equations = CoefficientEquations(recording, point.model, point.effects, motion, point.free)
        touching, columns = equations.columns(point.free)
        first = 0
        for name, entries in touching.items():
            self._low_pass(recording, name, columns[:, first : first + 1 + len(entries)])
            first += 1 + len(entries)
        filtered = recording.band(columns)
        random_walk = self._sideslip_errors(n, recording, point.model, motion)
        segments, index = [], 0
        for name, entries in touching.items():
            target, *slopes = filtered[:, index : index + 1 + len(entries)].T
            gust = rotary = None
            if motion.gusts[VANE_OF[name]].any():
                gust = recording.band(_gust(name, recording, point.effects, motion))
                if name in self._rotary:
                    rotary = recording.band(motion.rotary_gust(self._rotary[name], point.model.constants))
            own = dict(zip(entries, slopes, strict=True))
            segment = Segment(n, name, target, own, recording.from_middle, 0.0, gust=gust, rotary_gust=rotary)
            if self._rolls and name in BY_GUST_IN_ROLL and (responses := self._responses[n]) is not None:
                known = [responses, *(each for each in (gust, rotary) if each is not None)]
                segment = replace(segment, instruments=orthonormal(np.column_stack(known)))
            if name in random_walk:
                segment = replace(segment, random_walk=random_walk[name], drifts=True)
            segments.append(segment)
            index += 1 + len(entries)
        return segments

    def _low_pass(self, recording: Recording, equation: str, columns: Array) -> None:
        """Columns (N, K) of an equation behind the low-pass that it needs without its accelerometer, in place."""
        if is_derived(recording, equation):
            columns[:] = low_passed(columns, recording.interval, self._settings.derived_forces)

    def _sideslip_errors(
        self, n: int, recording: Recording, model: AerodynamicModel, motion: Motion
    ) -> dict[str, Array]:
        """Effect of usual errors of a sideslip without a vane on each coefficient, in the band, (n, K) each."""
        if recording.manoeuvre.sideslip_measured:
            return {}
        if n not in self._sideslip_modes:
            speed = recording.manoeuvre.mean_airspeed
            gains = {"a_y": 1.0 / speed, "r": 1.0, "phi": GRAVITY / speed}
            self._sideslip_modes[n] = integral_modes(recording, recording.time_in_band, gains, self._settings)
        errors = np.column_stack([motion.sideslip_errors_in_band, self._sideslip_modes[n]])
        return {name: model.value((name, SIDESLIP)) * errors for name in LATERAL_COEFFICIENTS}

    def _modes_of_path(self, n: int, recording: Recording, name: str) -> Array | None:
        """Low-frequency error modes of an integrated path of a record, computed once; None where there are none."""
        if name not in (HEIGHT, AIRSPEED):
            return None
        if (n, name) not in self._path_modes:
            self._path_modes[n, name] = (
                height_random_walk(recording, recording.time_in_band, self._settings)
                if name == HEIGHT
                else airspeed_by_mean_gust(recording, self._settings)
            )
        return self._path_modes[n, name]

    def _motion(self, n: int, recording: Recording, effects: Sequence[ActiveEffect]) -> Motion:
        """The motion reconstructed from a record's sensors without their errors."""

        def compute() -> Motion:
            return reconstruct(recording, other, self._corrected(recording, other), self._settings)

        def compute_with_height() -> Motion:
            motion = _cached(self._motions[n], _sensors(other), CACHED_MOTIONS, compute)
            return with_height(motion, self._corrected(recording, effects)[HEIGHT])

        # The path relative to the air does not depend on the height sensor.
        is_measured = HEIGHT in recording.channels
        other = [active for active in effects if not (is_measured and _is_of_height(active))]
        return _cached(
            self._motions[n],
            _sensors(effects),
            CACHED_MOTIONS,
            compute if len(other) == len(effects) else compute_with_height,
        )

    def _corrected(self, recording: Recording, effects: Sequence[ActiveEffect]) -> dict[str, Array]:
        """The channels without their sensors' errors; where a late one has no data it follows the path."""
        return corrected(recording, effects, lambda: path_as_measured(recording, self._settings))

    def _path(self, n: int, recording: Recording, effects: Sequence[ActiveEffect]) -> list[Segment]:
        """The kinematic equations of a record."""

        def compute() -> list[Segment]:
            motion = self._motion(n, recording, effects)
            predicted = predicted_records(recording, effects, motion)
            names = [name for name in predicted if name not in self._excluded[n]]
            if not names:
                return []
            targets = recording.band(np.column_stack([recording.channels[name] - predicted[name] for name in names]))
            segments = []
            for name, target in zip(names, np.ascontiguousarray(targets.T), strict=True):
                random_walk = self._modes_of_path(n, recording, name)
                floor = _floor(recording, name)
                segments.append(
                    Segment(
                        n, name, target, {}, recording.from_middle, floor, self._instruments[n], random_walk=random_walk
                    )
                )
            return segments

        most = max(CACHED_PATHS, CACHED_SAMPLES // recording.time_in_band.size)
        return _cached(self._paths[n], _sensors(effects), most, compute)


def _is_of_height(active: ActiveEffect) -> bool:
    return isinstance(active.effect, OutputEffect) and active.effect.where == HEIGHT


def _sensors(effects: Sequence[ActiveEffect]) -> _Sensors:
    """Key of the effects that change the reconstructed motion."""
    return tuple(
        (active.name, getattr(active.effect, "axes", ""), active.numbers, active.log)
        for active in effects
        if isinstance(active.effect, OutputEffect | PositionEffect)
    )


def _cached(known: dict[_Sensors, _Computed], key: _Sensors, most: int, compute: Callable[[], _Computed]) -> _Computed:
    """The result computed for a key; the least recently used one is dropped."""
    found = known.pop(key) if key in known else compute()
    known[key] = found
    if len(known) > most:
        del known[next(iter(known))]
    return found


def value_of(entry: Entry, recording: int) -> Unknown:
    """The unknown that is a term's value on a record: constants are estimated for each record."""
    return ("one", entry, recording) if entry[1] == CONSTANT else ("term", entry)


def _gust(name: str, recording: Recording, effects: Sequence[ActiveEffect], motion: Motion) -> Array:
    """Difference of the vane of an equation's plane from the path, (N,), as an accelerometer reads the response to it.

    A gyro's is not delayed: moments respond to gusts within hundredths of a second, and on the ATTAS stall, whose gyro
    leads by .03 s, the search ended 60 lower in ln L with the lead applied to it.
    """
    plane, channel = VANE_OF[name], MEASURED_BY[name]
    if channel not in ACCELERATIONS:
        return motion.gusts_in_rates[plane]
    return as_read(recording, effects, channel, motion.gusts[plane][:, None])[:, 0]


def _floor(recording: Recording, channel: str) -> float:
    """Standard deviation of a recorder's rounding, averaged over the samples that the band combines into one."""
    return float(recording.resolution.get(channel, 0.0) / np.sqrt(12.0 * recording.band.step))
