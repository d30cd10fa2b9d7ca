"""Input design by expected information.

Every input is judged before it is flown, with the models that the flights were fitted by: how far the predictions of
alternatives come apart although each may still move its parameters, and how small the deviations of derivatives become.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.errors import EstimationError
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.estimation.open_loop import simulate
from aerosid.estimation.preparation_settings import PREPARATION
from aerosid.flight_model.input_shapes import InputShape, Steps, neighbours, patterns
from aerosid.loop.next_flight.expected_information import (
    Prospect,
    expected_deviations,
    expected_difference,
    needed_difference,
    prospect,
    shared_information,
)
from aerosid.loop.next_flight.flight_limits import FlightLimits, flight_limits, shown
from aerosid.loop.next_flight.predicted_flight import (
    SteadyFlight,
    at_steady,
    planned_manoeuvre,
    sampling_ratio,
    steady_flight,
)
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, named
from aerosid.search.settings import AttributionSettings


@dataclass(frozen=True)
class DesignSettings:
    """Settings of the search, each with the reason for its value.

    Attributes
    ----------
    base_times : tuple of float
        s, of the patterns: a factor of 1.5 apart, from what a pilot can fly to half a slow short period.
    lead, tail : float
        s of steady flight before the input, and of free response after it.
    shortest, longest : float
        s of the whole flight; between them it is as long as the record.
    samples : int
        Most samples while searching; the noise is scaled to their interval.
    substep : float
        s, longest of the integrator while searching: a short period of 5 rad/s to 1e-5.
    resolution : float
        rad; amplitudes are whole multiples, as a pilot can set them.
    bisections : int
        Simulations with which the greatest amplitude of a shape is found.
    refined : int
        Inputs of the grid from which the free switching times and levels are searched.
    rounds : int
        Rounds of that search; each tries every duration and level both ways.
    worth : float
        Share by which a multistep must be better than the named pattern it came from.
    rivals : int
        Alternatives considered, the closest first.
    repeats : int
        Flights beyond which one input does not decide a question.
    certain : float
        Probability, 1, from which a question counts as decided. Chosen.
    """

    base_times: tuple[float, ...] = (0.3, 0.5, 0.8, 1.2, 1.8, 2.6)
    lead: float = 1.0
    tail: float = 3.0
    shortest: float = 15.0
    longest: float = 30.0
    samples: int = 300
    substep: float = 0.05
    resolution: float = float(np.radians(0.1))
    bisections: int = 6
    refined: int = 2
    rounds: int = 4
    worth: float = 0.05
    rivals: int = 4
    repeats: int = 20
    certain: float = 0.95


@dataclass(frozen=True)
class Rival:
    """A model that fits the records about as well as the chosen one.

    `estimate` it, fitted; `known` (K, K) what the records tell of its parameters; `present` the difference of -2 ln L
    that stands against it, counted for coloured residuals as all expected ones are; `label` its name, `instead_of` the
    chosen effect that it would replace; `kinds` and `places` of both.
    """

    estimate: Refinement
    known: NDArray[np.float64]
    present: float
    label: str
    instead_of: str
    kinds: frozenset[str]
    places: frozenset[str]


@dataclass(frozen=True)
class Unknown:
    """A derivative that is not shown: its `place` among the free entries, deviations `present` and `needed`, and by
    how much coloured residuals widen it.
    """

    label: str
    place: int
    present: float
    needed: float
    colour: float


@dataclass(frozen=True)
class Trial:
    """An input with what it would tell: `shares` (Q,) of each question, information over the information needed."""

    shape: InputShape
    amplitude: float
    shares: NDArray[np.float64]

    @property
    def worth(self) -> float:
        """Sum over the questions of x/(1 + x): what is decided already counts little more, what is hopeless nothing."""
        return float(np.sum(self.shares / (1.0 + self.shares)))

    @property
    def decides_less_than_all(self) -> bool:
        """Whether one flight leaves a question open."""
        return bool(np.any(self.shares < 1.0))


class InputSearch:
    """The search for one input on the condition of the first record.

    Parameters
    ----------
    found : Attribution
        The chosen model with its alternatives.
    manoeuvres : sequence of Manoeuvre
        The records it was fitted to.
    rivals, unknowns : sequence
        The questions.
    given : mapping
        Limits that were given.

    Raises
    ------
    EstimationError
        Where the model has no elevator or no steady flight.
    """

    def __init__(
        self,
        found: Attribution,
        manoeuvres: Sequence[Manoeuvre],
        rivals: Sequence[Rival],
        unknowns: Sequence[Unknown],
        given: Mapping[str, tuple[float, float]],
        settings: DesignSettings,
    ) -> None:
        self.settings = settings
        self.chosen = found.completed
        self.record = manoeuvres[0]
        self.rivals, self.unknowns = tuple(rivals), tuple(unknowns)
        self.colour = largest_colour(found)
        self.known = shared_information(self.chosen)
        self.steady: SteadyFlight = steady_flight(self.chosen, self.record)
        # A model in which the airspeed reads with an offset flies at another one: each begins in its own steady flight.
        self.starts = {id(rival.estimate): self._start(rival.estimate) for rival in self.rivals}
        span = float(np.ptp(self.record.flight.time))
        self.span = float(np.clip(span, settings.shortest, settings.longest))
        interval = float(np.median(np.diff(self.record.flight.time)))
        self.time = self._grid(max(interval, self.span / settings.samples))
        self.fine = self._grid(max(interval, 0.01))
        none = np.zeros(2)
        outputs = self.simulated(self.chosen, planned_manoeuvre(self.record, self.steady, self.time[:2], none))
        self.still = {name: float(values[0]) for name, values in shown(outputs, none + self.steady.delta_e).items()}
        self.limits = self._limits(manoeuvres, given)
        self.tried = 0

    def _grid(self, interval: float) -> NDArray[np.float64]:
        return np.arange(round(self.span / interval) + 1, dtype=np.float64) * interval

    def _start(self, rival: Refinement) -> NDArray[np.float64]:
        try:
            return steady_flight(rival, self.record).state
        except EstimationError:
            return self.steady.state

    def _limits(self, manoeuvres: Sequence[Manoeuvre], given: Mapping[str, tuple[float, float]]) -> FlightLimits:
        flown = []
        for place, manoeuvre in enumerate(manoeuvres):
            state = self.chosen.states[place]
            outputs, _ = simulate(self.chosen.model, manoeuvre, state, self.chosen.effects)
            flown.append((outputs, manoeuvre.flight.inputs[:, self.steady.elevator]))
        return flight_limits(flown, self.still, given)

    def simulated(self, estimate: Refinement, planned: Manoeuvre) -> NDArray[np.float64]:
        """What the sensors would show (N, 8) if `estimate` were true; NaN from where it leaves its range."""
        return simulate(estimate.model, planned, self.start_of(estimate), estimate.effects)[0]

    def start_of(self, estimate: Refinement) -> NDArray[np.float64]:
        """The initial state (5,) of a model in question."""
        return self.starts.get(id(estimate), self.steady.state)

    def planned(self, shape: InputShape, amplitude: float, time: NDArray[np.float64]) -> Manoeuvre:
        """The flight with an input; its sensors show nothing yet."""
        deflection = shape.deflection(time, self.settings.lead, amplitude, self.limits.rate)
        substep = self.settings.substep if time is self.time else PREPARATION.longest_substep
        return planned_manoeuvre(self.record, self.steady, time, deflection, longest_substep=substep)

    def room(self, planned: Manoeuvre, estimates: Sequence[Refinement]) -> float:
        """How far the flight stays from the limits, whichever of `estimates` is true."""
        delta_e = planned.flight.inputs[:, self.steady.elevator]
        return min(self.limits.room(self.simulated(one, planned), delta_e, self.still) for one in estimates)

    def largest(self, shape: InputShape) -> float:
        """The greatest amplitude [rad] of a shape that stays within the limits; 0 where none does."""
        low, high = self.limits.ranges["delta_e"]
        amplitude = self.rounded(max(high - self.steady.delta_e, self.steady.delta_e - low))
        inside, outside = 0.0, np.inf
        for _ in range(self.settings.bisections):
            room = self.room(self.planned(shape, amplitude, self.time), (self.chosen,))
            if room >= 0.0:
                inside = amplitude
            else:
                outside = amplitude
            # The response is nearly linear: what it uses of the room grows with the amplitude. Speed is not.
            guess = 0.5 * outside if not np.isfinite(room) else 0.97 * amplitude / (1.0 - room)
            amplitude = self.rounded(guess if inside == 0.0 else 0.5 * (inside + outside))
            if outside < 1.08 * inside or not inside < amplitude < outside:
                break
        # Models that fit the same record answer nearly alike: they are asked last.
        others = [rival.estimate for rival in self.rivals]
        while inside > 0.0 and others and self.room(self.planned(shape, inside, self.time), others) < 0.0:
            inside = self.rounded(0.9 * inside)
        return inside

    def rounded(self, amplitude: float) -> float:
        """The amplitude as a whole multiple of what a pilot can set, not above."""
        resolution = self.settings.resolution
        return float(np.floor(amplitude / resolution + 1e-6)) * resolution

    def prospects(self, planned: Manoeuvre, chosen: NDArray[np.float64]) -> list[Prospect]:
        """A flight on which the chosen model is true, `chosen` (N, 8) being what is shown, as each rival sees it."""
        flight = planned.flight
        true = replace(planned, flight=flight._replace(measured=np.where(np.isnan(flight.measured), np.nan, chosen)))
        return [prospect(self.seen(rival.estimate, planned), true) for rival in self.rivals]

    def seen(self, estimate: Refinement, planned: Manoeuvre) -> Refinement:
        """An estimate at the beginning of a planned flight, with the chosen one's noise."""
        level = replace(estimate, variance=self.chosen.variance)
        return at_steady(level, self.start_of(estimate), sampling_ratio(self.record, planned.flight.time))

    def trial(self, shape: InputShape, amplitude: float) -> Trial | None:
        """What an input would tell; None where a model leaves its range on it, or its information overflows."""
        self.tried += 1
        planned = self.planned(shape, amplitude, self.time)
        shares: list[float] = []
        try:
            if self.rivals:
                ahead = self.prospects(planned, self.simulated(self.chosen, planned))
                for rival, one in zip(self.rivals, ahead, strict=True):
                    difference = expected_difference(rival.known, one) / self.colour
                    shares.append(difference / needed_difference(rival.present, REACH, self.settings.certain))
            if self.unknowns:
                spread = expected_deviations(self.known, prospect(self.seen(self.chosen, planned), planned))
                shares += [(one.needed / (one.colour * float(spread[one.place]))) ** 2 for one in self.unknowns]
        except (OutOfRangeError, np.linalg.LinAlgError):
            return None
        return Trial(shape, amplitude, np.array(shares))

    def best(self) -> tuple[Trial | None, NDArray[np.float64]]:
        """The input that tells most, and what the best input for each question alone would tell of it (Q,)."""
        longest = self.span - self.settings.lead - self.settings.tail
        shapes = patterns(self.settings.base_times, longest)
        pairs = [(shape, self.largest(shape)) for shape in shapes]
        trials = [self.trial(shape, amplitude) for shape, amplitude in pairs if amplitude > 0.0]
        grid = sorted((one for one in trials if one is not None), key=lambda one: -one.worth)
        if not grid:
            return None, np.zeros(len(self.rivals) + len(self.unknowns))
        alone = np.max([one.shares for one in grid], axis=0)
        by_hand = [one for one in grid if isinstance(one.shape, Steps)]
        best = by_hand[0] if by_hand else grid[0]
        for start in by_hand[: self.settings.refined]:
            reached = self.refined(start, longest)
            alone = np.maximum(alone, reached.shares)
            if reached.worth > (1.0 + self.settings.worth) * best.worth:
                best = reached
        # What a pilot can fly comes first, as long as it decides everything.
        if best.decides_less_than_all and grid[0].worth > (1.0 + self.settings.worth) * best.worth:
            best = grid[0]
        return best, alone

    def refined(self, start: Trial, longest: float) -> Trial:
        """The best input near `start`: every duration and level moved in turn, by smaller and smaller steps."""
        best, stretch, change = start, 1.4, 0.3
        for _ in range(self.settings.rounds):
            moved = []
            for shape in neighbours(best.shape, stretch, change, longest):
                amplitude = self.largest(shape)
                if amplitude > 0.0:
                    moved.append(self.trial(shape, amplitude))
            better = max((one for one in moved if one is not None), key=lambda one: one.worth, default=best)
            if better.worth > best.worth:
                best = better
            else:
                stretch, change = stretch**0.5, 0.5 * change
        return best


