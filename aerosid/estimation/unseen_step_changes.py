"""Step changes on a flight that was not fitted: events of the configuration, each at an instant of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, frozen
from aerosid.effects.step_input import at_instant, instant_of, step_changes_on
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.linearised_instants import predicted_misfits
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement

Event = tuple[ActiveEffect, ...]

SIMULTANEOUS = 1.0
"""Numerical: s between the instants of two step changes up to which they are one event."""

GRID = 19
"""Numerical: instants over a whole flight at which an event is tried first."""

FOLLOWED = 3
"""Numerical: instants of the grid whose misfit is simulated, the least by the linearised prediction. The least of all
came first in that order for each of 11 events of the practice flights."""

REACHES = (1.0 / 20.0, 1.0 / 200.0)
"""Numerical: reach of the refinements of an instant, as fractions of the log."""

STEPS = 9
"""Numerical: instants over twice that reach. The misfit is taken to have one minimum there, and is simulated downhill
from the middle alone."""


def events_of(step_changes: Sequence[ActiveEffect]) -> list[Event]:
    """Step changes by event: those of one log that follow one another closely, as of all coefficients by a flap.

    Log by log in order of their instants, and so within each event.
    """
    events: list[list[ActiveEffect]] = []
    for active in sorted(step_changes, key=lambda each: (each.log, instant_of(each))):
        last = events[-1][-1] if events else None
        if last and last.log == active.log and instant_of(active) - instant_of(last) <= SIMULTANEOUS:
            events[-1].append(active)
        else:
            events.append([active])
    return [tuple(event) for event in events]


def matched_step_changes(
    step_changes: Sequence[ActiveEffect], seen: Sequence[ActiveEffect], manoeuvre: Manoeuvre
) -> tuple[Event, list[ActiveEffect], list[float]]:
    """The step changes of other logs at the instants of those that the coefficients show on a log, by their sizes.

    A step change recurs where one of its coefficient is seen that it explains better than none would; the nearest in
    size are taken first, each once. What changed at the same time but is not seen on the log recurs with it.

    Parameters
    ----------
    step_changes : sequence of ActiveEffect
        Those of other logs.
    seen : sequence of ActiveEffect
        Those of the log itself, with their own sizes and instants.
    manoeuvre : Manoeuvre
        The log.

    Returns
    -------
    placed : tuple of ActiveEffect
        On the log, with the sizes of the others.
    others : list of ActiveEffect
        Events of which no coefficient is seen to change.
    instants : list of float
        Those of what is seen and not explained, s from the log's start.
    """
    events = events_of(step_changes)
    steps = [active for event in events for active in event]
    instant_by_step: dict[int, float] = {}
    unexplained = list(range(len(seen)))
    distances = {
        (n, k): abs(active.numbers[0] / there.numbers[0] - 1.0)
        for n, active in enumerate(steps)
        for k, there in enumerate(seen)
        if active.name == there.name and there.numbers[0] != 0.0
    }
    for n, k in sorted(distances, key=lambda pair: distances[pair]):
        if distances[n, k] < 1.0 and n not in instant_by_step and k in unexplained:
            instant_by_step[n] = instant_of(seen[k])
            unexplained.remove(k)
    known = {active.name for active in seen}
    placed: list[ActiveEffect] = []
    others: list[ActiveEffect] = []
    first = 0
    for event in events:
        instants = [instant_by_step.get(n) for n in range(first, first + len(event))]
        first += len(event)
        recurring = min((instant for instant in instants if instant is not None), default=None)
        for active, own in zip(event, instants, strict=True):
            instant = recurring if own is None and active.name not in known else own
            if instant is not None:
                placed.append(at_instant(active, instant, manoeuvre.name, manoeuvre.interval))
        if not any(active.name in known for active in event):
            others += event
    start = float(manoeuvre.flight.time[0])
    return tuple(placed), others, [instant_of(seen[k]) - start for k in unexplained]


def fitted_step_changes(
    completed: Refinement,
    manoeuvre: Manoeuvre,
    own: tuple[ActiveEffect, ...],
    step_changes: Sequence[ActiveEffect],
    state: NDArray[np.float64],
    near: Sequence[float] | None = None,
) -> tuple[ActiveEffect, ...]:
    """The step changes of other logs on a log, each event at its instant of best fit, or left out.

    The event that reduces the errors most is placed first, the others beside it; of several then each once more.

    Parameters
    ----------
    completed : Refinement
        The model; sizes of the step changes are held.
    manoeuvre : Manoeuvre
        The log.
    own : tuple of ActiveEffect
        What else acts on it.
    step_changes : sequence of ActiveEffect
        Those of other logs.
    state : ndarray, shape (n,)
        Near the initial state.
    near : sequence of float, optional
        Instants from the log's start, s, from which those of best fit are looked for; without, the whole log.
    """
    start, span = float(manoeuvre.flight.time[0]), float(np.ptp(manoeuvre.flight.time))
    grid = _instants_anywhere(step_changes, manoeuvre.flight.time) if near is None else list(near)
    if not grid:
        return ()
    misfit = _Misfit(completed, manoeuvre, own, state)

    def moved(event: Event, at: float) -> Event:
        return tuple(at_instant(active, start + at, manoeuvre.name, manoeuvre.interval) for active in event)

    def likeliest(event: Event, others: Event) -> tuple[float, float]:
        """Misfit with an event beside others at its instant of best fit, and that instant; infinite if none helps."""

        @cache
        def at(instant: float | None) -> float:
            return misfit(others if instant is None else (*others, *moved(event, instant)))

        tried = misfit.most_promising(others, {instant: moved(event, instant) for instant in grid})
        best = min((None, *tried), key=at)
        if best is None:
            return np.inf, np.nan
        for reach in REACHES:
            best = _downhill((best + reach * span * np.linspace(-1.0, 1.0, STEPS)).tolist(), at)
        return at(best), best

    placed: list[Event] = []
    remaining = events_of(step_changes)
    while remaining:
        beside = _joined(placed)
        cost, at, event = min(((*likeliest(each, beside), each) for each in remaining), key=lambda row: row[0])
        if not np.isfinite(cost):
            break
        placed.append(moved(event, at))
        remaining.remove(event)
    for n, event in enumerate(placed if len(placed) > 1 else ()):
        cost, at = likeliest(event, _joined([*placed[:n], *placed[n + 1 :]]))
        if np.isfinite(cost):
            placed[n] = moved(event, at)
    return _joined(placed)


def _joined(events: Sequence[Event]) -> Event:
    return tuple(active for event in events for active in event)


def instants_of(placed: Sequence[ActiveEffect], manoeuvre: Manoeuvre) -> list[float]:
    """Instants of a log's own step changes, s from its start."""
    own = {instant_of(active) for active in step_changes_on(placed, manoeuvre.name)}
    return [at - float(manoeuvre.flight.time[0]) for at in sorted(own)]


