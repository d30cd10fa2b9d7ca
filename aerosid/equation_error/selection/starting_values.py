"""Starting values of hypotheses with nonlinear parameters: instants of step changes, flow separation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect
from aerosid.effects.aerodynamic_terms import is_symmetric, searched_parameters
from aerosid.effects.cg_shift import cg_shift_step
from aerosid.effects.flow_separation import flow_separation, longest_separation
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_change import step_change
from aerosid.effects.step_input import instant_of, is_step_change, rise_of, step_changes_on
from aerosid.effects.thrust import thrust_change
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.instrumental_variables import is_control
from aerosid.equation_error.equations.points import Point
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.design import design_of
from aerosid.equation_error.regression.estimate import Estimate, effect_sensitivities
from aerosid.equation_error.regression.least_squares import regress
from aerosid.equation_error.regression.problem import RegressionProblem
from aerosid.equation_error.selection.candidates import with_hypothesis
from aerosid.equation_error.selection.step_change_scores import step_change_scores

Array = NDArray[np.float64]

MAINLY = {name: name for name in COEFFICIENT} | {"C_D": "C_X", "C_L": "C_Z"}
"""The body-axis equation in which a step change of a coefficient has its largest effect."""

EDGE = 4
"""Numerical: samples in the band at either end of a record in which no step change is searched for."""

RISES = (1.0, 3.0)
"""Numerical: s; rise times tried in addition to an instantaneous step: those of a flap or an engine."""

STAR_SHARES = (0.6, 0.75, 0.9, 1.0)
"""Numerical: trial values of the onset of separation as fractions, 1, of the highest angle of attack; and one slightly
beyond it."""

BEYOND = 0.03
"""Numerical: rad; trial onset of separation beyond the highest angle of attack: it still reduces the lift slope."""

SHARPNESS = (12.0, 25.0)
"""Numerical: 1/rad; trial values of the static separation curve's steepness: slender and thick sections."""

LAGS = ((0.1, 0.1), (0.4, 0.4))
"""Numerical: s; trial values of delay and relaxation: a few and some twenty chords over the airspeed."""


def step_change_hypotheses(
    problem: RegressionProblem, base: Estimate, coefficients: Sequence[str], recording_name: str | None = None
) -> list[Hypothesis]:
    """A step of each coefficient on each identification record, at the instant of highest score.

    And at the instants of the steps that are known: a change of the configuration acts on all coefficients at once. One
    coefficient may change several times (gear, then flaps), and on several records.
    `recording_name`: on that record alone, whether identification or validation.
    """
    found: list[Hypothesis] = []
    for n, recording in enumerate(problem.recordings):
        if not (recording.fitted if recording_name is None else recording.name == recording_name):
            continue
        steps = step_changes_on(base.point.effects, recording.name)
        for coefficient in coefficients:
            known = [
                (instant_of(each), max(rise_of(each), recording.interval))
                for each in steps
                if each.effect.where != coefficient
            ]
            scored = [
                (moment, rise)
                for rise in (recording.interval, *RISES)
                if (moment := _likeliest_instant(base, recording, n, MAINLY[coefficient], rise)) is not None
                and not any(abs(moment - instant) <= rise == of_known for instant, of_known in known)
            ]
            found.extend(
                _at(effect, moment, recording, base.point)
                for moment, rise in (*scored, *dict.fromkeys(known))
                for effect in _step_changes(coefficient, recording, moment, rise)
                if not any(_is_same_event(effect, moment, rise, each) for each in steps)
            )
    return found


def _is_same_event(effect: InputEffect, moment: float, rise: float, known: ActiveEffect) -> bool:
    """Whether a step change is one that is known: of the same kind and place, and hardly later than a slow one lasts.

    Two that follow one another faster model the form of one change, or a transient: a stall, a gust.
    """
    apart = abs(moment - instant_of(known))
    return known.name == (effect.kind, effect.where) and apart <= rise + rise_of(known) + max(RISES)


def _step_changes(coefficient: str, recording: Recording, moment: float, rise: float) -> list[InputEffect]:
    """The step changes at an instant that act on one coefficient: of itself, of thrust, of the centre of gravity."""
    effects = [step_change(coefficient, moment, rise)]
    if MAINLY[coefficient] == "C_X":
        effects.append(thrust_change(moment, rise))
    elif coefficient == "C_m":
        effects.append(cg_shift_step("x", moment, rise))
    elif coefficient == "C_l" and "w" in recording.manoeuvre.axes.integrated:
        effects.append(cg_shift_step("y", moment, rise))
    return effects


def step_changes_in_place_of(reduced: Estimate, removed: Hypothesis, coefficients: Sequence[str]) -> list[Hypothesis]:
    """Step changes that may replace a hypothesis; `reduced`: the estimate without it.

    Of a step change, those of all coefficients at its instant and with its rise. Of a constant shift of the centre of
    gravity those of the moments at their likeliest instants: it multiplies the steps of the forces.
    """
    if len(removed.effects) != 1:
        return []
    (active,) = removed.effects
    problem = reduced.problem
    if not is_step_change(active):
        moments = [name for name in coefficients if name in ("C_m", "C_l")]
        return step_change_hypotheses(problem, reduced, moments) if active.effect.kind == "cg_shift" else []
    moment, rise = instant_of(active), rise_of(active)
    recording = next(each for each in problem.recordings if each.name == active.log)
    steps = [active, *step_changes_on(reduced.point.effects, active.log)]
    return [
        _at(effect, moment, recording, reduced.point)
        for coefficient in coefficients
        for effect in _step_changes(coefficient, recording, moment, rise)
        if not any(_is_same_event(effect, moment, rise, each) for each in steps)
    ]


