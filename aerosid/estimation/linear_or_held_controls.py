"""Interpolation of recorded controls between samples, linear or held, by the angular rates or by likelihood.

Programmed inputs and digital flight controls hold a surface at each sample until the next; linear interpolation then
has it lead by half an interval, which a search explains by delays, sensor positions and terms that do not exist.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.compiled.threads import mapped_in_threads
from aerosid.effects import ActiveEffect
from aerosid.effects.control import control_delay
from aerosid.errors import EstimationError
from aerosid.estimation.fit_settings import WRONG_STRUCTURE
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.estimation.movement_between_samples import Movement, movement_between_samples, pooled
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.nomenclature import is_surface
from aerosid.notation import listed, number
from aerosid.signals.noise import estimate_noise


@dataclass(frozen=True)
class InterpolationSettings:
    """Limits of the selection, each with quantity, unit, effect and source.

    Attributes
    ----------
    jump : float
        Change of a control between two samples over its noise, 1, from which it moves. Chosen.
    part : float
        Least change over the control's range, 1, of a step. Chosen.
    neighbour : float
        Largest change before and after a step over the step, 1: a control that moves over several samples, as a pilot's
        does, is as well interpolated linearly. Chosen.
    stepped : float
        Least part, 1, of all a control's movements that are steps. Chosen.
    fewest : int
        Steps without which nothing is decided: one alone does not tell a held input from a late one.
    longest : float
        Part of an interval, 1, in which a held surface may move. One that takes longer is as well linear: where a term
        is missing the likeliest part was .8 and more (tests/search/test_candidate_terms.py). Chosen.
    gain : float
        Decrease of -2 ln L by which held inputs have to be likelier than linear ones, and than linear ones with a free
        time delay of each control. Chosen: from 270 to 1,800 where an independent simulator held them, -16 to -410
        where its actuators lagged and -613 where it moved them linearly.
    answered : float
        t-ratio of a control's moment from which an angular rate answers it. Chosen.
    known : float
        Standard error of a part of the step, 1, up to which the angular rates tell when it acts. Chosen: a quarter
        of what lies between held and linear, 1/2.
    late : float
        Least part, 1, of the step before that makes a control late, beside three standard errors. Chosen: it was up to
        .07 where nothing was late and from .58 where a control lagged or was delayed.
    """

    jump: float = 8.0
    part: float = 0.1
    neighbour: float = 0.2
    stepped: float = 0.5
    fewest: int = 2
    longest: float = 0.6
    gain: float = 10.0
    answered: float = 5.0
    known: float = 0.12
    late: float = 0.1


INTERPOLATION = InterpolationSettings()
"""Of every flight."""


def with_likelier_interpolation(
    manoeuvres: Sequence[Manoeuvre],
    model: AerodynamicModel,
    free: Sequence[Entry],
    effects: Sequence[ActiveEffect] = (),
) -> tuple[Manoeuvre, ...]:
    """The manoeuvres with their stepped controls held between samples, where that is likelier than linear.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
        All flights; those sampled at one rate are taken as made by one recorder.
    model : AerodynamicModel
        The declared one.
    free : sequence of Entry
        Its estimated entries.
    effects : sequence of ActiveEffect
        The declared ones.

    Notes
    -----
    The angular rates of all flights of a recorder are asked first: their change over the interval of a step does not
    depend on what the model lacks, whereas the likelihood of an incomplete structure may favour either (of 20,000
    samples without the C_m alpha^2 that was flown, by 221). It decides on each flight where the rates are too noisy, or
    where a control is late.

    Of the part of an interval in which a held surface moves, -2 ln L is nearly a parabola over a half: from none to a
    half, or from there to the whole, which is linear interpolation. A surface that lags or is delayed is late too, but
    does not move at its samples: a linear input with free delays is the likelier then.
    """
    controls = [stepped_controls(each) for each in manoeuvres]
    movements = _by_recorder(manoeuvres, controls)

    def likelier(pair: tuple[Manoeuvre, tuple[str, ...]]) -> Manoeuvre:
        manoeuvre, stepped = pair
        if not stepped:
            return manoeuvre
        movement = movements.get(_recorder(manoeuvre))
        if movement is not None and _is_told(movement):
            part = 2.0 * max(movement.now, 0.0)
            return manoeuvre if part > INTERPOLATION.longest else _held(manoeuvre, stepped, part)
        own = tuple(active for active in effects if active.acts_on(manoeuvre.name))
        try:
            return _likelier(manoeuvre, stepped, model, free, own)
        except EstimationError:
            return manoeuvre

    return tuple(mapped_in_threads(likelier, list(zip(manoeuvres, controls, strict=True))))


def _by_recorder(manoeuvres: Sequence[Manoeuvre], controls: Sequence[tuple[str, ...]]) -> dict[int, Movement]:
    """What the angular rates of all flights sampled at one rate tell of their stepped controls."""
    found: dict[int, list[Movement]] = {}
    for manoeuvre, stepped in zip(manoeuvres, controls, strict=True):
        movement = movement_between_samples(manoeuvre, stepped, INTERPOLATION.answered) if stepped else None
        if movement is not None:
            found.setdefault(_recorder(manoeuvre), []).append(movement)
    return {rate: pooled(rows) for rate, rows in found.items()}


def _recorder(manoeuvre: Manoeuvre) -> int:
    """Samples in 100 s, by which recorders are told apart."""
    return round(100.0 / manoeuvre.interval)


def _is_told(movement: Movement) -> bool:
    """Whether the movement is known, and its control not late."""
    known = max(movement.now_error, movement.before_error) < INTERPOLATION.known
    return known and abs(movement.before) < max(INTERPOLATION.late, 3.0 * movement.before_error)


def _likelier(
    manoeuvre: Manoeuvre,
    controls: Sequence[str],
    model: AerodynamicModel,
    free: Sequence[Entry],
    effects: tuple[ActiveEffect, ...],
) -> Manoeuvre:
    """As `with_likelier_interpolation`, of the controls that move in steps.

    Raises
    ------
    EstimationError
        Where the simulation leaves the model's range.
    """
    linear = refine(model, [manoeuvre], free, effects=effects, settings=WRONG_STRUCTURE)

    def fitted(flown: Manoeuvre, further: tuple[ActiveEffect, ...] = ()) -> Refinement:
        return refine(
            linear.model,
            [flown],
            free,
            effects=(*effects, *further),
            states=linear.states,
            variance=linear.variance,
            settings=WRONG_STRUCTURE,
        )

    half = fitted(_held(manoeuvre, controls, 0.5)).cost
    if half >= linear.cost:
        return manoeuvre  # the parabola is lowest beyond three quarters, where a control is as well linear
    none = fitted(_held(manoeuvre, controls, 0.0)).cost
    upper = linear.cost < none
    quarter = fitted(_held(manoeuvre, controls, 0.75 if upper else 0.25)).cost
    held = _held(
        manoeuvre, controls, _lowest(0.5, half, quarter, linear.cost) if upper else _lowest(0.0, none, quarter, half)
    )
    if held.flight.ramp > INTERPOLATION.longest:
        return manoeuvre
    cost = fitted(held).cost
    if cost > linear.cost - INTERPOLATION.gain:
        return manoeuvre
    late = 0.5 * manoeuvre.interval
    delays = tuple(ActiveEffect(control_delay(name, -late), (late,)) for name in controls)
    return held if cost < fitted(manoeuvre, delays).cost - INTERPOLATION.gain else manoeuvre


def _lowest(begin: float, first: float, middle: float, last: float) -> float:
    """Where from `begin` to a half more a parabola through its ends and middle is lowest; an end where it is none."""
    curvature = first - 2.0 * middle + last
    if curvature <= 0.0:
        return begin if first < last else begin + 0.5
    return begin + float(np.clip(0.25 + 0.125 * (first - last) / curvature, 0.0, 0.5))


def _held(manoeuvre: Manoeuvre, controls: Sequence[str], ramp: float) -> Manoeuvre:
    """The manoeuvre with controls held, moving in the last `ramp` of each interval, 1."""
    places = np.array([manoeuvre.columns.index(name) for name in controls], dtype=np.int64)
    return replace(manoeuvre, flight=manoeuvre.flight._replace(held=places, ramp=ramp))


def stepped_controls(manoeuvre: Manoeuvre) -> tuple[str, ...]:
    """The controls of a manoeuvre that move in steps from one sample to the next and rest before and after."""
    time = manoeuvre.flight.time
    inputs = zip(manoeuvre.extra_columns, manoeuvre.extra_inputs.T, strict=True)
    return tuple(name for name, values in inputs if is_surface(name) and _is_stepped(time, values))


def _is_stepped(time: NDArray[np.float64], values: NDArray[np.float64]) -> bool:
    change, noise = np.abs(np.diff(values)), float(estimate_noise(time, values))
    moves = change > INTERPOLATION.jump * noise
    beside = np.maximum(np.append(0.0, change[:-1]), np.append(change[1:], 0.0))
    steps = moves & (change > INTERPOLATION.part * float(np.ptp(values)))
    steps &= beside < INTERPOLATION.neighbour * change + INTERPOLATION.jump * noise
    if int(steps.sum()) < INTERPOLATION.fewest:
        return False
    return float(change[steps].sum()) > INTERPOLATION.stepped * float(change[moves].sum())


def notes_on_held_controls(manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    """A remark on each flight whose controls are held between samples."""
    notes = []
    for manoeuvre in manoeuvres:
        if manoeuvre.flight.held.size:
            names = listed([manoeuvre.columns[place] for place in manoeuvre.flight.held])
            moving = f", moving in the last {number(100.0 * manoeuvre.flight.ramp, 2)} % of the interval"
            notes.append(
                f"{manoeuvre.name}: {names}: moves in steps and is taken as held at each sample until the next"
                f"{moving if manoeuvre.flight.ramp > 0.005 else ''}, which is likelier than linear interpolation."
            )
    return tuple(notes)
