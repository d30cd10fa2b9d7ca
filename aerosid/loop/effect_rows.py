"""The effects missing from the declared model, as in result.json, with the evidence for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.model_validation.leave_one_out import Gains
from aerosid.loop.quantity import Parameter
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding, identity


@dataclass(frozen=True)
class Confirmation:
    """A term's parameter from the validation logs alone; `p_value` of such an estimate by chance."""

    value: float
    std_error: float
    p_value: float


@dataclass(frozen=True)
class Evidence:
    """Evidence for an effect.

    Attributes
    ----------
    correlation : float or None
        |rho| of the model error d(t) with the candidate, both through the same estimator (Parameswaran & Raol 1994,
        table 3); None for an effect that is no term.
    p_value : float
        Of the effect being absent, corrected for coloured residuals and the number of candidates.
    validation_gain : float or None
        Root-mean-square error without the effect, everything else estimated again, over that with it, on the validation
        logs; median over channels. None without such a log.
    likelihood_gain : float
        Rise of -2 ln L when the effect is removed; of an alternative the fall when it replaces the chosen one, negative
        where it fits worse.
    hold_out_gain : float or None
        As `validation_gain`, on the hold-out logs.
    confirmation : Confirmation or None
        Estimate from the validation logs alone, where only that made the effect significant.
    unseen_better : bool or None
        Whether data not used in the fit (validation logs, hold-out logs first, or parts of a single log) are predicted
        better with the effect; None without such data and for an instrument error identified by kinematics.
    """

    correlation: float | None
    p_value: float
    validation_gain: float | None
    likelihood_gain: float
    hold_out_gain: float | None = None
    confirmation: Confirmation | None = None
    unseen_better: bool | None = None


@dataclass(frozen=True)
class Effect:
    """One effect missing from the declared model, as in result.json."""

    rank: int
    kind: str
    where: str
    term: str
    value: float
    std_error: float
    unit: str
    evidence: Evidence
    time: float | None = None
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    instead_of: str = ""
    """For an alternative: the chosen effect that it could replace."""
    worse_by: float | None = None
    """For an alternative: -2 ln L with the penalty for its parameters, less that of the chosen effect."""
    margin: float | None = None
    """For an alternative: the difference below which the flights do not decide; worse ones are not listed."""
    along: str = ""
    """For a position: the body axes along which it differs."""
    log: str = ""
    """For a step change: the log that it belongs to, where several were fitted."""

    @property
    def moment(self) -> str:
        """When a step change acts, and on which of several logs, as a sentence ends; empty of any other effect."""
        of_log = f" of {self.log}" if self.log else ""
        rise = self.parameters.get("rise")
        taking = f" over {rise.value:g} s" if rise is not None else ""
        return "" if self.time is None else f" at {self.time:.2f} s{taking}{of_log}"


def _estimated(error: float) -> float | None:
    """A standard error; None of a parameter that the records do not determine, or that is held at its limit."""
    return error if np.isfinite(error) and error > 0.0 else None


def effect_row(rank: int, finding: Finding, evidence: Evidence, *, several: bool = False) -> Effect:
    """The row of a finding; `several`: whether several logs were fitted."""
    return Effect(
        rank=rank,
        kind=finding.kind,
        where=finding.where,
        term=finding.term,
        value=finding.value,
        std_error=finding.std_error,
        unit=finding.unit,
        evidence=evidence,
        time=finding.time,
        parameters={name: Parameter(value, _estimated(error), unit) for name, value, error, unit in finding.parameters},
        instead_of=finding.instead_of,
        worse_by=finding.worse_by,
        margin=finding.margin,
        along=finding.along,
        log=finding.log if several else "",
    )


def effect_rows(found: Attribution, gains: Gains, hold_out_gains: Gains) -> tuple[Effect, ...]:
    """The findings, most certain first, each with its evidence but the correlation, which `with_correlations` adds."""
    confirmed = {each.entry: Confirmation(each.value, each.std_error, each.p_value) for each in found.confirmed}
    rows = []
    for rank, finding in enumerate(found.findings, start=1):
        term = finding.entry
        evidence = Evidence(
            correlation=None,
            p_value=finding.p_value,
            validation_gain=gains.get(identity(finding)),
            likelihood_gain=finding.gain,
            hold_out_gain=hold_out_gains.get(identity(finding)),
            confirmation=confirmed.get(term) if term is not None else None,
            unseen_better=improves_prediction(finding, gains, hold_out_gains, regressed=found.regressed),
        )
        rows.append(effect_row(rank, finding, evidence, several=_has_several_logs(found)))
    return tuple(rows)


def improves_prediction(finding: Finding, gains: Gains, hold_out_gains: Gains, *, regressed: bool) -> bool | None:
    """Whether validation data are predicted better with a finding: by the open-loop error where the simulation decided.

    A step change occurs on one flight, and does not affect the prediction of another.
    """
    if regressed or finding.time is not None:
        return finding.unseen_better
    gain = hold_out_gains.get(identity(finding), gains.get(identity(finding)))
    return None if gain is None else gain > 1.0


def with_correlations(
    effects: Sequence[Effect], found: Attribution, correlations: Mapping[Entry, float]
) -> tuple[Effect, ...]:
    """The rows with the correlation of the model error with each term, where that is known."""
    return tuple(
        replace(effect, evidence=replace(effect.evidence, correlation=correlations.get(finding.entry)))
        if finding.entry is not None
        else effect
        for effect, finding in zip(effects, found.findings, strict=True)
    )


def alternative_rows(found: Attribution) -> tuple[Effect, ...]:
    """Effects that could replace a finding."""
    return tuple(
        effect_row(rank, other, Evidence(None, other.p_value, None, other.gain), several=_has_several_logs(found))
        for rank, other in enumerate(found.alternatives, start=1)
    )


def _has_several_logs(found: Attribution) -> bool:
    return len(found.completed.states) > 1
