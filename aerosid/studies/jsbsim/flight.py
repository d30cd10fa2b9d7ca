"""Flight by JSBSim: its configurations, the run, the log, the declared aircraft and its true parameters."""

from __future__ import annotations

import importlib.metadata
import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.errors import AircraftError, UsageError
from aerosid.flight_model.axes import LONGITUDINAL, SIX
from aerosid.logs.standard_atmosphere import GAS_CONSTANT, pressure, temperature
from aerosid.reporting.export.jsbsim_functions import References
from aerosid.reporting.export.jsbsim_units import FOOT, SLUG
from aerosid.studies.jsbsim.configuration import driven_controls, thrust_force
from aerosid.studies.jsbsim.control_inputs import ELEVATOR
from aerosid.studies.jsbsim.declared import declared_aircraft
from aerosid.studies.jsbsim.derivatives import COEFFICIENTS, LATERAL_COEFFICIENTS, LATERAL_VARIABLES, VARIABLES
from aerosid.studies.jsbsim.injected import InjectedEffect
from aerosid.studies.jsbsim.injection import Body, Injection, inject, needs_slopes
from aerosid.studies.jsbsim.plan import FlightPlan, JsbsimFlight
from aerosid.studies.jsbsim.polynomial import (
    as_flown,
    driven_by,
    geometry_and_mass,
    polynomial_aerodynamics,
    set_inertia,
    thrust_line,
)
from aerosid.studies.jsbsim.process import require_jsbsim, run_job
from aerosid.studies.jsbsim.properties import DEVIATIONS, SURFACES, THRUST
from aerosid.studies.jsbsim.recorder import recorded_flight
from aerosid.studies.jsbsim.stock import stock_parts

Array = NDArray[np.float64]

_ELEVATOR_TRAVEL = math.radians(25.0)
_FLAP_TRAVEL = 30.0
"""Design: deg, of full flap in a configuration generated from an aircraft file."""

_APPLIED = ("control_lag", "control_delay", "control_rate_limit", "control_deadband")
_SENSED = ("sensor_bias", "sensor_scale", "sensor_delay", "sensor_lag", "sensor_position")


@dataclass(frozen=True)
class Parts:
    """Parts of a configuration; see `stock.StockParts`.

    `reads` are properties that must exist, `thrust` direction (x, z) and height below the centre of gravity [m],
    `controls` those that the flight moves, `sideways` whether it is trimmed by aileron and rudder as well.
    """

    elements: tuple[ET.Element, ...]
    aerodynamics: ET.Element
    reads: tuple[str, ...]
    channels: tuple[str, ...]
    elevator_limit: float
    flap_limit: float
    thrust: tuple[tuple[float, float], float]
    properties: Mapping[str, float]
    body: Body
    controls: tuple[str, ...]
    sideways: bool
    side_limits: tuple[float, float] = (1.0, 1.0)


