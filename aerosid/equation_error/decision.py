"""What the declared model lacks, by kinematics first and coefficients second, with all recordings in one likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid.effects import ActiveEffect, StateEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.sudden import is_sudden
from aerosid.equation_error.candidates import of_sensors, position_hypotheses
from aerosid.equation_error.channels import EQUATIONS, KINEMATIC
from aerosid.equation_error.estimate import Estimate, Frame, estimate
from aerosid.equation_error.points import Point
from aerosid.equation_error.recording import read_recordings
from aerosid.equation_error.selection import Rules, Selected, forward, kinematic_gain, rules_for, total_price, with_separation
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry

TAUTOLOGICAL = frozenset({"C_X", "C_Z", "C_L", "C_D"})
"""Coefficients in which a term of alphadot says no more than a_z = V (alphadot - q), whatever the aerodynamics."""


def askable(hypothesis: Hypothesis) -> bool:
    """Whether the equations can judge a hypothesis."""
    if hypothesis.time is not None:
        return False
    return not any(c in TAUTOLOGICAL and "alpha_dot_hat" in term.variables for c, term in hypothesis.entries)


def decide(
    model: AerodynamicModel,
    free: Sequence[Entry],
    given: Sequence[ActiveEffect],
    hypotheses: Sequence[Hypothesis],
    coefficients: Sequence[str],
    identification: Sequence[Manoeuvre],
    validation: Sequence[Manoeuvre] = (),
    settings: EquationErrorSettings = EquationErrorSettings(),
    told: Callable[[str], None] = lambda _text: None,
) -> Selected:
    recordings = read_recordings(identification, validation, settings)
    channels = [name for name in dict.fromkeys(c for r in recordings for c in r.channels)]
    asked = [h for h in (*hypotheses, *position_hypotheses(channels)) if askable(h)]
    sensors = [h for h in asked if of_sensors(h) and h.where != "q_dot"]
    others = [h for h in asked if not of_sensors(h)]
    start = Point(model, tuple(free), tuple(given))
    frame = Frame(recordings, KINEMATIC, settings)
    base = estimate(frame, start)
    told(f"kinematics: {len(sensors)} asked, {base.design.target.size} rows")
    rules = rules_for(asked, base.design.target.size, settings.false_alarm, settings.factor_odds)
    first = forward(Selected(base, ()), frame, rules, sensors, kinematic=True, told=told)
    whole = Frame(recordings, EQUATIONS, settings, all_fitted=settings.joint)
    full = estimate(whole, first.estimate.point)
    told(f"coefficients: {len(others)} asked, {full.design.target.size} rows")
    rules = rules_for(asked, full.design.target.size, settings.false_alarm, settings.factor_odds)
    begun = Selected(full, first.chosen)
    found = forward(begun, whole, rules, others, kinematic=False, coefficients=coefficients, told=told)
    separated = with_separation(begun, whole, rules, coefficients, told)
    if separated is not None:
        told("separation first")
        separated = forward(separated, whole, rules, others, kinematic=False, coefficients=coefficients, told=told)
        if worth(separated, rules) > worth(found, rules):
            found = separated
    return found


def worth(selected: Selected, rules: Rules) -> float:
    """ln L less the price of all that entered."""
    return selected.estimate.log_likelihood - total_price(rules, selected.chosen)


__all__ = ["Estimate", "StateEffect", "decide", "is_sudden", "kinematic_gain", "np", "replace"]
