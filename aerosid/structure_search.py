"""Search the structure that the declared model lacks: score, try, prune, exchange.

A hypothesis (a term, a sensor's or control's fault, a sudden change) enters where three things hold: among all its fit
is the most likely, its deviation corrected for coloured residuals leaves no doubt after counting how many were looked
at, and it stays so beside everything else that entered.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri, ndtr, ndtri

from aerosid.aerodynamics import AerodynamicModel, Entry
from aerosid.effects import KINDS, ActiveEffect, InputEffect, NoiseEffect, OutputEffect, frozen, whole
from aerosid.effects.aerodynamic_terms import rarity, searched_numbers
from aerosid.effects.disturbance import gust, unmodelled_forces
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.sudden import GRID, at_moment, is_sudden, moment
from aerosid.evidence import Deviations, Linearised, Score, deviations, score_hypotheses, unexplained_channels
from aerosid.findings import Finding, Part, named
from aerosid.hypotheses import Hypothesis, with_columns_of, with_gust, with_offsets
from aerosid.likelihood_point import Point
from aerosid.manoeuvre import Manoeuvre, with_calm_inputs
from aerosid.refinement import Refinement, RefinementSettings, Start, contest, refine, refine_on
from aerosid.terms import Term


@dataclass(frozen=True)
class AttributionSettings:
    """Settings of the structure search, each with the reason for its value.

    Attributes
    ----------
    false_alarm : float
        Share of flights with nothing missing in which something may be named, by design.
    shortlist : int
        Hypotheses that are fitted in each round; the score's ranking is exact only for small effects.
    rounds : int
        How many may enter; beyond, a flight misses something that is no sum of them.
    reach : float
        Difference of -2 ln L, for white residuals, within which another hypothesis counts as not told apart (20:1).
    price : float
        What each further number must bring in -2 ln L for one hypothesis to be preferred to a simpler one.
    disturbances : bool
        Whether gusts and forces of any shape are considered where something is left.
    """

    false_alarm: float = 0.001
    shortlist: int = 6
    rounds: int = 6
    reach: float = 6.0
    price: float = 8.0
    disturbances: bool = True


TRIAL = RefinementSettings(
    steps=16, step_tolerance=0.03, variance_tolerance=0.02, cost_tolerance=1.0, disturbances=False
)
"""A trial decides between hypotheses that differ by many units of -2 ln L: a few steps are enough."""

BACKGROUND = RefinementSettings(steps=30, rounds=5, step_tolerance=0.03, variance_tolerance=0.01, cost_tolerance=0.1)
"""As a trial, with the size of the disturbance estimated too."""

UNLIKE_THEIR_SCORE = frozenset(name for name, kind in KINDS.items() if not kind.follows_its_score)
"""Kinds whose effect is far from linear in their number."""

FILTERS = frozenset(name for name in UNLIKE_THEIR_SCORE if KINDS[name].place == "input")
"""Those of them that take noise out of a record."""

CALM_LEFT = 0.5
"""Of what averaging a noisy record brings, the share that a better average could still bring."""

LEAST_SHARE = 0.1
"""Share of the best score from which such a kind is worth a fit."""

SPLINE_SHARE = 0.9
"""Share of the best score from which a spline is worth a fit."""

RIVAL_SHARE = 0.75
"""Share of the chosen one's score from which another hypothesis is worth a fit in its place."""


PROFILE = 10
"""Values of an effect of a control at which everything else is estimated: neighbours differ by less than twice."""

REACH_OF_PROFILE = 3.0
"""Times the largest trial value up to which they go."""

NEARLY_ALL = 0.02
"""Share of the loss that a rival may leave and still be fitted: second order errs by less where it wins back most."""

STAND_IN_SHARE = 0.5
"""Share of the loss, linear in the number of an effect that is not, from which a stand-in is worth a fit."""

GROSS = 3.0
"""Times a channel's noise from which what the model leaves may have drawn every estimate far off."""


BESIDE_SEPARATION = 1
"""How many may enter beside flow separation: each is searched for among as many rivals as all that entered before."""

PATCHES = 3
"""Terms that together may be a likeness of something else: the lift of a stall alone bends as two of them."""

LIKENESS = 0.9
"""Share of what its likeness brings that separation brings too, from which others are looked for beside it."""

OTHERWISE_GOOD = 0.5
"""Share of what a hypothesis brings in the place of a part, from which, brought beside it, it says something else."""

RAREST = max(kind.rarity for kind in KINDS.values())
"""What a rival may lose by its rareness alone and still be listed."""

SURELY_APART = 20.0
"""Times the difference in price that decides nothing, within which a rival of a small effect is fitted."""


@dataclass(frozen=True)
class Searched:
    """Where a search ended: the estimate, what could stand in place of its parts, the scores of each round."""

    estimate: Refinement
    others: tuple[Finding, ...] = ()
    rounds: tuple[tuple[Score, ...], ...] = ()


