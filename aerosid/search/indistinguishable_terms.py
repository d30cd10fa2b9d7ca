"""Terms that one coefficient alone cannot tell from a sensor's or a control's fault."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aerosid.effects import ActiveEffect, InputEffect, OutputEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.errors import EstimationError
from aerosid.estimation.deviations import deviations
from aerosid.estimation.fit_settings import RefinementSettings
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import refine_on
from aerosid.estimation.open_loop import on_log
from aerosid.flight_model.aerodynamics import Entry
from aerosid.flight_model.terms import Term
from aerosid.model_error.coefficient_match import Corrected
from aerosid.model_error.paper_chain import ChainSettings, feed
from aerosid.notation import number
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, Part, finding_among, labels, named
from aerosid.search.settings import IndistinguishableTermSettings

USUAL = IndistinguishableTermSettings()
"""The settings of a loop unless told otherwise."""

RECORDED_RATE = "recorded_alpha_dot_hat"
"""Column of the derivative of the recorded alpha, made dimensionless: what a fit to one coefficient would use."""


FIT = RefinementSettings(steps=30, cost_tolerance=0.5, disturbances=False)
"""A rival stands beside the chosen one with its numbers, not in its table."""


@dataclass(frozen=True)
class IndistinguishableTerm:
    """A term that explains a coefficient as an effect does.

    Attributes
    ----------
    coefficient : str
        Where it does so.
    finding : Finding
        The term with its evidence; `gain` is what all channels together say, negative where they speak against it.
    share : float
        What it takes away of the coefficient's unexplained variance over what the effect takes away.
    """

    coefficient: str
    finding: Finding
    fraction: float


def indistinguishable_terms(
    found: Attribution,
    manoeuvres: Sequence[Manoeuvre],
    hypotheses: Sequence[Hypothesis],
    settings: IndistinguishableTermSettings = USUAL,
) -> list[IndistinguishableTerm]:
    """For each sensor or control effect that was found, the term that looks most like it in a coefficient alone.

    Notes
    -----
    A vane that lags by tau reads alpha - tau alphadot, so that a moment coefficient fitted to its readings asks for an
    alphadot derivative. Equation error, as it is much used, sees no more; the motion as a whole usually tells the two
    apart, as the vane's lag shows in the accelerometers too. The engineer has to know both.
    """
    found_effects = [
        active
        for active in found.completed.effects
        if isinstance(active.effect, OutputEffect | InputEffect) and (*active.name, "") in labels(found.findings)
    ]
    terms = tuple(entry for h in hypotheses if h.is_plain_term for entry in h.entries)
    terms = tuple(entry for entry in terms if entry not in found.completed.free)
    rivals: dict[tuple[str, Entry], IndistinguishableTerm] = {}
    for active in found_effects:
        for coefficient, entry, fraction in _collinear_terms(found, active, manoeuvres, terms, settings):
            if (named((*active.name, "")), entry) not in rivals:
                finding = _replacement_finding(found, active, entry, manoeuvres, len(hypotheses))
                if finding is not None:
                    rivals[named((*active.name, "")), entry] = IndistinguishableTerm(coefficient, finding, fraction)
    return list(rivals.values())


def note_on_indistinguishable_terms(rivals: Sequence[IndistinguishableTerm]) -> list[str]:
    """A sentence for each, for the notes."""
    return [
        f"{alternative.coefficient} alone does not tell {alternative.finding.where} {alternative.finding.term} from "
        f"{alternative.finding.instead_of}: the term explains {min(alternative.fraction, 1.0):.0%} of what the effect explains there. "
        f"All channels together {_likelihood_comparison(alternative.finding.gain)}."
        for alternative in rivals
    ]


def _likelihood_comparison(gain: float) -> str:
    if gain < 0.0:
        return f"speak for the effect, by a log-likelihood difference 2Δln L of {number(-gain)}"
    return f"do not speak against the term (log-likelihood difference 2Δln L = {number(gain)} in its favour)"


def _collinear_terms(
    found: Attribution,
    active: ActiveEffect,
    manoeuvres: Sequence[Manoeuvre],
    terms: Sequence[Entry],
    settings: IndistinguishableTermSettings,
) -> Iterator[tuple[str, Entry, float]]:
    """Coefficient, term and share of the best term in each coefficient that looks like an effect."""
    own = found.completed.free
    without, acting = (_regression(found, out, manoeuvres, own) for out in (active, None))
    held = np.isfinite(without.target) & np.isfinite(acting.target)
    held &= np.isfinite(without.columns.sum(axis=2)) & np.isfinite(acting.columns.sum(axis=2))
    candidates: list[_Regression] = []
    for i, coefficient in enumerate(found.completed.model.axes.coefficients):
        rows = held[:, i]
        if rows.sum() < settings.rows_each * len(own):
            continue
        moved = np.sum((acting.measured - without.measured)[rows, i] ** 2)
        before, after = (_Residual.of(each, rows, i) for each in (without, acting))
        if moved > settings.corrected * before.squares or after.squares > (1.0 - settings.material) * before.squares:
            continue
        if not candidates:
            candidates = [_regression(found, out, manoeuvres, terms) for out in (active, None)]
        explained = before.squares - after.squares
        fractions = before.variance_reductions(candidates[0], rows, i) / explained
        additional = after.variance_reductions(candidates[1], rows, i) / explained
        fractions[~(additional < settings.more)] = 0.0
        best = int(np.argmax(fractions)) if fractions.size else 0
        if fractions.size and fractions[best] > settings.as_good:
            yield coefficient, terms[best], float(fractions[best])


@dataclass(frozen=True)
class _Regression:
    """What is left to a coefficient's regression: `measured` and `target`, the measured less what is held, (N, k);
    `columns` (N, k, K) of each entry, `logs` (N,) which record a sample belongs to.
    """

    measured: NDArray[np.float64]
    target: NDArray[np.float64]
    columns: NDArray[np.float64]
    logs: NDArray[np.int64]


def _regression(
    found: Attribution, out: ActiveEffect | None, manoeuvres: Sequence[Manoeuvre], entries: Sequence[Entry]
) -> _Regression:
    """The regression on some entries, the records corrected for all effects but one."""
    completed = found.completed
    entries = [(coefficient, _with_recorded_rate_variable(term)) for coefficient, term in entries]
    model = completed.model.with_columns([RECORDED_RATE]).extended(entries)
    places = [model.entries.index(entry) for entry in entries]
    numbers = np.array(model.values)
    numbers[[model.entries.index(entry) for entry in completed.free]] = 0.0
    parts = []
    for n, manoeuvre in enumerate(manoeuvres):
        effects = [active for active in on_log(completed, manoeuvre) if out is None or active.name != out.name]
        log = _with_recorded_rate(Corrected.of(model, effects, manoeuvre, feed(manoeuvre, ChainSettings())))
        rest = log.modelled(numbers)
        columns = np.stack([log.modelled(numbers + unit) - rest for unit in np.eye(numbers.size)[places]], axis=2)
        parts.append((log.measured, log.measured - rest, columns, np.full(manoeuvre.flight.time.size, n)))
    measured, target, columns, logs = (np.concatenate(each) for each in zip(*parts, strict=True))
    return _Regression(measured, target, columns, logs)


def _with_recorded_rate_variable(term: Term) -> Term:
    """The term with alphadot as the vane's record gives it, in place of what the equations make of the other terms."""
    rate = [replace(f, variable=RECORDED_RATE) if f.variable == "alpha_dot_hat" else f for f in term.factors]
    return replace(term, factors=tuple(rate))


