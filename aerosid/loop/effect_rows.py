"""The effects that the declared model lacks, as result.json names them, with the evidence for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.quantity import Parameter
from aerosid.search.findings import Finding


@dataclass(frozen=True)
class Evidence:
    """Why an effect is believed.

    Attributes
    ----------
    correlation : float or None
        |rho| of the model error d(t) with the candidate, both through the same estimator (Parameswaran & Raol 1994,
        table 3); None for an effect that is no term.
    p_value : float
        Of the effect being none, coloured residuals and the number of candidates counted.
    validation_gain : float or None
        before/after of the root-mean-square error on the validation logs, median over channels; None without one.
    likelihood_gain : float
        Rise of -2 ln L when the effect is struck out again.
    """

    correlation: float | None
    p_value: float
    validation_gain: float | None
    likelihood_gain: float


@dataclass(frozen=True)
class Effect:
    """One effect that the declared model lacks, as result.json names it."""

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


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def effect_row(rank: int, finding: Finding, correlations: dict[Entry, float], gain: float | None) -> Effect:
    """The row of a finding; `gain`: on the validation flights, None without one."""
    correlation = correlations.get(finding.entry) if finding.entry is not None else None
    return Effect(
        rank=rank,
        kind=finding.kind,
        where=finding.where,
        term=finding.term,
        value=finding.value,
        std_error=finding.std_error,
        unit=finding.unit,
        evidence=Evidence(correlation, finding.p_value, gain, finding.gain),
        time=finding.time,
        parameters={name: Parameter(value, _finite(error), unit) for name, value, error, unit in finding.parameters},
        instead_of=finding.instead_of,
    )
