"""The tables of the cross-check as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from aerosid import notation
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.result import ClosedLoop
from aerosid.nomenclature import CHANNELS
from aerosid.notation import MISSING
from aerosid.studies.cross_check.effects_check import EffectCheck, Outcome
from aerosid.studies.cross_check.paper_flight import PaperFlight
from aerosid.studies.cross_check.sideways_check import SidewaysCheck
from aerosid.studies.cross_check.stock_check import StockCheck
from aerosid.studies.cross_check.tables import TablePoint
from aerosid.studies.paper.view import TableView, number, scientific
from aerosid.studies.settings import CROSS_CHECK

_AGREEMENT = (
    "The declared aircraft with both alpha^2 terms as external force and moment, trimmed by each on its own; frames of "
    "1 ms, Adams-Bashforth of third order, a flat planet at rest."
)
_AGREES = (
    f"Agreement: within {CROSS_CHECK.deviations:g} corrected deviations or {100 * CROSS_CHECK.share:g} % of the "
    "derivative that JSBSim's own forces have with alphadot self-consistent; of the chord over the flown range where "
    "the tables bend."
)
_ERRORS = (
    "Errors are root-mean-square over the measurement's noise, the median of the channels. Flown again: the completed "
    "model as JSBSim XML through the validation doublet, greatest difference over peak-to-peak."
)
_SLOPES = (
    "The estimate is the slope of the completed polynomial over the flown range. Local and chord are JSBSim's; in all "
    "three alphadot is self-consistent, since a model without alphadot cannot find the frozen derivatives. 'Not "
    "significant': by the loop's criterion the flight contains too little information on the derivative."
)
_PLANTED = (
    "A doublet (a multisine for the dead band) with usual sensor noise; the effect is not declared in the aircraft "
    "file. A constant shift of the centre of gravity is a change of derivatives and little else: re-estimating them is "
    "correct. Icing, flap and gear change several coefficients at once and have no kind of their own."
)
_COEFFICIENTS = ("C_X", "C_Z", "C_m")


def agreement_view(paper: PaperFlight) -> TableView:
    """JSBSim's flight of (33)-(36) compared with our own integration."""
    return TableView(
        "Agreement of JSBSim's flight with our own integration",
        ("state", "greatest difference over peak-to-peak"),
        tuple((name, scientific(apart)) for name, apart in paper.agreement.items()),
        (_AGREEMENT,),
    )


def overview(checks: Sequence[StockCheck]) -> TableView:
    """One line for each aircraft."""
    return TableView(
        "Aircraft of JSBSim",
        (
            "aircraft", "V", "altitude", "derivatives that agree", "verdict", "missing in the linear model",
            "validation doublet: before / noise", "after / noise", "flown again: w, q",
        ),
        tuple(
            (
                check.name,
                f"{check.airspeed:g} m/s",
                f"{check.altitude:g} m",
                f"{sum(row.agrees for row in check.rows)} of {len(check.rows)}",
                check.result.verdict.name.lower().replace("_", " "),
                _lacking(check.result),
                *_error_ratios(check.errors),
                MISSING if check.flown_again is None
                else ", ".join(f"{100.0 * check.flown_again[name]:.2f} %" for name in ("w", "q")),
            )
            for check in checks
        ),
        (
            _AGREES,
            _ERRORS,
        ),
    )  # fmt: skip


def derivatives_view(check: StockCheck) -> TableView:
    """The derivatives of one aircraft with their true values."""
    return TableView(
        "Derivatives",
        ("derivative", "estimate", "deviation", "local", "chord", "alphadot frozen", "off by", "deviations", "agrees"),
        tuple(
            (
                f"{row.coefficient} {row.term}",
                number(row.estimate, 4),
                number(row.std_error, 4),
                number(row.self_consistent, 4),
                number(row.chord, 4),
                number(row.frozen, 4),
                MISSING if abs(row.truth) < 1e-3 else f"{number(100.0 * (row.estimate / row.truth - 1.0), 1)} %",
                number((row.estimate - row.truth) / row.std_error, 1) if row.std_error else MISSING,
                ("yes" if row.agrees else "no") + ("" if row.shown else ", not significant"),
            )
            for row in check.rows
        ),
        (_SLOPES,),
    )


def errors_view(check: StockCheck) -> TableView:
    """Errors on the hold-out manoeuvre."""
    return TableView(
        "Error on the validation doublet, root-mean-square",
        ("channel", "unit", "declared", "before", "after", "noise"),
        tuple(
            (row.channel, CHANNELS[row.channel].unit,
             *(number(value, 5, MISSING) for value in (row.declared, row.before, row.after, row.noise)))
            for row in check.errors
        ),
        ("Declared is JSBSim's own linear model about the trim. Before: the same terms, re-estimated.",),
    )  # fmt: skip


def effects_found_view(check: StockCheck) -> TableView:
    """Effects found to be missing in the linear model of one aircraft."""
    return TableView(
        "Effects missing from the linear model, as identified",
        ("effect", "value", "deviation"),
        tuple(
            (
                " ".join(filter(None, (e.kind, e.where, e.term))),
                notation.number(e.value, 4),
                notation.number(e.std_error, 2),
            )
            for e in check.result.effects
        )
        or (("nothing", "", ""),),
        (check.result.summary,),
    )


