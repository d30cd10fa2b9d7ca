"""The true flight of a study: simulated from trim, or the completed model of a real log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.aircraft.declared_model import declared_model
from aerosid.effects import ActiveEffect, InputEffect, OutputEffect
from aerosid.errors import UsageError
from aerosid.estimation.declared_effects import declared_effects
from aerosid.estimation.effect_columns import with_columns_of
from aerosid.estimation.manoeuvre import Manoeuvre, initial_state, prepare
from aerosid.estimation.open_loop import simulate
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry, controls_of
from aerosid.flight_model.simulation import ALTITUDE, flown_controls, fly_controls, trim, trimmed_state
from aerosid.flight_model.terms import VARIABLES
from aerosid.logs.flight_log import FlightLog
from aerosid.nomenclature import is_surface
from aerosid.studies.monte_carlo.elevator import in_turn
from aerosid.studies.monte_carlo.noise_draw import NoiseSource, redrawn
from aerosid.studies.monte_carlo.plan import FlownInput, StudyPlan
from aerosid.studies.monte_carlo.planted import Planted
from aerosid.studies.monte_carlo.search import search

FloatArray = NDArray[np.float64]

_FINER = 3
"""Numerical: steps of the truth's integration within a sampling interval."""

VALIDATION_SHARE = 0.75
"""Design: size of a simulated validation input over that of the identification, 1: it predicts inside the range of
the identification."""


@dataclass(frozen=True)
class TrueFlight:
    """One flight of the true aircraft, without noise.

    `manoeuvre` contains its true inputs and noise-free sensor readings; `state` (n,) is its initial state.
    """

    manoeuvre: Manoeuvre
    state: FloatArray

    @property
    def outputs(self) -> FloatArray:
        """Noise-free sensor readings, (N, p) in the order of the manoeuvre's outputs."""
        return self.manoeuvre.flight.measured[:, _places(self.manoeuvre)]


@dataclass(frozen=True)
class Truth:
    """The true aircraft, as shared by the runs of a study.

    Attributes
    ----------
    aircraft : Aircraft
        The declared model.
    model : AerodynamicModel
        The true one.
    free : tuple of Entry
        Its derivatives: those declared and not fixed, then those planted.
    planted : tuple of Planted
        Effects that the search should identify.
    identification : TrueFlight
    validation : TrueFlight or None
    input_deviation : ndarray, shape (E,)
        Noise of each sample of the recorded extra inputs, SI; for levels with noise.
    recorded : NoiseSource or None
        The residuals of the base log.
    recorded_deviation : ndarray, shape (p,)
        Their standard deviations, SI.
    """

    aircraft: Aircraft
    model: AerodynamicModel
    free: tuple[Entry, ...]
    planted: tuple[Planted, ...]
    identification: TrueFlight
    validation: TrueFlight | None
    input_deviation: FloatArray
    recorded: NoiseSource | None
    recorded_deviation: FloatArray

    @property
    def effects(self) -> tuple[ActiveEffect, ...]:
        """Planted effects on controls and sensors of the identification flight."""
        return planted_effects(self.planted, self.identification.manoeuvre)

    @property
    def acting(self) -> tuple[ActiveEffect, ...]:
        """All effects on the identification flight: those declared, with their values fixed, and those planted."""
        manoeuvre = self.identification.manoeuvre
        return (*declared_effects(self.aircraft, controls_of(self.model), [manoeuvre]), *self.effects)

    @property
    def signal(self) -> FloatArray:
        """Standard deviation of each output about its mean, (p,)."""
        return np.asarray(np.nanstd(self.identification.outputs, axis=0))


def planted_effects(planted: tuple[Planted, ...], manoeuvre: Manoeuvre) -> tuple[ActiveEffect, ...]:
    """The planted effects that are not terms, for one flight."""
    interval = manoeuvre.interval
    return tuple(effect.active(interval, manoeuvre.name) for effect in planted if effect.entry is None)


