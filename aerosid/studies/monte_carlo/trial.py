"""One run of a study: draws the noise, runs the chain, and returns the results as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect
from aerosid.errors import EstimationError
from aerosid.estimation.open_loop import simulate
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.settings import StartValues
from aerosid.studies.journal import Row
from aerosid.studies.monte_carlo.noise_draw import ColouredNoise, NoiseSource
from aerosid.studies.monte_carlo.plan import Catalogue, Snr
from aerosid.studies.monte_carlo.search import Found, estimate_known, search, start_values
from aerosid.studies.monte_carlo.truth import Truth

FloatArray = NDArray[np.float64]


_NO_RUN = 2**32 - 1
"""Numerical: an unused run number, which seeds the draws common to all runs."""


@dataclass(frozen=True)
class Trials:
    """Data shared by all runs of a study; sent to workers.

    Attributes
    ----------
    truth : Truth
    levels : tuple of (snr, colour)
    seed : int
    catalogue : "known", "terms" or "all"
    starts : tuple of StartValues
        By level, where the re-estimation of the declared structure begins; from the declared values, which are far off
        where the structure is wrong, it takes a third of a run's time. Empty: at those declared.
    """

    truth: Truth
    levels: tuple[tuple[Snr, float], ...]
    seed: int
    catalogue: Catalogue
    starts: tuple[StartValues, ...] = ()

    def begun(self) -> Trials:
        """The shared data with initial values: results of one more flight at each level, with an unused run number."""
        if self.catalogue == "known":
            return self
        levels = range(len(self.levels))
        return replace(
            self, starts=tuple(start_values(self.log(level, _NO_RUN), self.truth.aircraft) for level in levels)
        )

    def deviations(self, level: int) -> tuple[FloatArray, FloatArray]:
        """Noise of the outputs, (p,), and of the extra inputs, (E,), SI per sample."""
        snr, _ = self.levels[level]
        truth = self.truth
        if snr is None:
            return np.zeros(truth.signal.size), np.zeros_like(truth.input_deviation)
        outputs = truth.recorded_deviation if snr == "recorded" else truth.signal / float(snr)
        return outputs, truth.input_deviation

    def source(self, level: int) -> NoiseSource:
        """The source of the outputs' noise."""
        return self.truth.recorded or ColouredNoise(self.levels[level][1])

    def log(self, level: int, run: int) -> FlightLog:
        """The log of one run. Its seed is that of `SeedSequence(seed).spawn` by level, then by run."""
        generator = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(level, run)))
        manoeuvre = self.truth.identification.manoeuvre
        outputs, inputs = self.deviations(level)
        clean = self.truth.identification.outputs
        samples = clean.shape[0]
        drawn = clean + outputs * self.source(level).draw(generator, samples, clean.shape[1])
        channels = dict(manoeuvre.log.channels)
        channels.update(zip(manoeuvre.outputs, drawn.T, strict=True))
        for j, deviation in enumerate(inputs):
            name = manoeuvre.extra_columns[j]
            if name in channels:
                noise = deviation * generator.standard_normal(samples) if deviation > 0.0 else 0.0
                channels[name] = manoeuvre.extra_inputs[:, j] + noise
        return replace(manoeuvre.log, channels=channels)


def run_trial(trials: Trials, key: str) -> Row:
    """The result of the run level/number.

    `values`, `plain`, `published`, `own`: of each true derivative its estimate and three standard errors, None where
    the model does not contain it; `found`: kind, place, term, value and standard error of each identified effect;
    `before`, `after`: root-mean-square error of each output of the predicted flight, None where it departs.
    """
    level, run = (int(part) for part in key.split("/"))
    truth = trials.truth
    log = trials.log(level, run)
    if trials.catalogue == "known":
        found = estimate_known(log, truth.aircraft, truth.free, truth.effects)
    else:
        found = search(log, truth.aircraft, trials.catalogue, trials.starts[level] if trials.starts else None)
    completed, uncertainty = found.completed, found.uncertainty
    if not np.isfinite(completed.cost):
        raise EstimationError("the likelihood of the estimate is not a number.")
    places = [completed.free.index(entry) if entry in completed.free else None for entry in truth.free]

    def of(numbers: FloatArray) -> list[float | None]:
        return [None if n is None or not np.isfinite(numbers[n]) else float(numbers[n]) for n in places]

    return {
        "values": of(np.array([completed.model.value(entry) for entry in completed.free])),
        "plain": of(uncertainty.white),
        "published": of(uncertainty.published),
        "own": of(uncertainty.corrected),
        "found": [[f.kind, f.where, f.term, f.value, f.std_error] for f in found.findings],
        **_predicted(truth, found),
    }


def _predicted(truth: Truth, found: Found) -> Row:
    if truth.validation is None:
        return {}
    row: Row = {"after": _errors(truth, found.completed.model, found.completed.effects)}
    if found.before is not None:
        row["before"] = _errors(truth, found.before.model, found.before.effects)
    return row


def _errors(truth: Truth, model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> list[float | None]:
    """Root-mean-square of true minus predicted outputs of the validation flight, from its true initial state."""
    flight = truth.validation
    assert flight is not None
    acting = [active for active in effects if active.acts_on(flight.manoeuvre.name)]
    outputs, _ = simulate(model, flight.manoeuvre, flight.state, acting)
    places = [flight.manoeuvre.row(name) for name in flight.manoeuvre.outputs]
    rms = np.sqrt(np.nanmean((flight.outputs - outputs[:, places]) ** 2, axis=0))
    diverged = not np.isfinite(outputs).all()
    return [None if diverged or not np.isfinite(value) else float(value) for value in rms]
