"""Fixed-interval model error d(t) of flights, with every candidate passed through the same estimator.

The aircraft's equations are those of Parameswaran & Raol 1994, x' = f(x) + d, with d in the force and moment
coefficients. The forward estimate (21)-(23) on prefiltered channels gives a first d(t). Each sweep then flies the model
with d(t) acting, linearises along that motion, and solves the two-point boundary value problem (18)-(20) there exactly:
filter forward, costate backward.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, OutputEffect
from aerosid.effects.kinds import BodyEffect, PositionEffect
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import Entry
from aerosid.model_error.flight_sweeps.flights_in_error import FlightsInError, FlownError
from aerosid.model_error.flight_sweeps.swept_model import ErrorStatistics, Rows, Sweep, SweepSettings, SweptModel
from aerosid.model_error.flight_sweeps.whitened_rows import columns_of, smoothed_error, whiten, whitened_rows
from aerosid.model_error.term_selection.partial_correlation import Coloured, coloured_regression
from aerosid.signals.factor_search import search_in_logarithms

Array = NDArray[np.float64]

Cost = Callable[[tuple[float, ...]], float]


class FlightSweeps:
    """Sweeps on one set of flights.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
        One joint estimate.
    coefficients : sequence of str
        Those in which model error is allowed: the aircraft's.
    settings : SweepSettings, optional
    """

    def __init__(
        self, manoeuvres: Sequence[Manoeuvre], coefficients: Sequence[str], settings: SweepSettings | None = None
    ) -> None:
        self.flights = FlightsInError(tuple(manoeuvres), tuple(coefficients))
        self.settings = settings or SweepSettings()

    def estimate(
        self, start: SweptModel, *, search: bool = True, sweeps: int | None = None, polished: bool = True
    ) -> Sweep:
        """The estimate of a structure: sweeps until no number moves.

        Parameters
        ----------
        start : SweptModel
            Structure and start values.
        search : bool
            Whether spreads and memory of d are sought too.
        sweeps : int, optional
            In place of the settings' number.
        polished : bool
            Whether one more step is made by the weights of the innovations' own colour, and the deviation of d(t) is
            wanted.

        Raises
        ------
        EstimationError
            Where the model with d(t) cannot be flown, or a structure has more numbers than the flights hold.
        """
        settings = self.settings
        swept, traced = self.flights.begun(start)
        converged = False
        limit = settings.sweeps if sweeps is None else sweeps
        rows: Rows | None = None
        for turn in range(limit):
            if search and turn in settings.searches and (turn == 0 or sweeps is None):
                swept, rows = replace(swept, statistics=self._likeliest(swept, traced)), None
            rows = rows or whitened_rows(self.flights, swept, traced)
            if search and turn == 0:
                swept, rows = self._matched(swept, traced, rows)
            step, deviation = _plain_step(rows)
            size = self._size(step, deviation, swept)
            moved, _ = self._moved(swept, traced, step)
            traced, swept, rows = self._settled(swept, moved, rows, traced)
            if size < settings.tolerance and turn > 0:
                converged = True
                break
        rows = rows or whitened_rows(self.flights, swept, traced)
        fit = self.regressed(rows)
        if polished and settings.coloured and any(taps.size > 1 for taps in fit.filters):
            # The colour of the noise gives its own weights: one more step, by those.
            moved, _ = self._moved(swept, traced, fit.coefficients)
            traced, swept, rows = self._settled(swept, moved, rows, traced)
            fit = self.regressed(rows)
        _, spread = self._moved(swept, traced, fit.coefficients) if polished else (swept, ())
        return Sweep(swept, rows, fit, fit.cost + rows.log_sum, spread, converged)

    def _matched(self, swept: SweptModel, traced: list[FlownError], rows: Rows) -> tuple[SweptModel, Rows]:
        """The structure with sensors' noise of the innovations' own size, where those are far beyond all that it says.

        A recording that was smoothed afterwards differs from sample to sample by less than the sensors erred: no d(t)
        explains that attitude and rates then disagree by thousands of their noise. A channel's noise stays a small
        share of its motion: beyond, d(t) has to follow it.

        References
        ----------
        Myers & Tapley (1976), IEEE Transactions on Automatic Control 21, 520-523 (covariance matching).
        """
        settings = self.settings
        sizes = _mean_squares(rows, swept.statistics.variance.size)
        if float(np.nanmean(sizes)) < settings.unlike_noise**2:
            return swept, rows
        spread = np.array([manoeuvre.spread for manoeuvre in self.flights.manoeuvres]).max(axis=0)
        most = np.maximum(swept.statistics.variance, (settings.most_noise * spread) ** 2)
        for _ in range(settings.matchings):
            variance = np.minimum(swept.statistics.variance * np.nan_to_num(sizes, nan=1.0), most)
            swept = replace(swept, statistics=replace(swept.statistics, variance=variance))
            swept = replace(swept, statistics=self._likeliest(swept, traced))
            rows = whitened_rows(self.flights, swept, traced)
            sizes = _mean_squares(rows, variance.size)
            if np.all(np.isnan(sizes) | ((sizes > 0.5) & ((sizes < 2.0) | (variance >= most)))):
                break
        return swept, rows

    def asked(self, sweep: Sweep, entries: Sequence[Entry], effects: Sequence[ActiveEffect]) -> Rows:
        """The rows of an estimate with the columns of candidates: terms, then effects at their present numbers."""
        return whitened_rows(
            self.flights, sweep.swept, self.flights.traced_or_said(sweep.swept, entries, effects), entries
        )

    def undisturbed(self, sweep: Sweep) -> Sweep:
        """An estimate linearised along the motion that controls and terms make, without d(t); what is left is noise.

        Its columns are functions of the recorded controls alone: what d(t) has taken from the sensors' noise is in
        none of them, so that they serve as instrumental variables (Young 2011, Recursive Estimation and Time-Series
        Analysis, chapter 7). A noise model of each channel whitens what is left, as it comes from the sensors.

        Raises
        ------
        OutOfRangeError
            Where the model cannot be flown without its d(t).
        """
        least = (self.settings.least_spread,) * len(self.flights.coefficients)
        still = replace(
            sweep.swept,
            forces=tuple(np.zeros_like(force) for force in sweep.swept.forces),
            statistics=replace(sweep.swept.statistics, spread=least, gust=None),
        )
        rows = whitened_rows(self.flights, still, self.flights.traced(still))
        fit = self.regressed(rows)
        return Sweep(still, rows, fit, fit.cost + rows.log_sum, (), sweep.converged)

    def _size(self, step: Array, deviation: Array, swept: SweptModel) -> float:
        """Largest step of an estimate in its own deviations; initial states do not count."""
        count = len(swept.free) + swept.slopes
        known = np.isfinite(deviation[:count]) & (deviation[:count] > 0.0)
        return float(np.max(np.abs(step[:count][known]) / deviation[:count][known], initial=0.0))

    def _settled(
        self, swept: SweptModel, moved: SweptModel, rows: Rows, traced: list[FlownError]
    ) -> tuple[list[FlownError], SweptModel, Rows]:
        """The flown motion after a step, which is halved while it raises the weighted squares or cannot be flown.

        `rows`: of the motion before; those of the motion after are given back.
        """
        share, before = 1.0, float(rows.target @ rows.target)
        for _ in range(self.settings.halvings + 1):
            aim = _between(swept, moved, share)
            try:
                ahead = self.flights.traced(aim)
            except OutOfRangeError:
                share *= 0.5
                continue
            reached = whitened_rows(self.flights, aim, ahead)
            if float(reached.target @ reached.target) <= before * (1.0 + 1e-3) + 1.0:
                return ahead, aim, reached
            share *= 0.5
        return traced, swept, rows

    def regressed(self, rows: Rows) -> Coloured:
        """The regression of whitened rows on their known columns, in the colour that the settings allow."""
        colour = self.settings.colour if self.settings.coloured else replace(self.settings.colour, highest_order=0)
        return coloured_regression(rows.target, rows.known, rows.lengths, colour)

    def _moved(
        self, swept: SweptModel, traced: Sequence[FlownError], step: Array
    ) -> tuple[SweptModel, tuple[Array, ...]]:
        """The structure after a step in its numbers, with the d(t) that then fits best, and its deviation."""
        free, slopes = len(swept.free), swept.slopes
        values = swept.model.values.copy()
        values[swept.model.indices(swept.free)] += step[:free]
        effects, place = [], free
        for active in swept.effects:
            effects.append(active.moved(step[place : place + active.slopes]))
            place += active.slopes
        states, forces, deviations = [], [], []
        for n, flown in enumerate(traced):
            place, count = free + slopes + self.flights.state_count * n, self.flights.state_count
            states.append(swept.states[n] + step[place : place + count])
            columns = columns_of(swept, flown, n)
            residual = np.ascontiguousarray((columns[:, :, 0] - columns[:, :, 1:] @ step)[:, :, None])
            error, deviation = smoothed_error(self.flights, n, flown, residual, swept.statistics)
            forces.append(error[:, : len(self.flights.coefficients)] if self.settings.smoothed else swept.forces[n])
            deviations.append(deviation)
        model = swept.model.with_values(values)
        return replace(swept, model=model, effects=tuple(effects), states=tuple(states), forces=tuple(forces)), tuple(
            deviations
        )

    def _likeliest(self, swept: SweptModel, traced: Sequence[FlownError]) -> ErrorStatistics:
        """Spreads, memory and the sensors' noise at the maximum of the restricted likelihood, the motion held."""
        settings, statistics = self.settings, swept.statistics
        columns = [columns_of(swept, flown, n) for n, flown in enumerate(traced)]
        count = len(statistics.spread)

        def at(numbers: Sequence[float]) -> ErrorStatistics:
            air = statistics.gust and replace(statistics.gust, values=tuple(map(float, numbers[count + 1 :])))
            return replace(statistics, spread=tuple(numbers[:count]), memory=float(numbers[count]), gust=air)

        @cache
        def cost(numbers: tuple[float, ...]) -> float:
            total, normal = 0.0, np.zeros(())
            for n, (flown, block) in enumerate(zip(traced, columns, strict=True)):
                white = block.copy()
                total += whiten(self.flights, n, flown, white, at(numbers))
                flat = white.reshape(-1, white.shape[2])
                normal = normal + flat.T @ flat
            return total + _restricted(normal)

        air_numbers = statistics.gust.values if statistics.gust is not None else ()
        # From where a spread is none its slope is none either: what entered may have explained all of one coefficient.
        start = self._shown(cost, (*statistics.spread, statistics.memory, *air_numbers), count)
        limits = [(settings.least_spread, settings.most_spread)] * count
        limits.append((settings.shortest_memory, settings.longest_memory))
        if statistics.gust is not None:
            limits += [(parameter.lowest, parameter.highest) for parameter in statistics.gust.effect.parameters]
        sought = self._sought(start, count)
        if not sought:
            return at(start)

        def along(numbers: Sequence[float]) -> tuple[float, ...]:
            chosen = dict(zip(sought, numbers, strict=True))
            return tuple(chosen.get(place, number) for place, number in enumerate(start))

        found = search_in_logarithms(
            lambda numbers: cost(along(numbers)),
            tuple(start[place] for place in sought),
            [limits[place] for place in sought],
            0.1,
            settings.turns * count,
            settings.settled,
        )
        return at(self._shown(cost, along(found), count))

    def _sought(self, start: Sequence[float], count: int) -> list[int]:
        """Places of the numbers that are sought: no spread that is none, nor a memory of no d or a given one."""
        still = [self.settings.shown > 0.0 and number <= self.settings.least_spread for number in start[:count]]
        if all(still) and len(start) == count + 1:
            return []
        held = {count} if self.settings.shortest_memory == self.settings.longest_memory else set()
        return [place for place in range(len(start)) if place not in held and (place >= count or not still[place])]

    def _shown(self, cost: Cost, numbers: Sequence[float], count: int) -> tuple[float, ...]:
        """The numbers with each of the first `count`, the spreads, at its least where the flights show no more."""
        numbers, least = tuple(numbers), self.settings.least_spread
        for place in range(count if self.settings.shown > 0.0 else 0):
            still = (*numbers[:place], least, *numbers[place + 1 :])
            if numbers[place] > least and cost(still) < cost(numbers) + self.settings.shown:
                numbers = still
        return numbers


