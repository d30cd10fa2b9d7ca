"""The completed aircraft file: the declared model with the findings in it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aerosid.aircraft import Aircraft, DeclaredEffect
from aerosid.effects import ActiveEffect
from aerosid.effects.sudden import is_sudden, moment
from aerosid.search.attribution import Attribution
from aerosid.search.findings import Finding


def complete_aircraft(aircraft: Aircraft, found: Attribution, logs: int) -> Aircraft:
    """The aircraft with the completed model's values and the effects that are no terms.

    Parameters
    ----------
    aircraft : Aircraft
        As given.
    found : Attribution
        What is missing.
    logs : int
        How many identification logs there were: with more than one a sudden change says on which it happened.
    """
    completed, spread = found.completed, found.completed_deviations
    values = {
        (coefficient, str(term)): (completed.model.value((coefficient, term)), _finite(float(spread.corrected[n])))
        for n, (coefficient, term) in enumerate(completed.free)
    }
    effects = [
        DeclaredEffect(
            kind=finding.kind,
            where=finding.where,
            value=finding.value,
            time=finding.time,
            log=_log_of(finding, completed.effects) if logs > 1 else "",
            std_error=_finite(finding.std_error),
            parameters={name: value for name, value, _, _ in finding.parameters},
        )
        for finding in found.findings
        if finding.entry is None
    ]
    return aircraft.completed(values, effects)


def _log_of(finding: Finding, effects: Sequence[ActiveEffect]) -> str:
    """The log that a sudden change belongs to; empty for what acts on all."""
    own = (active for active in effects if active.name == (finding.kind, finding.where) and is_sudden(active))
    return next((active.log for active in own if moment(active) == finding.time), "")


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
