"""The plan of the next flight: open questions, the input that answers them, the expected answers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import StateEffect
from aerosid.effects.aerodynamic_terms import is_symmetric
from aerosid.errors import EstimationError
from aerosid.estimation.effects_in_flight import OutOfRangeError
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.axes import ATMOSPHERE_AND_BODY, LATERAL, LONGITUDINAL, SIX
from aerosid.flight_model.input_shapes import Multisine
from aerosid.loop.derivative_table import DerivativeRow, derivative_name
from aerosid.loop.judgement_settings import JUDGEMENT
from aerosid.loop.next_flight.expected_information import (
    Prospect,
    expected_deviations,
    expected_difference,
    needed_difference,
    probability_distinguished,
    prospect,
)
from aerosid.loop.next_flight.flight_limits import UNITS, shown
from aerosid.loop.next_flight.input_design import DesignSettings, InputSearch, Trial
from aerosid.loop.next_flight.open_questions import REACH, CompetingModel, Unknown, competing_models
from aerosid.loop.next_flight.planned_flight import (
    NextFlight,
    PlannedHistory,
    PlannedInput,
    PlannedPeak,
    PlannedStep,
    Question,
)
from aerosid.loop.next_flight.predicted_flight import SURFACES
from aerosid.nomenclature import CHANNELS
from aerosid.search.attribution import Attribution


def plan_next_flight(
    found: Attribution,
    manoeuvres: Sequence[Manoeuvre],
    derivatives: Sequence[DerivativeRow],
    limits: Mapping[str, tuple[float, float]],
    settings: DesignSettings | None = None,
) -> NextFlight | None:
    """What to fly next; None where the flights left nothing open.

    Parameters
    ----------
    found : Attribution
        The chosen model and its alternatives.
    manoeuvres : sequence of Manoeuvre
        The records it was fitted to; the next flight begins in steady flight at the condition of the first.
    derivatives : sequence of DerivativeRow
        Those that are not significant are questions.
    limits : mapping of str to (float, float)
        Of `flight_limits.UNITS`, SI; those that are not given follow from what was flown.
    """
    settings = settings or DesignSettings()
    rivals, unknowns = competing_models(found, settings.rivals), _unknowns(found, derivatives)
    if not rivals and not unknowns:
        return None
    if found.completed.held_to_data > 0.0:
        return _nothing(rivals, unknowns, settings, 0, _RUNS_AWAY)
    estimates = (found.completed, *(rival.estimate for rival in rivals))
    if any(isinstance(active.effect, StateEffect) for one in estimates for active in one.effects):
        # Separation is simulated by repetition, its slopes by differences of whole simulations: fewer inputs then.
        settings = replace(settings, base_times=settings.base_times[1::2], refined=0)
    try:
        search = InputSearch(found, manoeuvres, rivals, unknowns, limits, settings)
    except EstimationError as error:
        return _nothing(rivals, unknowns, settings, 0, f"No input was designed: {error}")
    best, alone = search.best()
    moved = _surfaces(search)
    if best is None:
        note = f"No {moved} input stays within the limits from this trim."
        return _nothing(rivals, unknowns, settings, search.tried, note)
    questions = _assessed(search, best, alone)
    if all(question.repeats is None for question in questions):
        return NextFlight(
            None, questions, search.tried, f"No {moved} input within these limits answers an open question."
        )
    return NextFlight(_planned_input(search, best), questions, search.tried, "")


def _unknowns(found: Attribution, derivatives: Sequence[DerivativeRow]) -> tuple[Unknown, ...]:
    """The derivatives that are not significant but can be estimated."""
    uncertainty = found.completed_deviations
    names = [(coefficient, str(term)) for coefficient, term in found.completed.free]
    unknowns = []
    for row in derivatives:
        place = names.index((row.coefficient, row.term)) if (row.coefficient, row.term) in names else None
        # Aircraft are nearly symmetric: a constant of an asymmetric coefficient need not exist.
        if row.shown or place is None or (row.term == "1" and not is_symmetric(row.coefficient)):
            continue
        corrected, white = float(uncertainty.corrected[place]), float(uncertainty.white[place])
        known = np.isfinite(corrected) and np.isfinite(white) and white > 0.0
        estimate = row.value if row.estimate is None else row.estimate
        needed = JUDGEMENT.least_known(constant=row.term == "1") * max(abs(estimate), abs(row.declared or 0.0))
        if needed > 0.0:
            unknowns.append(
                Unknown(
                    label=derivative_name(row.coefficient, row.term),
                    place=place,
                    present=corrected,
                    needed=needed,
                    colour=max(1.0, corrected / white) if known else 1.0,
                )
            )
    return tuple(unknowns)


def _nothing(
    rivals: Sequence[CompetingModel], unknowns: Sequence[Unknown], settings: DesignSettings, tried: int, note: str
) -> NextFlight:
    """The questions where no input could be designed, without expected results."""
    open_ones = [_about_rival(rival, settings, None, None, None, _NOT_JUDGED) for rival in rivals]
    open_ones += [_about_derivative(unknown, None, None, _NOT_JUDGED) for unknown in unknowns]
    return NextFlight(None, tuple(open_ones), tried, note)


def _assessed(search: InputSearch, best: Trial, alone: NDArray[np.float64]) -> tuple[Question, ...]:
    """The questions with the results expected from the input, at the record's own sampling."""
    planned = search.planned(best.moves, search.fine)
    questions = []
    ahead = search.prospects(planned, search.simulated(search.chosen, planned)) if search.rivals else []
    for n, (rival, one) in enumerate(zip(search.rivals, ahead, strict=True)):
        back = _seen_by_chosen(search, planned, rival)

        def difference(
            count: int, rival: CompetingModel = rival, one: Prospect = one, back: Prospect | None = back
        ) -> float:
            ways = [expected_difference(rival.known, one, count)]
            if back is not None:
                ways.append(expected_difference(search.known, back, count))
            return min(ways) / search.colour

        repeats = next(
            (
                count
                for count in range(1, search.settings.repeats + 1)
                if probability_distinguished(difference(count), rival.present, REACH) >= search.settings.certain
            ),
            None,
        )
        expected = difference(1)
        probability = probability_distinguished(expected, rival.present, REACH)
        hint = "" if repeats is not None else _instead(rival, float(alone[n]), _surfaces(search))
        questions.append(_about_rival(rival, search.settings, expected, probability, repeats, hint))
    if search.unknowns:
        known = prospect(search.seen(search.chosen, planned), planned)
        for n, unknown in enumerate(search.unknowns, start=len(search.rivals)):
            ahead_of = [
                unknown.colour * float(expected_deviations(search.known, known, count)[unknown.place])
                for count in range(1, search.settings.repeats + 1)
            ]
            repeats = next(
                (count for count, deviation in enumerate(ahead_of, start=1) if deviation <= unknown.needed), None
            )
            hint = (
                ""
                if repeats is not None
                else _OWN_INPUT
                if alone[n] >= 1.0
                else _OTHER_CONDITION.format(_surfaces(search))
            )
            questions.append(_about_derivative(unknown, ahead_of[0], repeats, hint))
    return tuple(questions)