def tables_view(check: StockCheck) -> TableView:
    """The coefficients over alpha, of tables and polynomials."""
    rows = []
    for point in check.tables:
        cells = [f"{number(math.degrees(point.alpha), 2)}°", "flown" if point.inside else ""]
        for coefficient in _COEFFICIENTS:
            cells += [number(table[coefficient], 4) for table in (point.table, point.declared, point.completed)]
        rows.append(tuple(cells))
    heads = [f"{coefficient} {kind}" for coefficient in _COEFFICIENTS for kind in ("table", "linear", "completed")]
    return TableView(
        f"{check.name}: coefficients over alpha",
        ("alpha", "", *heads),
        tuple(rows),
        tuple(follows(check.tables, coefficient) for coefficient in ("C_Z", "C_m")),
    )


def follows(points: Sequence[TablePoint], coefficient: str) -> str:
    """A sentence on how well the completed polynomial reproduces a coefficient."""
    inside = [point for point in points if point.inside]
    swing = max(p.table[coefficient] for p in inside) - min(p.table[coefficient] for p in inside)
    within = max(abs(p.completed[coefficient] - p.table[coefficient]) for p in inside)
    beyond = [p for p in points if not p.inside and abs(p.completed[coefficient] - p.table[coefficient]) > 0.1 * swing]
    share = 100.0 * within / swing
    deviates = (
        f"{coefficient}: within the flown range the completed polynomial deviates by {share:.1f} % of the variation"
    )
    if not beyond:
        return f"{deviates}; it agrees over the whole range."
    near = min(beyond, key=lambda p: min(abs(p.alpha - q.alpha) for q in inside))
    return f"{deviates}; outside, by more than a tenth of it from {math.degrees(near.alpha):.1f}° on."


def planted_view(checks: Sequence[EffectCheck]) -> TableView:
    """Result of the loop for each planted effect."""
    return TableView(
        "Effects planted in a flight of JSBSim",
        ("planted", "aircraft", "outcome", "verdict", "identified", "alternatives"),
        tuple(
            (
                check.planted.effect or "nothing",
                check.planted.aircraft,
                "" if check.outcome is None else check.outcome.value,
                check.verdict.name.lower().replace("_", " "),
                "; ".join(check.named) or MISSING,
                "; ".join(check.alternatives) or MISSING,
            )
            for check in checks
        ),
        (
            _PLANTED,
            not_named(checks),
        ),
    )


def not_named(checks: Sequence[EffectCheck]) -> str:
    """A sentence that lists the effects that the loop did not identify."""
    missed = [c.planted.effect for c in checks if c.outcome not in (None, Outcome.NAMED)]
    return f"Not identified: {', '.join(missed)}." if missed else "Every planted effect was identified."


def sideways_overview(checks: Sequence[SidewaysCheck]) -> TableView:
    """One line for each aircraft with lateral axes."""
    return TableView(
        "Lateral axes of the aircraft of JSBSim",
        (
            "aircraft", "derivatives that agree", "verdict", "missing in the linear model",
            "validation flight: before / noise", "after / noise",
        ),
        tuple(
            (
                check.name,
                f"{sum(row.agrees for row in check.rows)} of {len(check.rows)}",
                check.result.verdict.name.lower().replace("_", " "),
                _lacking(check.result),
                *_error_ratios(check.errors),
            )
            for check in checks
        ),
        (f"{_AGREES} Or within 0.001 of it.", "Errors: root-mean-square over the noise, the median of the channels."),
    )  # fmt: skip


def sideways_view(check: SidewaysCheck) -> TableView:
    """The lateral derivatives of one aircraft with their true values."""
    beta, aileron, rudder = (
        " to ".join(f"{math.degrees(end):.1f}°" for end in check.flown[name]) for name in ("beta", "delta_a", "delta_r")
    )
    return TableView(
        f"{check.name}: lateral derivatives",
        ("derivative", "estimate", "deviation", "local", "chord", "deviations off", "agrees"),
        tuple(
            (
                f"{row.coefficient} {row.term}",
                number(row.estimate, 4),
                number(row.std_error, 4),
                number(row.self_consistent, 4),
                number(row.chord, 4),
                number((row.estimate - row.truth) / row.std_error, 1) if row.std_error else MISSING,
                ("yes" if row.agrees else "no") + ("" if row.shown else ", not significant"),
            )
            for row in check.rows
        ),
        (f"beta {beta}, aileron {aileron}, rudder {rudder}. {check.result.summary}",),
    )


def _lacking(result: ClosedLoop) -> str:
    """The effects found by the loop, by name."""
    named = (filter(None, (e.kind if e.kind != "aero_term" else "", e.where, e.term)) for e in result.effects)
    return ", ".join(" ".join(words) for words in named) or "nothing"


def _error_ratios(errors: Sequence[ErrorRow]) -> tuple[str, str]:
    ratios = []
    for variant in ("before", "after"):
        values = [getattr(row, variant) / row.noise for row in errors if getattr(row, variant) is not None]
        values.sort()
        ratios.append(f"{values[len(values) // 2]:.2f}" if values else MISSING)
    return ratios[0], ratios[1]
