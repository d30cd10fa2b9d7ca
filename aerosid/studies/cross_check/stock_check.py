"""Check of one aircraft of JSBSim: simulation, close-loop, comparison of derivatives, and the exported result flown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from aerosid.aircraft import Aircraft
from aerosid.errors import EstimationError, UsageError
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.result import ClosedLoop
from aerosid.studies.cross_check.polynomial import coefficients_at, term_at
from aerosid.studies.cross_check.tables import TablePoint, follow_tables
from aerosid.studies.jsbsim.control_inputs import manoeuvre
from aerosid.studies.jsbsim.flight import fly_jsbsim
from aerosid.studies.jsbsim.plan import FlightPlan, JsbsimFlight
from aerosid.studies.jsbsim.stock import CONDITIONS
from aerosid.studies.settings import CROSS_CHECK

_COMPARED = (
    ("C_Z", "alpha"),
    ("C_Z", "q_hat"),
    ("C_Z", "delta_e"),
    ("C_m", "alpha"),
    ("C_m", "q_hat"),
    ("C_m", "delta_e"),
)
_SPAN = {"alpha": "alpha", "q_hat": "q", "delta_e": "delta_e"}


@dataclass(frozen=True)
class Compared:
    """One derivative with its true value.

    Attributes
    ----------
    coefficient, term : str
    estimate, std_error : float
        Slope of the completed polynomial over the flown range, its corrected standard error. Where the polynomial has
        alpha_dot_hat, alphadot is self-consistent here too: it follows the variable as in JSBSim.
    frozen, self_consistent, chord : float
        Of JSBSim, locally with alphadot frozen and self-consistent, and over the flown range.
    agrees : bool
    shown : bool
        Whether the flight contains enough information on it.
    """

    coefficient: str
    term: str
    estimate: float
    std_error: float
    frozen: float
    self_consistent: float
    chord: float
    agrees: bool
    shown: bool

    @property
    def truth(self) -> float:
        """Reference of the estimate: the local slope, or the chord slope where the tables bend."""
        bent = abs(self.chord - self.self_consistent) > CROSS_CHECK.bends * abs(self.self_consistent)
        return self.chord if bent else self.self_consistent


@dataclass(frozen=True)
class StockCheck:
    """Result of the cross-check of one aircraft.

    Attributes
    ----------
    name, title : str
    airspeed, altitude : float
    flown : mapping of str to (float, float)
        Ranges of the identification flight.
    result : ClosedLoop
    rows : tuple of Compared
    errors : tuple of ErrorRow
        On the hold-out doublet.
    flown_again : mapping of str to float or None
        Greatest difference over peak-to-peak value between JSBSim flying the completed model and the aircraft itself
        on the hold-out doublet, in w and q; None where the completed model does not trim or leaves its range.
    tables : tuple of TablePoint
        Coefficients of aircraft and completed model over alpha.
    """

    name: str
    title: str
    airspeed: float
    altitude: float
    flown: Mapping[str, tuple[float, float]]
    result: ClosedLoop
    rows: tuple[Compared, ...]
    errors: tuple[ErrorRow, ...]
    flown_again: Mapping[str, float] | None
    tables: tuple[TablePoint, ...]


def check_aircraft(name: str, amplitude: float, seed: int) -> StockCheck:
    """Fly a 3-2-1-1 for identification and a doublet for prediction only, both with usual sensor noise.

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
    shape = manoeuvre("3211", amplitude, 0.6, 14.0, 0.02)
    plan = FlightPlan(name, shape, airspeed, altitude, seed=seed)
    unseen_plan = replace(plan, manoeuvre=manoeuvre("doublet", amplitude, 1.0, 14.0, 0.02), seed=seed + 1)
    fitted, unseen, result = closed_on(plan, unseen_plan)
    return StockCheck(
        name=name,
        title=fitted.aircraft.name,
        airspeed=airspeed,
        altitude=altitude,
        flown={key: (float(low), float(high)) for key, (low, high) in fitted.truth["flown"].items()},
        result=result,
        rows=compare(result, fitted.truth),
        errors=tuple(row for row in result.errors if row.role == "validation"),
        flown_again=_flown_again(result.completed_aircraft, unseen_plan, unseen),
        tables=follow_tables(plan, fitted.truth, fitted.aircraft, result.completed_aircraft),
    )


