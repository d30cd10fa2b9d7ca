"""Density of the recorded motion, which the coefficient equations turn into residuals.

A regression maximises the density of its residuals e. What was recorded is the motion y, and a linear transformation e
= T y gives it the density of e times |det T|. At the frequency w of a record the residual of a rolling moment, say, is
(j w - L_p) p less the response to the controls: the determinant rises with the damping L_p. In general it is that of 1
- A/(j w), A the matrix of the linear equations of motion, and ln L contains its logarithm at every frequency of the
band, twice, for a complex amplitude is two real numbers. Of a first-order process with white residuals the sum over T
seconds tends to |L_p| T/2, the term by which Ito's integral differs from that with the symmetric derivative (Liptser &
Shiryayev, Statistics of Random Processes II, chapter 17).

Where all modes are damped, this is the determinant of the initial-value problem; one that grows within a record is not.
A misfit of the model, which is no noise, would be weighed wrongly by it: least squares is kept but where structures are
compared whose damping differs.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from aerosid.equation_error.equations.points import Unknown
from aerosid.equation_error.equations.recording import Recording
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import coupled_of, state_vector
from aerosid.flight_model.linear_model import evaluated

Array = NDArray[np.float64]

ITERATIONS = 2
"""Numerical: times that the determinant's gradient is taken at the values which the gradient before gave."""


STEP = 1e-4
"""Numerical: change of a term's value, over it or 1, by which the motion's dependence on it is found."""


class _Motion(NamedTuple):
    """The linear equations of motion of a record: without the unknowns (n, n), slopes by them (U, n, n), rad/s (K,)."""

    known: Array
    slopes: Array
    frequencies: Array

    @property
    def s(self) -> NDArray[np.complex128]:
        """J w, (K, 1, 1)."""
        return np.asarray(1j * self.frequencies[:, None, None], dtype=np.complex128)


@dataclass(frozen=True)
class OutputDensity:
    """Logarithm of the determinant as a function of the unknowns of a regression.

    Attributes
    ----------
    motions : tuple
        One for each record.
    places : ndarray of int, shape (U,)
        The unknowns that are terms.
    """

    motions: tuple[_Motion, ...]
    places: NDArray[np.int64]

    def logarithm(self, values: Array) -> float:
        """At values (P,) of the unknowns."""
        return sum(
            2.0 * float(np.sum(np.linalg.slogdet(self._characteristic(each, values) / each.s)[1]))
            for each in self.motions
        )

    def gradient(self, values: Array) -> Array:
        """Of the logarithm, (P,), at values (P,) of the unknowns."""
        gradient = np.zeros(values.size)
        for each in self.motions:
            resolvent = np.linalg.inv(self._characteristic(each, values)).sum(axis=0).real
            gradient[self.places] -= 2.0 * np.einsum("ji,uij->u", resolvent, each.slopes)
        return gradient

    def _characteristic(self, motion: _Motion, values: Array) -> NDArray[np.complex128]:
        """J w - A at every frequency, (K, n, n)."""
        matrix = motion.known + np.tensordot(values[self.places], motion.slopes, axes=1)
        return motion.s * np.eye(matrix.shape[0]) - matrix

    def likeliest(self, least_squares: Array, covariance: Array) -> tuple[Array, float]:
        """Values (P,) of highest likelihood with the determinant, and its logarithm there.

        `covariance`, (P, P), of the least-squares values (P,).
        """
        values, log_determinant = least_squares, self.logarithm(least_squares)
        likelihood = log_determinant
        for _ in range(ITERATIONS):
            gradient = self.gradient(values)
            step = covariance @ gradient
            reached = self.logarithm(least_squares + step)
            if reached - 0.5 * float(gradient @ step) < likelihood:
                break  # a covariance so wide that the determinant is not linear within it
            values, log_determinant = least_squares + step, reached
            likelihood = reached - 0.5 * float(gradient @ step)
        return values, log_determinant

    def without(self, removed: Collection[int]) -> OutputDensity:
        """The same without some unknowns, which are zero."""
        kept = [n for n, place in enumerate(self.places.tolist()) if place not in removed]
        places = [place - sum(other < place for other in removed) for place in self.places[kept].tolist()]
        motions = tuple(each._replace(slopes=each.slopes[kept]) for each in self.motions)
        return OutputDensity(motions, np.array(places, dtype=np.int64))


def output_density(
    recordings: Sequence[Recording],
    model: AerodynamicModel,
    unknowns: Sequence[Unknown],
    samples: Mapping[int, int],
) -> OutputDensity:
    """The density of some records' motion.

    Parameters
    ----------
    recordings : sequence of Recording
    model : AerodynamicModel
        With its inertia as it acts; its terms that are no unknowns are known.
    unknowns : sequence of Unknown
        Of the regression.
    samples : mapping of int to int
        Number of samples in the band of each record that is compared, by its index.
    """
    terms = [(place, unknown[1]) for place, unknown in enumerate(unknowns) if unknown[0] == "term"]
    columns = [model.index(entry) for _, entry in terms]  # type: ignore[arg-type]
    motions = tuple(_motion(model, columns, recordings[index], count) for index, count in samples.items() if count > 1)
    return OutputDensity(motions, np.array([place for place, _ in terms], dtype=np.int64))


def _motion(model: AerodynamicModel, columns: Sequence[int], recording: Recording, samples: int) -> _Motion:
    """The linear equations about a record's mean, linearised by the unknowns about the model's values.

    They are products of terms where the moment depends on alphadot, and thereby on the forces.
    """
    here, own = rates_matrix(model, recording), model.values[list(columns)]
    slopes = np.zeros((len(columns), *here.shape))
    for n, column in enumerate(columns):
        values = model.values.copy()
        values[column] += STEP * max(abs(float(values[column])), 1.0)
        moved = rates_matrix(model.with_values(values), recording)
        slopes[n] = (moved - here) / (values[column] - model.values[column])
    span = samples * recording.band.step * recording.interval
    frequencies = np.asarray(2.0 * np.pi * np.arange(1, (samples + 1) // 2) / span, dtype=np.float64)
    return _Motion(here - np.tensordot(own, slopes, axes=1), slopes, frequencies)


def rates_matrix(model: AerodynamicModel, recording: Recording) -> Array:
    """Partial derivatives (n, n) of the states' rates by the n coupled states, at the mean of a record.

    Of effects those on the inertia are in the model; a displaced centre of gravity and flow separation are left out.
    """
    inputs = dict(zip(recording.manoeuvre.columns, recording.manoeuvre.flight.inputs.mean(axis=0), strict=True))
    mean = {**inputs, **{name: float(np.mean(values)) for name, values in recording.channels.items()}}
    speed, alpha = float(mean["V"]), float(mean.get("alpha", 0.0))
    state = {
        "u": speed * np.cos(alpha),
        "w": speed * np.sin(alpha),
        "phi": float(mean.get("phi", 0.0)),
        "theta": float(mean.get("theta", alpha)),
        "h": float(mean.get("h", 0.0)),
    }
    row = np.array([float(inputs.get(name, 0.0)) for name in model.columns])
    coupled = [model.axes.integrated.index(name) for name in coupled_of(model.axes)]
    return evaluated(model, state_vector(model.axes, state), row).rates_x[np.ix_(coupled, coupled)]
