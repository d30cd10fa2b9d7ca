"""Causes indistinguishable at one airspeed from a step of a moment: lateral offset of thrust or centre of gravity.

Thrust T at y to the left of the centre of gravity has the yawing moment C_n = T y/(q_bar S b), weight W at y to the
right of the plane of symmetry the rolling moment C_l = W y/(q_bar S b). At constant airspeed a step of a coefficient or
a term in C_T has the same response in every sensor; the lever arm is what an inspection can check.
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
    """The attribution with the lever arms of equal effect among its alternatives.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
        The identification flights, whose mean dynamic pressure, thrust and weight give the arms.
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
    """The lever arm with the effect of a finding, where there is one."""
    if aircraft.span is None:
        return
    label = finding.kind, finding.where, finding.term
    moment_per_unit = aircraft.span * aircraft.wing_area * _mean(manoeuvres, _pressure)
    if label == ("step_change", "C_n", ""):
        thrust = _mean(manoeuvres, lambda flight: _column(flight, "thrust"))
        if thrust > 0.0:
            yield _arm("thrust_asymmetry", "thrust", finding, moment_per_unit / thrust)
    elif label == ("step_change", "C_l", ""):
        weight = GRAVITY * _mean(manoeuvres, lambda flight: _column(flight, "mass"))
        yield _arm("cg_shift", "y", finding, moment_per_unit / weight)
    elif label == ("aero_term", "C_n", "C_T"):
        yield _arm("thrust_asymmetry", "thrust", finding, aircraft.span)


def _arm(kind: str, where: str, finding: Finding, metres: float) -> Finding:
    """A lever arm in place of a finding; `metres`: arm per unit of the finding."""
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
