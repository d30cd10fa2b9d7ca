"""Causes that one airspeed cannot tell from a step of a moment: thrust to one side, a centre of gravity to one side.

Thrust T that acts y to the left of the centre of gravity yaws as C_n = T y/(q_bar S b) does, weight W that lies y to
the right of the plane of symmetry rolls as C_l = W y/(q_bar S b) does. While the airspeed stays, the step of a
coefficient or a term in C_T says the same to every sensor; the arm says what an inspection would look for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.constants import GRAVITY
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, labels, named


def with_equivalent_causes(found: Attribution, aircraft: Aircraft, manoeuvres: Sequence[Manoeuvre]) -> Attribution:
    """What was found, with the arms that would do the same among its alternatives.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
        The identification flights, at whose mean dynamic pressure, thrust and weight the arms are told.
    """
    known = labels((*found.findings, *found.alternatives))
    added = [
        cause
        for finding in found.findings
        for cause in _causes(finding, aircraft, manoeuvres)
        if (cause.kind, cause.where, cause.term) not in known
    ]
    return replace(found, alternatives=(*found.alternatives, *added)) if added else found


def _causes(finding: Finding, aircraft: Aircraft, manoeuvres: Sequence[Manoeuvre]) -> Iterator[Finding]:
    """The arm that would do what a finding does, where there is one."""
    if aircraft.span is None:
        return
    label = finding.kind, finding.where, finding.term
    moment = aircraft.span * aircraft.wing_area * _mean(manoeuvres, _pressure)
    if label == ("step_change", "C_n", ""):
        thrust = _mean(manoeuvres, lambda flight: _column(flight, "thrust"))
        if thrust > 0.0:
            yield _arm("thrust_asymmetry", "thrust", finding, moment / thrust)
    elif label == ("step_change", "C_l", ""):
        weight = GRAVITY * _mean(manoeuvres, lambda flight: _column(flight, "mass"))
        yield _arm("cg_shift", "y", finding, moment / weight)
    elif label == ("aero_term", "C_n", "C_T"):
        yield _arm("thrust_asymmetry", "thrust", finding, aircraft.span)


def _arm(kind: str, where: str, finding: Finding, metres: float) -> Finding:
    """An arm in place of a finding; `metres`: of one unit of it."""
    return replace(
        finding,
        kind=kind,
        where=where,
        term="",
        entry=None,
        value=metres * finding.value,
        std_error=metres * finding.std_error,
        unit="m",
        instead_of=named((finding.kind, finding.where, finding.term)),
        parameters=(),
    )


def _mean(manoeuvres: Sequence[Manoeuvre], of: Callable[[Manoeuvre], np.ndarray]) -> float:
    """The mean over all samples of some flights."""
    return float(np.nanmean(np.concatenate([of(manoeuvre) for manoeuvre in manoeuvres])))


def _column(manoeuvre: Manoeuvre, name: str) -> np.ndarray:
    """An input column, (N,), SI."""
    return np.asarray(manoeuvre.flight.inputs[:, manoeuvre.columns.index(name)])


def _pressure(manoeuvre: Manoeuvre) -> np.ndarray:
    """Dynamic pressure, (N,), Pa, by the measured airspeed."""
    measured = "V" in manoeuvre.columns
    speed = _column(manoeuvre, "V") if measured else manoeuvre.flight.measured[:, manoeuvre.row("V")]
    return np.asarray(0.5 * _column(manoeuvre, "rho") * speed**2)