def has_disturbance(current: Refinement) -> bool:
    """Whether gusts or forces of any shape act, which leave no gross residual to be led astray by."""
    return any(isinstance(active.effect, NoiseEffect) for active in current.effects)


def with_plain_noise(active: ActiveEffect) -> ActiveEffect:
    """The effect on a control without what it does to the noise of its record."""
    if active.effect.kind not in FILTERS or not isinstance(active.effect, InputEffect):
        return active
    return replace(active, effect=replace(active.effect, noise=lambda _numbers, _interval: (1.0, 0.0)))


class StructureSearch:
    """The stepwise search over one set of hypotheses on one set of manoeuvres."""

    def __init__(
        self,
        manoeuvres: tuple[Manoeuvre, ...],
        hypotheses: tuple[Hypothesis, ...],
        stepping: tuple[str, ...],
        declared: Refinement,
        settings: AttributionSettings,
        given: AerodynamicModel | None = None,
    ) -> None:
        self.given = given
        self.manoeuvres = manoeuvres
        self.stepping = stepping
        self.hypotheses = hypotheses
        self.declared = declared
        self.settings = settings
        self.linearised: tuple[Refinement, Linearised] | None = None
        self.plain: tuple[Refinement, Linearised] | None = None
        self.rough: tuple[Refinement, Deviations] | None = None
        self.struck: dict[tuple[tuple[Entry, ...], tuple[str, ...]], Refinement] = {}
        self.noise = np.sqrt(self.noise_level(declared))
        self.critical = float(-ndtri(0.5 * settings.false_alarm / max(len(self.hypotheses), 1)))

    def forward(self, start: Refinement, most: int | None = None) -> tuple[Refinement, list[tuple[Score, ...]]]:
        """Let hypotheses enter one at a time, `most` in all, and leave again when a later one explains them."""
        current = start
        rounds = []
        for _ in range(self.settings.rounds if most is None else most):
            scores = self.scores(current)
            rounds.append(scores)
            shortlist = self.shortlist(scores)
            trials = self.tried(current, shortlist)
            if all(self.is_gross(trial) for trial in trials):
                level = min(map(self.price, trials), default=self.price(current))
                trials += self.tried(current, [], level, further=self.afresh(current, shortlist, level))
            trials = self.lightened(current, trials, min(map(self.price, trials), default=np.inf))
            trials = [trial for trial in trials if self.price(trial) < self.price(current)]
            improved = next((better for better in self.pruned_trials(trials) if self.is_news(better, current)), None)
            if improved is None:
                break
            current = self.settled(improved)
        return current, rounds

    def is_doubtful(self, current: Refinement) -> bool:
        """Whether flow separation or disturbances may say it better: the model is still wrong, or is a staircase.

        One sudden change is one event. Several on a flight follow whatever comes and goes, as a staircase does.
        """
        if current.held_to_data > 0.0:
            return False
        moments = {(active.log, round(moment(active))) for active in current.effects if is_sudden(active)}
        logs = [log for log, _ in moments]
        staircase = any(logs.count(log) > 1 for log in logs)
        return staircase or bool(unexplained_channels(current, self.manoeuvres))

    def settled(self, current: Refinement) -> Refinement:
        """The estimate with the statistics of its disturbances moved too, which trials keep: less is left for them."""
        if not any(isinstance(active.effect, NoiseEffect) and active.values for active in current.effects):
            return current
        return refine_on(current, self.manoeuvres, BACKGROUND)

    def in_moving_air(self, start: Refinement) -> Refinement:
        """The estimate with a gust beside it."""
        room = self.with_room(start)
        return self.with_noise(replace(room, model=with_gust(room.model)), gust())

    def through_air(self, start: Refinement, most: int | None = None) -> Searched:
        """The search beside a disturbance; `most`: how many may enter."""
        current, rounds = self.forward(self.pruned(start), most)
        current, others = self.exchange(current)
        return Searched(current, others, tuple(rounds))

    def is_gust(self, current: Refinement) -> bool:
        """Whether a gust explains more than forces of any shape do, which follow whatever the model lacks."""
        return self.price(current) < self.price(self.in_forces(current)) - self.critical**2

    def in_forces(self, start: Refinement) -> Refinement:
        """The estimate with forces of any shape, in place of a gust that it may hold."""
        effects = tuple(active for active in start.effects if not isinstance(active.effect, NoiseEffect))
        return self.with_noise(self.with_room(replace(start, effects=effects)), unmodelled_forces(self.stepping))

    def disturbed(self, start: Refinement, gusty: Searched | None = None) -> Searched:
        """The search against a background of disturbances: a gust, or forces of any shape.

        Against it a term must bring more than what any force could: deviations and likelihoods then mean what they say
        although the model is still wrong somewhere. A gust is named only where it explains more than forces of any
        shape do, which follow whatever the model lacks and explain nothing. `gusty`: the search beside a gust, where
        that is known.
        """
        background = self.in_moving_air(start) if gusty is None else gusty.estimate
        if self.stepping:
            forced = self.in_forces(start)
            if self.price(forced) < self.price(background) + self.critical**2:
                return self.through_air(forced)
        return self.through_air(background) if gusty is None else gusty

    def separated(self, found: Refinement) -> Refinement:
        """The search with flow separation in place of what was found of its likeness.

        Its six numbers can mimic much, so that it is asked late. Curves of alpha and sudden changes are how it looks
        where it is unknown. Where it leaves the model wrong, others may enter beside it.
        """
        highest = max(float(np.nanmax(manoeuvre.flight.measured[:, 1])) for manoeuvre in self.manoeuvres)
        drag, lift, moment_name = self.stepping
        effect = flow_separation(highest, lift, (drag, moment_name))
        rest = tuple(parameter.trials[0] for parameter in effect.parameters[1:])
        alike = [part for part in self.parts(found, None) if part.time is not None or is_curve(part)]
        base = self.without(found, alike) if alike else found
        bases = [base]
        if jump := self.greatest_jump(found):
            # One event may be real beside it.
            bases.append(self.without(found, [part for part in alike if part not in jump]))
        starts = [
            Start(
                self.with_room(each).model,
                each.free,
                (*each.effects, ActiveEffect(effect, (first, *rest))),
                each.states,
                each.variance,
            )
            for each in bases
            for first in effect.parameters[0].trials
        ]
        handicaps = [self.fare(each) for each in starts]
        best = min(contest(starts, self.manoeuvres, TRIAL, handicaps), key=self.price)
        won, asked = self.price(base) - self.price(best), self.price(base) - self.price(found)
        if won > max(LIKENESS * asked, 0.0) and self.is_doubtful(best):
            best, _ = self.forward(self.pruned(best), BESIDE_SEPARATION)
        return best

    def greatest_jump(self, found: Refinement) -> list[Part]:
        """Of several sudden changes the parts of the most certain; none where there are not several."""
        spread = self.rough_deviations(found)
        certainty = {(part.label, part.time): part.ratio for part in self.parts(found, spread)}
        jumps = [group for group in self.groups(found) if group[0].time is not None]
        if len(jumps) < 2:
            return []
        return max(jumps, key=lambda group: max(certainty[part.label, part.time] for part in group))

    def jumps_alike(self, group: Sequence[Part]) -> list[Score]:
        """Other kinds of sudden change at the moment of one that was found.

        Where a jump was struck out the fit has moved so far that scores no longer show its moment.
        """
        time, found = group[0].time, group[0].active
        if time is None or found is None:
            return []
        nearest = {
            hypothesis.kind: replace(hypothesis, time=time)
            for hypothesis in self.hypotheses
            if hypothesis.time is not None
            and hypothesis.kind not in (group[0].label[0], "step_change")
            and hypothesis.effects[0].log == found.log
        }
        return [Score(each, 0.0, (0.0,) * each.parameters, 0.0) for each in nearest.values()]

    def is_patchwork(self, current: Refinement) -> bool:
        """Whether terms are so many, bent in alpha some of them, that one cause with a memory may say them all."""
        terms = [part for part in self.parts(current, None) if part.entry is not None]
        return len(terms) >= PATCHES and any(map(is_curve, terms))

    def with_noise(self, start: Refinement, effect: NoiseEffect) -> Refinement:
        """The estimate with a disturbance, from the most likely of its trial values."""
        trials = [
            refine(
                start.model,
                self.manoeuvres,
                start.free,
                effects=(*start.effects, ActiveEffect(effect, (first, *(p.trials[0] for p in effect.parameters[1:])))),
                states=start.states,
                variance=self.noise_level(start),
                settings=BACKGROUND,
            )
            for first in effect.parameters[0].trials
        ]
        return min(trials, key=lambda trial: trial.cost)

    def noise_level(self, start: Refinement) -> NDArray[np.float64]:
        """The logs' own noise variances: a disturbance, not the sensors, is to take what the model leaves."""
        squares = np.nan_to_num(np.array([manoeuvre.noise**2 for manoeuvre in self.manoeuvres]))
        known = np.count_nonzero(squares, axis=0)
        return np.where(known > 0, squares.sum(axis=0) / np.maximum(known, 1), start.variance)

    def pruned_trials(self, trials: Sequence[Refinement]) -> Iterator[Refinement]:
        """The trials without their weak parts, the most likely first."""
        return (self.pruned(trial) for trial in sorted(trials, key=self.price))

    def is_news(self, trial: Refinement, current: Refinement) -> bool:
        """Whether a trial says something else than the present estimate, and better."""
        held = {(part.label, part.time and round(part.time, 1)) for part in self.parts(current, None)}
        told = {(part.label, part.time and round(part.time, 1)) for part in self.parts(trial, None)}
        return told != held and self.price(trial) < self.price(current) and self.is_no_filter(trial, current)

    def is_no_filter(self, trial: Refinement, current: Refinement) -> bool:
        """Whether what a trial says of a control does more than to take noise out of its record.

        A lag, a delay between two samples or a limit of rate averages a noisy record, and the motion is then better
        simulated though the surface does nothing of the kind. With that noise averaged out it brings nothing.
        """
        acting = [active for active in trial.effects if not active.held and active.effect.kind in FILTERS]
        held = {active.name for active in current.effects}
        if all(active.name in held for active in acting):
            return True
        calm = [with_calm_inputs(manoeuvre) for manoeuvre in self.manoeuvres]
        with_it, without = (
            refine_on(each, calm, TRIAL, [with_plain_noise(active) for active in each.effects])
            for each in (trial, current)
        )
        averaging = max(current.cost - without.cost, 0.0)
        return without.cost - with_it.cost > self.critical**2 + CALM_LEFT * averaging

    def price(self, trial: Refinement) -> float:
        """-2 ln L with what its numbers cost."""
        return trial.cost + self.fare(trial)

    def fare(self, trial: Refinement | Start) -> float:
        """What the numbers of an estimate cost."""
        count = len(trial.free) + sum(map(searched_numbers, self.added_terms(trial)))
        count += sum(len(active.values) for active in trial.effects)
        return self.rareness(trial) + self.settings.price * count

    def rareness(self, trial: Refinement | Start) -> float:
        """What an estimate must bring beyond a commoner one that does the same."""
        rare = sum(map(rarity, self.added_terms(trial)))
        return rare + sum(KINDS[a.effect.kind].rarity for a in trial.effects if a.values and a.effect.kind in KINDS)

    def added_terms(self, trial: Refinement | Start) -> list[Term]:
        """The terms that are not declared."""
        return [term for coefficient, term in trial.free if (coefficient, term) not in self.declared.free]

    def scores(self, current: Refinement, without: Sequence[tuple[str, str, str]] = ()) -> tuple[Score, ...]:
        """Scores of all that the estimate does not hold yet, nor `without` names."""
        if not without and current.held_to_data == 0.0:
            return self.about(current).scores()
        asked = self.open_hypotheses(current, without)
        return score_hypotheses(self.asking(current, asked), self.manoeuvres, asked)

    def open_hypotheses(self, current: Refinement, without: Sequence[tuple[str, str, str]] = ()) -> list[Hypothesis]:
        """All that the estimate does not hold yet, nor `without` names."""
        held = {part.label for part in self.parts(current, None)} | set(without)
        held |= {(*active.name, "") for active in current.effects if active.held}
        return [h for h in self.hypotheses if h.label not in held and not self.is_near_a_step(h, current)]

    def is_near_a_step(self, hypothesis: Hypothesis, current: Refinement) -> bool:
        """Whether a step change is so close to one that is held already that it would only mend its edge."""
        if hypothesis.time is None:
            return False
        manoeuvre = next(m for m in self.manoeuvres if m.name == hypothesis.where)
        reach = 3.0 * float(np.ptp(manoeuvre.flight.time)) / GRID
        jumps = [active for active in current.effects if active.log == manoeuvre.name and is_sudden(active)]
        return any(abs(moment(active) - hypothesis.time) < reach for active in jumps)

    def asking(self, current: Refinement, hypotheses: Sequence[Hypothesis]) -> Refinement:
        """The estimate with the input columns that the effects of some hypotheses fill."""
        room = self.with_room(current)
        effects = [active for hypothesis in hypotheses for active in hypothesis.effects]
        return replace(room, model=with_columns_of(room.model, effects))

    def with_room(self, current: Refinement) -> Refinement:
        """The estimate with input columns for step changes."""
        if not self.stepping or current.held_to_data > 0.0:
            return current
        return replace(current, model=with_offsets(current.model, self.stepping))

    def shortlist(self, scores: Sequence[Score]) -> list[Score]:
        """The hypotheses worth a fit: the best few whose score could pass, one a label, and the best of some kinds.

        The score of a large effect that is not linear, as of a rate limit, can rank below terms that only follow it.
        """
        worth: dict[tuple[str, str, str], Score] = {}
        for score in scores:
            if score.gain > self.critical**2 + self.settings.price * (score.hypothesis.parameters - 1):
                worth.setdefault(score.hypothesis.label, score)
        splines = [score for score in worth.values() if score.hypothesis.searched]
        ranked = [score for score in worth.values() if not score.hypothesis.searched]
        chosen = ranked[: self.settings.shortlist]
        # One spline follows another closely: the best stands for all, where it is about as good as a simpler term.
        chosen += [score for score in splines[:1] if not chosen or score.gain > SPLINE_SHARE * chosen[0].gain]
        kinds = {score.hypothesis.kind for score in chosen}
        for score in ranked[self.settings.shortlist :]:
            kind = score.hypothesis.kind
            if kind not in kinds and kind in UNLIKE_THEIR_SCORE and score.gain > LEAST_SHARE * ranked[0].gain:
                kinds.add(kind)
                chosen.append(score)
        return chosen

    def tried(
        self,
        current: Refinement,
        scores: Sequence[Score],
        level: float | None = None,
        margin: float = 0.0,
        further: Sequence[Start] = (),
    ) -> list[Refinement]:
        """The estimate with one more hypothesis, for each of several, and from `further` starts.

        Those are not followed to the end that stay more than `margin` above the price `level`, or above the best.
        """
        starts = [*(self.start(current, score) for score in scores), *further]
        fares = [self.fare(start) - self.spare(start, current) for start in starts]
        return contest(starts, self.manoeuvres, TRIAL, fares, level, margin)

    def spare(self, trial: Refinement | Start, current: Refinement) -> float:
        """What a trial may save: coefficients jump all at once at first, though one of them may be all that does."""
        new = len([a for a in trial.effects if a.effect.kind == "step_change"])
        new -= len([a for a in current.effects if a.effect.kind == "step_change"])
        return self.settings.price * 2 * max(new - 1, 0)

    def lightened(self, current: Refinement, trials: Sequence[Refinement], level: float) -> list[Refinement]:
        """The trials, without their idle jumps those that could then cost less than `level`."""
        return [
            self.pruned(trial) if 0.0 < self.price(trial) - level < self.spare(trial, current) else trial
            for trial in trials
        ]

    def start(self, current: Refinement, score: Score) -> Start:
        """Where the fit of one more hypothesis begins."""
        hypothesis = score.hypothesis
        start = score.start[len(hypothesis.entries) :]
        effects = hypothesis.at(start, score.trial).effects
        base = current.model
        if hypothesis.kind == "step_change":
            base = self.with_room(current).model
        if hypothesis.time is not None:
            effects = tuple(self.moving(active, hypothesis.time) for active in effects)
        effects = tuple(whole(active) for active in effects)
        base = with_columns_of(base, effects).extended(hypothesis.entries)
        point = None
        if not effects and current.held_to_data == 0.0 and self.linearised is not None:
            known, linearised = self.linearised
            if known is current:
                point = replace(linearised.with_terms(hypothesis.entries), values=np.array(base.values))
        return Start(
            base,
            (*current.free, *hypothesis.entries),
            (*current.effects, *effects),
            current.states,
            current.variance,
            point,
        )

    def afresh(self, current: Refinement, shortlist: Sequence[Score], level: float) -> list[Start]:
        """Starts from the declared numbers, where what is missing is gross; `level`: a price that is reached already.

        The re-estimated ones then imitate it: from there the way to the truth may lead uphill, and scores mislead. So
        all that is far from linear is asked too, whatever its score.
        """
        if self.given is None or not self.is_gross(current) or has_disturbance(current):
            return []
        numbers = {entry: self.given.value(entry) for entry in self.declared.free if entry in self.given.entries}
        values = current.model.values.copy()
        for entry, value in numbers.items():
            values[current.model.index(entry)] = value
        untouched = replace(current, model=current.model.with_values(values))
        asked = [(s.hypothesis, s.trial) for s in shortlist if s.hypothesis.kind not in FILTERS]
        filters = [h for h in self.open_hypotheses(current) if h.kind in FILTERS]
        starts = self.profiled(untouched, filters, level)
        for hypothesis, trial in asked:
            effects = tuple(
                replace(a, values=tuple(p.trials[min(trial, len(p.trials) - 1)] for p in a.effect.parameters))
                for a in hypothesis.effects
            )
            score = Score(replace(hypothesis, effects=effects), 0.0, (0.0,) * hypothesis.parameters, 0.0, trial)
            starts.append(replace(self.start(untouched, score), states=None))
        return starts

    def profiled(self, untouched: Refinement, hypotheses: Sequence[Hypothesis], level: float) -> list[Start]:
        """Where the fit of each effect of a control begins: the likeliest of many values, all else estimated at each.

        A surface that is far behind its record is at times on the wrong side of every step, and only from a limit or a
        lag near the true one does the likelihood lead there.
        """
        starts, owners = [], []
        for hypothesis in hypotheses:
            (active,) = hypothesis.effects
            parameter = active.effect.parameters[0]
            last = min(REACH_OF_PROFILE * parameter.trials[-1], 0.99 * parameter.highest)
            for value in np.geomspace(parameter.trials[0], last, PROFILE):
                tried = replace(active, values=(float(value),))
                effects = (*untouched.effects, frozen(tried))
                starts.append(Start(untouched.model, untouched.free, effects, None, untouched.variance))
                owners.append(tried)
        if not starts:
            return []
        fits = contest(starts, self.manoeuvres, TRIAL, [self.fare(start) for start in starts], level)
        found = []
        for hypothesis in hypotheses:
            own = [n for n, tried in enumerate(owners) if tried.name == (hypothesis.kind, hypothesis.where)]
            n = min(own, key=lambda place: fits[place].cost)
            effects = (*untouched.effects, owners[n])
            found.append(Start(fits[n].model, untouched.free, effects, fits[n].states, fits[n].variance))
        return found

    def is_gross(self, current: Refinement) -> bool:
        """Whether some channel's residual is many times its noise."""
        return bool(np.any(np.sqrt(current.variance) > GROSS * np.nan_to_num(self.noise, nan=np.inf)))

    def moving(self, active: ActiveEffect, time: float) -> ActiveEffect:
        """A jump whose moment is estimated too, near `time` s."""
        manoeuvre = next(m for m in self.manoeuvres if m.name == active.log)
        interval = float(np.median(np.diff(manoeuvre.flight.time)))
        return at_moment(active, time, active.log, interval)

    def struck_out(self, current: Refinement, parts: Sequence[Part]) -> Refinement:
        """The structure without some parts, the other numbers as they were."""
        entries = [part.entry for part in parts if part.entry is not None]
        effects = [part.active for part in parts if part.active is not None]
        return replace(
            current,
            model=current.model.without(entries),
            free=tuple(entry for entry in current.free if entry not in entries),
            effects=tuple(active for active in current.effects if active not in effects),
        )

    def without(self, current: Refinement, parts: Sequence[Part]) -> Refinement:
        """The estimate with parts struck out."""
        struck = self.struck_out(current, parts)
        entries = [part.entry for part in parts if part.entry is not None]

        def fitted(point: Point | None) -> Refinement:
            return refine(
                struck.model,
                self.manoeuvres,
                struck.free,
                effects=struck.effects,
                states=struck.states,
                variance=struck.variance,
                point=point,
                settings=TRIAL,
            )

        if current.effects or current.held_to_data > 0.0:
            return fitted(None)
        # Terms alone have one likeliest set of numbers, wherever the search for it begins.
        known = self.struck.get((struck.free, struck.model.columns))
        if known is None:
            near = self.near(current).without_terms(entries)
            known = fitted(replace(near, values=np.array(struck.model.values)))
            known = known if known.converged else fitted(None)
            self.struck[struck.free, struck.model.columns] = known
        return known

    def parts(self, current: Refinement, spread: Deviations | None) -> list[Part]:
        """Everything that was added to the declared model, with deviations where they are given."""
        parts = []
        for n, entry in enumerate(current.free):
            if entry not in self.declared.free:
                error = float(spread.corrected[n]) if spread is not None else 0.0
                parts.append(Part(entry, None, current.model.value(entry), 0.0, error))
        place = 0
        for active in current.effects:
            if active.held:
                continue  # declared
            errors: tuple[float, ...] = ()
            if isinstance(active.effect, NoiseEffect):
                error = active.values[0] / np.sqrt(2.0 * self.independent_gusts(active))
            elif spread is not None:
                errors = tuple(float(number) for number in spread.effects[place : place + active.slopes])
                error = errors[0]
            else:
                error = 0.0
            parts.append(Part(None, active, active.values[0], active.effect.parameters[0].null, error, errors))
            place += active.slopes
        return parts

    def independent_gusts(self, active: ActiveEffect) -> float:
        """How many scale lengths the flights crossed: that many samples of the disturbance's size they hold."""
        length = 0.0
        for manoeuvre in self.manoeuvres:
            time, speed = manoeuvre.flight.time, float(np.nanmean(manoeuvre.flight.measured[:, 0]))
            length += float(np.ptp(time)) * speed
        return max(length / active.values[-1], 1.0)

    def certain(self, completed: Refinement) -> tuple[Refinement, Deviations]:
        """The final estimate without what its thorough deviations leave in doubt, and those deviations."""
        while True:
            spread = deviations(completed, self.manoeuvres)
            reduced = self.without_the_weakest(completed, spread)
            if reduced is None:
                return completed, spread
            completed = refine_on(reduced, self.manoeuvres)

    def pruned(self, current: Refinement) -> Refinement:
        """The estimate without those added parts that corrected deviations cannot tell from none."""
        while (reduced := self.without_the_weakest(current, self.rough_deviations(current))) is not None:
            current = reduced
        return current

    def without_the_weakest(self, current: Refinement, spread: Deviations) -> Refinement | None:
        """The estimate without the part that is most in doubt; None where none is."""
        # A disturbance is judged by the likelihood alone, where it came from.
        parts = [
            part
            for part in self.parts(current, spread)
            if part.active is None or not isinstance(part.active.effect, NoiseEffect)
        ]
        for part in sorted(parts, key=lambda part: part.ratio):
            if part.ratio >= self.critical:
                break
            reduced = self.without(current, [part])
            if not self.is_shown_as_a_whole(
                part, reduced.cost - current.cost, self.inflation(current, spread, {part.label})
            ):
                return reduced
        return None

    def is_shown_as_a_whole(self, part: Part, loss: float, inflation: float) -> bool:
        """Whether an effect that one deviation cannot judge is shown by what striking it out costs.

        The deviation of a gain counts that its reach is unknown, though without a gain there is no reach: where the two
        go together, neither is certain and their effect is. And where an effect is far from linear, the likelihood
        between none and its number is no parabola. Wilks' ratio, less what coloured residuals pretend, judges both.
        """
        if part.active is None or part.ratio == 0.0 or is_sudden(part.active):
            return False
        count = len(part.active.values)
        if count < 2 and part.active.effect.kind not in UNLIKE_THEIR_SCORE:
            return False
        return loss / inflation > float(chdtri(count, self.settings.false_alarm / max(len(self.hypotheses), 1)))

    def inflation(self, current: Refinement, spread: Deviations, labels: set[tuple[str, str, str]]) -> float:
        """By how much coloured residuals widen the variance of some parts at most, at least 1."""
        white = self.parts(current, replace(spread, corrected=spread.white, effects=spread.effects_white))
        corrected = self.parts(current, spread)
        ratios = [
            (part.std_error / plain.std_error) ** 2
            for part, plain in zip(corrected, white, strict=True)
            if part.label in labels and plain.std_error > 0.0
        ]
        return max(1.0, *ratios, 1.0)

    def exchange(self, current: Refinement) -> tuple[Refinement, tuple[Finding, ...]]:
        """Try others in the place of each found part: take a better one, list those within reach."""
        alternatives: list[Finding] = []
        done: set[tuple[str, str, str]] = set()
        for _ in range(2 * self.settings.rounds):
            groups = [group for group in self.groups(current) if group[0].label not in done]
            if not groups:
                break
            group = groups[0]
            done.add(group[0].label)
            reduced, trials = self.in_its_place(current, group)
            best = min(trials, key=self.price, default=None)
            if best is not None and self.price(best) < self.price(current) and self.stands(best, reduced):
                trials = [*(trial for trial in trials if trial is not best), current]
                current = best
                newest = {part.label for part in self.parts(best, None)} - {p.label for p in self.parts(reduced, None)}
                done |= newest
                alternatives = [other for other in alternatives if other.instead_of != named(group[0].label)]
            alternatives.extend(self.within_reach(current, reduced, trials))
        return current, tuple(alternatives)

    def alternatives(self, current: Refinement) -> tuple[Finding, ...]:
        """What could stand in the place of each found part, the estimate kept as it is."""
        found: list[Finding] = []
        for group in self.groups(current):
            found.extend(self.within_reach(current, *self.in_its_place(current, group, alike=True)))
        return tuple(found)

    def in_its_place(
        self, current: Refinement, group: Sequence[Part], *, alike: bool = False
    ) -> tuple[Refinement, list[Refinement]]:
        """The estimate without a group of parts, and with each rival that could take its place.

        `alike`: none of those that bring much the same beside the group as in its place, which are about another thing.
        """
        margin = self.margin(current, {part.label for part in group})
        if not self.has_rivals(current, group, margin):
            return current, []
        reduced = self.without(current, group)
        rivals = {score.hypothesis.label: score for score in self.rivals(reduced, group)}
        stand_ins = {score.hypothesis.label: score for score in self.stand_ins(current, group)}
        if alike:
            beside = {id(score.hypothesis): score.gain for score in self.scores(current)}
            alone = {id(score.hypothesis): score.gain for score in self.scores(reduced)}
            rivals = {
                label: score
                for label, score in rivals.items()
                if beside.get(id(score.hypothesis), 0.0) < OTHERWISE_GOOD * alone.get(id(score.hypothesis), np.inf)
            }
        # What does the same to the motion is found from where that motion is, not from the fit without it.
        struck = self.struck_out(current, group)
        further = [self.start(struck, score) for score in (*stand_ins.values(), *self.jumps_alike(group))]
        margin += RAREST
        rest = [score for label, score in rivals.items() if label not in stand_ins]
        trials = self.tried(reduced, rest, self.price(current), margin, further)
        return reduced, self.lightened(reduced, trials, self.price(current) + margin)

    def stands(self, trial: Refinement, reduced: Refinement) -> bool:
        """Whether an estimate needs all its parts, none of them a filter alone."""
        return self.pruned(trial) is trial and self.is_no_filter(trial, reduced)

    def has_rivals(self, current: Refinement, group: Sequence[Part], margin: float) -> bool:
        """Whether anything could win back nearly all that striking out a group costs.

        Terms are judged without a fit; an effect that is far from linear in its number is always worth one.
        """
        entries = [part.entry for part in group if part.entry is not None]
        if len(entries) < len(group):
            return True
        loss, scores = self.about(current).in_place_of(entries)
        # A spline follows any curve closely; it counts where it does so to the last.
        near = SURELY_APART * margin, NEARLY_ALL * loss + SURELY_APART * margin
        return any(loss - score.gain < near[score.hypothesis.searched == 0] for score in scores)

    def near(self, current: Refinement) -> Linearised:
        """The estimate to second order, with nothing beside it unless that is known already."""
        for known in (self.linearised, self.plain):
            if known is not None and known[0] is current:
                return known[1]
        self.plain = current, Linearised(current, self.manoeuvres, ())
        return self.plain[1]

    def about(self, current: Refinement) -> Linearised:
        """The estimate with all that may stand beside it, to second order; that of the last estimate is kept."""
        if self.linearised is None or self.linearised[0] is not current:
            asked = self.open_hypotheses(current)
            self.linearised = current, Linearised(self.asking(current, asked), self.manoeuvres, asked)
        return self.linearised[1]

    def stand_ins(self, current: Refinement, group: Sequence[Part]) -> list[Score]:
        """Hypotheses that do about the same to the motion as a group of parts: so the rivals of a large effect show.

        Where a large effect was struck out, the fit without it has moved so far that scores rank what follows the rest
        of the misfit, not what could take its place.
        """
        effects = [part.active for part in group if part.active is not None]
        if not effects or any(not isinstance(active.effect, OutputEffect | InputEffect) for active in effects):
            return []
        entries = [part.entry for part in group if part.entry is not None]
        loss, scores = self.about(current).in_place_of(entries, effects)
        return self.shortlist([score for score in scores if score.gain > STAND_IN_SHARE * loss])

    def rivals(self, reduced: Refinement, group: Sequence[Part]) -> list[Score]:
        """Hypotheses whose score, where a group was struck out, is not far below the group's own."""
        labels = {part.label for part in group}
        scores = self.scores(reduced)

        def is_own(hypothesis: Hypothesis) -> bool:
            alike = group[0].time and hypothesis.time and hypothesis.kind == group[0].label[0]
            return hypothesis.label in labels or bool(alike)

        own = [s.gain for s in scores if is_own(s.hypothesis)]
        others = [s for s in scores if not is_own(s.hypothesis)]
        return self.shortlist([score for score in others if score.gain > RIVAL_SHARE * max(own, default=0.0)])

    def groups(self, current: Refinement) -> list[list[Part]]:
        """The added parts, jumps at about the same moment together."""
        groups: dict[object, list[Part]] = {}
        for part in self.parts(current, None):
            if part.active is not None and isinstance(part.active.effect, NoiseEffect):
                continue
            groups.setdefault(part.label if part.time is None else round(part.time, 0), []).append(part)
        return list(groups.values())

    def within_reach(self, current: Refinement, reduced: Refinement, trials: Sequence[Refinement]) -> list[Finding]:
        """Those trials that the data hardly tell from the chosen estimate."""
        base = {part.label for part in self.parts(reduced, None)}
        chosen = [part.label for part in self.parts(current, None) if part.label not in base]
        if not chosen:
            return []
        margin = self.margin(current, set(chosen))
        base.update(chosen)
        found: list[Finding] = []
        for trial in trials:
            # What is rarer loses a tie, and is as much within reach as before.
            loss = self.price(trial) - self.rareness(trial) - self.price(current) + self.rareness(current)
            if loss < margin:
                spread = self.rough_deviations(trial)
                others = [part for part in self.parts(trial, spread) if part.label not in base and part.ratio > 2.0]
                place = named(chosen[0])
                found.extend(replace(self.finding(part, -loss, place), fit=trial) for part in others)
        return found

    def margin(self, current: Refinement, labels: set[tuple[str, str, str]]) -> float:
        """Difference in price that decides nothing: wider where coloured residuals widen these parts' variance."""
        return self.settings.reach * self.inflation(current, self.rough_deviations(current), labels)

    def rough_deviations(self, current: Refinement) -> Deviations:
        """Deviations good enough for a search; those of the last estimate are kept."""
        if self.rough is None or self.rough[0] is not current:
            self.rough = current, deviations(current, self.manoeuvres, quick=True)
        return self.rough[1]

    def finding(self, part: Part, gain: float, instead_of: str = "") -> Finding:
        """A part with its evidence."""
        kind, where, term = part.label
        unit = part.active.effect.parameters[0].unit if part.active is not None else "1"
        p_value = float(min(1.0, 2.0 * ndtr(-part.ratio) * len(self.hypotheses)))
        return Finding(
            kind=kind,
            where=where,
            term=term,
            entry=part.entry,
            value=part.value,
            std_error=part.std_error,
            unit=unit,
            time=part.time,
            p_value=p_value,
            gain=gain,
            instead_of=instead_of,
            parameters=part.parameters,
        )

    def findings(self, completed: Refinement, spread: Deviations) -> tuple[Finding, ...]:
        """The found parts, most certain first."""
        rows = []
        for part in self.parts(completed, spread):
            gain = self.without(completed, [part]).cost - completed.cost
            row = self.finding(part, gain)
            if part.active is not None:
                disturbance = isinstance(part.active.effect, NoiseEffect)
                inflation = 1.0 if disturbance else self.inflation(completed, spread, {part.label})
                if disturbance or self.is_shown_as_a_whole(part, gain, inflation):
                    # A spread has no sign to be tested against zero: the likelihood ratio speaks.
                    count = 1 if disturbance else len(part.active.values)
                    p_value = float(min(1.0, chdtrc(count, max(gain, 0.0) / inflation) * len(self.hypotheses)))
                    row = replace(row, p_value=p_value if disturbance else min(p_value, row.p_value))
            rows.append(row)
        return tuple(sorted(rows, key=lambda row: -row.gain))


def is_curve(part: Part) -> bool:
    """Whether a part is a term in which the angle of attack is bent."""
    if part.entry is None:
        return False
    return any(factor.variable == "alpha" and str(factor) != "alpha" for factor in part.entry[1].factors)