def _with_recorded_rate(log: Corrected) -> Corrected:
    axes, constants = log.model.axes, log.model.constants
    if not {"u", "w"} <= set(axes.integrated):
        return log  # no term knows alphadot there
    u, w = (log.states[:, axes.integrated.index(name)] for name in ("u", "w"))
    alpha, airspeed = np.arctan2(w, u), log.flight.measured[:, axes.outputs.index("V")]
    speed = constants.airspeed_of_rates if constants.airspeed_of_rates > 0.0 else airspeed
    inputs = log.flight.inputs.copy()
    place = log.model.columns.index(RECORDED_RATE)
    inputs[:, place] = np.gradient(alpha, log.flight.time) * constants.mean_chord / (2.0 * speed)
    return replace(log, flight=log.flight._replace(inputs=inputs))


@dataclass(frozen=True)
class _Residual:
    """What a regression with a constant for each record leaves, (n,), and the directions that it took, (n, K)."""

    values: NDArray[np.float64]
    basis: NDArray[np.float64]

    @classmethod
    def of(cls, regression: _Regression, rows: NDArray[np.bool_], i: int) -> _Residual:
        logs = regression.logs[rows]
        constants = (logs[:, None] == np.unique(logs)).astype(float)
        columns = np.column_stack([constants, regression.columns[rows, i]])
        lengths = np.linalg.norm(columns, axis=0)
        columns = columns[:, lengths > 0.0] / lengths[lengths > 0.0]
        remaining, sizes, _ = np.linalg.svd(columns, full_matrices=False)
        basis = remaining[:, sizes > 1e-10 * sizes[0]]
        target = regression.target[rows, i]
        return cls(target - basis @ (basis.T @ target), basis)

    @property
    def squares(self) -> float:
        return float(self.values @ self.values)

    def variance_reductions(self, candidates: _Regression, rows: NDArray[np.bool_], i: int) -> NDArray[np.float64]:
        """By how much each further entry would lower the sum of squares, (K,)."""
        columns = np.nan_to_num(candidates.columns[rows, i])
        length = np.linalg.norm(columns, axis=0)
        columns = columns - self.basis @ (self.basis.T @ columns)
        remaining = np.sum(columns**2, axis=0)
        independent = remaining > 1e-8 * length**2
        return np.where(independent, (self.values @ columns) ** 2 / np.where(independent, remaining, 1.0), 0.0)


def _replacement_finding(
    found: Attribution, active: ActiveEffect, entry: Entry, manoeuvres: Sequence[Manoeuvre], tested: int
) -> Finding | None:
    """A term in an effect's place; None where it cannot be flown.

    Without its fit: no flight is designed to tell apart what the channels of this one tell apart together.
    """
    completed = found.completed
    others = [each for each in completed.effects if each.name != active.name]
    try:
        fit = refine_on(completed.with_terms([entry]), manoeuvres, FIT, others)
    except EstimationError:
        return None
    error = float(deviations(fit, manoeuvres, quick=True).corrected[-1])
    part = Part(entry, None, fit.model.value(entry), 0.0, error)
    return finding_among(part, tested, completed.cost - fit.cost, named((*active.name, "")))


def with_indistinguishable_terms(
    found: Attribution, rivals: Sequence[IndistinguishableTerm], reach: float
) -> Attribution:
    """What was found with those rivals among its alternatives that all channels together do not tell from it either.

    Parameters
    ----------
    reach : float
        Difference of -2 ln L that decides nothing. What is worse by more is a warning about one coefficient, which the
        notes give, and no alternative.
    """
    known = {(other.kind, other.where, other.term, other.instead_of) for other in found.alternatives}
    new = [replace(alternative.finding, worse_by=-alternative.finding.gain, margin=reach) for alternative in rivals]
    new = [f for f in new if -f.gain <= reach and (f.kind, f.where, f.term, f.instead_of) not in known]
    return replace(found, alternatives=(*found.alternatives, *new))