def _seen_by_chosen(search: InputSearch, planned: Manoeuvre, rival: CompetingModel) -> Prospect | None:
    """The planned flight with the competing model true, seen by the chosen model; None where it leaves its range."""
    flight = planned.flight
    response = search.simulated(rival.estimate, planned)
    true = replace(planned, flight=flight._replace(measured=np.where(np.isnan(flight.measured), np.nan, response)))
    try:
        return prospect(search.seen(search.chosen, planned), true)
    except OutOfRangeError:
        return None


def _about_rival(
    rival: CompetingModel,
    settings: DesignSettings,
    expected: float | None,
    probability: float | None,
    repeats: int | None,
    hint: str,
) -> Question:
    return Question(
        kind="alternative",
        subject=rival.instead_of,
        rival=rival.label,
        present=rival.present,
        expected=expected,
        needed=needed_difference(rival.present, REACH, settings.certain),
        probability=probability,
        repeats=repeats,
        elsewhere=hint,
    )


def _about_derivative(unknown: Unknown, expected: float | None, repeats: int | None, hint: str) -> Question:
    return Question(
        kind="derivative",
        subject=unknown.label,
        rival="",
        present=unknown.present if np.isfinite(unknown.present) else None,
        expected=expected if expected is None or np.isfinite(expected) else None,
        needed=unknown.needed,
        probability=None,
        repeats=repeats,
        elsewhere=hint,
    )


_RUNS_AWAY = (
    "The model is unstable in open loop: an input needs a pilot or a controller in the loop, which this design does "
    "not include."
)
_NOT_JUDGED = "Not assessed: no input was designed."
_OWN_INPUT = "Another input would answer it: fly this one first, then run again."
_OTHER_CONDITION = (
    "No {} input within these limits makes it significant; another trim (airspeed, centre of gravity, "
    "configuration) or wider limits are needed."
)


def _surfaces(search: InputSearch) -> str:
    """The surfaces that may be moved, joined by or."""
    return " or ".join(SURFACES[name] for name in search.steady.controls)


def _instead(rival: CompetingModel, share: float, surfaces: str) -> str:
    """Advice where the planned input does not decide: another input, or other means."""
    return _OWN_INPUT if share >= 1.0 else elsewhere(rival, surfaces)


