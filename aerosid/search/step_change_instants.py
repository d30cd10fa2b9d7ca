"""Instants of step changes from the largest innovations, since d(t) follows a step between instants of a grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aerosid.effects import ActiveEffect, InputEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.limits import OFFERED
from aerosid.effects.step_input import at_instant, instant_of, step_changes_on, with_fixed_instant
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.model_error.flight_sweeps.swept_model import Sweep
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings


def is_near_step_change(
    hypothesis: Hypothesis,
    effects: Sequence[ActiveEffect],
    manoeuvres: Sequence[Manoeuvre],
    spacing: float,
) -> bool:
    """Whether a step change is within `spacing` grid steps of one among `effects`: it would only correct its instant.

    Other hypotheses never are.
    """
    if hypothesis.time is None:
        return False
    log = next(m for m in manoeuvres if m.name in (hypothesis.where, hypothesis.effects[0].log))
    reach = spacing * float(np.ptp(log.flight.time)) / OFFERED.grid
    return any(abs(instant_of(active) - hypothesis.time) < reach for active in step_changes_on(effects, log.name))


def thinned(hypotheses: Sequence[Hypothesis], stride: int) -> list[Hypothesis]:
    """All hypotheses but step changes, and of each kind of step change on each log every n-th instant."""
    places: dict[tuple[str, str, tuple[str, ...]], int] = {}
    thinned_out = []
    for hypothesis in hypotheses:
        if hypothesis.time is not None:
            key = (hypothesis.kind, hypothesis.where, tuple(active.log for active in hypothesis.effects))
            places[key] = places.get(key, -1) + 1
            if places[key] % stride:
                continue
        thinned_out.append(hypothesis)
    return thinned_out


def at_innovation_outliers(
    current: Sweep,
    hypotheses: Sequence[Hypothesis],
    manoeuvres: Sequence[Manoeuvre],
    settings: ModelErrorSearchSettings,
) -> list[Hypothesis]:
    """The step changes among some hypotheses, one of each kind, at the instants of the largest innovations."""
    found = []
    for n, log in enumerate(manoeuvres):
        squares, count = np.zeros(log.flight.time.size), np.zeros(log.flight.time.size)
        for part, (flight, output) in zip(current.fit.groups, current.rows.channels, strict=True):
            if flight == n:
                present = np.isfinite(log.flight.measured[:, output])
                squares[present] += current.fit.white_target[part] ** 2
                count += present
        excess = (squares - count) / np.sqrt(2.0 * np.maximum(count, 1.0))
        interval = log.interval
        reach = max(1, round(settings.jump_spacing * float(np.ptp(log.flight.time)) / OFFERED.grid / interval))
        kinds = {
            h.kind: h
            for h in hypotheses
            if h.time is not None and (h.where == log.name or all(a.log == log.name for a in h.effects))
        }
        for _ in range(settings.outliers):
            k = int(np.argmax(excess))
            if excess[k] < settings.outlying:
                break
            found += [_at_instant(h, float(log.flight.time[k]) - 0.5 * interval, interval) for h in kinds.values()]
            excess[max(k - reach, 0) : k + reach] = -np.inf
    return [h for h in found if not is_near_step_change(h, current.swept.effects, manoeuvres, settings.jump_spacing)]


def with_free_instant(active: ActiveEffect, time: float, manoeuvres: Sequence[Manoeuvre]) -> ActiveEffect:
    """A step change whose instant, near `time` s, is a free parameter."""
    log = next(m for m in manoeuvres if m.name == active.log)
    return at_instant(active, time, active.log, log.interval)


def _at_instant(hypothesis: Hypothesis, time: float, interval: float) -> Hypothesis:
    """The same step changes at another, fixed instant."""
    effects = []
    for active in hypothesis.effects:
        effect = active.effect
        if isinstance(effect, InputEffect) and effect.at_time is not None:
            active = replace(active, effect=with_fixed_instant(effect.at_time(time, interval)))
        effects.append(active)
    return replace(hypothesis, effects=tuple(effects), time=time)
