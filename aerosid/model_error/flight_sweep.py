"""Fixed-interval model error d(t) of flights, with every candidate passed through the same estimator.

The aircraft's equations are those of Parameswaran & Raol 1994, x' = f(x) + d, with d in the force and moment
coefficients. The forward estimate (21)-(23) on prefiltered channels gives a first d(t). Each sweep then flies the model
with d(t) acting, linearises along that motion, and solves the two-point boundary value problem (18)-(20) there exactly:
filter forward, costate backward. What the filter does to the residual it does to the columns of the terms, sensors and
controls that are estimated, and to those that are only asked about.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, EffectParameter, InputEffect, OutputEffect
from aerosid.effects.disturbance import GUST_COLUMN, gust
from aerosid.effects.step_change import offset_column
from aerosid.errors import EstimationError
from aerosid.estimation.effect_columns import with_columns_of, with_gust, with_offsets
from aerosid.estimation.effects_in_flight import OutOfRangeError, acting_flight
from aerosid.estimation.likelihood import Likelihood, Traced
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.flight_model.axes import LONGITUDINAL, loads_of
from aerosid.flight_model.flight import Flight, coefficients_along, simulate_outputs
from aerosid.model_error.forward_start import forward_forces
from aerosid.model_error.partial_correlation import Coloured, coloured_regression
from aerosid.model_error.swept_model import ErrorStatistics, Rows, Sweep, SweepSettings, SweptModel
from aerosid.signals.factor_search import search_in_logarithms
from aerosid.signals.smoothing import smooth_inputs
from aerosid.signals.trace import Trace
from aerosid.signals.whitening import (
    InputNoise,
    initial_covariance,
    make_whitening_carry,
    noisy_inputs_alone,
    whiten_stretch,
)

Array = NDArray[np.float64]

STATE_COUNT = len(LONGITUDINAL.integrated)


@dataclass(frozen=True)
class _Flown:
    """One flight of the model with d(t) acting; `offsets` are d's places among the extra inputs, the air's last."""

    part: Traced
    offsets: tuple[int, ...]


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
        self.manoeuvres = tuple(manoeuvres)
        self.coefficients = tuple(coefficients)
        self.settings = settings or SweepSettings()
        self.airspeeds = tuple(float(np.nanmean(m.measured("V"))) for m in self.manoeuvres)
        self.columns = tuple(offset_column(name) for name in self.coefficients)
        self.intervals = tuple(float(np.median(np.diff(m.flight.time))) for m in self.manoeuvres)

    def estimate(self, start: SweptModel, *, search: bool = True, sweeps: int | None = None) -> Sweep:
        """The estimate of a structure: sweeps until no number moves.

        Parameters
        ----------
        start : SweptModel
            Structure and start values.
        search : bool
            Whether spreads and memory of d are sought too.
        sweeps : int, optional
            In place of the settings' number.

        Raises
        ------
        EstimationError
            Where the model with d(t) cannot be flown, or a structure has more numbers than the flights hold.
        """
        settings = self.settings
        swept, traced = self._begun(start)
        converged = False
        limit = settings.sweeps if sweeps is None else sweeps
        for turn in range(limit):
            if search and turn in settings.searches and (turn == 0 or sweeps is None):
                swept = replace(swept, statistics=self._likeliest(swept, traced))
            rows = self._whitened(swept, traced)
            step, deviation = _plain_step(rows)
            size = self._size(step, deviation, swept)
            moved, _ = self._moved(swept, traced, step)
            traced, swept = self._settled(swept, moved, float(rows.target @ rows.target), traced)
            if size < settings.tolerance and turn > 0:
                converged = True
                break
        rows = self._whitened(swept, traced)
        fit = self._regressed(rows)
        if settings.coloured and any(taps.size > 1 for taps in fit.filters):
            # The colour of the noise gives its own weights: one more step, by those.
            moved, _ = self._moved(swept, traced, fit.coefficients)
            traced, swept = self._settled(swept, moved, float(rows.target @ rows.target), traced)
            rows = self._whitened(swept, traced)
            fit = self._regressed(rows)
        _, spread = self._moved(swept, traced, fit.coefficients)
        return Sweep(swept, rows, fit, fit.cost + rows.log_sum, spread, converged)

    def carried(self, flown: SweptModel, other: SweptModel) -> SweptModel:
        """Another structure with the d(t) that keeps the motion of the one that is flown.

        What the other one adds to the coefficients along that motion is taken out of d, what it lacks is put into it;
        the sweeps then begin where the measurements are. Unchanged where the motion cannot be flown.
        """
        forces = []
        for n, force in enumerate(flown.forces):
            acting = (*flown.effects, *_given_forces(self.columns, force, self.manoeuvres[n].name))
            before, flight = self._acting(flown, n, acting)
            _, states = simulate_outputs(flown.states[n], flight, before.values.copy(), before.table, before.constants)
            if not np.isfinite(states).all():
                return other
            given = coefficients_along(states, flight, before.values.copy(), before.table, before.constants)
            places = [loads_of(before.axes).index(name) for name in self.coefficients]
            after, plain = self._acting(other, n, other.effects)
            taken = coefficients_along(states, plain, after.values.copy(), after.table, after.constants)
            forces.append((given - taken)[:, places])
        return replace(other, forces=tuple(forces), states=flown.states)

    def _acting(self, swept: SweptModel, n: int, effects: Sequence[ActiveEffect]) -> tuple[AerodynamicModel, Flight]:
        """The model with columns for all that acts, and a flight with it acting."""
        model = self._flying(swept.model, effects)
        return model, acting_flight(model, self.manoeuvres[n], effects)[0]

    def _flying(self, model: AerodynamicModel, effects: Sequence[ActiveEffect]) -> AerodynamicModel:
        """The model with columns for what acts, for d(t) and for the velocity of the air."""
        return with_gust(with_offsets(with_columns_of(model, effects), self.coefficients))

    def _begun(self, start: SweptModel) -> tuple[SweptModel, list[_Flown]]:
        """The start as it flies: with the d(t) given, else with that of the forward estimate, else with none."""
        try:
            return start, self._traced(start)
        except OutOfRangeError:
            pass
        model = self._flying(start.model, start.effects)
        acting = [
            replace(m, flight=acting_flight(model, m, start.effects)[0], columns=model.columns) for m in self.manoeuvres
        ]
        swept = replace(start, forces=forward_forces(model, acting, self.coefficients))
        try:
            return swept, self._traced(swept)
        except OutOfRangeError:
            still = replace(start, forces=tuple(np.zeros_like(force) for force in start.forces))
            return still, self._traced_or_said(still)

    def asked(self, sweep: Sweep, entries: Sequence[Entry], effects: Sequence[ActiveEffect]) -> Rows:
        """The rows of an estimate with the columns of candidates: terms, then effects at their present numbers."""
        return self._whitened(sweep.swept, self._traced_or_said(sweep.swept, entries, effects), entries)

    def _size(self, step: Array, deviation: Array, swept: SweptModel) -> float:
        """Largest step of an estimate in its own deviations; initial states do not count."""
        count = len(swept.free) + swept.slopes
        known = np.isfinite(deviation[:count]) & (deviation[:count] > 0.0)
        return float(np.max(np.abs(step[:count][known]) / deviation[:count][known], initial=0.0))

    def _settled(
        self, swept: SweptModel, moved: SweptModel, before: float, traced: list[_Flown]
    ) -> tuple[list[_Flown], SweptModel]:
        """The flown motion after a step, which is halved while it raises the weighted squares or cannot be flown."""
        share = 1.0
        for _ in range(self.settings.halvings + 1):
            aim = _between(swept, moved, share)
            try:
                ahead = self._traced(aim)
            except OutOfRangeError:
                share *= 0.5
                continue
            reached = self._whitened(aim, ahead).target
            if float(reached @ reached) <= before * (1.0 + 1e-3) + 1.0:
                return ahead, aim
            share *= 0.5
        return traced, swept

    def _traced_or_said(
        self, swept: SweptModel, entries: Sequence[Entry] = (), effects: Sequence[ActiveEffect] = ()
    ) -> list[_Flown]:
        try:
            return self._traced(swept, entries, effects)
        except OutOfRangeError as error:
            names = ", ".join(manoeuvre.name for manoeuvre in self.manoeuvres)
            raise EstimationError(
                f"{names}: the model with its model error d(t) leaves |alpha| < 1.5 rad; check the signs of delta_e, "
                "C_m_alpha and C_m_delta_e, the mass and the units of alpha and q, or use --method likelihood."
            ) from error

    def _traced(
        self, swept: SweptModel, entries: Sequence[Entry] = (), effects: Sequence[ActiveEffect] = ()
    ) -> list[_Flown]:
        """Each flight with d(t) acting, and the response to every number: known, d's own, then asked.

        Raises
        ------
        OutOfRangeError
            Where the flown model leaves its range.
        """
        model = self._flying(swept.model.extended(entries), (*swept.effects, *effects))
        offsets = tuple(model.extra_place(name) for name in (*self.columns, GUST_COLUMN))
        likelihood = Likelihood(model, self.manoeuvres, (*swept.free, *entries))
        found = []
        for n, (manoeuvre, force) in enumerate(zip(self.manoeuvres, swept.forces, strict=True)):
            acting = (*swept.effects, *_given_forces(self.columns, force, manoeuvre.name))
            part = next(iter(likelihood.traced(n, model.values, swept.states[n], acting, effects, whole=True)))
            found.append(_Flown(part, offsets))
        return found

    def _noise(self, n: int, flown: _Flown, statistics: ErrorStatistics) -> tuple[InputNoise, Trace]:
        """The inputs' noise with that of the coefficients, and the linearisation, of what has noise alone."""
        variance, memory = flown.part.noise.variance.copy(), flown.part.noise.memory.copy()
        offsets, air = list(flown.offsets[:-1]), flown.offsets[-1]
        variance[offsets] = np.square(statistics.spread)
        memory[offsets] = np.exp(-self.intervals[n] / statistics.memory)
        if statistics.gust is not None:
            variance[air] = statistics.gust[0] ** 2
            memory[air] = np.exp(-self.airspeeds[n] * self.intervals[n] / statistics.gust[1])
        return noisy_inputs_alone(InputNoise(variance, memory), flown.part.trace)

    def _columns(self, swept: SweptModel, traced: Sequence[_Flown], asked: int = 0) -> list[tuple[Array, Array, Array]]:
        """Of each flight (N, 8, .): the residual as if no d had acted, known columns in joint places, asked columns."""
        logs, free, slopes = len(traced), len(swept.free), swept.slopes
        forces = len(self.columns)
        found = []
        for n, flown in enumerate(traced):
            block, held = flown.part.block, flown.part.held
            first = 1 + free + asked + STATE_COUNT
            acted = first + slopes
            target = block[:, :, 0] + block[:, :, acted : acted + forces].sum(axis=2)
            known = np.zeros((*target.shape, free + slopes + STATE_COUNT * logs))
            known[:, :, :free] = block[:, :, 1 : 1 + free]
            known[:, :, free : free + slopes] = block[:, :, first:acted]
            place = free + slopes + STATE_COUNT * n
            known[:, :, place : place + STATE_COUNT] = block[:, :, first - STATE_COUNT : first]
            others = np.concatenate([block[:, :, 1 + free : 1 + free + asked], block[:, :, acted + forces :]], axis=2)
            found.append((np.where(held, target, 0.0), known, others))
        return found

    def _whitened(
        self,
        swept: SweptModel,
        traced: Sequence[_Flown],
        entries: Sequence[Entry] = (),
    ) -> Rows:
        """The innovations and every column through the same filter."""
        targets, knowns, others, lengths, channels = [], [], [], [], []
        log_sum = 0.0
        parts = self._columns(swept, traced, len(entries))
        for n, (flown, columns) in enumerate(zip(traced, parts, strict=True)):
            target, known, asked = columns
            width = known.shape[2]
            block = np.ascontiguousarray(np.concatenate([target[:, :, None], known, asked], axis=2))
            log_sum += self._whiten(n, flown, block, swept.statistics)
            for i in np.flatnonzero(flown.part.held.any(axis=0)):
                held = flown.part.held[:, i]
                lengths.append(int(held.sum()))
                channels.append((n, int(i)))
                targets.append(block[held, i, 0])
                knowns.append(block[held, i, 1 : 1 + width])
                others.append(block[held, i, 1 + width :])
        return Rows(
            np.concatenate(targets), np.concatenate(knowns), np.concatenate(others), tuple(lengths), log_sum,
            tuple(channels),
        )  # fmt: skip

    def _whiten(self, n: int, flown: _Flown, block: Array, statistics: ErrorStatistics) -> float:
        """Whiten columns (N, 8, C) of a flight in place; the sum of the logarithms of the innovations' variances."""
        noise, trace = self._noise(n, flown, statistics)
        part = flown.part
        carry = make_whitening_carry(noise, block.shape[2], trace, part.sensors)
        return float(whiten_stretch(part.held, block, trace, statistics.variance, noise, part.sensors, carry))

    def _regressed(self, rows: Rows) -> Coloured:
        colour = self.settings.colour if self.settings.coloured else replace(self.settings.colour, highest_order=0)
        return coloured_regression(rows.target, rows.known, rows.lengths, colour)

    def _moved(self, swept: SweptModel, traced: Sequence[_Flown], step: Array) -> tuple[SweptModel, tuple[Array, ...]]:
        """The structure after a step in its numbers, with the d(t) that then fits best, and its deviation."""
        free, slopes = len(swept.free), swept.slopes
        values = swept.model.values.copy()
        values[swept.model.indices(swept.free)] += step[:free]
        effects, place = [], free
        for active in swept.effects:
            effects.append(active.moved(step[place : place + active.slopes]))
            place += active.slopes
        states, forces, deviations = [], [], []
        for n, (flown, columns) in enumerate(zip(traced, self._columns(swept, traced), strict=True)):
            place = free + slopes + STATE_COUNT * n
            states.append(swept.states[n] + step[place : place + STATE_COUNT])
            target, known, _ = columns
            residual = np.ascontiguousarray((target - known @ step)[:, :, None])
            error, deviation = self._smoothed(n, flown, residual, swept.statistics)
            forces.append(error[:, : len(self.coefficients)] if self.settings.smoothed else swept.forces[n])
            deviations.append(deviation)
        model = swept.model.with_values(values)
        return replace(swept, model=model, effects=tuple(effects), states=tuple(states), forces=tuple(forces)), tuple(
            deviations
        )

    def _smoothed(self, n: int, flown: _Flown, residual: Array, statistics: ErrorStatistics) -> tuple[Array, Array]:
        """d(t) (N, coefficients) of a residual (N, 8, 1), and its deviation."""
        noise, trace = self._noise(n, flown, statistics)
        part, samples, inputs = flown.part, residual.shape[0], noise.variance.size
        errors, variances = np.zeros((samples, inputs, 1)), np.zeros((samples, inputs))
        start = initial_covariance(np.zeros((STATE_COUNT, STATE_COUNT)), noise, trace, part.sensors)
        held = np.ascontiguousarray(part.held)
        smooth_inputs(held, residual, trace, statistics.variance, noise, part.sensors, start, errors, variances)
        # What has no noise has no error: the air's velocity where it is taken as still.
        moving = flown.offsets if statistics.gust is not None else flown.offsets[:-1]
        noisy = np.flatnonzero((part.noise.variance > 0.0) | np.isin(np.arange(part.noise.variance.size), moving))
        places = [int(np.flatnonzero(noisy == place)[0]) for place in moving]
        found, deviation = np.zeros((samples, len(flown.offsets))), np.zeros((samples, len(flown.offsets)))
        found[:, : len(places)], deviation[:, : len(places)] = errors[:, places, 0], np.sqrt(variances[:, places])
        return found, deviation

    def _likeliest(self, swept: SweptModel, traced: Sequence[_Flown]) -> ErrorStatistics:
        """Spreads, memory and the sensors' noise at the maximum of the restricted likelihood, the motion held."""
        settings, statistics = self.settings, swept.statistics
        columns = [
            np.ascontiguousarray(np.concatenate([target[:, :, None], known], axis=2))
            for target, known, _ in self._columns(swept, traced)
        ]

        count = len(statistics.spread)

        def at(numbers: Sequence[float]) -> ErrorStatistics:
            air = (float(numbers[count + 1]), float(numbers[count + 2])) if statistics.gust is not None else None
            return replace(statistics, spread=tuple(numbers[:count]), memory=float(numbers[count]), gust=air)

        def cost(numbers: Sequence[float]) -> float:
            total, normal = 0.0, 0.0
            for n, (flown, block) in enumerate(zip(traced, columns, strict=True)):
                white = block.copy()
                total += self._whiten(n, flown, white, at(numbers))
                flat = white.reshape(-1, white.shape[2])
                normal = normal + flat.T @ flat
            return total + _restricted(np.asarray(normal))

        start = (*statistics.spread, statistics.memory, *(statistics.gust or ()))
        limits = [(settings.least_spread, settings.most_spread)] * count
        limits.append((settings.shortest_memory, settings.longest_memory))
        if statistics.gust is not None:
            limits += [(parameter.lowest, parameter.highest) for parameter in gust().parameters]
        return at(search_in_logarithms(cost, start, limits, least_fall=0.1, turns=settings.turns))