def fly_jsbsim(plan: FlightPlan) -> JsbsimFlight:
    """The flight of a plan.

    Parameters
    ----------
    plan : FlightPlan

    Raises
    ------
    UsageError
        Where JSBSim is not installed, has no aircraft of that name, or an effect does not fit the aircraft.
    AircraftError
        Where the aircraft file declares an effect that JSBSim cannot apply.
    EstimationError
        Where no trim is found, the flight leaves its range, or JSBSim fails.
    """
    require_jsbsim()
    _check(plan)
    effects = (*_declared_effects(plan.aircraft), *plan.effects)
    interval = float(plan.manoeuvre.time[1])
    count = max(1, math.ceil(interval / plan.longest_frame - 1e-9))
    frames = np.arange(float((plan.manoeuvre.time.size - 1) * count + 1)) * (interval / count)

    slopes: dict[tuple[str, str], float] = {}
    if needs_slopes(effects):
        parts = _parts(plan, {})
        answer, _ = run_job({"clean": _configuration(parts, None)}, _job(plan, parts, "trim", interval / count))
        slopes = slopes_by_name(answer["slopes"]["self_consistent"])
    parts = _parts(plan, slopes)
    _fit(effects, parts)
    injection = inject(effects, parts.body, frames, interval, plan.seed)
    drives = {
        **injection.drives,
        THRUST: injection.thrust_share,
    }
    for control in parts.controls:
        moved = plan.manoeuvre.deviations.get(control, np.zeros(plan.manoeuvre.time.size))
        drives[DEVIATIONS[control]] = np.interp(frames, plan.manoeuvre.time, moved)
    job = _job(plan, parts, "fly", interval / count) | {
        "places": [
            *injection.places,
            *((f"external_reactions/{name}/location-{{x}}-in", 0.0, 0.0) for name in _points(injection)),
        ],
        "after_trim": injection.after_trim,
        "attached": injection.attached,
    }
    configurations = {"clean": _configuration(parts, None), "flown": _configuration(parts, injection)}
    answer, histories = run_job(configurations, job, drives)
    histories |= {
        **{f"a_{axis}": histories[f"force_{axis}"] / histories["mass"] for axis in "xyz"},
        **{control: answer["trim"][control] + drives[DEVIATIONS[control]] for control in parts.controls},
        "psi": _heading(histories["psi"]),
    }
    moving = (*(SIX if parts.sideways else LONGITUDINAL).outputs, *parts.controls)
    log = recorded_flight(plan, moving, effects, frames, count, histories, float(answer["trim"]["thrust"]))
    aircraft = plan.aircraft
    if isinstance(aircraft, str):
        title = stock_parts(aircraft).title
        aircraft = declared_aircraft(title, aircraft, answer, jsbsim_version(), plan.planes)
    truth = _truth(plan, parts, answer, frames)
    return JsbsimFlight(log, aircraft, truth, {name: values[::count] for name, values in histories.items()})


def coefficients_in(plan: FlightPlan, trim: Mapping[str, float], alphas: Array) -> tuple[Array, Array]:
    """C_X, C_Z and C_m of a plan's aircraft, without its injected effects, at other angles of attack: (A, 3).

    Also the alphadot, rad/s, (A,), with which they are consistent.

    Parameters
    ----------
    plan : FlightPlan
    trim : mapping of str to float
        airspeed, delta_e and thrust, from the truth of a flight; alphadot is self-consistent on a level path.
    alphas : (A,)
        rad.
    """
    require_jsbsim()
    parts = _parts(plan, {})
    states = [
        {
            "airspeed": plan.airspeed,
            "alpha": float(alpha),
            "q": 0.0,
            "delta_e": trim["delta_e"],
            "thrust": trim["thrust"],
        }
        for alpha in alphas
    ]
    job = _job(plan, parts, "freeze", plan.longest_frame) | {"states": states}
    answer, _ = run_job({"clean": _configuration(parts, None)}, job)
    return np.array(answer["coefficients"]), np.array([reading["alpha_dot"] for reading in answer["readings"]])


def slopes_by_name(table: Sequence[Sequence[float]]) -> dict[tuple[str, str], float]:
    """(coefficient, variable) -> derivative, from a table (3, 4) of the worker."""
    return {
        (coefficient, variable): table[i][j]
        for i, coefficient in enumerate(COEFFICIENTS)
        for j, variable in enumerate(VARIABLES)
    }


def jsbsim_version() -> str:
    """Version of the installed JSBSim."""
    return importlib.metadata.version("jsbsim")


def _check(plan: FlightPlan) -> None:
    for label, number, low, high in (
        ("--airspeed", plan.airspeed, 1.0, 1000.0),
        ("--altitude", plan.altitude, 0.0, 30000.0),
        ("--noise", plan.noise, 0.0, 1e6),
    ):
        if not low <= number <= high:
            raise UsageError(f"{label} is {number:g}; give a number from {low:g} to {high:g}.")


def _heading(psi: Array) -> Array:
    """JSBSim's heading, which jumps between 0 and 2 pi, unwrapped, beginning near north."""
    whole = np.unwrap(psi)
    return np.asarray(whole - 2.0 * np.pi * np.round(whole[0] / (2.0 * np.pi)))


