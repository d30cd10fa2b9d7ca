"""The declared model of an aircraft of JSBSim: linear about its trim, as in a handbook."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

from aerosid.aircraft import Aircraft
from aerosid.aircraft.reading import aircraft_from_text
from aerosid.flight_model.axes import LATERAL, LONGITUDINAL
from aerosid.studies.jsbsim.derivatives import COEFFICIENTS, LATERAL_COEFFICIENTS, LATERAL_VARIABLES, VARIABLES

_DECLARED = {"C_X": ("alpha", "delta_e"), "C_Z": ("alpha", "q_hat", "delta_e"), "C_m": ("alpha", "q_hat", "delta_e")}


def declared_aircraft(
    title: str, name: str, answer: Mapping[str, Any], version: str, planes: Sequence[str] = (LONGITUDINAL.name,)
) -> Aircraft:
    """The aircraft file of the linear model.

    The derivatives are those of JSBSim at the trim with alphadot self-consistent: a model without alphadot has no
    others. q_hat refers to the current airspeed, as in JSBSim.

    Parameters
    ----------
    title, name : str
        Title of the aircraft, and its name in JSBSim.
    answer : mapping
        The worker's: trim, slopes, mass, I_yy, wing_area, mean_chord; also span and the other inertias where it flew in
        all axes.
    version : str
        Version of JSBSim.
    planes : sequence of str
        Names of the planes of motion in the file, as far as the worker's results contain them.
    """
    sideways = LATERAL.name in planes and "sideways" in answer
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
        *([f"span = {_number(answer['span'], 10)}  # m"] if sideways else []),
        "",
        "[mass]",
        f"mass = {_number(answer['mass'], 10)}  # kg",
        f"I_yy = {_number(answer['I_yy'], 10)}  # kg m^2",
        *([f"{key} = {_number(answer[key], 10)}" for key in ("I_xx", "I_zz", "I_xz")] if sideways else []),
        "",
        "[thrust]",
        f"force = {_number(trim['thrust'], 10)}  # N",
    ]
    for i, coefficient in enumerate(COEFFICIENTS if LONGITUDINAL.name in planes or not sideways else ()):
        constant = answer["slopes"]["at"][0][i]
        rows = []
        for variable in _DECLARED[coefficient]:
            value = slopes[i][VARIABLES.index(variable)]
            constant -= value * trim.get(variable, 0.0)  # level flight has no q
            rows.append(f'"{variable}" = {{ value = {_number(value)} }}')
        lines += ["", f"[derivatives.{coefficient}]", f'"1" = {{ value = {_number(constant)} }}', *rows]
    if sideways:
        lines += _sideways(answer["sideways"], trim)
    text = "\n".join(lines) + "\n"
    return aircraft_from_text(text, f"{name}.aircraft.toml", hashlib.sha256(text.encode()).hexdigest())


def _sideways(slopes: Mapping[str, Any], trim: Mapping[str, float]) -> list[str]:
    """The tables of the lateral coefficients; level flight has no roll and yaw rate."""
    lines = []
    for i, coefficient in enumerate(LATERAL_COEFFICIENTS):
        own = dict(zip(LATERAL_VARIABLES, slopes["local"][i], strict=True))
        constant = slopes["at"][0][i] - sum(slope * trim.get(name, 0.0) for name, slope in own.items())
        lines += ["", f"[derivatives.{coefficient}]", f'"1" = {{ value = {_number(constant)} }}']
        lines += [f'"{name}" = {{ value = {_number(slope)} }}' for name, slope in own.items()]
    return lines


def _number(value: float, digits: int = 6) -> str:
    """Six digits: more than differences resolve; a sum that cancels is zero."""
    return repr(float(f"{value:.{digits}g}") if abs(value) > 1e-9 else 0.0)


def _plain(text: str) -> str:
    """The text without characters that would end a string of TOML."""
    return "".join(character if character.isprintable() and character not in '"\\' else " " for character in text)