def _at(effect: InputEffect, moment: float, recording: Recording, point: Point) -> Hypothesis:
    """A step change as a hypothesis, with the first ordinal that no other of its kind and place has."""
    name = effect.kind, effect.where
    taken = {each.ordinal for each in point.effects if each.name == name}
    numbered = replace(effect, ordinal=next(n for n in range(1, len(taken) + 2) if n not in taken))
    active = ActiveEffect(numbered, (effect.parameters[0].null, moment), recording.name)
    repetition = sum(each.name == name for each in step_changes_on(point.effects, recording.name))
    return as_hypothesis(active, recording.interval, repetition)


def as_hypothesis(active: ActiveEffect, interval: float, repetition: int) -> Hypothesis:
    """A step change as a hypothesis, after so many of its kind and place on its record.

    The rise time of one that takes longer than a sampling `interval`, s, is estimated too, which `time` counts.
    """
    time = instant_of(active) if rise_of(active) > interval else None
    return Hypothesis(*active.name, effects=(active,), time=time, repetition=repetition)


def _likeliest_instant(base: Estimate, recording: Recording, index: int, equation: str, rise: float) -> float | None:
    """Instant, s, at which a step of one equation's residual has the highest score."""
    if (index, equation) not in base.design.segments:
        return None
    s = base.design.segments.index((index, equation))
    rows = base.design.rows(s)
    samples = rows.stop - rows.start
    if samples < 4 * EDGE:
        return None
    at = recording.time_in_band
    step = float(at[1] - at[0])
    weights, solution = base.solution.weights, base.solution
    gain = step_change_scores(
        solution.whitened[rows],
        solution.slopes[rows],
        solution.covariance,
        weights.colours[s],
        max(rise / step, 1.0),
        np.arange(EDGE, samples - EDGE),
    )
    return float(at[EDGE + int(np.argmax(gain))])


def shows_separation(problem: RegressionProblem) -> bool:
    """Whether the range of alpha of an identification record suffices to show flow separation."""
    return any(
        float(np.ptp(r.channels["alpha"])) >= problem.settings.separation_range
        for r in problem.recordings
        if r.fitted and "alpha" in r.channels
    )


def is_control_term(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is the linear effect of a recorded control or of thrust on a coefficient."""
    if len(hypothesis.entries) != 1 or hypothesis.effects:
        return False
    factors = hypothesis.entries[0][1].factors
    if len(factors) != 1 or factors[0].power != 1:
        return False
    return is_control(factors[0].variable) or factors[0].variable.startswith("C_T")


def may_replace_separation(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is a nonlinear term of the angle of attack, several of which may take a stall's place."""
    return any(
        ("alpha" in term.variables and sum(factor.power for factor in term.factors) > 1) or searched_parameters(term)
        for _, term in hypothesis.entries
    )


def separation_hypotheses(problem: RegressionProblem, base: Estimate, coefficients: Sequence[str]) -> list[Hypothesis]:
    """Flow separation from several starting values, the likeliest first; none where the range of alpha is too small."""
    symmetric = [name for name in coefficients if is_symmetric(name)]
    if not symmetric or not shows_separation(problem):
        return []
    alphas = [r.channels["alpha"] for r in problem.recordings if r.fitted]
    drag, lift, moment = symmetric
    highest = max(float(np.max(alpha)) for alpha in alphas)
    airspeeds = [r.manoeuvre.mean_airspeed for r in problem.recordings if r.fitted]
    longest = longest_separation(base.point.model.constants.mean_chord, airspeeds)
    effect = flow_separation(highest, lift, (drag, moment), longest)
    ranked = []
    for star in (*(share * highest for share in STAR_SHARES), highest + BEYOND):
        for sharpness in SHARPNESS:
            for delay, relaxation in LAGS:
                active = ActiveEffect(effect, (star, sharpness, delay, relaxation, 0.0, 0.0))
                hypothesis = Hypothesis("flow_separation", lift, effects=(active,))
                ranked.append((*_gain(problem, base, hypothesis), hypothesis))
    ranked.sort(key=lambda row: -row[0])
    return [
        replace(h, effects=(replace(h.effects[0], values=(*h.effects[0].values[:4], *map(float, rest))),))
        for _, rest, h in ranked[:2]
    ]


def is_within_signed_limits(active: ActiveEffect) -> bool:
    """Whether no parameter of either sign lies at one of its limits, where it would model something else."""
    return all(
        not p.lowest < p.null < p.highest or p.lowest < value < p.highest
        for p, value in zip(active.effect.parameters, active.values, strict=True)
    )


def _gain(problem: RegressionProblem, base: Estimate, hypothesis: Hypothesis) -> tuple[float, Array]:
    """Ln L with separation at its starting values, its fractions in other coefficients regressed with the terms."""
    point = with_hypothesis(base.point, hypothesis)
    index = len(point.effects) - 1
    design = design_of(problem.segments(point), problem.settings)
    known = {unknown: _value_of(base, unknown) for unknown in design.unknowns}
    columns = effect_sensitivities(problem, known, point, [(index, 4), (index, 5)])
    wide = design.extended(columns, [("effect", index, 4), ("effect", index, 5)])
    found = regress(wide, problem.settings, base.solution.weights, 2)
    return found.log_likelihood, found.values[-2:]


def _value_of(base: Estimate, unknown: tuple[object, ...]) -> float:
    if unknown in base.design.unknowns:
        return float(base.solution.values[base.design.unknowns.index(unknown)])
    return 0.0
