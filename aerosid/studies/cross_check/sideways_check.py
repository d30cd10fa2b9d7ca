"""Lateral check of one aircraft of JSBSim: simulation, close-loop, comparison with the true derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from aerosid.flight_model.axes import LATERAL
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.result import ClosedLoop
from aerosid.studies.cross_check.polynomial import term_at
from aerosid.studies.cross_check.stock_check import Compared, closed_on, held_to_truth, require_condition
from aerosid.studies.jsbsim.control_inputs import ControlInput, sequence
from aerosid.studies.jsbsim.derivatives import LATERAL_COEFFICIENTS, LATERAL_VARIABLES
from aerosid.studies.jsbsim.plan import FlightPlan
from aerosid.studies.jsbsim.stock import CONDITIONS
from aerosid.studies.settings import CROSS_CHECK

_UNIT, _INTERVAL = 1.0, 0.04
"""Design: s; half the doublets, and the sampling interval."""

_SPANWISE = {"p_hat": "p", "r_hat": "r"}


@dataclass(frozen=True)
class SidewaysCheck:
    """Result of the lateral cross-check of one aircraft.

    Attributes
    ----------
    name : str
    airspeed, altitude : float
        m/s, m.
    flown : mapping of str to (float, float)
        Ranges of beta, aileron and rudder [rad], p and r [rad/s] of the identification flight.
    result : ClosedLoop
        For the declared model in C_Y, C_l and C_n only: V, alpha, q and theta are measured.
    rows : tuple of Compared
    errors : tuple of ErrorRow
        On the hold-out flight.
    """

    name: str
    airspeed: float
    altitude: float
    flown: Mapping[str, tuple[float, float]]
    result: ClosedLoop
    rows: tuple[Compared, ...]
    errors: tuple[ErrorRow, ...]


def check_sideways(name: str, amplitude: float, seed: int) -> SidewaysCheck:
    """Fly an aileron doublet and a rudder 2-1-1 for identification, in reverse order for prediction.

    Parameters
    ----------
    name : str
        Of an aircraft of JSBSim with a condition in `CONDITIONS`.
    amplitude : float
        rad.
    seed : int

    Raises
    ------
    UsageError
        Where no condition is known for the aircraft.
    """
    require_condition(name)
    airspeed, altitude = CONDITIONS[name]

    def inputs(*moves: tuple[str, str]) -> list[ControlInput]:
        return [ControlInput(control, shape, amplitude, _UNIT) for control, shape in moves]

    first = sequence(inputs(("delta_a", "doublet"), ("delta_r", "211")), None, _INTERVAL)
    second = sequence(inputs(("delta_r", "doublet"), ("delta_a", "211")), None, _INTERVAL)
    plan = FlightPlan(name, first, airspeed, altitude, seed=seed, planes=(LATERAL.name,))
    fitted, _, result = closed_on(plan, replace(plan, manoeuvre=second, seed=seed + 1))
    ranges = {key: fitted.truth["flown"][_SPANWISE.get(key, key)] for key in LATERAL_VARIABLES}
    return SidewaysCheck(
        name=name,
        airspeed=airspeed,
        altitude=altitude,
        flown={key: (float(low), float(high)) for key, (low, high) in ranges.items()},
        result=result,
        rows=compare_sideways(result, fitted.truth),
        errors=tuple(row for row in result.errors if row.role == "validation"),
    )


def compare_sideways(result: ClosedLoop, truth: Mapping[str, Any]) -> tuple[Compared, ...]:
    """Each lateral derivative of the completed model with JSBSim's: slopes over the flown range."""
    completed, trim = result.completed_aircraft, truth["trim"]
    half = float(completed.span or 0.0) / (2.0 * trim["airspeed"])
    level = {name: trim[name] for name in ("alpha", "beta", "delta_a", "delta_r")}
    shown = {(row.coefficient, row.term): row.shown for row in result.derivatives}
    true = {(row["coefficient"], row["term"]): row for row in truth["derivatives"]}
    rows = []
    for coefficient in LATERAL_COEFFICIENTS:
        own = [entry for entry in completed.derivatives if entry.coefficient == coefficient]
        for variable in LATERAL_VARIABLES:
            low, high = truth["flown"][_SPANWISE.get(variable, variable)]
            scale = half if variable in _SPANWISE else 1.0
            ends = [{**level, variable: scale * end} for end in (low, high)]
            width = scale * (high - low)
            rises = [(term_at(entry.term, ends[1]) - term_at(entry.term, ends[0])) / width for entry in own]
            estimate = sum(entry.value * rise for entry, rise in zip(own, rises, strict=True))
            spread = np.sqrt(sum(((entry.sigma or 0.0) * rise) ** 2 for entry, rise in zip(own, rises, strict=True)))
            row = true[coefficient, variable]
            made = Compared(
                coefficient, variable, estimate, float(spread), row["frozen"], row["self_consistent"], row["chord"],
                False, shown[coefficient, variable],
            )  # fmt: skip
            rows.append(held_to_truth(made, CROSS_CHECK.least))
    return tuple(rows)