def _fit(effects: Sequence[InjectedEffect], parts: Parts) -> None:
    """Refuse an effect of a control, sensor or coefficient that this aircraft does not have."""
    axes = SIX if parts.sideways else LONGITUDINAL
    for effect in effects:
        prefix = effect.kind.partition("_")[0]
        there = {"control": parts.controls, "sensor": axes.outputs}.get(prefix, axes.coefficients)
        if effect.where and effect.kind != "inertia" and effect.where not in there:
            raise UsageError(
                f"the effect {effect} names {effect.where}, but this aircraft's flight has {', '.join(there)}; give "
                "one of these."
            )


def _declared_effects(aircraft: Aircraft | str) -> tuple[InjectedEffect, ...]:
    """The effects declared in the aircraft file, which are simulated as well."""
    if isinstance(aircraft, str):
        return ()
    made = []
    for effect in aircraft.effects:
        if effect.kind not in (*_APPLIED, *_SENSED, "step_change") or effect.value is None:
            raise AircraftError(
                f"{aircraft.path}: [[effects]] declares {effect.kind}, which is not flown in JSBSim; delete the "
                "effect, or inject it with --effect."
            )
        made.append(InjectedEffect(effect.kind, (effect.value,), effect.where, time=effect.time))
    return tuple(made)


def _parts(plan: FlightPlan, slopes: Mapping[tuple[str, str], float]) -> Parts:
    """The parts of an aircraft, created for each configuration: XML elements are not shared."""
    aircraft = plan.aircraft
    if isinstance(aircraft, str):
        sideways = bool({"delta_a", "delta_r"} & plan.manoeuvre.deviations.keys())
        stock = stock_parts(aircraft, sideways)
        metrics = stock.elements[0]
        references = References(
            _area(metrics), _length(metrics, "chord"), None, plan.airspeed, where=f"JSBSim's {aircraft}"
        )
        return Parts(
            stock.elements, stock.aerodynamics, stock.reads, (), stock.elevator_limit, stock.flap_limit,
            ((1.0, 0.0), 0.0), {}, Body(references, True, stock.point_masses, slopes),
            tuple(SURFACES) if sideways else (ELEVATOR,), sideways, (stock.aileron_limit, stock.rudder_limit),
        )  # fmt: skip
    aircraft = _with_lift(plan, aircraft)
    # Its effects are simulated by this package's own actuator and recorder.
    aerodynamics, channels = polynomial_aerodynamics(replace(aircraft, effects=()), plan.airspeed)
    properties = {}
    if aircraft.density is not None:
        properties["atmosphere/override/density"] = aircraft.density / SLUG * FOOT**3
    references = References(
        aircraft.wing_area,
        aircraft.mean_chord,
        aircraft.airspeed,
        aircraft.airspeed or plan.airspeed,
        where=aircraft.path,
        span=aircraft.span,
    )
    return Parts(
        tuple(geometry_and_mass(aircraft)), aerodynamics, (), channels, _ELEVATOR_TRAVEL, _FLAP_TRAVEL,
        thrust_line(aircraft), properties, Body(references, False, 0, slopes), driven_by(aircraft),
        aircraft.axes == SIX,
    )  # fmt: skip


def _with_lift(plan: FlightPlan, aircraft: Aircraft) -> Aircraft:
    """The aircraft `as_flown` in the air density of the plan."""
    density = aircraft.density
    if density is None:
        density = float(pressure(plan.altitude) / (GAS_CONSTANT * temperature(plan.altitude)))
    return as_flown(aircraft, plan.airspeed, density)


def _area(metrics: ET.Element) -> float:
    return _length(metrics, "wingarea")


_UNITS = {"FT2": FOOT**2, "M2": 1.0, "FT": FOOT, "M": 1.0, "IN": FOOT / 12.0}


def _length(metrics: ET.Element, tag: str) -> float:
    element = metrics.find(tag)
    text = "" if element is None else element.text or ""
    try:
        return float(text) * _UNITS[element.get("unit", "FT2" if tag == "wingarea" else "FT")]  # type: ignore[union-attr]
    except (ValueError, KeyError, AttributeError):
        raise UsageError(f"this aircraft of JSBSim does not give its {tag}; try another.") from None


