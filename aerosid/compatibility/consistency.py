"""Data compatibility check of recordings alone: kinematic equations of their channels, no aircraft and no model.

Flight-path reconstruction: attitude, flow angle, airspeed and altitude follow from accelerometers and gyros without any
aerodynamics, so that what their sensors show beside the path is the instruments' and the air's. Klein & Morelli,
Aircraft System Identification, chapter 10; Jategaonkar, Flight Vehicle System Identification, 2nd ed., chapter 10.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.compatibility.agreement import Agreement, KinematicConsistency
from aerosid.compatibility.contradiction import contradictions
from aerosid.compatibility.flight_path import GIVEN, SEEN
from aerosid.compatibility.proved_agreement import agreement_of
from aerosid.compatibility.recording import Recording, lacking, read_recording
from aerosid.compatibility.settings import USUAL, CompatibilitySettings
from aerosid.effects.hypothesis import Hypothesis
from aerosid.effects.limits import OFFERED
from aerosid.effects.sensor import sensor_offers
from aerosid.equation_error.equations.instrumental_variables import CONTROLS
from aerosid.equation_error.selection.instrument_errors import identify_instrument_errors
from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.flight_model.axes import LONGITUDINAL, input_columns_of
from aerosid.flight_model.constants import Constants
from aerosid.flight_model.flight import Flight
from aerosid.logs.flight_log import FlightLog

NO_AIRCRAFT = Constants(1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0)
"""Geometry and inertia, 1 in SI units, where no equation holds any: those of kinematics."""


def check_kinematics(
    logs: Sequence[FlightLog], settings: CompatibilitySettings = USUAL, length: float | None = None
) -> KinematicConsistency | None:
    """What the kinematics of these logs say about their instruments; None where channels or seconds are too few.

    Parameters
    ----------
    logs : sequence of FlightLog
        Flights with the same instruments: one joint estimate.
    settings : CompatibilitySettings
        Limits of the check.
    length : float, optional
        Of the aircraft, m: no sensor is placed further from the centre of gravity than it reaches.
    """
    recordings, notes = _compared(logs, settings)
    if not recordings:
        return None
    opposed = _opposed(recordings, notes, settings)
    if opposed is not None:
        return opposed
    pieces = [manoeuvre for recording in recordings for manoeuvre in manoeuvres_of(recording)]
    manoeuvres = [piece for piece in pieces if float(np.ptp(piece.flight.time)) >= settings.shortest] or pieces
    noise = {name: _mean_noise(recordings, name) for name in _outputs(manoeuvres)}
    sensors = tuple(Hypothesis(offer.kind, offer.where, effects=offer.effects) for offer in sensor_offers(noise))
    model = AerodynamicModel((), np.zeros(0), manoeuvres[0].columns, NO_AIRCRAFT, LONGITUDINAL)
    equations = EquationErrorSettings(false_alarm=settings.false_alarm)
    longest = length or OFFERED.furthest / OFFERED.reach
    faults = identify_instrument_errors(model, (), (), sensors, manoeuvres, settings=equations, length=longest)
    return agreement_of(faults, settings, notes) if faults is not None else None


def contradicting(logs: Sequence[FlightLog], settings: CompatibilitySettings = USUAL) -> KinematicConsistency | None:
    """What no fault of an instrument reconciles; None where there is nothing of the kind, or too few channels."""
    recordings, notes = _compared(logs, settings)
    return _opposed(recordings, notes, settings) if recordings else None


def manoeuvres_of(recording: Recording) -> tuple[Manoeuvre, ...]:
    """Each stretch of a recording as the kinematic equations take it: its path, and its controls as instruments."""
    log, axes = recording.log, LONGITUDINAL
    controls = [name for name in log.channels if name.startswith(CONTROLS) and np.isfinite(log[name]).sum() > 1]
    columns = tuple(dict.fromkeys((*input_columns_of(axes), *controls)))
    inputs = np.zeros((recording.time.size, len(columns)))
    for name in controls:
        known = np.isfinite(log[name])
        inputs[:, columns.index(name)] = np.interp(recording.time, log.time[known], log[name][known])
    measured = np.full((recording.time.size, len(axes.outputs)), np.nan)
    noise, positions = np.full(len(axes.outputs), np.nan), np.zeros((len(axes.outputs), 3))
    for name in (*GIVEN, *SEEN):
        if name in axes.outputs and np.isfinite(recording.channel(name)).any():
            i = axes.outputs.index(name)
            measured[:, i], noise[i] = recording.channel(name), recording.noise[name]
            positions[i] = recording.positions.get(name, (0.0, 0.0, 0.0))
        elif name in columns:
            inputs[:, columns.index(name)] = recording.channel(name)
    found = []
    for stretch in recording.stretches:
        there = np.isfinite(measured[stretch]).any(axis=0)
        flight = Flight(
            recording.time[stretch],
            inputs[stretch],
            measured[stretch],
            positions,
            1,
            np.zeros(len(columns) - len(input_columns_of(axes))),
        )
        outputs = tuple(name for name, held in zip(axes.outputs, there, strict=True) if held)
        found.append(Manoeuvre(log, flight, columns, outputs, np.where(there, noise, np.nan), (), axes=axes))
    return tuple(found)


def _mean_noise(recordings: Sequence[Recording], channel: str) -> float:
    return float(np.mean([recording.noise[channel] for recording in recordings if channel in recording.noise]))


def _outputs(manoeuvres: Sequence[Manoeuvre]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for manoeuvre in manoeuvres for name in manoeuvre.outputs))


def _compared(logs: Sequence[FlightLog], settings: CompatibilitySettings) -> tuple[list[Recording], tuple[str, ...]]:
    """The logs as arrays, and what was left out of them."""
    read = [(log, read_recording(log, settings.stretches)) for log in logs]
    recordings = [recording for _, recording in read if recording is not None]
    notes = tuple(_left_out(log, settings) for log, recording in read if recording is None)
    notes += tuple(
        f"{r.log.name}: the liveliest {r.compared_samples} of {r.log.samples} samples are looked at."
        for r in recordings
        if r.log.samples > settings.stretches.most_samples
    )
    return recordings, notes


def _opposed(
    recordings: Sequence[Recording], notes: tuple[str, ...], settings: CompatibilitySettings
) -> KinematicConsistency | None:
    opposed = contradictions(recordings, settings.contradiction)
    if not opposed:
        return None
    names = tuple(recording.log.name for recording in recordings)
    sentence = " ".join(each.sentence for each in opposed)
    return KinematicConsistency(names, Agreement.INCONSISTENT, (), (), (), (), sentence, notes, opposed)


def _left_out(log: FlightLog, settings: CompatibilitySettings) -> str:
    absent = lacking(log, settings.stretches)
    why = f"it lacks {', '.join(absent)}" if absent else "no stretch of 3 s is without gaps"
    return f"{log.name}: its instruments cannot be compared by kinematics, {why}."
