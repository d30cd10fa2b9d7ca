"""Detection of effects injected into flights of JSBSim and left undeclared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from aerosid.aircraft import Aircraft, load_aircraft
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict
from aerosid.notation import number
from aerosid.studies.jsbsim.control_inputs import manoeuvre
from aerosid.studies.jsbsim.flight import fly_jsbsim
from aerosid.studies.jsbsim.injected import InjectedEffect, parse_effect
from aerosid.studies.jsbsim.plan import FlightPlan
from aerosid.studies.jsbsim.stock import CONDITIONS


class Outcome(Enum):
    """Result for a planted effect; the page prints the value."""

    NAMED = "identified"
    ALTERNATIVE = "listed among the alternatives"
    SEEN = "detected, not identified: other effects replace it"
    UNEXPLAINED = "detected, not identified: a significant residual remains"
    ABSORBED = "absorbed by the re-estimated derivatives"


@dataclass(frozen=True)
class PlantedFlight:
    """One effect and the flight into which it is injected.

    Attributes
    ----------
    effect : str
        In the notation of --effect.
    kinds : tuple of str
        Effects that count as its identification.
    aircraft : str
        An aircraft file's name, or one of JSBSim's.
    altitude : float
        m.
    shape, amplitude : str, float
        Amplitude of the elevator.
    """

    effect: str
    kinds: tuple[str, ...]
    aircraft: str = "light_transport"
    altitude: float = 1500.0
    shape: str = "doublet"
    amplitude: float = 0.06


PLANTED = (
    PlantedFlight("", ()),
    PlantedFlight("C_m:alpha^2=-1.715", ("aero_term",)),
    PlantedFlight("C_X:alpha^2=3.6089", ("aero_term",)),
    PlantedFlight("C_X:alpha^3=20", ("aero_term",)),
    PlantedFlight("control_lag=0.15", ("control_lag",)),
    PlantedFlight("control_delay=0.09", ("control_delay",)),
    PlantedFlight("control_rate_limit=0.3", ("control_rate_limit",)),
    # To a dead band, two levels of the same size would only be a weaker elevator.
    PlantedFlight("control_deadband=0.01", ("control_deadband",), shape="multisine"),
    PlantedFlight("sensor_bias:alpha=0.01", ("sensor_bias",)),
    PlantedFlight("sensor_scale:alpha=1.1", ("sensor_scale",)),
    PlantedFlight("sensor_delay:theta=0.1", ("sensor_delay",)),
    PlantedFlight("sensor_lag:alpha=0.1", ("sensor_lag",)),
    PlantedFlight("cg_shift=200,-1.5@7", ("cg_shift",)),
    PlantedFlight("cg_shift=200,-1.5", ("cg_shift",)),
    PlantedFlight("icing=1@7", ("step_change",)),
    PlantedFlight("flap=0.3@7", ("step_change",), "c310"),
    PlantedFlight("gear=1@7", ("step_change",), "c310"),
    PlantedFlight("thrust_loss=0.3@7", ("thrust_change",)),
    PlantedFlight("ground_effect=0.2", ("ground_effect",), altitude=6.0, amplitude=-0.015),
    PlantedFlight("stall_hysteresis=0.04,0.1,0.15,-0.02", ("flow_separation",)),
    PlantedFlight("turbulence=3", ("gust",)),
)
"""The first is no effect at all: nothing may be identified then."""


@dataclass(frozen=True)
class EffectCheck:
    """Result of the loop for a planted effect.

    Attributes
    ----------
    planted : PlantedFlight
    verdict : Verdict
    named, alternatives : tuple of str
        Effects as text, most certain first.
    outcome : Outcome or None
        None where no effect was planted.
    """

    planted: PlantedFlight
    verdict: Verdict
    named: tuple[str, ...]
    alternatives: tuple[str, ...]
    outcome: Outcome | None


def check_effect(planted: PlantedFlight, seed: int) -> EffectCheck:
    """Plant an effect in a flight with usual sensor noise and run close-loop on it."""
    effects = (parse_effect(planted.effect),) if planted.effect else ()
    flown: Aircraft | str
    if planted.aircraft in CONDITIONS:
        flown = planted.aircraft
        airspeed, altitude = CONDITIONS[planted.aircraft]
    else:
        flown = load_aircraft(planted.aircraft)
        airspeed, altitude = flown.airspeed or 100.0, planted.altitude
    unit = 0.5 if planted.shape == "multisine" else 1.0
    shape = manoeuvre(planted.shape, planted.amplitude, unit, 14.0, 0.03)
    flight = fly_jsbsim(FlightPlan(flown, shape, airspeed, altitude, effects, seed=seed))
    result = close_loop([flight.log], flight.aircraft)
    return EffectCheck(
        planted,
        result.verdict,
        tuple(_text(effect) for effect in result.effects),
        tuple(_text(effect) for effect in result.alternatives),
        judge(planted, effects, result) if effects else None,
    )


def judge(planted: PlantedFlight, effects: tuple[InjectedEffect, ...], result: ClosedLoop) -> Outcome:
    """Whether the loop's result contains the planted effect, at its place where it has one."""

    def fits(kind: str, where: str, term: str) -> bool:
        (effect,) = effects
        same = not effect.where or where == effect.where
        return kind in planted.kinds and same and (not effect.term or term == effect.term)

    if any(fits(effect.kind, effect.where, effect.term) for effect in result.effects):
        return Outcome.NAMED
    if any(fits(effect.kind, effect.where, effect.term) for effect in result.alternatives):
        return Outcome.ALTERNATIVE
    if result.verdict is Verdict.EXPLAINED:
        return Outcome.SEEN
    return Outcome.ABSORBED if result.verdict is Verdict.NOTHING_MISSING else Outcome.UNEXPLAINED


def check_effects(seed: int, tick: Callable[[int], None]) -> tuple[EffectCheck, ...]:
    """All of `PLANTED`; `tick` is called after each."""
    checks = []
    for planted in PLANTED:
        checks.append(check_effect(planted, seed))
        tick(1)
    return tuple(checks)


def _text(effect: object) -> str:
    kind, where, term, value, unit, time = (
        getattr(effect, name) for name in ("kind", "where", "term", "value", "unit", "time")
    )
    place = " ".join(word for word in (kind, where, term) if word)
    unit_text = "" if unit == "1" else f" {unit}"
    return f"{place} = {number(value, 4)}{unit_text}" + ("" if time is None else f" at {time:.2f} s")
