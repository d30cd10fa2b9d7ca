"""Input design by expected information.

Every input is judged before it is flown, with the models that the flights were fitted by: how far the predictions of
alternatives come apart although each may still move its parameters, and how small the deviations of derivatives become.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.cores import mapped
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
from aerosid.loop.next_flight.open_questions import REACH, CompetingModel, Unknown, largest_colour
from aerosid.loop.next_flight.predicted_flight import (
    SteadyFlight,
    at_steady,
    planned_manoeuvre,
    sampling_ratio,
    steady_flight,
)
from aerosid.search.attribution import Attribution


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
    resolved : float
        Amplitude that leaves the limits over one that keeps them, 1, below which the search of the greatest ends.
    refined : int
        Inputs of the grid from which the free switching times and levels are searched.
    rounds : int
        Rounds of that search; each tries every duration and level both ways.
    worth : float
        Share by which a multistep must be better than the named pattern it came from.
    pause : float
        s of free response between the inputs of two surfaces.
    joined : int
        Inputs of each surface alone, the best, that are tried one after the other with those of the others.
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
    resolved: float = 1.08
    refined: int = 2
    rounds: int = 4
    worth: float = 0.05
    pause: float = 2.0
    joined: int = 3
    rivals: int = 4
    repeats: int = 20
    certain: float = 0.95


@dataclass(frozen=True)
class Move:
    """One surface's part of an input; `amplitude` rad of level 1."""

    surface: str
    shape: InputShape
    amplitude: float


