"""The pages of the cross-check: each one file that loads nothing and runs nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from aerosid import __version__
from aerosid.reporting.templating import page_environment, page_style
from aerosid.studies.cross_check import views
from aerosid.studies.cross_check.run import CrossCheck
from aerosid.studies.cross_check.sideways_check import SidewaysCheck
from aerosid.studies.cross_check.stock_check import StockCheck
from aerosid.studies.paper import table3, table4
from aerosid.studies.paper.view import TableView

_TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True)
class Page:
    """One page: file name, title, a paragraph at its top, tables."""

    name: str
    title: str
    intro: str
    tables: tuple[TableView, ...]


def pages(result: CrossCheck) -> dict[str, str]:
    """File name -> HTML; identical for an identical result and the same versions."""
    template = page_environment(_TEMPLATES).get_template("cross_check.html")
    style = page_style()
    made = _pages(result)
    links = [(page.name, page.title) for page in made]
    return {
        page.name: template.render(
            page=page, links=links, style=style, version=__version__, jsbsim=result.jsbsim, seed=result.seed
        )
        for page in made
    }


_OVERVIEW = (
    "JSBSim simulates flights, aerosid identifies the missing effects, JSBSim's own forces verify them. Stock aircraft "
    "fly without engines and lateral axes; a constant force along body x maintains the trim. Identification: a 3-2-1-1 "
    "of {:g} rad with usual sensor noise; a doublet is only predicted."
)
_PAPER = (
    "Tables 3 and 4 of Parameswaran & Raol 1994 from a flight of JSBSim: light transport, trim at 45 m/s, elevator "
    "doublet of 0.10 rad, samples every 30 ms, both alpha^2 terms flown and not declared."
)
_TABLES = (
    "JSBSim's aircraft are tables, with corners, plateaus and stall. A polynomial found in a small manoeuvre follows "
    "them where it was flown; beyond, it is an extrapolation. Elevator and airspeed are the trim's, there is no pitch "
    "rate, alphadot is self-consistent."
)


_LATERAL = (
    "The same aircraft with their lateral axes: an aileron doublet and a rudder 2-1-1 are fitted, a rudder doublet and "
    "an aileron 2-1-1 are only predicted. The declared model is linear in C_Y, C_l and C_n about the trim; airspeed, "
    "angle of attack, pitch rate and pitch angle are measured."
)


def _pages(result: CrossCheck) -> list[Page]:
    paper = result.paper
    paper_tables = (views.agreement_view(paper), table3.view(paper.table3), table4.view(paper.table4))
    bends = tuple(views.tables_view(check) for check in result.aircraft)
    return [
        Page("index.html", "Flights by JSBSim", _OVERVIEW.format(result.amplitude), (views.overview(result.aircraft),)),
        Page("paper.html", "The paper's doublet", _PAPER, paper_tables),
        *(_aircraft_page(check) for check in result.aircraft),
        Page("tables.html", "Where a polynomial cannot follow", _TABLES, bends),
        *_lateral_page(result.sideways),
        Page("effects.html", "Planted effects", "", (views.planted_view(result.effects),)),
    ]


def _lateral_page(checks: Sequence[SidewaysCheck]) -> list[Page]:
    """The lateral axes of all aircraft; empty where these were not flown."""
    if not checks:
        return []
    tables = [views.sideways_overview(checks), *(views.sideways_view(check) for check in checks)]
    return [Page("lateral.html", "Lateral axes", _LATERAL, tuple(tables))]


def _aircraft_page(check: StockCheck) -> Page:
    low, high = (_degrees(angle) for angle in check.flown["alpha"])
    return Page(
        f"{check.name}.html",
        check.title if check.name in check.title else f"{check.name}: {check.title}",
        f"Level flight at {check.airspeed:g} m/s and {check.altitude:g} m; alpha from {low} to {high}.",
        (views.derivatives_view(check), views.effects_found_view(check), views.errors_view(check)),
    )


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.1f}°"