def closed_on(plan: FlightPlan, unseen_plan: FlightPlan) -> tuple[JsbsimFlight, JsbsimFlight, ClosedLoop]:
    """A flight for identification, one for prediction only, and close-loop on both."""
    fitted, unseen = fly_jsbsim(plan), fly_jsbsim(unseen_plan)
    return fitted, unseen, close_loop([fitted.log], fitted.aircraft, [unseen.log])


def require_condition(name: str) -> None:
    """None; checks that the aircraft's flight condition is known.

    Raises
    ------
    UsageError
        Where it is not known.
    """
    if name not in CONDITIONS:
        raise UsageError(f"the cross-check has no flight condition for {name!r}; give some of {', '.join(CONDITIONS)}.")


def compare(result: ClosedLoop, truth: Mapping[str, Any]) -> tuple[Compared, ...]:
    """Each longitudinal derivative of the completed model with JSBSim's."""
    true = {(row["coefficient"], row["term"]): row for row in truth["derivatives"]}
    trim = {name: truth["trim"][name] for name in ("alpha", "delta_e")}
    chord_scale = result.aircraft.mean_chord / (2.0 * truth["trim"]["airspeed"])
    rows = []
    for coefficient, variable in _COMPARED:
        low, high = truth["flown"][_SPAN[variable]]
        if variable == "q_hat":
            low, high = low * chord_scale, high * chord_scale
        ends = [dict(trim, **{variable: end}) for end in (low, high)]
        bottom, top = (coefficients_at(result.completed_aircraft, end)[coefficient] for end in ends)
        known = {(row.coefficient, row.term): row for row in result.derivatives}
        spread = _deviation(result, coefficient, ends) / (high - low)
        own = true[coefficient, variable]
        following = known.get((coefficient, "alpha_dot_hat"))
        by_alphadot = true[coefficient, "alpha_dot_hat"]["frozen"]
        if following is not None and by_alphadot:
            # Slope of alphadot with the variable, from JSBSim's two derivatives.
            top += (high - low) * following.value * (own["self_consistent"] - own["frozen"]) / by_alphadot
        row = known[coefficient, variable]
        made = Compared(
            coefficient, variable, (top - bottom) / (high - low), spread,
            own["frozen"], own["self_consistent"], own["chord"] if own["chord"] is not None else own["self_consistent"],
            False, row.shown,
        )  # fmt: skip
        rows.append(held_to_truth(made))
    return tuple(rows)


def held_to_truth(row: Compared, least: float = 0.0) -> Compared:
    """The row, which agrees within the greatest of so many standard errors, a fraction of the truth, and `least`."""
    allowed = max(CROSS_CHECK.deviations * row.std_error, CROSS_CHECK.share * abs(row.truth), least)
    return replace(row, agrees=bool(abs(row.estimate - row.truth) <= allowed))


def _deviation(result: ClosedLoop, coefficient: str, ends: Sequence[Mapping[str, float]]) -> float:
    """Standard error of the completed coefficient's difference between two points, for uncorrelated terms."""
    total = 0.0
    for entry in result.completed_aircraft.derivatives:
        if entry.coefficient == coefficient and entry.sigma is not None:
            total += (entry.sigma * (term_at(entry.term, ends[1]) - term_at(entry.term, ends[0]))) ** 2
    return float(np.sqrt(total))


def _flown_again(completed: Aircraft, plan: FlightPlan, source: JsbsimFlight) -> dict[str, float] | None:
    """The completed model exported to JSBSim and flown through the hold-out doublet."""
    # Effects of recorder and recording are not part of the flying aircraft.
    aircraft = replace(completed, effects=())
    try:
        again = fly_jsbsim(replace(plan, aircraft=aircraft, noise=0.0))
    except EstimationError:
        return None
    return {
        name: float(np.abs(again.states[name] - source.states[name]).max() / np.ptp(source.states[name]))
        for name in ("w", "q")
    }