@dataclass(frozen=True)
class Trial:
    """An input, its parts one after the other, with what it would tell: `shares` (Q,) of each question, information
    over the information needed.
    """

    moves: tuple[Move, ...]
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
        Where the model lacks a surface or has no steady flight.
    """

    def __init__(
        self,
        found: Attribution,
        manoeuvres: Sequence[Manoeuvre],
        rivals: Sequence[CompetingModel],
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
        interval = self.record.interval
        self.time = self._grid(max(interval, self.span / settings.samples))
        self.fine = self._grid(max(interval, 0.01))
        outputs = self.simulated(self.chosen, planned_manoeuvre(self.record, self.steady, self.time[:2], {}))
        level = {name: np.full(2, trim) for name, trim in self.steady.trim.items()}
        self.axes = self.chosen.model.axes
        self.still = {name: float(values[0]) for name, values in shown(outputs, level, self.axes).items()}
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
            flown.append((outputs, self.surfaces(manoeuvre)))
        return flight_limits(flown, self.still, given, self.axes)

    def surfaces(self, manoeuvre: Manoeuvre) -> dict[str, NDArray[np.float64]]:
        """Each surface of a flight, (N,) rad."""
        return {name: manoeuvre.flight.inputs[:, place] for name, place in self.steady.controls.items()}

    def simulated(self, estimate: Refinement, planned: Manoeuvre) -> NDArray[np.float64]:
        """Sensor outputs (N, m) if `estimate` were true; NaN from where it leaves its range."""
        return simulate(estimate.model, planned, self.start_of(estimate), estimate.effects)[0]

    def start_of(self, estimate: Refinement) -> NDArray[np.float64]:
        """The initial state (n,) of a model in question."""
        return self.starts.get(id(estimate), self.steady.state)

    def planned(self, moves: Sequence[Move], time: NDArray[np.float64]) -> Manoeuvre:
        """The flight with an input; its sensors show nothing yet."""
        deflections = {
            move.surface: move.shape.deflection(time, start, move.amplitude, self.limits.rates[move.surface])
            for move, start in self.begun(moves)
        }
        substep = self.settings.substep if time is self.time else PREPARATION.longest_substep
        return planned_manoeuvre(self.record, self.steady, time, deflections, longest_substep=substep)

    def begun(self, moves: Sequence[Move]) -> Iterator[tuple[Move, float]]:
        """Each part of an input with when it begins, s."""
        start = self.settings.lead
        for move in moves:
            yield move, start
            start += move.shape.duration + self.settings.pause

    def room(self, planned: Manoeuvre, estimates: Sequence[Refinement]) -> float:
        """How far the flight stays from the limits, whichever of `estimates` is true."""
        surfaces = self.surfaces(planned)
        return min(self.limits.room(self.simulated(one, planned), surfaces, self.still) for one in estimates)

    def largest(self, surface: str, shape: InputShape) -> float:
        """The greatest amplitude [rad] of a shape that stays within the limits; 0 where none does."""
        low, high = self.limits.ranges[surface]
        trim = self.steady.trim[surface]
        amplitude = self.rounded(max(high - trim, trim - low))
        inside, outside = 0.0, np.inf
        for _ in range(self.settings.bisections):
            room = self.room(self.planned((Move(surface, shape, amplitude),), self.time), (self.chosen,))
            if room >= 0.0:
                inside = amplitude
            else:
                outside = amplitude
            # The response is nearly linear: what it uses of the room grows with the amplitude. Speed is not.
            guess = 0.5 * outside if not np.isfinite(room) else 0.97 * amplitude / (1.0 - room)
            amplitude = self.rounded(guess if inside == 0.0 else 0.5 * (inside + outside))
            if outside < self.settings.resolved * inside or not inside < amplitude < outside:
                break
        # Models that fit the same record respond nearly alike: they are simulated last.
        others = [rival.estimate for rival in self.rivals]
        while inside > 0.0 and others:
            if self.room(self.planned((Move(surface, shape, inside),), self.time), others) >= 0.0:
                break
            inside = self.rounded(0.9 * inside)
        return inside

    def rounded(self, amplitude: float) -> float:
        """The amplitude as a whole multiple of what a pilot can set, not above."""
        resolution = self.settings.resolution
        return float(np.floor(amplitude / resolution + 1e-6)) * resolution

    def prospects(self, planned: Manoeuvre, chosen: NDArray[np.float64]) -> list[Prospect]:
        """A flight on which the chosen model is true, with outputs `chosen` (N, m), seen by each competing model."""
        flight = planned.flight
        true = replace(planned, flight=flight._replace(measured=np.where(np.isnan(flight.measured), np.nan, chosen)))
        return [prospect(self.seen(rival.estimate, planned), true) for rival in self.rivals]

    def seen(self, estimate: Refinement, planned: Manoeuvre) -> Refinement:
        """An estimate at the beginning of a planned flight, with the chosen one's noise."""
        level = replace(estimate, variance=self.chosen.variance)
        return at_steady(level, self.start_of(estimate), sampling_ratio(self.record, planned.flight.time))

    def trial(self, *moves: Move) -> Trial | None:
        """Information expected from an input; None where a model leaves its range, or the information overflows."""
        planned = self.planned(moves, self.time)
        shares: list[float] = []
        try:
            if self.rivals:
                ahead = self.prospects(planned, self.simulated(self.chosen, planned))
                for rival, one in zip(self.rivals, ahead, strict=True):
                    difference = expected_difference(rival.known, one) / self.colour
                    shares.append(difference / needed_difference(rival.present, REACH, self.settings.certain))
            if self.unknowns:
                expected = expected_deviations(self.known, prospect(self.seen(self.chosen, planned), planned))
                shares += [(one.needed / (one.colour * float(expected[one.place]))) ** 2 for one in self.unknowns]
        except (OutOfRangeError, np.linalg.LinAlgError):
            return None
        return Trial(moves, np.array(shares))

    def best(self) -> tuple[Trial | None, NDArray[np.float64]]:
        """The input with most expected information, and that of the best input for each question alone (Q,)."""
        surfaces = tuple(self.steady.controls)
        free = self.span - self.settings.lead - self.settings.tail - self.settings.pause * (len(surfaces) - 1)
        longest = free / len(surfaces)
        grids = [self.grid(surface, longest) for surface in surfaces]
        grid = sorted(itertools.chain(*grids), key=lambda one: -one.worth)
        if len(surfaces) > 1 and grid:
            return self.one_after_the_other(grids, grid)
        if not grid:
            return None, np.zeros(len(self.rivals) + len(self.unknowns))
        alone = np.max([one.shares for one in grid], axis=0)
        by_hand = [one for one in grid if isinstance(one.moves[0].shape, Steps)]
        best = by_hand[0] if by_hand else grid[0]
        for start in by_hand[: self.settings.refined]:
            reached = self.refined(start, longest)
            alone = np.maximum(alone, reached.shares)
            if reached.worth > (1.0 + self.settings.worth) * best.worth:
                best = reached
        # Inputs that a pilot can fly come first, as long as they answer everything.
        if best.decides_less_than_all and grid[0].worth > (1.0 + self.settings.worth) * best.worth:
            best = grid[0]
        return best, alone

    def grid(self, surface: str, longest: float) -> list[Trial]:
        """Every pattern of one surface at its greatest amplitude, the one that tells most first."""
        shapes = patterns(self.settings.base_times, longest)
        if len(self.steady.controls) > 1:
            # Of several surfaces every second pattern: both ways round a symmetric aircraft answers alike.
            shapes = tuple(shape for shape in shapes if not isinstance(shape, Steps) or shape.levels[0] > 0.0)
        return sorted(self.strongest(surface, shapes), key=lambda one: -one.worth)

    def strongest(self, surface: str, shapes: Sequence[InputShape]) -> list[Trial]:
        """Each shape of a surface at its greatest amplitude, in order, those without any left out."""

        def tried(shape: InputShape) -> list[Trial | None]:
            amplitude = self.largest(surface, shape)
            return [self.trial(Move(surface, shape, amplitude))] if amplitude > 0.0 else []

        trials = list(itertools.chain(*mapped(tried, shapes)))
        self.tried += len(trials)
        return [one for one in trials if one is not None]

    def one_after_the_other(
        self, grids: Sequence[Sequence[Trial]], alone: Sequence[Trial]
    ) -> tuple[Trial, NDArray[np.float64]]:
        """The best of inputs of several surfaces in turn, or of one alone where the others add little; as `best`."""
        shares = np.max([one.shares for one in alone], axis=0)
        heads = [
            [one for one in grid if isinstance(one.moves[0].shape, Steps)][: self.settings.joined] for grid in grids
        ]
        best = next((one for one in alone if isinstance(one.moves[0].shape, Steps)), alone[0])
        for parts in itertools.product(*(head for head in heads if head)):
            moves = self.within(tuple(move for part in parts for move in part.moves))
            joined = self.trial(*moves) if len(moves) > 1 else None
            self.tried += len(moves) > 1
            if joined is None:
                continue
            shares = np.maximum(shares, joined.shares)
            if joined.worth > (1.0 + (self.settings.worth if len(best.moves) == 1 else 0.0)) * best.worth:
                best = joined
        return best, shares

    def within(self, moves: tuple[Move, ...]) -> tuple[Move, ...]:
        """The moves, all of them smaller by as much as they need to stay within the limits together; else none."""
        estimates = [self.chosen, *(rival.estimate for rival in self.rivals)]
        while min(move.amplitude for move in moves) > 0.0:
            if self.room(self.planned(moves, self.time), estimates) >= 0.0:
                return moves
            moves = tuple(replace(move, amplitude=self.rounded(0.85 * move.amplitude)) for move in moves)
        return ()

    def refined(self, start: Trial, longest: float) -> Trial:
        """The best input near `start`: every duration and level moved in turn, by smaller and smaller steps."""
        best, stretch, change = start, 1.4, 0.3
        surface = start.moves[0].surface
        for _ in range(self.settings.rounds):
            moved = self.strongest(surface, tuple(neighbours(best.moves[0].shape, stretch, change, longest)))
            better = max(moved, key=lambda one: one.worth, default=best)
            if better.worth > best.worth:
                best = better
            else:
                stretch, change = stretch**0.5, 0.5 * change
        return best
