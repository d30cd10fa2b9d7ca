"""The declared model of an aircraft of JSBSim: linear about its trim, as a handbook would give it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.studies.jsbsim.derivatives import COEFFICIENTS, VARIABLES

_DECLARED = {"C_X": ("alpha", "delta_e"), "C_Z": ("alpha", "q_hat", "delta_e"), "C_m": ("alpha", "q_hat", "delta_e")}


def declared_aircraft(title: str, name: str, answer: Mapping[str, Any], version: str) -> Aircraft:
    """The aircraft file of the linear model.

    The derivatives are those of JSBSim at the trim with alphadot self-consistent: a model without alphadot knows no
    other. q_hat refers to the current airspeed, as in JSBSim.

    Parameters
    ----------
    title, name : str
        What the aircraft calls itself, and JSBSim's name for it.
    answer : mapping
        The worker's: trim, slopes, mass, I_yy, wing_area, mean_chord.
    version : str
        JSBSim's.
    """
    slopes, trim = answer["slopes"]["self_consistent"], answer["trim"]
    lines = [
        "schema = 1",
        "",
        "[aircraft]",
        f'name = "{_plain(title)}"',
        f'source = "linear about level flight of {_plain(name)} in JSBSim {_plain(version)}, by differences"',
        "",
        "[reference]",
        f"wing_area = {_number(answer['wing_area'], 10)}  # m^2",
        f"mean_chord = {_number(answer['mean_chord'], 10)}  # m",
        "",
        "[mass]",
        f"mass = {_number(answer['mass'], 10)}  # kg",
        f"I_yy = {_number(answer['I_yy'], 10)}  # kg m^2",
        "",
        "[thrust]",
        f"force = {_number(trim['thrust'], 10)}  # N",
    ]
    for i, coefficient in enumerate(COEFFICIENTS):
        constant = answer["slopes"]["at"][0][i]
        rows = []
        for variable in _DECLARED[coefficient]:
            value = slopes[i][VARIABLES.index(variable)]
            constant -= value * trim.get(variable, 0.0)  # level flight has no q
            rows.append(f'"{variable}" = {{ value = {_number(value)} }}')
        lines += ["", f"[derivatives.{coefficient}]", f'"1" = {{ value = {_number(constant)} }}', *rows]
    text = "\n".join(lines) + "\n"
    return aircraft_from_text(text, f"{name}.aircraft.toml", hashlib.sha256(text.encode()).hexdigest())


def _number(value: float, digits: int = 6) -> str:
    """Six digits: more than differences hold; a sum that cancels to nothing is nothing."""
    return repr(float(f"{value:.{digits}g}") if abs(value) > 1e-9 else 0.0)


def _plain(text: str) -> str:
    """The text without what would end a string of TOML."""
    return "".join(character if character.isprintable() and character not in '"\\' else " " for character in text)
