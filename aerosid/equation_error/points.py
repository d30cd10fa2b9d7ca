"""A point of the search: what acts with which numbers, and the equations of every recording there, in the band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.flight_model.aerodynamics import CONSTANT, AerodynamicModel, Entry
from aerosid.effects import ActiveEffect
from aerosid.equation_error.channels import COEFFICIENT, EQUATIONS, KINEMATIC
from aerosid.equation_error.coefficient_equations import CoefficientEquations
from aerosid.equation_error.kinematic_equations import predicted_records, reconstruct
from aerosid.equation_error.recording import Recording
from aerosid.equation_error.sensors import corrected
from aerosid.estimation.effect_columns import with_columns_of

Array = NDArray[np.float64]


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
    ramp : ndarray, shape (n,)
        Time from the middle of the record, s; empty where the equation has no drift.
    floor : float
        Least size of a residual that the recorder's resolution allows.
    """

    recording: int
    equation: str
    target: Array
    columns: dict[Entry, Array]
    time: Array
    floor: float


def equations_of(
    point: Point, recordings: Sequence[Recording], blend: float, kinds: Sequence[str] = EQUATIONS
) -> list[Segment]:
    """The equations of all recordings at a point; of those that are not fitted the kinematic ones alone."""
    segments = []
    for n, recording in enumerate(recordings):
        true = corrected(recording, point.effects)
        motion = reconstruct(recording, point.effects, true, blend)
        rows = recording.time[recording.band.rows(recording.time.size)]
        time = rows - 0.5 * (rows[0] + rows[-1])
        if any(kind in kinds for kind in KINEMATIC):
            for name, values in predicted_records(recording, point.effects, motion).items():
                target = recording.band(recording.channels[name] - values)
                segments.append(Segment(n, name, target, {}, time, _floor(recording, name)))
        if any(kind in kinds for kind in COEFFICIENT):
            segments.extend(_coefficients(n, point, recording, motion, time))
    return segments


def _coefficients(n, point, recording, motion, time):  # type: ignore[no-untyped-def]
    equations = CoefficientEquations(recording, point.model, point.effects, motion, point.free)
    names = [name for name in COEFFICIENT if name in equations.target]
    stacked = [equations.target[name] for name in names]
    keys: list[tuple[str, Entry | None]] = [(name, None) for name in names]
    for entry in point.free:
        for name, series in equations.column(entry).items():
            keys.append((name, entry))
            stacked.append(series)
    banded = recording.band(np.column_stack(stacked))
    found = {name: Segment(n, name, banded[:, i], {}, time, 0.0) for i, name in enumerate(names)}
    for i, (name, entry) in enumerate(keys):
        if entry is not None:
            found[name].columns[entry] = banded[:, i]
    return list(found.values())


def _floor(recording: Recording, channel: str) -> float:
    """Standard deviation of the rounding of a recorder, averaged over the samples that the band makes one of."""
    return float(recording.resolution.get(channel, 0.0) / np.sqrt(12.0 * recording.band.step))


CONSTANT_TERM = CONSTANT
