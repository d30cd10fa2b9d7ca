"""Rate limits whose surface never reaches its recorded position: only limit times effectiveness is observable.

A surface that moves at its limit throughout a manoeuvre has an excursion proportional to the limit. Every coefficient
holds the product of that excursion and a derivative, so that a higher limit with less effectiveness has the same motion
in every sensor. The likelihood then depends on the limit by the noise of the record at rest alone, of which a less
effective control simulates less: it rises to the greatest limit at which the surface does not arrive, whatever the true
one, and its curvature there gives standard errors that are far too small. The declared effectiveness decides instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.aircraft import Aircraft, Derivative
from aerosid.effects import ActiveEffect, InputEffect, frozen
from aerosid.estimation.deviations import deviations
from aerosid.estimation.likelihood import Likelihood
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine_on
from aerosid.flight_model.aerodynamics import CONSTANT
from aerosid.flight_model.terms import Term
from aerosid.notation import number, with_deviation
from aerosid.search.attribution import Attribution
from aerosid.search.finding_evidence import findings_with_p_values
from aerosid.search.findings import labels
from aerosid.search.settings import UnreachedPositionSettings
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class UnreachedPosition:
    """A rate limit that is known only together with the effectiveness of its control.

    Attributes
    ----------
    channel : str
        The control.
    derivative : Derivative
        Its declared derivative of a moment, by which the two could be separated.
    product, product_error : float
        Limit times that derivative, rad/s, and its standard error.
    declared_limit : float
        rad/s; the limit with the derivative as declared.
    """

    channel: str
    derivative: Derivative
    product: float
    product_error: float
    declared_limit: float


def with_unreached_positions(
    found: Attribution, aircraft: Aircraft, search: StructureSearch
) -> tuple[Attribution, tuple[UnreachedPosition, ...]]:
    """The attribution with such rate limits at the declared effectiveness, with standard errors that include its own.

    Parameters
    ----------
    found : Attribution
        The result of a search.
    aircraft : Aircraft
        The declared one: only its derivatives say how effective the control is.
    search : StructureSearch
        The flights that were fitted.
    """
    named, settings = labels(found.findings), search.settings.unreached
    unreached: list[UnreachedPosition] = []
    if found.filter_error is not None:
        return found, ()
    for active in found.completed.effects:
        if (*active.name, "") not in named or not _is_never_reached(active, search.manoeuvres, settings):
            continue
        derivative = derivative_of_moment(aircraft, active.effect.where, settings)
        entry = None if derivative is None else (derivative.coefficient, derivative.term)
        if derivative is not None and entry in found.completed.free:
            unreached.append(_unreached(found, active, derivative))
            found = _at_declared_effectiveness(found, unreached[-1], search)
            found = _widened(found, active.name, _relative(derivative, settings), search)
    return found, tuple(unreached)


def note_on_unreached(each: UnreachedPosition) -> str:
    """One sentence for the notes."""
    name = f"{each.derivative.coefficient} {each.derivative.term}"
    return (
        f"{each.channel} moves at its rate limit and never reaches its recorded position: the flights determine only "
        f"the product of the limit and {name}, {with_deviation(each.product, each.product_error)} rad/s, and cannot "
        f"distinguish the two. With {name} as declared, {number(each.derivative.value)}, the limit is "
        f"{number(each.declared_limit)} rad/s; the standard errors of both include the uncertainty of the declared "
        "value. Smaller or longer inputs, which the surface can follow, separate them."
    )


def _is_never_reached(
    active: ActiveEffect, manoeuvres: Sequence[Manoeuvre], settings: UnreachedPositionSettings
) -> bool:
    """Whether a smaller limit would only scale the movement of the surface, on every flight on which it moves."""
    effect = active.effect
    if not isinstance(effect, InputEffect) or effect.kind != "control_rate_limit":
        return False
    (limit,) = active.values
    compared = False
    for manoeuvre in manoeuvres:
        recorded = np.asarray(manoeuvre.flight.inputs[:, manoeuvre.columns.index(effect.where)])
        surface, slower = (
            effect.transform(manoeuvre.flight.time, recorded, (share * limit,)) for share in (1.0, 1.0 - settings.tried)
        )
        deviation, excursion = np.std(slower - (1.0 - settings.tried) * surface), settings.tried * np.std(surface)
        if deviation > settings.proportional * excursion:
            return False
        compared = True
    return compared


def derivative_of_moment(aircraft: Aircraft, channel: str, settings: UnreachedPositionSettings) -> Derivative | None:
    """The declared moment derivative of a control that is known best in relation to its size; none that is zero."""
    own = [
        d
        for d in aircraft.derivatives
        if str(d.term) == channel and d.coefficient in ("C_m", "C_l", "C_n") and d.value != 0.0
    ]
    return min(own, key=lambda d: (_relative(d, settings), -abs(d.value)), default=None)


def _relative(derivative: Derivative, settings: UnreachedPositionSettings) -> float:
    """A-priori standard deviation of a derivative over its size."""
    return settings.effectiveness if derivative.sigma is None else derivative.sigma / abs(derivative.value)


def _unreached(found: Attribution, active: ActiveEffect, derivative: Derivative) -> UnreachedPosition:
    """The product that the flights determine; its relative error is that of the derivative at a given limit."""
    place = found.completed.free.index((derivative.coefficient, derivative.term))
    limit, value = active.values[0], found.completed.model.value((derivative.coefficient, derivative.term))
    return UnreachedPosition(
        active.effect.where,
        derivative,
        limit * value,
        limit * float(found.completed_deviations.corrected[place]),
        limit * value / derivative.value,
    )


def _at_declared_effectiveness(found: Attribution, at: UnreachedPosition, search: StructureSearch) -> Attribution:
    """The attribution with the limit of the declared effectiveness, where the surface does not arrive with that either.

    Above the estimated limit it would arrive, which the flights contradict.
    """
    (active,) = (each for each in found.completed.effects if each.name == ("control_rate_limit", at.channel))
    if not 0.0 < at.declared_limit < active.values[0]:
        return found

    name, values = active.name, (at.declared_limit,)
    held = _with_limit_held(found.completed, name, values, search)
    completed = _with_limit_free(held, found.completed, name, values, search)
    if completed is None:
        return found
    known = deviations(held, search.manoeuvres)
    place = _place_of(completed, name)
    uncertainty = replace(
        known, effects=np.insert(known.effects, place, 0.0), effects_white=np.insert(known.effects_white, place, 0.0)
    )

    def re_estimated(start: Refinement) -> Refinement:
        again = _with_limit_held(start, name, values, search)
        return _with_limit_free(again, start, name, values, search) or start

    return replace(found, completed=completed, completed_deviations=uncertainty, re_estimator=re_estimated)


def _with_limit_held(
    start: Refinement, name: tuple[str, str], values: tuple[float, ...], search: StructureSearch
) -> Refinement:
    """The estimate with the limit held at a value."""
    effects = [frozen(replace(each, values=values)) if each.name == name else each for each in start.effects]
    return refine_on(start, search.manoeuvres, effects=effects)


def _with_limit_free(
    held: Refinement, start: Refinement, name: tuple[str, str], values: tuple[float, ...], search: StructureSearch
) -> Refinement | None:
    """The estimate with the limit held, as one with the limit among its parameters; None where it diverges."""
    pairs = zip(start.effects, held.effects, strict=True)
    effects = tuple(replace(own, values=values) if own.name == name else other for own, other in pairs)
    likelihood = Likelihood(held.model, search.manoeuvres, held.free)
    likelihood.held_to_data = held.held_to_data
    point = likelihood.evaluate(held.model.values, held.states, effects, held.variance)
    return None if point is None else replace(held, effects=effects, cost=point.cost, information=point.information)


def _place_of(completed: Refinement, name: tuple[str, str]) -> int:
    """Index of an effect's first number among those of all effects."""
    names = [each.name for each in completed.effects]
    return sum(each.slopes for each in completed.effects[: names.index(name)])