def make_truth(plan: StudyPlan) -> Truth:
    """The true aircraft and its flights.

    Raises
    ------
    UsageError
        Where the plan is inconsistent with the aircraft or the log.
    EstimationError
        Where no trim exists, or the flight leaves the model's range.
    """
    return _simulated(plan) if plan.base is None else _from_log(plan, plan.base)


def _true_model(plan: StudyPlan, airspeed: float) -> tuple[AerodynamicModel, tuple[Entry, ...]]:
    """The declared model with the planted terms added, and those terms.

    Raises
    ------
    UsageError
        Where an effect is planted on a surface that no term uses, or a term of a channel that no flight of the study
        moves.
    """
    terms = {effect.entry: effect.value for effect in plan.effects if effect.entry is not None}
    declared = declared_model(plan.aircraft, airspeed)
    model = declared_model(plan.aircraft, airspeed, [term for _, term in terms]).extended(terms)
    values = model.values.copy()
    for entry, value in terms.items():
        values[model.index(entry)] = value
    model = model.with_values(values)
    controls = controls_of(model)
    # An estimate with known terms flies the surfaces of these too; a search knows those of the declared model alone.
    moved = (*declared.columns, *(flown_controls(model) if plan.catalogue == "known" else ()))
    for coefficient, term in terms:
        if unknown := sorted(term.variables - {*VARIABLES, *moved}):
            known = (*VARIABLES, *(name for name in dict.fromkeys(moved) if is_surface(name)))
            raise UsageError(
                f"--effect {coefficient}:{term}: {unknown[0]} is not part of the motion and moved in no flight of the "
                f"study; give a term of {', '.join(known)}."
            )
    for effect in plan.effects:
        if effect.entry is None and is_surface(effect.where) and effect.where not in controls:
            raise UsageError(
                f"--effect {effect.kind}:{effect.where}: no term uses that surface; give one in {controls}."
            )
    return model, tuple(terms)


def _simulated(plan: StudyPlan) -> Truth:
    aircraft = plan.aircraft
    airspeed = plan.flown.airspeed or aircraft.airspeed
    density = plan.flown.density or aircraft.density
    if airspeed is None or density is None:
        raise UsageError(
            f"{aircraft.path}: it gives no {'airspeed' if airspeed is None else 'density'}; add it to the command as "
            f"--{'airspeed' if airspeed is None else 'density'}."
        )
    model, terms = _true_model(plan, airspeed)
    level = trim(model, airspeed, density, aircraft.mass)
    state, controls = trimmed_state(model, level, ALTITUDE), flown_controls(model)
    # Where the motion in the plane of symmetry is measured, it is recorded at its trim values.
    recorded = model.axes.measured if "V" in model.axes.measured else ()

    def true_flight(flown_input: FlownInput, name: str, effects: tuple[Planted, ...]) -> TrueFlight:
        time = np.arange(float(flown_input.samples)) * flown_input.interval
        others = {column: np.zeros(time.size) for column in model.extra_columns if column not in controls}
        log = fly_controls(
            model,
            level,
            time,
            in_turn(controls, flown_input.shape, time, flown_input.amplitude, flown_input.unit),
            density=density,
            mass=aircraft.mass,
            noise=dict.fromkeys((*plan.measured, *recorded, *controls), 0.0),
            seed=0,
            further_inputs=others | {"thrust": np.full(time.size, level.thrust)},
            name=name,
        )
        log = replace(log, channels={**log.channels, "thrust": np.full(time.size, level.thrust)})
        return _recorded(aircraft, model, prepare(log, aircraft, model.columns), state, effects)

    declared = {(d.coefficient, d.term) for d in aircraft.derivatives}
    validation = None
    if not isinstance(plan.validation, FlightLog):
        other = replace(plan.flown, shape=plan.validation, amplitude=VALIDATION_SHARE * plan.flown.amplitude, unit=None)
        validation = true_flight(other, "validation", _lasting(plan.effects))
    else:
        flight = prepare(plan.validation, aircraft, model.columns)
        validation = _recorded(
            aircraft, model, flight, initial_state(flight.flight, flight.axes), _lasting(plan.effects)
        )
    return Truth(
        aircraft=aircraft,
        model=model,
        free=(*aircraft.free, *(entry for entry in terms if entry not in aircraft.free)),
        # A declared term that is flown with another value is re-estimated, not found.
        planted=tuple(effect for effect in plan.effects if effect.entry not in declared),
        identification=true_flight(plan.flown, "study", plan.effects),
        validation=validation,
        input_deviation=np.array([plan.elevator_noise if name in controls else 0.0 for name in model.extra_columns]),
        recorded=None,
        recorded_deviation=np.zeros(len(plan.measured)),
    )


