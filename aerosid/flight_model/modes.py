"""Natural modes of a linear model: short period, phugoid, Dutch roll, roll, spiral; frequency, damping, times."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from aerosid.flight_model.axes import LATERAL, LONGITUDINAL, coupled_of

SHORT_PERIOD, PHUGOID = "short_period", "phugoid"
THIRD_OSCILLATION, REAL_ROOT = "third_oscillatory", "real_root"
DUTCH_ROLL, ROLL, SPIRAL, ROLL_SPIRAL = "dutch_roll", "roll", "spiral", "coupled_roll_spiral"
LATERAL_ROOT, MIXED = "lateral_root", "mixed_root"

LONGITUDINAL_NAMES = (SHORT_PERIOD, PHUGOID, THIRD_OSCILLATION, f"{REAL_ROOT}_1", f"{REAL_ROOT}_2")
"""Of the modes of u, w, q, theta."""


@dataclass(frozen=True)
class Mode:
    """One mode of motion: a pair of roots, or a single real root.

    Attributes
    ----------
    name : str
        `short_period`, `phugoid`, `third_oscillatory`, `real_root_1`, `real_root_2`; `dutch_roll`, `roll`, `spiral`,
        `coupled_roll_spiral`, `lateral_root_1` to `_4`; `mixed_root_1` and so on where the motions cannot be told
        apart.
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

    @property
    def root(self) -> float | None:
        """Of a single root [1/s], negative where it decays; None of a pair."""
        return self.roots[0].real if len(self.roots) == 1 else None

    @property
    def time_constant(self) -> float | None:
        """Time to 1/e of the amplitude [s] of a single root that decays; None of any other."""
        root = self.root
        return -1.0 / root if root is not None and root < 0.0 else None


def modes_of(A: NDArray[np.float64], states: tuple[str, ...]) -> tuple[Mode, ...]:
    """The modes of the matrix A (n, n) of some states, each motion's by itself: longitudinal ones, then lateral ones.

    Parameters
    ----------
    A : ndarray, shape (n, n)
        d(rates)/d(states).
    states : tuple of str
        The states of one case.

    Notes
    -----
    Where both motions are integrated a root belongs to that motion whose states take the larger part in it; the part
    is the product of its left and right eigenvectors, which does not depend on the states' units.

    References
    ----------
    Perez-Arriaga, Verghese, Schweppe: Selective modal analysis with applications to electric power systems. IEEE
    Trans. Power Apparatus and Systems 101 (1982): participation factors.
    """
    motions = [
        ([states.index(name) for name in coupled_of(case) if name in states], named)
        for case, named in ((LONGITUDINAL, longitudinal_modes_of), (LATERAL, lateral_modes_of))
    ]
    motions = [(rows, named) for rows, named in motions if rows]
    if len(motions) == 1:
        return motions[0][1](_sorted(np.linalg.eigvals(A).tolist()))
    roots, left, right = eig(A, left=True, right=True)  # type: ignore[misc]  # its stub knows no left vectors
    part = np.abs(left.conj() * right)
    part = part / part.sum(axis=0)
    modes: list[Mode] = []
    for rows, named in motions:
        chosen = np.argsort(-part[rows].sum(axis=0), kind="stable")[: len(rows)]
        own = _sorted(roots[chosen].tolist())
        if sum(root.imag for root in own) != 0.0:  # a pair is torn apart: the motions are one
            every = _sorted(roots.tolist())
            return tuple(Mode(f"{MIXED}_{n}", (root,)) for n, root in enumerate(every, 1))
        modes.extend(named(own))
    return tuple(modes)


def mode_shape_ratio(
    A: NDArray[np.float64], states: tuple[str, ...], mode: Mode, above: str, below: str
) -> float | None:
    """Amplitude of one state over that of another in a mode; None where the other does not move.

    Parameters
    ----------
    A : ndarray, shape (n, n)
    states : tuple of str
    mode : Mode
        One of `modes_of` this matrix.
    above, below : str
        Two of the states.
    """
    roots, shapes = np.linalg.eig(A)
    shape = np.abs(shapes[:, int(np.argmin(np.abs(roots - mode.roots[0])))])
    moved = float(shape[states.index(below)])
    return float(shape[states.index(above)]) / moved if moved > 0.0 else None


def _sorted(roots: list[complex]) -> list[complex]:
    """The fastest first."""
    return sorted(map(complex, roots), key=lambda root: (-abs(root), root.real, root.imag))


def longitudinal_modes(A: NDArray[np.float64]) -> tuple[Mode, ...]:
    """The modes of the matrix A (4, 4) of u, w, q, theta, the fastest first.

    Notes
    -----
    The faster pair of roots is the short period, the slower one the phugoid, whether they are complex or real. Where
    an oscillation lies between two real roots (a statically unstable aircraft) the classical names mean nothing: it is
    the third oscillatory mode, and the real roots stand for themselves. McRuer, Ashkenas & Graham, Aircraft Dynamics
    and Automatic Control, chapter 5; Nelson, Flight Stability and Automatic Control, chapter 4.
    """
    return longitudinal_modes_of(_sorted(np.linalg.eigvals(A).tolist()))


def longitudinal_modes_of(roots: list[complex]) -> tuple[Mode, ...]:
    """The modes of four roots of u, w, q, theta, the fastest first; see `longitudinal_modes`."""
    oscillating = [root for root in roots if root.imag != 0.0]
    real = [root for root in roots if root.imag == 0.0]
    if len(oscillating) == 2 and abs(real[0]) > abs(oscillating[0]) > abs(real[1]):
        return (
            Mode(f"{REAL_ROOT}_1", (real[0],)),
            Mode(THIRD_OSCILLATION, tuple(oscillating)),
            Mode(f"{REAL_ROOT}_2", (real[1],)),
        )
    return Mode(SHORT_PERIOD, tuple(roots[:2])), Mode(PHUGOID, tuple(roots[2:]))


def lateral_modes_of(roots: list[complex]) -> tuple[Mode, ...]:
    """The modes of four roots of v, p, r, phi, the fastest first.

    Notes
    -----
    One pair is the Dutch roll; of the two real roots beside it the one that decays faster is the roll mode, the other
    the spiral. Of two pairs the slower one is roll and spiral coupled. Four real roots (an aircraft without directional
    stability) stand for themselves. McRuer, Ashkenas & Graham, Aircraft Dynamics and Automatic Control, chapter 6;
    Nelson, Flight Stability and Automatic Control, chapter 5.
    """
    oscillating = tuple(root for root in roots if root.imag != 0.0)
    real = [root for root in roots if root.imag == 0.0]
    if not oscillating:
        return tuple(Mode(f"{LATERAL_ROOT}_{n}", (root,)) for n, root in enumerate(roots, 1))
    modes = [Mode(DUTCH_ROLL, oscillating[:2])]
    if real:
        slower, faster = sorted(real, key=lambda root: -root.real)
        modes += [Mode(ROLL, (faster,)), Mode(SPIRAL, (slower,))]
    else:
        modes.append(Mode(ROLL_SPIRAL, oscillating[2:]))
    return tuple(sorted(modes, key=lambda mode: -abs(mode.roots[0])))