def _instants_anywhere(step_changes: Sequence[ActiveEffect], time: NDArray[np.float64]) -> list[float]:
    """Instants on a whole log, s from its start: those of the step changes on their own logs, and a grid."""
    shifts = [instant_of(active) - time[0] for active in step_changes]
    span = float(np.ptp(time))
    return [*np.clip(shifts, 0.0, span).tolist(), *(span * np.linspace(0.05, 0.95, GRID)).tolist()]


def _downhill(instants: Sequence[float], misfit: Callable[[float], float]) -> float:
    """The instant of least misfit among some in order, from the middle one as far as it falls."""
    place = len(instants) // 2
    for ahead in (1, -1):
        first = place
        while 0 <= place + ahead < len(instants) and misfit(instants[place + ahead]) < misfit(instants[place]):
            place += ahead
        if place != first:
            break
    return instants[place]


class _Misfit:
    """Sum of squared normalised errors of a log with some step changes beside its own effects.

    Parameters
    ----------
    completed : Refinement
        The model, held.
    manoeuvre : Manoeuvre
        The log.
    own : tuple of ActiveEffect
        Effects that always act.
    state : ndarray, shape (n,)
        Near the initial state.
    """

    def __init__(
        self, completed: Refinement, manoeuvre: Manoeuvre, own: tuple[ActiveEffect, ...], state: NDArray[np.float64]
    ) -> None:
        self._likelihood = Likelihood(completed.model, (manoeuvre,), (), filtering=False)
        self._own, self._variance = own, completed.variance
        # Neighbouring instants hardly change the initial state: each step starts from the last one.
        self._last = state if np.isfinite(state).all() else manoeuvre.first_state

    def __call__(self, step_changes: Event) -> float:
        acting = (*self._own, *step_changes)
        cost, self._last = _from_likeliest_state(self._likelihood, acting, self._variance, self._last)
        return cost

    def most_promising(self, acting: Event, tried: Mapping[float, Event]) -> list[float]:
        """Instants at which the least misfit is predicted beside `acting` step changes, among those `tried`.

        All where they are few, or where the log cannot be simulated without the event.
        """
        instants = list(tried)
        if len(instants) <= FOLLOWED:
            return instants
        effects = [frozen(active) for active in (*self._own, *acting)]
        events = list(tried.values())
        predicted = predicted_misfits(self._likelihood, effects, self._variance, self._last, events)
        if predicted is None:
            return instants
        return [instants[n] for n in np.argsort(predicted, kind="stable")[:FOLLOWED]]


def _from_likeliest_state(
    likelihood: Likelihood,
    effects: Sequence[ActiveEffect],
    variance: NDArray[np.float64],
    state: NDArray[np.float64],
) -> tuple[float, NDArray[np.float64]]:
    """Sum of squared normalised errors of a flight from its maximum-likelihood initial state, and that state (n,).

    One Gauss-Newton step from a `state` near it, as the response is nearly linear in the initial state. Infinite where
    the simulation from there leaves its range.
    """
    point = likelihood.evaluate(likelihood.model.values, [state], [frozen(active) for active in effects], variance)
    if point is None:
        return np.inf, state
    moved = likelihood.active(())
    pull = point.gradients.sum(axis=0)
    scale = np.sqrt(np.diag(point.information))
    moved &= scale > 0.0
    scaled = point.information[np.ix_(moved, moved)] / np.outer(scale[moved], scale[moved])
    step = np.zeros_like(state)
    step[moved] = np.linalg.pinv(scaled, rcond=1e-13, hermitian=True) @ (pull[moved] / scale[moved]) / scale[moved]
    return point.cost - float(pull @ step), state + step