REACH = AttributionSettings().reach
"""Difference of -2 ln L below which the loop lists a model as an alternative."""


def largest_colour(found: Attribution) -> float:
    """By how much coloured residuals widen the variance of what was found: expected differences shrink by as much."""
    completed, spread = found.completed, found.completed_deviations
    ratios = [1.0]
    for n, entry in enumerate(completed.free):
        if entry not in found.before.free and np.isfinite(spread.corrected[n]):
            ratios.append(float(spread.corrected[n] / spread.white[n]) ** 2)
    finite = np.isfinite(spread.effects) & (spread.effects_white > 0.0)
    ratios += ((spread.effects[finite] / spread.effects_white[finite]) ** 2).tolist()
    return max(ratios)


def rivals_of(found: Attribution, most: int) -> tuple[Rival, ...]:
    """The alternatives as models, the closest first; several effects of one fit are one rival."""
    fits: dict[int, tuple[Refinement, list[Finding]]] = {}
    for other in sorted(found.alternatives, key=lambda one: -one.gain):
        if other.fit is not None and other.fit.held_to_data == 0.0:
            fits.setdefault(id(other.fit), (other.fit, []))[1].append(other)
    colour = largest_colour(found)
    chosen = {named((one.kind, one.where, one.term)): one for one in found.findings}
    rivals = []
    for fit, parts in list(fits.values())[:most]:
        instead_of = parts[0].instead_of
        both = [*parts, *([chosen[instead_of]] if instead_of in chosen else [])]
        rivals.append(
            Rival(
                estimate=fit,
                known=shared_information(fit),
                present=-parts[0].gain / colour,
                label=" and ".join(dict.fromkeys(named((part.kind, part.where, part.term)) for part in parts)),
                instead_of=instead_of,
                kinds=frozenset(part.kind for part in both),
                places=frozenset(part.where for part in both),
            )
        )
    return tuple(rivals)
