"""The result for recordings whose channels contradict each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import aerosid
from aerosid.aircraft import Aircraft
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.open_loop import respond
from aerosid.flight_model.aerodynamics import AerodynamicModel
from aerosid.logs.flight_log import FlightLog
from aerosid.loop.completed_aircraft import completion_record
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.identification import Identification
from aerosid.loop.model_error_pictures import PrefilterNote
from aerosid.loop.model_validation.goodness import CorrelationMatrix
from aerosid.loop.model_validation.open_loop_errors import ErrorRow, Simulated
from aerosid.loop.provenance import Provenance
from aerosid.loop.result import ClosedLoop
from aerosid.loop.roles import Role
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict
from aerosid.nomenclature import CHANNELS


def contradicted_loop(
    identified: Identification,
    aircraft: Aircraft,
    settings: LoopSettings,
    provenance: Provenance,
    hold_out: Sequence[FlightLog] = (),
) -> ClosedLoop:
    """The result of a loop that stops: the declared model as it was, its errors, and what contradicts what.

    Nothing is estimated but initial states; the sentence of the instruments' check becomes the summary.
    """
    manoeuvres, agreement = identified.manoeuvres, identified.agreement
    assert agreement is not None
    logs: dict[Role, Sequence[FlightLog]] = {"identification": [m.log for m in manoeuvres]}
    record = completion_record(aircraft, logs, Verdict.INCONSISTENT_DATA, provenance)
    pairs = [_declared_alone(identified.declared, manoeuvre) for manoeuvre in manoeuvres]
    return ClosedLoop(
        version=aerosid.__version__,
        seed=settings.seed,
        settings=settings,
        aircraft=aircraft,
        completed_aircraft=aircraft.completed({}, record=record),
        identification=tuple(m.log for m in manoeuvres),
        validation=tuple(m.log for m in identified.validation),
        verdict=Verdict.INCONSISTENT_DATA,
        summary=f"{agreement.sentence} The aerodynamics were not identified.",
        effects=(),
        alternatives=(),
        derivatives=tuple(
            DerivativeRow(d.coefficient, str(d.term), d.value, None, d.value, None, None, None, None, None, False)
            for d in aircraft.derivatives
        ),
        coefficients=(),
        errors=tuple(row for _, rows in pairs for row in rows),
        simulated=tuple(simulated for simulated, _ in pairs),
        screening=(),
        model_error=(),
        prefilter=PrefilterNote("off", None, "The channels contradict each other: d(t) is not estimated.", ""),
        fit=(),
        innovations=(),
        correlation=CorrelationMatrix((), ()),
        notes=tuple(f"{m.log.name}: {note}" for m in manoeuvres for note in (*m.log.notes, *m.notes)),
        kinematics=agreement,
        hold_out=tuple(hold_out),
        provenance=provenance,
    )


def _declared_alone(declared: AerodynamicModel, manoeuvre: Manoeuvre) -> tuple[Simulated, list[ErrorRow]]:
    """The declared model's simulation of one log; there is no other."""
    variance = np.where(np.isfinite(manoeuvre.noise), np.maximum(manoeuvre.noise, 1e-9), 1.0) ** 2
    response = respond(declared, manoeuvre, variance)
    absent = np.full(manoeuvre.flight.time.size, np.nan)
    places = {name: manoeuvre.row(name) for name in manoeuvre.outputs}
    nothing = dict.fromkeys(places, absent)
    simulated = Simulated(
        log=manoeuvre.log,
        role="identification",
        measured={name: manoeuvre.flight.measured[:, i] for name, i in places.items()},
        declared={name: response.outputs[:, i] for name, i in places.items()},
        before=nothing,
        after=nothing,
        trimmed=nothing,
    )
    rows = [
        ErrorRow(
            log=manoeuvre.log.name,
            role="identification",
            channel=name,
            unit=CHANNELS[name].unit,
            declared=response.rms[name],
            before=None,
            after=None,
            trimmed=None,
            noise=float(manoeuvre.noise[i]),
        )
        for name, i in places.items()
    ]
    return simulated, rows