def _from_log(plan: StudyPlan, log: FlightLog) -> Truth:
    """The completed model of a real log as the true aircraft, with its residuals as noise."""
    if plan.effects:
        raise UsageError(
            "--effect cannot be combined with --base: the effects missing from the log itself are identified."
        )
    aircraft = plan.aircraft
    found = search(log, aircraft, "all" if plan.catalogue == "all" else "terms")
    completed = found.completed
    parts = []
    for finding in found.findings:
        label = Planted(finding.kind, finding.where, finding.term, finding.value, finding.time)
        if finding.entry is None and not _can_be_flown(label, found.manoeuvre):
            raise UsageError(
                f"{log.path or log.name}: its loop names {finding.kind} of {finding.where or 'the air'}, which a study "
                "cannot fly again; give --catalogue terms, or another log."
            )
        parts.append(label)
    planted = tuple(parts)
    identification = _recorded(aircraft, completed.model, found.manoeuvre, completed.states[0], planted)
    measured = found.manoeuvre.flight.measured[:, _places(found.manoeuvre)]
    source, deviation = redrawn(measured - identification.outputs)
    validation = None
    if isinstance(plan.validation, FlightLog):
        other = prepare(plan.validation, aircraft, found.manoeuvre.columns)
        validation = _recorded(
            aircraft, completed.model, other, initial_state(other.flight, other.axes), _lasting(planted)
        )
    return Truth(
        aircraft=aircraft,
        model=completed.model,
        free=completed.free,
        planted=planted,
        identification=identification,
        validation=validation,
        # The effect of the recorded inputs' noise on the outputs is already part of the residuals.
        input_deviation=np.zeros(len(found.manoeuvre.extra_columns)),
        recorded=source,
        recorded_deviation=deviation,
    )


def _recorded(
    aircraft: Aircraft,
    model: AerodynamicModel,
    manoeuvre: Manoeuvre,
    state: FloatArray,
    planted: tuple[Planted, ...],
) -> TrueFlight:
    """The flight with noise-free sensor readings in place of its measurements, where there were any."""
    given = declared_effects(aircraft, controls_of(model), [manoeuvre])
    effects = (*given, *planted_effects(planted, manoeuvre))
    model = with_columns_of(model, effects)
    # Finer than the integration of the estimators: the truth must not share their truncation error.
    finer = replace(manoeuvre, flight=manoeuvre.flight._replace(substeps=_FINER * manoeuvre.flight.substeps))
    outputs, _ = simulate(model, finer, state, effects)
    if not np.isfinite(outputs).all():
        raise UsageError(
            f"the true flight {manoeuvre.name} leaves |alpha| < 1.5 rad; reduce --amplitude, or give another --effect."
        )
    measured = np.where(np.isfinite(manoeuvre.flight.measured), outputs, np.nan)
    return TrueFlight(replace(manoeuvre, flight=manoeuvre.flight._replace(measured=measured)), state)


def _can_be_flown(planted: Planted, manoeuvre: Manoeuvre) -> bool:
    try:
        (active,) = planted_effects((planted,), manoeuvre)
    except UsageError:
        return False
    return isinstance(active.effect, InputEffect | OutputEffect)


def _lasting(planted: tuple[Planted, ...]) -> tuple[Planted, ...]:
    """Effects that act on another flight as well: not a change at an instant of this one."""
    return tuple(effect for effect in planted if effect.time is None)


def _places(manoeuvre: Manoeuvre) -> list[int]:
    return [manoeuvre.row(name) for name in manoeuvre.outputs]
