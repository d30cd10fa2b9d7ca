"""Findings out of the parts of an estimate."""

from __future__ import annotations

from dataclasses import replace

from scipy.special import chdtrc, ndtr

from aerosid.effects import NoiseEffect
from aerosid.evidence import Deviations
from aerosid.findings import Finding, Part
from aerosid.pruning import inflation_of, is_shown_as_a_whole
from aerosid.refinement import Refinement
from aerosid.structure_search import StructureSearch


def finding_of(search: StructureSearch, part: Part, gain: float, instead_of: str = "") -> Finding:
    """A part with its evidence."""
    kind, where, term = part.label
    unit = part.active.effect.parameters[0].unit if part.active is not None else "1"
    p_value = float(min(1.0, 2.0 * ndtr(-part.ratio) * len(search.hypotheses)))
    return Finding(
        kind=kind,
        where=where,
        term=term,
        entry=part.entry,
        value=part.value,
        std_error=part.std_error,
        unit=unit,
        time=part.time,
        p_value=p_value,
        gain=gain,
        instead_of=instead_of,
        parameters=part.parameters,
    )


def findings_of(search: StructureSearch, completed: Refinement, spread: Deviations) -> tuple[Finding, ...]:
    """The found parts, most certain first."""
    rows = []
    for part in search.parts(completed, spread):
        gain = search.without(completed, [part]).cost - completed.cost
        row = finding_of(search, part, gain)
        if part.active is not None:
            disturbance = isinstance(part.active.effect, NoiseEffect)
            inflation = 1.0 if disturbance else inflation_of(search, completed, spread, {part.label})
            if disturbance or is_shown_as_a_whole(search, part, gain, inflation):
                # A spread has no sign to be tested against zero: the likelihood ratio speaks.
                count = 1 if disturbance else len(part.active.values)
                p_value = float(min(1.0, chdtrc(count, max(gain, 0.0) / inflation) * len(search.hypotheses)))
                row = replace(row, p_value=p_value if disturbance else min(p_value, row.p_value))
        rows.append(row)
    return tuple(sorted(rows, key=lambda row: -row.gain))