def _widened(found: Attribution, name: tuple[str, str], relative: float, search: StructureSearch) -> Attribution:
    """The attribution with the common uncertainty of a limit and of all derivatives of its control."""
    completed, known = found.completed, found.completed_deviations
    place = _place_of(completed, name)
    (active,) = (each for each in completed.effects if each.name == name)
    factors = _shares(completed, name[1], search)
    more = (relative * factors) ** 2
    effects = known.effects.copy()
    effects[place] = np.hypot(effects[place], relative * active.values[0])
    uncertainty = replace(
        known,
        corrected=np.sqrt(known.corrected**2 + more),
        published=np.sqrt(known.published**2 + more),
        covariance=known.covariance + relative**2 * np.outer(factors, factors),
        effects=effects,
    )
    findings = findings_with_p_values(search, completed, uncertainty)
    return replace(found, completed_deviations=uncertainty, findings=findings)


def _shares(completed: Refinement, control: str, search: StructureSearch) -> NDArray[np.float64]:
    """Change of each free entry with the effectiveness of a control, per relative change of that, (F,).

    The constants balance it at the position from which the surface starts.
    """
    model = completed.model
    start = float(np.mean([each.flight.inputs[0, each.columns.index(control)] for each in search.manoeuvres]))
    shares = np.array([_power(term, control) * model.value((c, term)) for c, term in completed.free])
    for n, (coefficient, term) in enumerate(completed.free):
        if term == CONSTANT:
            own = [
                value
                for (c, t), value in zip(model.entries, model.values, strict=True)
                if (c, str(t)) == (coefficient, control)
            ]
            shares[n] = -start * sum(own)
    return shares


def _power(term: Term, control: str) -> int:
    """Power of a control in a term."""
    return sum(factor.power for factor in term.factors if factor.variable == control)
