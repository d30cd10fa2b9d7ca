"""Findings from the parts of an estimate, with Wald and likelihood ratio p-values."""

from __future__ import annotations

from dataclasses import replace

from scipy.special import chdtrc

from aerosid.estimation.deviations import Deviations
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.search.backward_elimination import is_jointly_significant, variance_inflation
from aerosid.search.findings import Finding, Part, finding_among
from aerosid.search.structure_search import StructureSearch


def finding_from_part(search: StructureSearch, part: Part, gain: float, instead_of: str = "") -> Finding:
    """A part with its evidence."""
    return finding_among(part, len(search.hypotheses), gain, instead_of)


def findings_with_p_values(
    search: StructureSearch, completed: Refinement, uncertainty: Deviations
) -> tuple[Finding, ...]:
    """The found parts as findings, largest gain first."""
    rows = []
    white = search.parts(completed, uncertainty.as_white)
    for part, plain in zip(search.parts(completed, uncertainty), white, strict=True):
        if part.active is None and not search.settings.reported:
            gain = plain.ratio**2
        else:
            gain = search.re_estimated_without(completed, [part]).cost - completed.cost
        row = finding_from_part(search, part, gain)
        if part.active is not None:
            disturbance = part.is_disturbance
            inflation = 1.0 if disturbance else variance_inflation(search, completed, uncertainty, {part.label})
            if disturbance or is_jointly_significant(search, part, gain, inflation):
                # A disturbance's size is not tested against zero by its standard error: the likelihood ratio is.
                count = 1 if disturbance else len(part.active.values)
                p_value = float(min(1.0, chdtrc(count, max(gain, 0.0) / inflation) * len(search.hypotheses)))
                row = replace(row, p_value=p_value if disturbance else min(p_value, row.p_value))
        rows.append(row)
    return tuple(sorted(rows, key=lambda row: -row.gain))
