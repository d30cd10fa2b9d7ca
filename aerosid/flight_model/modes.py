"""Longitudinal modes of a linear model: short period, phugoid, real roots; frequency, damping, times."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SHORT_PERIOD, PHUGOID = "short_period", "phugoid"
THIRD_OSCILLATION, REAL_ROOT = "third_oscillatory", "real_root"


@dataclass(frozen=True)
class Mode:
    """One mode of motion: a pair of roots, or a single real root.

    Attributes
    ----------
    name : str
        `short_period`, `phugoid`, `third_oscillatory`, `real_root_1`, `real_root_2`.
    roots : tuple of complex
        1/s. A pair may be real: an overdamped short period, a phugoid that has become two subsidences.
    """

    name: str
    roots: tuple[complex, ...]

    @property
    def frequency(self) -> float | None:
        """Undamped natural frequency [rad/s]; None of a single root and of two real roots of opposite sign."""
        product = math.prod(self.roots).real if len(self.roots) == 2 else 0.0
        return math.sqrt(product) if product > 0.0 else None

    @property
    def damping(self) -> float | None:
        """Damping ratio, above 1 of two real roots; None where there is no natural frequency."""
        frequency = self.frequency
        return None if frequency is None else -sum(self.roots).real / (2.0 * frequency)

    @property
    def period(self) -> float | None:
        """Time of one oscillation [s]; None where the mode does not oscillate."""
        damped = abs(self.roots[0].imag)
        return 2.0 * math.pi / damped if damped > 0.0 else None

    @property
    def time_to_half(self) -> float | None:
        """Time to half amplitude [s], of the slower root where both are real; None where the mode grows."""
        growth = max(root.real for root in self.roots)
        return -math.log(2.0) / growth if growth < 0.0 else None

    @property
    def time_to_double(self) -> float | None:
        """Time to double amplitude [s]; None where the mode decays."""
        growth = max(root.real for root in self.roots)
        return math.log(2.0) / growth if growth > 0.0 else None


def longitudinal_modes(A: NDArray[np.float64]) -> tuple[Mode, ...]:
    """The modes of the matrix A (4, 4) of u, w, q, theta, the fastest first.

    Notes
    -----
    The faster pair of roots is the short period, the slower one the phugoid, whether they are complex or real. Where
    an oscillation lies between two real roots (a statically unstable aircraft) the classical names mean nothing: it is
    the third oscillatory mode, and the real roots stand for themselves. McRuer, Ashkenas & Graham, Aircraft Dynamics
    and Automatic Control, chapter 5; Nelson, Flight Stability and Automatic Control, chapter 4.
    """
    roots = sorted(np.linalg.eigvals(A).tolist(), key=lambda root: (-abs(root), root.real, root.imag))
    oscillating = [root for root in roots if root.imag != 0.0]
    real = [root for root in roots if root.imag == 0.0]
    if len(oscillating) == 2 and abs(real[0]) > abs(oscillating[0]) > abs(real[1]):
        return (
            Mode(f"{REAL_ROOT}_1", (real[0],)),
            Mode(THIRD_OSCILLATION, tuple(oscillating)),
            Mode(f"{REAL_ROOT}_2", (real[1],)),
        )
    return Mode(SHORT_PERIOD, tuple(roots[:2])), Mode(PHUGOID, tuple(roots[2:]))