def _mean_squares(rows: Rows, outputs: int) -> Array:
    """Mean square innovation of each output, the known columns' share taken out; NaN where nothing was measured."""
    step, _ = _plain_step(rows)
    left = (rows.target - rows.known @ step) ** 2
    squares, count, first = np.zeros(outputs), np.zeros(outputs), 0
    for (_, output), length in zip(rows.channels, rows.lengths, strict=True):
        squares[output] += float(left[first : first + length].sum())
        count[output] += length
        first += length
    return np.asarray(np.divide(squares, count, out=np.full(outputs, np.nan), where=count > 0.0))


def _plain_step(rows: Rows) -> tuple[Array, Array]:
    """Least squares of whitened rows, and deviations; an undetermined number stays, with an infinite one."""
    scale = np.linalg.norm(rows.known, axis=0)
    shown = np.flatnonzero(scale > 0.0)
    step, deviation = np.zeros(scale.size), np.full(scale.size, np.inf)
    columns = rows.known[:, shown] / scale[shown]
    strength, vectors = np.linalg.eigh(columns.T @ columns)
    clear = strength > 1e-12 * strength[-1]
    root = vectors[:, clear] / np.sqrt(strength[clear])
    step[shown] = root @ (root.T @ (columns.T @ rows.target)) / scale[shown]
    deviation[shown] = np.sqrt(np.sum(root**2, axis=1)) / scale[shown]
    return step, deviation


