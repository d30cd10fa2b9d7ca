"""Terms that one coefficient alone cannot distinguish from an error of a sensor or control."""

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
from aerosid.model_error.paper_chain.chain import ChainSettings, feed
from aerosid.model_error.paper_chain.coefficient_match import Corrected
from aerosid.notation import number
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, Part, finding_among, labels, named
from aerosid.search.settings import IndistinguishableTermSettings

RECORDED_RATE = "recorded_alpha_dot_hat"
"""Column of the nondimensional derivative of the recorded alpha, the regressor of a fit to one coefficient."""


FIT = RefinementSettings(steps=30, cost_tolerance=0.5, disturbances=False)
"""Lower accuracy: an alternative is reported with its value, not in the table of derivatives."""


@dataclass(frozen=True)
class IndistinguishableTerm:
    """A term that explains a coefficient as well as an effect does.

    Attributes
    ----------
    coefficient : str
        That coefficient.
    finding : Finding
        The term with its evidence; `gain` is in -2 ln L of all channels, negative where they favour the effect.
    fraction : float
        Fraction of the coefficient's variance explained by the term, over that explained by the effect.
    """

    coefficient: str
    finding: Finding
    fraction: float


def indistinguishable_terms(
    found: Attribution,
    manoeuvres: Sequence[Manoeuvre],
    hypotheses: Sequence[Hypothesis],
    settings: IndistinguishableTermSettings,
) -> list[IndistinguishableTerm]:
    """For each found sensor or control effect, the term that imitates it best in one coefficient alone.

    Notes
    -----
    A vane that lags by tau reads alpha - tau alphadot, so that a moment coefficient fitted to its readings contains an
    alphadot derivative. Equation error of one coefficient cannot distinguish the two; all channels together usually
    can, since the accelerometers show the vane's lag too. The engineer needs to know both.
    """
    found_effects = [
        active
        for active in found.completed.effects
        if isinstance(active.effect, OutputEffect | InputEffect) and (*active.name, "") in labels(found.findings)
    ]
    terms = tuple(entry for h in hypotheses if h.is_plain_term for entry in h.entries)
    terms = tuple(entry for entry in terms if entry not in found.completed.free)
    similar: dict[tuple[str, Entry], IndistinguishableTerm] = {}
    for active in found_effects:
        for coefficient, entry, fraction in _collinear_terms(found, active, manoeuvres, terms, settings):
            if (named((*active.name, "")), entry) not in similar:
                finding = _replacement_finding(found, active, entry, manoeuvres, len(hypotheses))
                if finding is not None:
                    similar[named((*active.name, "")), entry] = IndistinguishableTerm(coefficient, finding, fraction)
    return list(similar.values())


def note_on_indistinguishable_terms(indistinguishable: Sequence[IndistinguishableTerm]) -> list[str]:
    """One sentence per term, for the notes."""
    return [
        f"{each.coefficient} alone cannot distinguish {each.finding.where} {each.finding.term} from "
        f"{each.finding.instead_of}: the term explains {min(each.fraction, 1.0):.0%} of the variance that the effect "
        f"explains there. All channels together {_likelihood_comparison(each.finding.gain)}."
        for each in indistinguishable
    ]


def _likelihood_comparison(gain: float) -> str:
    if gain < 0.0:
        return f"favour the effect, by a log-likelihood difference 2Δln L of {number(-gain)}"
    return f"do not exclude the term (log-likelihood difference 2Δln L = {number(gain)} in its favour)"


def _collinear_terms(
    found: Attribution,
    active: ActiveEffect,
    manoeuvres: Sequence[Manoeuvre],
    terms: Sequence[Entry],
    settings: IndistinguishableTermSettings,
) -> Iterator[tuple[str, Entry, float]]:
    """Coefficient, term and variance fraction of the best term in each coefficient that an effect explains."""
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
        if (
            moved > settings.corrected * before.sum_of_squares
            or after.sum_of_squares > (1.0 - settings.material) * before.sum_of_squares
        ):
            continue
        if not candidates:
            candidates = [_regression(found, out, manoeuvres, terms) for out in (active, None)]
        explained = before.sum_of_squares - after.sum_of_squares
        fractions = before.variance_reductions(candidates[0], rows, i) / explained
        additional = after.variance_reductions(candidates[1], rows, i) / explained
        fractions[~(additional < settings.more)] = 0.0
        best = int(np.argmax(fractions)) if fractions.size else 0
        if fractions.size and fractions[best] > settings.as_good:
            yield coefficient, terms[best], float(fractions[best])


@dataclass(frozen=True)
class _Regression:
    """Data of the coefficients' regressions: `measured` and `target`, the measured less the fixed entries, (N, k);
    regressors `columns` (N, k, K) of each entry, `logs` (N,) the record of each sample.
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
    """The term with the recorded vane's alphadot in place of that from the equations of motion."""
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
    """Residual of a regression with a constant for each record, (n,), and the basis of its regressors, (n, K)."""

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
    def sum_of_squares(self) -> float:
        return float(self.values @ self.values)

    def variance_reductions(self, candidates: _Regression, rows: NDArray[np.bool_], i: int) -> NDArray[np.float64]:
        """Reduction of the sum of squares by each further entry, (K,), from orthogonalised regressors."""
        columns = np.nan_to_num(candidates.columns[rows, i])
        length = np.linalg.norm(columns, axis=0)
        columns = columns - self.basis @ (self.basis.T @ columns)
        remaining = np.sum(columns**2, axis=0)
        independent = remaining > 1e-8 * length**2
        return np.where(independent, (self.values @ columns) ** 2 / np.where(independent, remaining, 1.0), 0.0)


def _replacement_finding(
    found: Attribution, active: ActiveEffect, entry: Entry, manoeuvres: Sequence[Manoeuvre], tested: int
) -> Finding | None:
    """A term in an effect's place; None where the model with it cannot be simulated.

    The finding holds no fit, since no flight is designed to distinguish what all channels of this one distinguish.
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
    found: Attribution, indistinguishable: Sequence[IndistinguishableTerm], reach: float
) -> Attribution:
    """The attribution with those terms among its alternatives that all channels together do not distinguish either.

    Parameters
    ----------
    reach : float
        Insignificant difference of -2 ln L. A term that is worse by more is no alternative; the notes mention it.
    """
    known = {(other.kind, other.where, other.term, other.instead_of) for other in found.alternatives}
    new = [
        replace(alternative.finding, worse_by=-alternative.finding.gain, margin=reach)
        for alternative in indistinguishable
    ]
    new = [f for f in new if -f.gain <= reach and (f.kind, f.where, f.term, f.instead_of) not in known]
    return replace(found, alternatives=(*found.alternatives, *new))
