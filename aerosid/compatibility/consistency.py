"""Data compatibility check of recordings alone: kinematic equations of their channels, no aircraft and no model.

Flight-path reconstruction: attitude, flow angle, airspeed and altitude follow from accelerometers and gyros without any
aerodynamics, so that deviations of their sensors from the path are due to the instruments and the air. Klein & Morelli,
Aircraft System Identification, chapter 10; Jategaonkar, Flight Vehicle System Identification, 2nd ed., chapter 10.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.compatibility.agreement import Agreement, KinematicConsistency
from aerosid.compatibility.contradiction import contradictions
from aerosid.compatibility.flight_path import DRIVING, GIVEN, OBSERVED
from aerosid.compatibility.gross_errors import CLOCKS
from aerosid.compatibility.instrument_agreement import agreement_of
from aerosid.compatibility.recording import STRETCHES, Recording, missing_channels, read_recording
from aerosid.compatibility.settings import USUAL
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.limits import OFFERED
from aerosid.effects.sensor import sensor_offers
from aerosid.equation_error.equations.instrumental_variables import is_control
from aerosid.equation_error.selection.instrument_errors import identify_instrument_errors
from aerosid.equation_error.selection.joint_errors import DELAY, DELAY_KINDS
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, input_columns_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight
from aerosid.logs.flight_log import FlightLog

NO_AIRCRAFT = Constants(1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0)
"""Geometry and inertia, 1 in SI units: the kinematic equations do not depend on them."""

DRIVES = {name: [output for output, clocks in CLOCKS.items() if name in clocks] for name in DRIVING}
"""The outputs that follow from a gyro or an accelerometer by integration."""


def check_kinematics(logs: Sequence[FlightLog], length: float | None = None) -> KinematicConsistency | None:
    """Data compatibility check of some logs; None where channels or seconds are too few.

    Parameters
    ----------
    logs : sequence of FlightLog
        Flights with the same instruments: one joint estimate.
    length : float, optional
        Of the aircraft, m: bounds the distance of a sensor from the centre of gravity.
    """
    recordings, notes = _recordings(logs)
    if not recordings:
        return None
    contradictory = _contradictory(recordings, notes)
    if contradictory is not None and not _may_be_delays(contradictory):
        return contradictory
    identified = _identified(recordings, notes, length)
    return identified if contradictory is None or _finds_delays(identified, contradictory) else contradictory


def _identified(
    recordings: Sequence[Recording], notes: tuple[str, ...], length: float | None = None
) -> KinematicConsistency | None:
    """The instrument errors that the kinematic equations of all recordings show; None where there are too few."""
    pieces = [manoeuvre for recording in recordings for manoeuvre in manoeuvres_of(recording)]
    manoeuvres = [piece for piece in pieces if float(np.ptp(piece.flight.time)) >= USUAL.shortest] or pieces
    noise = {name: _mean_noise(recordings, name) for name in _outputs(manoeuvres)}
    sensors = tuple(Hypothesis(offer.kind, offer.where, effects=offer.effects) for offer in sensor_offers(noise))
    model = AerodynamicModel((), np.zeros(0), manoeuvres[0].columns, NO_AIRCRAFT, LONGITUDINAL)
    equations = EquationErrorSettings(false_alarm=USUAL.false_alarm)
    longest = length or OFFERED.furthest / OFFERED.reach
    instrument_errors = identify_instrument_errors(
        model, (), (), sensors, manoeuvres, settings=equations, length=longest
    )
    return agreement_of(instrument_errors, notes) if instrument_errors is not None else None


def contradicting(logs: Sequence[FlightLog]) -> KinematicConsistency | None:
    """Contradictions that no instrument error reconciles; None where there are none, or too few channels."""
    recordings, notes = _recordings(logs)
    contradictory = _contradictory(recordings, notes) if recordings else None
    if contradictory is None or not _may_be_delays(contradictory):
        return contradictory
    return None if _finds_delays(_identified(recordings, notes), contradictory) else contradictory


def manoeuvres_of(recording: Recording) -> tuple[Manoeuvre, ...]:
    """Each stretch of a recording as a manoeuvre for the kinematic equations, with its controls as instruments."""
    log, axes = recording.log, LONGITUDINAL
    controls = [name for name in log.channels if is_control(name) and np.isfinite(log[name]).sum() > 1]
    columns = tuple(dict.fromkeys((*input_columns_of(axes), *controls)))
    inputs = np.zeros((recording.time.size, len(columns)))
    for name in controls:
        known = np.isfinite(log[name])
        inputs[:, columns.index(name)] = np.interp(recording.time, log.time[known], log[name][known])
    measured = np.full((recording.time.size, len(axes.outputs)), np.nan)
    noise, positions = np.full(len(axes.outputs), np.nan), np.zeros((len(axes.outputs), 3))
    for name in (*GIVEN, *OBSERVED):
        if name in axes.outputs and np.isfinite(recording.channel(name)).any():
            i = axes.outputs.index(name)
            measured[:, i], noise[i] = recording.channel(name), recording.noise[name]
            positions[i] = recording.positions.get(name, (0.0, 0.0, 0.0))
        elif name in columns:
            inputs[:, columns.index(name)] = recording.channel(name)
    found = []
    for stretch in recording.stretches:
        present = np.isfinite(measured[stretch]).any(axis=0)
        flight = Flight(
            recording.time[stretch],
            inputs[stretch],
            measured[stretch],
            positions,
            1,
            np.zeros(len(columns) - len(input_columns_of(axes))),
        )
        outputs = tuple(name for name, held in zip(axes.outputs, present, strict=True) if held)
        found.append(Manoeuvre(log, flight, columns, outputs, np.where(present, noise, np.nan), (), axes=axes))
    return tuple(found)


def _mean_noise(recordings: Sequence[Recording], channel: str) -> float:
    return float(np.mean([recording.noise[channel] for recording in recordings if channel in recording.noise]))


def _outputs(manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for manoeuvre in manoeuvres for name in manoeuvre.outputs))


def _recordings(logs: Sequence[FlightLog]) -> tuple[list[Recording], tuple[str, ...]]:
    """The logs as arrays, and notes on excluded ones."""
    read = [(log, read_recording(log)) for log in logs]
    recordings = [recording for _, recording in read if recording is not None]
    notes = tuple(_exclusion_note(log) for log, recording in read if recording is None)
    notes += tuple(
        f"{r.log.name}: only the {r.compared_samples} of {r.log.samples} samples with most pitching are compared."
        for r in recordings
        if r.log.samples > STRETCHES.most_samples
    )
    return recordings, notes


def _contradictory(recordings: Sequence[Recording], notes: tuple[str, ...]) -> KinematicConsistency | None:
    contradictory = contradictions(recordings, USUAL.contradiction)
    if not contradictory:
        return None
    names = tuple(recording.log.name for recording in recordings)
    sentence = " ".join(each.sentence for each in contradictory)
    return KinematicConsistency(names, Agreement.INCONSISTENT, (), (), (), (), sentence, notes, contradictory)


def _may_be_delays(contradictory: KinematicConsistency) -> bool:
    """Whether each contradiction is that of a clock, off by no more than an instrument may be late."""
    latest = USUAL.contradiction.latest
    return all(
        each.clocks and all(abs(late) <= latest for _, late in each.clocks) for each in contradictory.contradictions
    )


def _finds_delays(identified: KinematicConsistency | None, contradictory: KinematicConsistency) -> bool:
    """Whether the time delays of contradicting channels are identified: they are instrument errors then.

    The kinematic equations find a delay from small ones on, and a larger one in slow motions alone: where they lose it,
    they take it for turbulence or errors of other instruments. Of corrections that the recording does not distinguish
    one suffices.
    """
    findings = identified.findings if identified is not None else ()
    timings = [each for each in findings if each.kind in DELAY_KINDS]
    late = {each.where: sum(other.value for other in timings if other.where == each.where) for each in timings}
    delays = {each.where: late[each.where] for each in timings if each.kind == DELAY}

    def is_found(channel: str, by: float) -> bool:
        same = USUAL.contradiction.same_delay
        if channel in late:
            return abs(delays.get(channel, np.inf) - by) < same
        # Only relative times show: a rate is early by what all that it drives is late.
        driven = DRIVES.get(channel, ())
        return bool(driven) and all(abs(late.get(output, np.inf) + by) < same for output in driven)

    return all(any(is_found(*clock) for clock in each.clocks) for each in contradictory.contradictions)


def _exclusion_note(log: FlightLog) -> str:
    absent = missing_channels(log)
    why = f"it lacks {', '.join(absent)} or they never change" if absent else "no stretch of 3 s is without gaps"
    return f"{log.name}: its instruments cannot be compared by kinematics, {why}."