def _restricted(normal: Array) -> float:
    """Residual squares and ln |information| from the products (1 + m, 1 + m) of target and known columns."""
    scale = np.sqrt(np.diag(normal)[1:])
    shown = np.flatnonzero(scale > 0.0)
    if not shown.size:
        return float(normal[0, 0])
    inner = normal[1:, 1:][np.ix_(shown, shown)] / np.outer(scale[shown], scale[shown])
    strength, vectors = np.linalg.eigh(inner)
    clear = strength > 1e-12 * strength[-1]
    product = vectors[:, clear].T @ (normal[1:, 0][shown] / scale[shown])
    squares = float(normal[0, 0] - np.sum(product**2 / strength[clear]))
    return squares + float(np.sum(np.log(strength[clear]))) + 2.0 * float(np.sum(np.log(scale[shown])))


def _between(swept: SweptModel, moved: SweptModel, share: float) -> SweptModel:
    """Part of the way from one set of numbers to another."""
    if share >= 1.0:
        return moved
    values = swept.model.values + share * (moved.model.values - swept.model.values)
    effects = tuple(
        replace(
            after, values=tuple((1.0 - share) * a + share * b for a, b in zip(before.values, after.values, strict=True))
        )
        for before, after in zip(swept.effects, moved.effects, strict=True)
    )
    states = tuple(a + share * (b - a) for a, b in zip(swept.states, moved.states, strict=True))
    forces = tuple(a + share * (b - a) for a, b in zip(swept.forces, moved.forces, strict=True))
    return replace(moved, model=moved.model.with_values(values), effects=effects, states=states, forces=forces)


def is_seen(active: ActiveEffect) -> bool:
    """Whether an effect is a column in d(t) to first order: of a sensor, of the aircraft's body or on an input."""
    return isinstance(active.effect, InputEffect | OutputEffect | PositionEffect | BodyEffect)
