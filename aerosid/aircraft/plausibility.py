"""Plausibility of an aircraft file: legal numbers that are unlike an aircraft."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from aerosid.aircraft.effect_values import made_effect
from aerosid.aircraft.model import Aircraft
from aerosid.effects import InputEffect
from aerosid.errors import AircraftError, EstimationError

_RANGES: tuple[tuple[str, float, float, str], ...] = (
    ("wing_area", 0.05, 1000.0, "m^2"),
    ("mean_chord", 0.03, 20.0, "m"),
    ("airspeed", 5.0, 1000.0, "m/s"),
    ("mass", 0.1, 700_000.0, "kg"),
    ("I_yy", 1e-3, 1e8, "kg m^2"),
    ("density", 0.01, 1.5, "kg/m^3"),
)

# Signs that hold for nearly every aircraft in the body axes of the glossary; a wrong one is mostly a sign convention.
_SIGNS: tuple[tuple[str, str, int, str], ...] = (
    ("C_m", "q_hat", -1, "pitch damping is negative; is the moment positive nose up?"),
    (
        "C_m",
        "delta_e",
        -1,
        "positive elevator is trailing edge down; a recorder of the other sign needs sign = -1 in the map",
    ),
    ("C_m", "alpha", -1, "the aircraft is statically unstable; is the centre of gravity right?"),
    ("C_Z", "delta_e", -1, "C_Z is positive down, and an elevator trailing edge down adds lift"),
    ("C_L", "delta_e", 1, "an elevator trailing edge down adds lift"),
    ("C_Z", "alpha", -1, "C_Z is positive down, so lift makes it fall with alpha"),
    ("C_L", "alpha", 1, "lift grows with alpha"),
    ("C_D", "1", 1, "drag is positive"),
    ("C_X", "1", -1, "C_X is positive forward, so drag makes it negative"),
)


def unusual_numbers(aircraft: Aircraft) -> tuple[str, ...]:
    """One sentence for each dimension, mass or inertia, and each ratio of them, that no aircraft has."""
    warnings = []
    for name, low, high, unit in _RANGES:
        number = getattr(aircraft, name)
        if number is not None and not low <= number <= high:
            warnings.append(f"{name} = {number:g} {unit} is unusual (mostly {low:g} to {high:g}); is the unit right?")
    return (*warnings, *_unusual_ratios(aircraft))


@contextmanager
def blamed_on_unusual_numbers(aircraft: Aircraft) -> Iterator[None]:
    """Within it, an estimation that breaks down says which numbers of the aircraft file may be the reason."""
    try:
        yield
    except EstimationError as error:
        if not (unusual := unusual_numbers(aircraft)):
            raise
        raise EstimationError(f"{error} In the aircraft file {' '.join(unusual)}") from error


def warnings_about(aircraft: Aircraft) -> tuple[str, ...]:
    """One sentence for each number of the file that a person should look at again."""
    warnings = [*unusual_numbers(aircraft)]
    values = {(entry.coefficient, str(entry.term)): entry.value for entry in aircraft.derivatives}
    for coefficient, term, sign, reason in _SIGNS:
        value = values.get((coefficient, term), 0.0)
        if value * sign < 0.0:
            warnings.append(f"{coefficient} {term} = {value:g} has an unusual sign: {reason}")
    damping = abs(values.get(("C_m", "q_hat"), -20.0))
    if not 3.0 <= damping <= 100.0:
        warnings.append(
            f"C_m q_hat is {damping:g} in size, mostly 3 to 100; "
            "q_hat is q c/(2 U0), a value per q c/V is to be doubled"
        )
    return (*warnings, *_impossible_effects(aircraft), *_left_to_the_log(aircraft))


USUAL_INTERVAL = 0.02
"""Numerical: sampling interval, s, for which declared effects are checked without a log; their limits do not depend on
it."""


def _impossible_effects(aircraft: Aircraft) -> list[str]:
    """What no aircraft shows among the declared effects: close-loop refuses them."""
    found = []
    used = aircraft.variables
    for number, effect in enumerate(aircraft.effects, start=1):
        key = f"effects[{number}] ({effect.kind})"
        try:
            made, _ = made_effect(effect, key, USUAL_INTERVAL)
        except AircraftError as error:
            found.append(f"{error}; close-loop refuses the file as it is")
            continue
        if isinstance(made, InputEffect) and not made.column and made.where not in used:
            found.append(
                f"{key} acts on {made.where}, which no declared term uses; add a term in {made.where} or strike the "
                "effect; close-loop refuses the file as it is"
            )
    return found


def _unusual_ratios(aircraft: Aircraft) -> list[str]:
    """Ratios that a wrong unit in one number gives away."""
    ratios = (
        ("wing loading mass/wing_area", aircraft.mass / aircraft.wing_area, 3.0, 1000.0, "kg/m^2"),
        ("aspect ratio wing_area/mean_chord^2", aircraft.wing_area / aircraft.mean_chord**2, 1.0, 40.0, ""),
        ("I_yy/(mass mean_chord^2)", aircraft.I_yy / (aircraft.mass * aircraft.mean_chord**2), 0.1, 12.0, ""),
    )
    return [
        f"{name} = {ratio:.3g} {unit}".rstrip() + f" is unusual (mostly {low:g} to {high:g}); are the units right?"
        for name, ratio, low, high, unit in ratios
        if not low <= ratio <= high
    ]


def _left_to_the_log(aircraft: Aircraft) -> list[str]:
    """What the file does not give and every log must."""
    notes = []
    if aircraft.density is None:
        notes.append("air.density is not given: every log needs rho or q_bar")
    if aircraft.thrust is None:
        notes.append("thrust.force is not given: without a thrust channel in the log the thrust counts as zero")
    return notes
