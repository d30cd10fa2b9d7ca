"""Constants of one record: trim, centre of gravity and instrument biases differ between records of one flight.

Not a finding: where several records are estimated together each has constants of its own, as each has an initial state.
"""

from __future__ import annotations

from aerosid.effects.kinds import EffectParameter, InputEffect
from aerosid.effects.step_change import offset_column


def record_constant(coefficient: str) -> InputEffect:
    """Addition of `constant` to the coefficient throughout the record that the effect belongs to."""
    return InputEffect(
        "record_constant",
        coefficient,
        (EffectParameter("constant", "1", trials=(0.0,), lowest=-1.0, highest=1.0, step=1e-4),),
        lambda _time, values, p: values + p[0],
        lambda _p, _interval: (1.0, 0.0),
        "trim differs between manoeuvres: Jategaonkar, Flight Vehicle System Identification, section 5.10",
        column=offset_column(coefficient),
    )
