"""Hypotheses whose inner numbers are searched for before they are asked: sudden changes, flow separation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.effects.cg_shift import cg_shift_step
from aerosid.effects.flow_separation import flow_separation
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.step_change import step_change
from aerosid.effects.thrust import thrust_change
from aerosid.equation_error.equations.channels import COEFFICIENT
from aerosid.equation_error.equations.instruments import CONTROLS
from aerosid.equation_error.equations.recording import Recording
from aerosid.equation_error.regression.design import design_of, regress
from aerosid.equation_error.regression.estimate import Estimate, Frame, effect_columns
from aerosid.equation_error.selection.candidates import joined
from aerosid.equation_error.selection.jump_gains import jump_gains

Array = NDArray[np.float64]

MAINLY = {name: name for name in COEFFICIENT} | {"C_D": "C_X", "C_L": "C_Z"}
"""The body-axis equation in which a coefficient's sudden change shows most."""

EDGE = 4
"""Numerical: samples in the band at either end of a record in which nothing sudden is looked for."""

RISES = (1.0, 3.0)
"""Numerical: s; a sudden change is tried at once and over these times: a flap or an engine takes them."""

STAR_SHARES = (0.6, 0.75, 0.9, 1.0)
"""Numerical: where separation is tried to begin, shares, 1, of the highest angle of attack; and a little beyond
it."""

BEYOND = 0.03
"""Numerical: rad; by how much separation is tried to begin beyond the highest angle of attack: it still bends the
lift."""

SHARPNESS = (12.0, 25.0)
"""Numerical: 1/rad; of the static curve of separation that is tried: slender and thick sections."""

LAGS = ((0.1, 0.1), (0.4, 0.4))
"""Numerical: s; delay and relaxation that are tried: a few and some twenty chords over the airspeed."""


def sudden_hypotheses(
    frame: Frame, base: Estimate, coefficients: Sequence[str], recording_name: str | None = None
) -> list[Hypothesis]:
    """A step of each coefficient on each fitted recording, at the instant that the whitened residuals favour most.

    `recording_name`: on that recording alone, fitted or not.
    """
    found: list[Hypothesis] = []
    for n, recording in enumerate(frame.recordings):
        if not (recording.fitted if recording_name is None else recording.name == recording_name):
            continue
        for coefficient in coefficients:
            for rise in (recording.interval, *RISES):
                moment = _likeliest_instant(base, recording, n, MAINLY[coefficient], rise)
                if moment is None:
                    continue
                slow = rise > recording.interval
                found.append(_at(step_change(coefficient, moment, rise), moment, recording.name, slow=slow))
                if MAINLY[coefficient] == "C_X":
                    found.append(_at(thrust_change(moment, rise), moment, recording.name, slow=slow))
                elif coefficient == "C_m":
                    found.append(_at(cg_shift_step("x", moment, rise), moment, recording.name, slow=slow))
                elif coefficient == "C_l" and "w" in recording.manoeuvre.axes.integrated:
                    found.append(_at(cg_shift_step("y", moment, rise), moment, recording.name, slow=slow))
    return found


def _at(effect: InputEffect, moment: float, log: str, *, slow: bool) -> Hypothesis:
    """A sudden change as a hypothesis; of a slow one the rise was chosen from the flight too, which `time` counts."""
    active = ActiveEffect(effect, (effect.parameters[0].null, moment), log)
    return Hypothesis(effect.kind, effect.where, effects=(active,), time=moment if slow else None)


def _likeliest_instant(base: Estimate, recording: Recording, place: int, equation: str, rise: float) -> float | None:
    """When a jump of one equation's residual would gain most, s."""
    if (place, equation) not in base.design.segments:
        return None
    s = base.design.segments.index((place, equation))
    rows = base.design.rows(s)
    samples = rows.stop - rows.start
    if samples < 4 * EDGE:
        return None
    at = recording.time_in_band
    step = float(at[1] - at[0])
    weights, solution = base.solution.weights, base.solution
    gain = jump_gains(
        solution.whitened[rows],
        solution.slopes[rows],
        solution.covariance,
        weights.colours[s],
        max(rise / step, 1.0),
        np.arange(EDGE, samples - EDGE),
    )
    return float(at[EDGE + int(np.argmax(gain))])


def may_separate(frame: Frame) -> bool:
    """Whether alpha spans enough on a fitted recording to show flow separation."""
    return any(
        float(np.ptp(r.channels["alpha"])) >= frame.settings.separation_range
        for r in frame.recordings
        if r.fitted and "alpha" in r.channels
    )


def of_controls(hypothesis: Hypothesis) -> bool:
    """Whether a hypothesis is the plain effect of a recorded control or of thrust on a coefficient."""
    if len(hypothesis.entries) != 1 or hypothesis.effects:
        return False
    factors = hypothesis.entries[0][1].factors
    return len(factors) == 1 and factors[0].power == 1 and factors[0].variable.startswith((*CONTROLS, "C_T"))


def separation_hypotheses(frame: Frame, base: Estimate, coefficients: Sequence[str]) -> list[Hypothesis]:
    """Flow separation from several starts, the likeliest first; none where alpha spans too little to show any."""
    symmetric = [name for name in coefficients if is_symmetric(name)]
    if not symmetric or not may_separate(frame):
        return []
    alphas = [r.channels["alpha"] for r in frame.recordings if r.fitted]
    drag, lift, moment = symmetric
    highest = max(float(np.max(alpha)) for alpha in alphas)
    effect = flow_separation(highest, lift, (drag, moment))
    ranked = []
    for star in (*(share * highest for share in STAR_SHARES), highest + BEYOND):
        for sharpness in SHARPNESS:
            for delay, relaxation in LAGS:
                active = ActiveEffect(effect, (star, sharpness, delay, relaxation, 0.0, 0.0))
                hypothesis = Hypothesis("flow_separation", lift, effects=(active,))
                ranked.append((*_gain(frame, base, hypothesis), hypothesis))
    ranked.sort(key=lambda row: -row[0])
    return [
        replace(h, effects=(replace(h.effects[0], values=(*h.effects[0].values[:4], *map(float, rest))),))
        for _, rest, h in ranked[:2]
    ]


def within_strengths(active: ActiveEffect) -> bool:
    """Whether no number that may have either sign lies at one of its limits: there it stands for something else."""
    return all(
        not p.lowest < p.null < p.highest or p.lowest < value < p.highest
        for p, value in zip(active.effect.parameters, active.values, strict=True)
    )


def _gain(frame: Frame, base: Estimate, hypothesis: Hypothesis) -> tuple[float, Array]:
    """Ln L with separation at its start values, its shares of the other coefficients regressed with the terms."""
    point = joined(base.point, hypothesis)
    place = len(point.effects) - 1
    design = design_of(frame.segments(point), frame.settings)
    known = {unknown: _known(base, unknown) for unknown in design.unknowns}
    columns = effect_columns(frame, known, point, [(place, 4), (place, 5)])
    wide = design.beside(columns, [("effect", place, 4), ("effect", place, 5)])
    found = regress(wide, frame.settings, base.solution.weights, 2)
    return found.log_likelihood, found.values[-2:]


def _known(base: Estimate, unknown: tuple[object, ...]) -> float:
    if unknown in base.design.unknowns:
        return float(base.solution.values[base.design.unknowns.index(unknown)])
    return 0.0