def _plain_step(rows: Rows) -> tuple[Array, Array]:
    """Least squares of whitened rows, and deviations; an undetermined number stays, with an infinite one."""
    scale = np.linalg.norm(rows.known, axis=0)
    held = np.flatnonzero(scale > 0.0)
    step, deviation = np.zeros(scale.size), np.full(scale.size, np.inf)
    columns = rows.known[:, held] / scale[held]
    strength, vectors = np.linalg.eigh(columns.T @ columns)
    clear = strength > 1e-12 * strength[-1]
    root = vectors[:, clear] / np.sqrt(strength[clear])
    step[held] = root @ (root.T @ (columns.T @ rows.target)) / scale[held]
    deviation[held] = np.sqrt(np.sum(root**2, axis=1)) / scale[held]
    return step, deviation


def _restricted(normal: Array) -> float:
    """Residual squares and ln |information| from the products (1 + m, 1 + m) of target and known columns."""
    scale = np.sqrt(np.diag(normal)[1:])
    held = np.flatnonzero(scale > 0.0)
    if not held.size:
        return float(normal[0, 0])
    inner = normal[1:, 1:][np.ix_(held, held)] / np.outer(scale[held], scale[held])
    strength, vectors = np.linalg.eigh(inner)
    clear = strength > 1e-12 * strength[-1]
    product = vectors[:, clear].T @ (normal[1:, 0][held] / scale[held])
    squares = float(normal[0, 0] - np.sum(product**2 / strength[clear]))
    return squares + float(np.sum(np.log(strength[clear]))) + 2.0 * float(np.sum(np.log(scale[held])))


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


def _given_forces(columns: Sequence[str], force: Array, log: str) -> tuple[ActiveEffect, ...]:
    """d(t) of a flight as it acts: one input a column, whose share of one is its response."""
    return tuple(
        ActiveEffect(_given_force(name, np.ascontiguousarray(force[:, i])), (1.0,), log)
        for i, name in enumerate(columns)
    )


def _given_force(column: str, history: Array) -> InputEffect:
    return InputEffect(
        "model_error",
        column,
        (EffectParameter("share", "1", trials=(1.0,), lowest=-1e3, highest=1e3, step=0.5),),
        lambda _time, values, p: np.asarray(values + p[0] * history),
        lambda _p, _interval: (1.0, 0.0),
        "d(t) of Parameswaran & Raol 1994, eq. (16)",
        column=column,
    )


def is_seen(active: ActiveEffect) -> bool:
    """Whether an effect is a column in d(t) to first order: of a sensor or on an input."""
    return isinstance(active.effect, InputEffect | OutputEffect)
