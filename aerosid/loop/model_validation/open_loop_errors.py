"""Errors of the declared, re-estimated, completed and trimmed model in open loop, on every log and channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft
from aerosid.effects import KINDS, ActiveEffect
from aerosid.effects.step_input import instant_of, step_changes_on
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.open_loop import Response, on_log, respond
from aerosid.estimation.unseen_step_changes import events_of
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.logs.channel_noise import channel_noise
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.roles import ROLES
from aerosid.model_error.paper_chain.coefficient_match import CoefficientRow, explained_shares
from aerosid.nomenclature import CHANNELS
from aerosid.notation import listed
from aerosid.search.attribution import Attribution

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ErrorRow:
    """Root-mean-square of measured minus simulated (open loop) of one channel on one log; None where it diverged."""

    log: str
    role: str
    channel: str
    unit: str
    declared: float | None
    before: float | None
    after: float | None
    trimmed: float | None
    noise: float
    r2_trimmed: float | None = None
    """Share of the measured variance that the trimmed simulation explains."""
    noise_doubt: str = ""
    """Why the noise, estimated from the log, is not to be believed; empty where it is."""


@dataclass(frozen=True, repr=False)
class Simulated:
    """Open-loop responses on one log, all in SI; NaN where a simulation left its range.

    `measured`, `declared`, `before`, `after`, `trimmed`: channel -> (N,).
    """

    log: FlightLog
    role: str
    measured: Mapping[str, FloatArray]
    declared: Mapping[str, FloatArray]
    before: Mapping[str, FloatArray]
    after: Mapping[str, FloatArray]
    trimmed: Mapping[str, FloatArray]

    def __repr__(self) -> str:
        """One line, however long the log."""
        return f"<Simulated {self.log.name} ({self.role}): {', '.join(self.measured)}>"


def compare(
    declared: AerodynamicModel,
    found: Attribution,
    aircraft: Aircraft,
    manoeuvres: Sequence[Manoeuvre],
    others: Sequence[Manoeuvre],
    held_out: Sequence[Manoeuvre] = (),
) -> tuple[list[Simulated], list[ErrorRow], list[CoefficientRow]]:
    """Open-loop simulations and their errors on every log, and the shares of the measured coefficients explained."""
    simulated, rows, shares = [], [], []
    variance = found.completed.variance
    logs = [
        (manoeuvre, role)
        for role, flights in zip(ROLES, (manoeuvres, others, held_out), strict=True)
        for manoeuvre in flights
    ]
    doubts = noise_doubts([manoeuvre for manoeuvre, _ in logs])
    for n, (manoeuvre, role) in enumerate(logs):
        effects, given = on_log(found.completed, manoeuvre), on_log(found.before, manoeuvre)
        # Each search of an initial state begins at the nearest one known: the estimate's own, or the last model's.
        fitted = n < len(manoeuvres)
        # The constants of single records are the estimate's and no part of the file.
        plain = respond(declared, manoeuvre, variance, effects=[each for each in given if each.effect.kind in KINDS])
        at = found.before.states[n] if fitted else plain.states[0]
        before = respond(found.before.model, manoeuvre, variance, effects=given, state=at)
        at = found.completed.states[n] if fitted else before.states[0]
        after = respond(found.completed.model, manoeuvre, variance, effects=effects, state=at)
        trimmed = respond(
            found.completed.model,
            manoeuvre,
            variance,
            effects=effects,
            constants_of=aircraft.coefficients,
            biases=True,
            state=after.states[0],
        )
        responses = {"declared": plain, "before": before, "after": after, "trimmed": trimmed}
        simulated.append(_simulated(manoeuvre, role, responses))
        rows.extend(_error_rows(manoeuvre, role, responses, doubts))
        shares.extend(explained_shares((found.before.model, given), (found.completed.model, effects), manoeuvre))
    return simulated, rows, shares


def notes_on_step_changes(found: Attribution, others: Sequence[Manoeuvre]) -> list[str]:
    """A note for each log that was not fitted on which step changes act at instants taken from that log itself."""
    notes = []
    for manoeuvre in others:
        events = events_of(step_changes_on(on_log(found.completed, manoeuvre), manoeuvre.name))
        if events:
            acting = listed(
                [f"{listed(list(map(_subject, event)))} at {instant_of(event[0]):.1f} s" for event in events]
            )
            notes.append(
                f"{manoeuvre.name}: the completed model is simulated with step changes of {acting}. The instants are "
                "from this log, as no channel shows them; the sizes are those estimated on the fitted logs."
            )
    return notes


def _subject(active: ActiveEffect) -> str:
    """What a step change changes."""
    kind, where = active.name
    return f"the centre of gravity along {where}" if kind == "cg_shift" else where


def _simulated(manoeuvre: Manoeuvre, role: str, responses: dict[str, Response]) -> Simulated:
    names = manoeuvre.outputs

    def channels(values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        return {name: values[:, manoeuvre.row(name)] for name in names}

    return Simulated(
        log=manoeuvre.log,
        role=role,
        measured=channels(manoeuvre.flight.measured),
        **{variant: channels(response.outputs) for variant, response in responses.items()},
    )


def noise_doubts(manoeuvres: Sequence[Manoeuvre]) -> dict[str, str]:
    """Why the noise of a channel cannot be estimated, by channel, where that is so on any of the logs.

    One installation recorded them: what was filtered on one flight was filtered on the others, whatever a short record
    of theirs lets be told.
    """
    doubts: dict[str, str] = {}
    for manoeuvre in manoeuvres:
        for name in manoeuvre.outputs:
            doubt = channel_noise(manoeuvre.log, name).doubt
            if doubt:
                doubts.setdefault(name, doubt)
    return doubts


def _error_rows(
    manoeuvre: Manoeuvre, role: str, responses: dict[str, Response], doubts: Mapping[str, str]
) -> list[ErrorRow]:
    rows = []
    for name in manoeuvre.outputs:
        i = manoeuvre.row(name)
        trimmed = responses["trimmed"].rms[name]
        variance = float(np.nanvar(manoeuvre.flight.measured[:, i]))
        rows.append(
            ErrorRow(
                log=manoeuvre.log.name,
                role=role,
                channel=name,
                unit=CHANNELS[name].unit,
                declared=responses["declared"].rms[name],
                before=responses["before"].rms[name],
                after=responses["after"].rms[name],
                trimmed=trimmed,
                noise=float(manoeuvre.noise[i]),
                r2_trimmed=None if trimmed is None or variance == 0.0 else 1.0 - trimmed**2 / variance,
                noise_doubt="" if name in manoeuvre.log.noise else doubts.get(name, ""),
            )
        )
    return rows
