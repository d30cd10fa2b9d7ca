"""Expected deviations of derivatives from a stretch of flight: Fisher information through equation error.

What a manoeuvre is worth is not how it looks, but how well it determines derivatives: q' is regressed on angle of
attack, pitch rate and elevator (p' and r' on sideslip, roll and yaw rate, aileron and rudder) and the deviations are
those of coloured residuals. With an aircraft they are those of its coefficients, else of the derivatives per unit
inertia, in 1/s and 1/s^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aerosid.aircraft.model import Aircraft
from aerosid.flight_model.constants import GRAVITY
from aerosid.logs.flight_log import FlightLog, FloatArray
from aerosid.nomenclature import is_surface
from aerosid.signals.resampling import without_gaps
from aerosid.signals.residual_covariance import coloured_covariance

__all__ = ["ExpectedDeviation", "expected_deviations"]


@dataclass(frozen=True)
class InformationSettings:
    """From what samples the information of a stretch is told; chosen, found on no recording.

    Attributes
    ----------
    fewest : int
        Samples from which on anything is told.
    most : int
        Samples; a longer stretch is thinned, it tells no more of so few derivatives.
    smoothed : float
        V/g; width of the local parabola whose slope is the rate's derivative.
    """

    fewest: int = 30
    most: int = 2000
    smoothed: float = 0.05


INFORMATION = InformationSettings()
"""The settings of every stretch."""


@dataclass(frozen=True)
class ExpectedDeviation:
    """One derivative as a stretch of flight would give it.

    Attributes
    ----------
    coefficient : str
        C_m and so on with an aircraft; M, L, N (moment over inertia) or Z (a_z) without.
    term : str
        What it is the derivative with respect to.
    value, deviation : float
        Estimate by equation error, and its standard error with coloured residuals.
    unit : str
    """

    coefficient: str
    term: str
    value: float
    deviation: float
    unit: str

    @property
    def shown(self) -> bool:
        """Whether the derivative differs from zero by two of its deviations."""
        return abs(self.value) > 2.0 * self.deviation


class _Equation(NamedTuple):
    """left side = sum of derivative * channel + constant."""

    name: str
    coefficient: str
    left: str
    derived: bool
    terms: tuple[str, ...]


_EQUATIONS = (
    _Equation("M", "C_m", "q", True, ("alpha", "q", "delta_e")),
    _Equation("Z", "C_Z", "a_z", False, ("alpha", "q", "delta_e")),
    _Equation("L", "C_l", "p", True, ("beta", "p", "r", "delta_a", "delta_r")),
    _Equation("N", "C_n", "r", True, ("beta", "p", "r", "delta_a", "delta_r")),
)
_LONGITUDINAL = ("M", "Z")
_LATERAL = ("L", "N")


def expected_deviations(
    log: FlightLog, moved: tuple[str, ...], aircraft: Aircraft | None = None
) -> tuple[ExpectedDeviation, ...]:
    """What a cut would tell of the derivatives of the axes whose surfaces moved in it.

    Parameters
    ----------
    log : FlightLog
        The cut.
    moved : tuple of str
        Its moved surfaces.
    aircraft : Aircraft, optional
        Turns derivatives per unit inertia into those of C_m and C_Z.
    """
    names = (_LONGITUDINAL if "delta_e" in moved else ()) + (
        _LATERAL if "delta_a" in moved or "delta_r" in moved else ()
    )
    found: list[ExpectedDeviation] = []
    for equation in _EQUATIONS:
        if equation.name in names:
            found += _from_equation(log, equation, moved, aircraft)
    return tuple(found)


def _from_equation(
    log: FlightLog, equation: _Equation, moved: tuple[str, ...], aircraft: Aircraft | None
) -> list[ExpectedDeviation]:
    # A surface that rested is not asked for: it would only take what it has in common with the constant.
    terms = [name for name in equation.terms if name in log and (not is_surface(name) or name in moved)]
    if equation.left not in log or "V" not in log or len(terms) < 2 or not np.isfinite(log["V"]).any():
        return []
    every = max(1, log.samples // INFORMATION.most)
    speed = float(np.nanmean(log["V"]))
    names = [equation.left, *terms]
    table = {name: _mostly_there(log, name) for name in names}
    if any(values is None for values in table.values()):
        return []
    columns = {name: values for name, values in table.items() if values is not None}
    left = columns[equation.left]
    if equation.derived:
        left = _slope(log, left, speed / GRAVITY)
    rows = np.column_stack([columns[name] for name in terms])[::every]
    rows = np.column_stack([rows - rows.mean(axis=0), np.ones(rows.shape[0])])
    right = left[::every]
    spread = rows[:, :-1].std(axis=0)
    if (
        right.size < INFORMATION.fewest
        or not np.all(spread > 0.0)
        or np.linalg.matrix_rank(rows / np.r_[spread, 1.0]) < len(terms) + 1
    ):
        return []
    solution = np.linalg.lstsq(rows, right, rcond=None)[0]
    residual = right - rows @ solution
    if float(residual.std()) <= 1e-9 * float(right.std()):
        deviations = np.zeros(len(terms))
    else:
        deviations = np.sqrt(np.maximum(np.diag(coloured_covariance(rows, residual).corrected)[:-1], 0.0))
    scale = _scales(equation, terms, speed, aircraft)
    return [
        ExpectedDeviation(
            *scale[name][:2], float(value * scale[name][2]), float(deviation * abs(scale[name][2])), scale[name][3]
        )
        for name, value, deviation in zip(terms, solution, deviations, strict=False)
    ]


def _mostly_there(log: FlightLog, name: str) -> FloatArray | None:
    """A channel without its missing samples; None where half of it is missing."""
    if np.count_nonzero(np.isfinite(log[name])) < 0.5 * log.samples:
        return None
    return without_gaps(log.time, log[name])


def _slope(log: FlightLog, rate: FloatArray, unit: float) -> FloatArray:
    """The derivative of a rate, from a local parabola of about 0.05 V/g."""
    from scipy.signal import savgol_filter

    width = max(5, round(INFORMATION.smoothed * unit / log.interval))
    width += 1 - width % 2
    slope: FloatArray = savgol_filter(rate, min(width, log.samples - 1 + log.samples % 2), 2, 1, log.interval)
    return slope


def _scales(
    equation: _Equation, terms: list[str], speed: float, aircraft: Aircraft | None
) -> dict[str, tuple[str, str, float, str]]:
    """Name, term, factor and unit of each derivative."""
    result = {}
    for name in terms:
        rate = name in ("p", "q", "r")
        per = {True: "1/s" if rate else "1/s^2", False: "m/s" if rate else "m/s^2"}[equation.derived]
        result[name] = (equation.name, name, 1.0, per)
        if aircraft is None or aircraft.density is None or equation.coefficient not in ("C_m", "C_Z"):
            continue
        force = 0.5 * aircraft.density * speed**2 * aircraft.wing_area
        factor = aircraft.I_yy / (force * aircraft.mean_chord) if equation.derived else aircraft.mass / force
        if rate:
            factor *= 2.0 * (aircraft.airspeed or speed) / aircraft.mean_chord
        result[name] = (equation.coefficient, f"{name}_hat" if rate else name, factor, "1")
    return result
