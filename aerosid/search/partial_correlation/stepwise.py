"""Stepwise selection of terms by partial correlation with the model error d(t).

Parameswaran & Raol 1994, section 3.3, on any flight: d(t) of the present structure, candidates passed through the same
estimator, partial correlation of each with d(t) in its coloured noise; the likeliest of the best few enters if its
correlation is significant among so many; recursive least squares of all terms; repeated until no candidate correlates.
Delays and lags of controls, and delays, lags, scale factors and biases of sensors are regressors too, to first order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import NoiseEffect, at_first_trials
from aerosid.effects.disturbance import VANE_IN, gusts_of
from aerosid.effects.hypothesis import Hypothesis
from aerosid.errors import EstimationError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.score_test import Score
from aerosid.flight_model.aerodynamics import Entry
from aerosid.model_error.flight_sweeps.sweeps import FlightSweeps, is_seen
from aerosid.model_error.flight_sweeps.swept_model import Sweep, SweptModel
from aerosid.search.findings import Finding, Part, finding_among, identity, named
from aerosid.search.partial_correlation.parts import apparent_mass, is_at_a_limit, parts_of, wald_p_value
from aerosid.search.partial_correlation.screening import SENSOR_EFFECTS, chords_of, screen, undisturbed_p_value
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from aerosid.search.partial_correlation.trials import first_order_trials, is_linear, net_gain, shortlisted
from aerosid.search.step_change_instants import at_innovation_outliers, is_near_step_change, thinned, with_free_instant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Selection:
    """Result of a stepwise selection by d(t).

    Attributes
    ----------
    before : Sweep
        The declared structure.
    completed : Sweep
        With everything that entered.
    parts : tuple of (Part, gain, p-value)
        The selected parts, largest gain first; the gain is the rise of -2 ln L when the part is removed.
    alternatives : tuple of Finding
        Indistinguishable from a part in its place.
    rounds : tuple of tuple of Score
        Scores of each round.
    tested : int
        Number of candidates of each round.
    unobservable : tuple of str
        Kinds of effect among the hypotheses that d(t) cannot show.
    """

    before: Sweep
    completed: Sweep
    parts: tuple[tuple[Part, float, float], ...]
    alternatives: tuple[Finding, ...]
    rounds: tuple[tuple[Score, ...], ...]
    tested: int
    unobservable: tuple[str, ...]


def select(
    start: SweptModel,
    manoeuvres: Sequence[Manoeuvre],
    coefficients: Sequence[str],
    hypotheses: Sequence[Hypothesis],
    settings: ModelErrorSearchSettings,
    progress: Callable[[str], None] = lambda _stage: None,
) -> Selection:
    """Stepwise selection by the model error of the declared structure.

    Parameters
    ----------
    start : SweptModel
        The declared structure with start values.
    manoeuvres : sequence of Manoeuvre
        The identification flights, one joint estimate.
    coefficients : sequence of str
        The aircraft's, in which model error is allowed.
    hypotheses : sequence of Hypothesis
        The candidates; those that d(t) cannot show are left out and listed as unobservable.

    Raises
    ------
    EstimationError
        Where the declared model with its model error cannot be simulated.
    """
    search = _Search(manoeuvres, coefficients, hypotheses, start, settings)
    before = current = search.sweeps.estimate(start, polished=not settings.kept_statistics)
    alternatives: list[Finding] = []
    rounds: list[tuple[Score, ...]] = []
    for n in range(settings.rounds):
        progress(f"screening d(t), round {n + 1}")
        scores = search.scores(current)
        rounds.append(scores)
        entered = search.enter(current, scores)
        if entered is None:
            break
        current, others = entered
        alternatives.extend(others)
        current = search.eliminate_insignificant(current)
    parts = search.significance_of_parts(current)
    held = {named(part.label) for part, _, _ in parts}
    return Selection(
        before,
        current,
        tuple(sorted(parts, key=lambda row: -row[1])),
        tuple(other for other in alternatives if other.instead_of in held and _label(other) not in held),
        tuple(rounds),
        search.tested,
        search.unobservable,
    )


def _label(finding: Finding) -> str:
    return named((finding.kind, finding.where, finding.term))


@dataclass(frozen=True)
class _Trial:
    hypothesis: Hypothesis
    sweep: Sweep
    penalised_cost: float


class _Search:
    """One set of candidates on one set of flights."""

    def __init__(
        self,
        manoeuvres: Sequence[Manoeuvre],
        coefficients: Sequence[str],
        hypotheses: Sequence[Hypothesis],
        declared: SweptModel,
        settings: ModelErrorSearchSettings,
    ) -> None:
        self.settings = settings
        self.manoeuvres = tuple(manoeuvres)
        self.sweeps = FlightSweeps(manoeuvres, coefficients, settings.sweeps)
        self.declared = declared
        seen = [all(is_seen(active) for active in h.effects) for h in hypotheses]
        self.observable = thinned([h for h, shown in zip(hypotheses, seen, strict=True) if shown], settings.jump_stride)
        self.unobservable = tuple(dict.fromkeys(h.kind for h, shown in zip(hypotheses, seen, strict=True) if not shown))
        self.chords = chords_of(self.observable)
        self.tested = len(self.observable)
        self.values = sum(int(np.isfinite(manoeuvre.flight.measured).sum()) for manoeuvre in self.manoeuvres)
        self.samples = sum(manoeuvre.flight.time.size for manoeuvre in self.manoeuvres)
        self.refuted: set[tuple[str, str, str]] = set()
        """Labels of candidates whose trial gained nothing where trials are held: they are not tried again."""

    def _candidates(self, current: Sweep) -> list[int]:
        """Places of the candidates that the structure does not hold yet."""
        labels = {part.label for part in self.parts(current)}
        labels |= {(*active.name, "") for active in self.declared.effects}
        return [
            place
            for place, h in enumerate(self.observable)
            if h.label not in labels
            and not is_near_step_change(h, current.swept.effects, self.manoeuvres, self.settings.jump_spacing)
        ]

    def parts(self, current: Sweep) -> list[Part]:
        """The parts of the structure beyond the declared one, with corrected standard deviations."""
        return parts_of(current, self.declared, sum(self.sweeps.flights.distances))

    def _p_value(self, sweep: Sweep, parts: Sequence[Part]) -> float:
        return wald_p_value(sweep, parts, self.tested, self.samples)

    def scores(self, current: Sweep) -> tuple[Score, ...]:
        """Scores of all open candidates by partial correlation with d(t), largest net gain first."""
        open_places = set(self._candidates(current))
        at_outliers = at_innovation_outliers(current, self.observable, self.manoeuvres, self.settings)
        chords = [chord for chord in self.chords if chord.place in open_places]
        chords += [replace(chord, place=chord.place + len(self.observable)) for chord in chords_of(at_outliers)]
        screening = (self.sweeps, current, (*self.observable, *at_outliers), chords, self.settings, self.tested)
        return tuple(sorted(screen(*screening), key=lambda score: -net_gain(score, self.settings)))

    def enter(self, current: Sweep, scores: Sequence[Score]) -> tuple[Sweep, list[Finding]] | None:
        """The structure with the likeliest candidate, and its alternatives; None where no candidate is significant."""
        trials = [
            *self._trials(current, shortlisted(scores, current, self.manoeuvres[0], self.settings, self.tested)),
            *self._trials_in_turbulence(current),
        ]
        for first in sorted(trials, key=lambda trial: trial.penalised_cost):
            trial = self._with_own_statistics(current, first)
            if trial is None:
                continue
            new = self._new_parts(current, trial.sweep)
            numbers = sum(len(part.std_errors) or 1 for part in new)
            least = 2.0 * self.settings.evidence + numbers * np.log(self.values)
            better = trial.penalised_cost < current.cost - self.settings.price
            better &= trial.sweep.cost < current.cost - least
            if not new or not better or not self._reduces_model_error(current, trial.sweep, new):
                continue
            if any(part.is_disturbance for part in new):
                return self.sweeps.estimate(trial.sweep.swept), []
            if self._p_value(trial.sweep, new) > self.settings.false_alarm or is_at_a_limit(new):
                continue
            p_value = undisturbed_p_value(self.sweeps, trial.sweep, trial.hypothesis, self.tested)
            if p_value > self.settings.false_alarm:
                continue
            others = [
                self._alternative(current, other, trial)
                for other in trials
                if other is not first and other.penalised_cost - first.penalised_cost < self.settings.reach
            ]
            whole = trial.sweep if self.settings.kept_statistics else self.sweeps.estimate(trial.sweep.swept)
            if apparent_mass(whole.swept.model, self.manoeuvres[0]) >= self.settings.apparent_mass:
                continue
            return whole, [other for other in others if other is not None]
        return None

    def _trials(self, current: Sweep, shortlist: Sequence[Score]) -> list[_Trial]:
        """Fits of the candidates: to first order where trials are held and that is exact, else by simulation."""
        linear = [s for s in shortlist if self.settings.kept_statistics and is_linear(s.hypothesis)]
        fits = list(zip(linear, first_order_trials(self.sweeps, current, linear), strict=True))
        for score in sorted((s for s in shortlist if s not in linear), key=lambda score: -score.gain):
            brought = max((current.cost - sweep.cost for _, sweep in fits), default=0.0)
            if not self.settings.far_ahead or brought < self.settings.far_ahead * score.gain:
                fits += [(score, sweep) for sweep in self._fits(current, score)]
        if self.settings.kept_statistics:
            self.refuted |= {score.hypothesis.label for score, sweep in fits if sweep.cost > current.cost}
        return [
            _Trial(score.hypothesis, sweep, sweep.cost + score.gain - net_gain(score, self.settings))
            for score, sweep in fits
            if apparent_mass(sweep.swept.model, self.manoeuvres[0]) < self.settings.apparent_mass
        ]

    def _with_own_statistics(self, current: Sweep, trial: _Trial) -> _Trial | None:
        """A trial with re-estimated statistics of d(t); None where it is not significant or cannot be simulated."""
        if not self.settings.kept_statistics or trial.sweep.swept.statistics.gust != current.swept.statistics.gust:
            return trial
        new = self._new_parts(current, trial.sweep)
        if not new or self._p_value(trial.sweep, new) > self.settings.false_alarm:
            return None
        start = self.sweeps.flights.carried(current.swept, trial.sweep.swept)
        try:
            sweep = self.sweeps.estimate(start, polished=False)
        except EstimationError:
            return None
        return replace(trial, sweep=sweep, penalised_cost=trial.penalised_cost - trial.sweep.cost + sweep.cost)

    def _reduces_model_error(self, current: Sweep, trial: Sweep, new: Sequence[Part]) -> bool:
        """Whether d(t) decreases in some coefficient, and increases in none, where it is more than rounding.

        A sensor error need only meet the second condition: it need not be in d(t).
        """
        before, after = (sweep.swept.statistics.density for sweep in (current, trial))
        noticed = self.settings.noticed * self.settings.sweeps.least_spread * np.sqrt(self.settings.sweeps.first_memory)
        # A rise of one coefficient's d(t) by rounding does not count against the fall of another's.
        counts = max(noticed, self.settings.least_rise * float(np.max(before - after)))
        if np.any((after > self.settings.most_increase * before) & (after > counts)):
            return False
        present = before > noticed
        of_sensors = all(part.active is not None and isinstance(part.active.effect, SENSOR_EFFECTS) for part in new)
        if of_sensors or not present.any():
            return True
        return bool(np.min(after[present] / before[present]) < self.settings.least_reduction)

    def _trials_in_turbulence(self, current: Sweep) -> list[_Trial]:
        """The structure in turbulence, where it is not in turbulence yet and some model error remains."""
        if current.swept.statistics.gust is not None or not self.settings.gusts or not self._has_model_error(current):
            return []
        found = []
        for effect in gusts_of(self.sweeps.flights.axes):
            air = at_first_trials(effect)
            statistics = replace(current.swept.statistics, gust=air)
            try:
                sweep = self.sweeps.estimate(
                    replace(current.swept, statistics=statistics), sweeps=self.settings.trial_sweeps
                )
            except EstimationError:
                continue
            if self._exceeds_vane_noise(sweep, effect):
                extra = self.settings.price * (len(effect.parameters) - 1)
                found.append(_Trial(Hypothesis(effect.kind, effect.where), sweep, sweep.cost + extra))
        return found

    def _exceeds_vane_noise(self, sweep: Sweep, effect: NoiseEffect) -> bool:
        """Whether turbulence moves each vane by more than its noise: less is the colour of that noise."""
        assert sweep.swept.statistics.gust is not None
        sizes = zip(effect.columns, sweep.swept.statistics.gust.values, strict=False)
        pairs = list(zip(self.manoeuvres, self.sweeps.flights.airspeeds, strict=True))
        return all(
            any(size / airspeed > float(m.noise[m.row(VANE_IN[column])]) for m, airspeed in pairs)
            for column, size in sizes
        )

    def _has_model_error(self, current: Sweep) -> bool:
        """Whether d(t) is more than rounding in some coefficient."""
        return max(current.swept.statistics.spread) > self.settings.noticed * self.settings.sweeps.least_spread

    def _fits(self, current: Sweep, score: Score) -> list[Sweep]:
        """The fit with one more candidate, from the best of its starts; empty where it cannot be simulated."""
        settings = self.settings
        sweeps = []
        starts = self._starts(score)
        whole = not settings.kept_statistics
        for start in starts:
            count = settings.trial_sweeps if len(starts) == 1 else 1
            swept = self._start_with(current, start)
            try:
                sweeps.append(self.sweeps.estimate(swept, search=whole, sweeps=count, polished=whole))
            except EstimationError:
                continue
        if len(starts) > 1 and sweeps:
            best = min(sweeps, key=lambda sweep: sweep.cost)
            sweeps = [self.sweeps.estimate(best.swept, sweeps=settings.trial_sweeps)]
        sweeps = [
            sweep for sweep in sweeps if apparent_mass(sweep.swept.model, self.manoeuvres[0]) < settings.apparent_mass
        ]
        return [min(sweeps, key=lambda sweep: sweep.cost)] if sweeps else []

    def _starts(self, score: Score) -> list[Score]:
        """Starts of a candidate's fits: its first-order step, or each trial value where it is nonlinear."""
        parameters = [p for active in score.hypothesis.effects for p in active.effect.parameters]
        trials = max((len(parameter.trials) for parameter in parameters), default=1)
        if trials < 2:
            return [score]
        beyond = tuple(np.inf for _ in score.start)
        trial_values = (score.trial,) if self.settings.kept_statistics else range(trials)
        return [replace(score, start=beyond, trial=trial) for trial in trial_values]

    def _alternative(self, current: Sweep, other: _Trial, chosen: _Trial) -> Finding | None:
        new = self._new_parts(current, other.sweep)
        if not new:
            return None
        return finding_among(new[0], self.tested, current.cost - other.sweep.cost, named(chosen.hypothesis.label))

    def _new_parts(self, current: Sweep, trial: Sweep) -> list[Part]:
        held = set(map(identity, self.parts(current)))
        return [part for part in self.parts(trial) if identity(part) not in held and part.ratio > 0.0]

    def _start_with(self, current: Sweep, score: Score) -> SweptModel:
        """Start of the fit with one more candidate."""
        swept, hypothesis = current.swept, score.hypothesis
        effects = hypothesis.at(score.start[len(hypothesis.entries) :], score.trial).effects
        if hypothesis.time is not None:
            effects = tuple(with_free_instant(active, hypothesis.time, self.manoeuvres) for active in effects)
        further = replace(
            swept,
            model=swept.model.extended(hypothesis.entries),
            free=(*swept.free, *hypothesis.entries),
            effects=(*swept.effects, *effects),
        )
        return self.sweeps.flights.carried(swept, further) if effects else further

    def _start_without(self, current: Sweep, part: Part) -> SweptModel:
        """Start of the fit without a part, whose effect d(t) takes in."""
        swept = current.swept
        if part.is_disturbance:
            remaining = replace(swept, statistics=replace(swept.statistics, gust=None))
        elif part.entry is None:
            remaining = replace(swept, effects=tuple(active for active in swept.effects if active is not part.active))
        else:
            entry: Entry = part.entry
            free = tuple(e for e in swept.free if e != entry)
            remaining = replace(swept, model=swept.model.without([entry]), free=free)
        return self.sweeps.flights.carried(swept, remaining)

    def eliminate_insignificant(self, current: Sweep) -> Sweep:
        """Backward elimination of the parts that later parts have made insignificant."""
        while True:
            parts = self.parts(current)
            doubts = [(self._p_value(current, [part]), part) for part in parts]
            worst = max(doubts, key=lambda doubt: (doubt[0], -doubt[1].ratio), default=None)
            if worst is None or worst[0] <= self.settings.false_alarm:
                return self._without_explained_turbulence(current)
            current = self.sweeps.estimate(self._start_without(current, worst[1]))

    def _without_explained_turbulence(self, current: Sweep) -> Sweep:
        """The structure without turbulence where parts that entered later explain it."""
        turbulence = [part for part in self.parts(current) if part.is_disturbance]
        if not turbulence:
            return current
        without = self.sweeps.estimate(self._start_without(current, turbulence[0]))
        numbers = len(turbulence[0].std_errors)
        return without if without.cost - current.cost < self.settings.price * numbers else current

    def significance_of_parts(self, current: Sweep) -> list[tuple[Part, float, float]]:
        """Each part with the rise of -2 ln L when it is removed, and its p-value."""
        rows = []
        for part in self.parts(current):
            if self.settings.kept_statistics:
                rows.append((part, part.ratio**2, self._p_value(current, [part])))
                continue
            try:
                without = self.sweeps.estimate(
                    self._start_without(current, part), sweeps=self.settings.trial_sweeps
                ).cost
            except EstimationError:
                without = current.cost + part.ratio**2  # by its t-ratio, where the rest cannot be simulated
            rows.append((part, without - current.cost, self._p_value(current, [part])))
        return rows