def _configuration(parts: Parts, injection: Injection | None) -> ET.Element:
    """The complete `<fdm_config>`; without injection, the unmodified aircraft."""
    config = ET.Element("fdm_config", name="aerosid", version="2.0", release="BETA")
    config.extend(deepcopy(list(parts.elements)))
    ET.SubElement(config, "ground_reactions")
    further = [*parts.channels, *(injection.properties if injection else ())]
    config.append(
        driven_controls(
            parts.elevator_limit,
            parts.flap_limit,
            further,
            injection.actuators if injection else {},
            parts.side_limits,
        )
    )
    config.append(deepcopy(parts.aerodynamics))
    reactions = ET.SubElement(config, "external_reactions")
    reactions.append(thrust_force(parts.thrust[0]))
    if injection is not None:
        reactions.extend(injection.forces)
        balance, aerodynamics = config.find("mass_balance"), config.find("aerodynamics")
        for name, inertia in injection.inertias.items():
            set_inertia(config, name, inertia)
        if injection.point_mass is not None and balance is not None:
            balance.append(injection.point_mass)
        if injection.hysteresis is not None and aerodynamics is not None:
            for old in aerodynamics.findall("hysteresis_limits"):
                aerodynamics.remove(old)
            aerodynamics.insert(0, injection.hysteresis)
    return config


def _points(injection: Injection) -> list[str]:
    return [str(force.get("name")) for force in injection.forces if force.tag == "force"]


def _job(plan: FlightPlan, parts: Parts, task: str, frame: float) -> dict[str, Any]:
    return {
        "task": task,
        "clean": "clean",
        "flown": "flown",
        "frame": frame,
        "altitude": plan.altitude,
        "airspeed": plan.airspeed,
        "properties": dict(parts.properties),
        "reads": list(parts.reads),
        "thrust_below": parts.thrust[1],
        "sideways": parts.sideways,
    }


def lateral_rows(slopes: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The lateral derivatives for the truth file, from the worker's tables."""
    return [
        {"coefficient": coefficient, "term": term, **{kind: slopes[key][i][j] for kind, key in _KINDS.items()}}
        for i, coefficient in enumerate(LATERAL_COEFFICIENTS)
        for j, term in enumerate(LATERAL_VARIABLES)
    ]


_KINDS = {"frozen": "local", "self_consistent": "local", "chord": "chord"}
"""No lateral force depends on the rate of sideslip: the local slopes are equal."""


def _truth(plan: FlightPlan, parts: Parts, answer: Mapping[str, Any], frames: Array) -> dict[str, Any]:
    """Contents of the truth file."""
    slopes, trim = answer["slopes"], answer["trim"]
    aside = ("beta", "delta_a", "delta_r") if parts.sideways else ()
    rows: list[dict[str, Any]] = []
    for i, coefficient in enumerate(COEFFICIENTS):
        for j, variable in enumerate(VARIABLES):
            rows.append(
                {
                    "coefficient": coefficient,
                    "term": variable,
                    **{kind: slopes[kind][i][j] for kind in ("frozen", "self_consistent", "chord")},
                }
            )
        rows.append({"coefficient": coefficient, "term": "alpha_dot_hat", "frozen": slopes["alpha_dot_hat"][0][i]})
    if parts.sideways:
        rows += lateral_rows(answer["sideways"])
    return {
        "schema": 1,
        "flown_by": f"JSBSim {jsbsim_version()}",
        "aircraft": plan.aircraft if isinstance(plan.aircraft, str) else plan.aircraft.name,
        "manoeuvre": plan.manoeuvre.name,
        "altitude": plan.altitude,
        "frame": float(frames[1]),
        "seed": plan.seed,
        "trim": {key: trim[key] for key in ("airspeed", "alpha", "delta_e", "thrust", *aside)},
        "coefficients_at_trim": dict(zip(COEFFICIENTS, slopes["at"][0], strict=True)),
        "derivatives": rows,
        "flown": {name: list(ends) for name, ends in answer["flown"].items()},
        "mass": answer["mass"],
        "I_yy": answer["I_yy"],
        "effects": [
            {
                "kind": effect.kind,
                "where": effect.where,
                "term": effect.term,
                "values": list(effect.values),
                "time": effect.time,
            }
            for effect in plan.effects
        ],
    }