def elsewhere(rival: CompetingModel, surfaces: str) -> str:
    """Means of distinguishing two effects that no input of some surfaces distinguishes."""
    kinds = rival.kinds
    if "gust" in kinds:
        what = "flights in calm air, or a measured flow angle ahead of the aircraft"
    elif all(kind.startswith("sensor_") for kind in kinds) and len(rival.places) == 1:
        what = "a calibration of that sensor on the ground, or a second sensor"
    elif all(kind.startswith("sensor_") for kind in kinds):
        what = "an independent sensor of one of the two channels, or its calibration on the ground"
    elif any(kind.startswith("sensor_") for kind in kinds):
        what = (
            "a second sensor of the channel, or another airspeed: an instrument error stays constant, an "
            "aerodynamic effect grows with the dynamic pressure"
        )
    elif any(kind.startswith("control_") for kind in kinds):
        what = "a position sensor on the surface itself"
    elif "step_change" in kinds:
        what = "a repeat of the flight, which shows whether the step change recurs"
    else:
        what = "another trim (airspeed, centre of gravity, flap or stabiliser setting)"
    return f"No {surfaces} input within these limits distinguishes them; required: {what}."


def _planned_input(search: InputSearch, best: Trial) -> PlannedInput:
    """The input with its steps and the peaks of the motion over all models in question."""
    planned = search.planned(best.moves, search.fine)
    responses = [search.simulated(one, planned) for one in (search.chosen, *(r.estimate for r in search.rivals))]
    surfaces, axes = search.surfaces(planned), search.axes
    histories = [shown(response, surfaces, axes) for response in responses]
    peaks = []
    for name, limits in search.limits.ranges.items():
        values = [history[name] for history in histories]
        peaks.append(_peak(name, UNITS[name], values, limits, name in search.limits.given))
    for name in (name for name in ("q", "p", "r") if name in axes.outputs):
        values = [response[:, axes.outputs.index(name)] for response in responses]
        peaks.append(_peak(name, CHANNELS[name].unit, values, None, False))
    moved = {move.surface: surfaces[move.surface] - search.steady.trim[move.surface] for move in best.moves}
    return PlannedInput(
        name=_name(search, best),
        steps=tuple(_steps(search, best)),
        amplitude=max(float(np.max(np.abs(deflection))) for deflection in moved.values()),
        rate=min(search.limits.rates[name] for name in moved),
        time=search.fine,
        deflections=moved,
        peaks=tuple(peaks),
        airspeed=search.steady.airspeed,
        density=float(search.steady.inputs[ATMOSPHERE_AND_BODY.index("rho")]),
        expected=_expected(search, responses),
        rival=search.rivals[0].label if search.rivals else "",
    )


def _name(search: InputSearch, best: Trial) -> str:
    """Name of an input for the pilot; with the surface where there are several."""
    if len(search.steady.controls) == 1:
        return best.moves[0].shape.name
    return " then ".join(f"{SURFACES[move.surface]} {move.shape.name}" for move in best.moves)


def _steps(search: InputSearch, best: Trial) -> Iterator[PlannedStep]:
    """The levels of all parts of an input that are steps."""
    for move, start in search.begun(best.moves):
        if isinstance(move.shape, Multisine):
            continue
        for duration, level in zip(move.shape.durations, move.shape.levels, strict=True):
            yield PlannedStep(round(start, 6), duration, level * move.amplitude, move.surface)
            start += duration


FOLLOWED = {
    LONGITUDINAL.name: ("alpha", "q", "theta", "a_z"),
    LATERAL.name: ("beta", "p", "r", "phi", "a_y"),
    SIX.name: ("alpha", "q", "beta", "p", "r", "phi"),
}
"""Channels that a pilot and an engineer follow, by the case."""


def _expected(search: InputSearch, responses: Sequence[NDArray[np.float64]]) -> dict[str, PlannedHistory]:
    """The histories of those channels by the chosen and the first competing model."""
    chosen, *rivals = responses
    histories = {}
    for name in FOLLOWED[search.axes.name]:
        column = search.axes.outputs.index(name)
        rival = rivals[0][:, column] if rivals else None
        histories[name] = PlannedHistory(CHANNELS[name].unit, chosen[:, column], rival)
    return histories


def _peak(
    name: str, unit: str, values: Sequence[NDArray[np.float64]], limits: tuple[float, float] | None, given: bool
) -> PlannedPeak:
    low, high = limits or (None, None)
    trim = float(values[0][0])
    return PlannedPeak(
        name=name,
        unit=unit,
        trim=trim,
        lowest=trim + min(float(np.min(one - one[0])) for one in values),
        highest=trim + max(float(np.max(one - one[0])) for one in values),
        limit_low=low,
        limit_high=high,
        given=given,
    )
