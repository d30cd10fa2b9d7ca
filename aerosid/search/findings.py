"""Findings: parts of an estimate beyond the declared model, and their labels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from aerosid.effects import KINDS, ActiveEffect, NoiseEffect
from aerosid.effects.sudden import is_sudden, moment
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import Entry


@dataclass(frozen=True)
class Part:
    """Something that was added to the declared model: a term or an effect, with its number and deviation."""

    entry: Entry | None
    active: ActiveEffect | None
    value: float
    null: float
    std_error: float
    std_errors: tuple[float, ...] = ()

    @property
    def parameters(self) -> tuple[tuple[str, float, float, str], ...]:
        """Name, value, deviation and unit of each number, of an effect that has several or whose one number needs its
        name; a jump's moment is apart.
        """
        if self.active is None or is_sudden(self.active):
            return ()
        kind, names = KINDS.get(self.active.effect.kind), [number.name for number in self.active.effect.parameters]
        if len(self.active.values) < 2 and (kind is None or names == [kind.leading] or not names):
            return ()
        errors = self.std_errors or (self.std_error,) + (np.nan,) * (len(self.active.values) - 1)
        numbers = zip(self.active.effect.parameters, self.active.values, errors, strict=True)
        return tuple((parameter.name, value, error, parameter.unit) for parameter, value, error in numbers)

    @property
    def ratio(self) -> float:
        """Distance from the null value over the deviation; none where the record's noise looks alike."""
        if self.active is not None and abs(self.value - self.null) < self.active.effect.parameters[0].least:
            return 0.0
        return abs(self.value - self.null) / self.std_error if self.std_error > 0.0 else np.inf

    @property
    def is_disturbance(self) -> bool:
        """Whether it is a gust or forces of any shape, which the likelihood alone judges."""
        return self.active is not None and isinstance(self.active.effect, NoiseEffect)

    @property
    def label(self) -> tuple[str, str, str]:
        """Kind, place and term."""
        if self.active is not None:
            return (*self.active.name, "")
        assert self.entry is not None
        return "aero_term", self.entry[0], str(self.entry[1])

    @property
    def time(self) -> float | None:
        """Of a step change, s."""
        return moment(self.active) if self.active is not None and is_sudden(self.active) else None


@dataclass(frozen=True)
class Finding:
    """One effect that the data show to be missing, or that could stand in place of one.

    Attributes
    ----------
    kind, where, term : str
        As in result.json.
    entry : Entry or None
        The term, where it is one.
    value, std_error : float
        In `unit`; corrected for coloured residuals.
    time : float or None
        Of a step change, s.
    p_value : float
        Of its being none; counts how many hypotheses were looked at.
    gain : float
        Rise of -2 ln L when it is struck out again.
    instead_of : str
        Of an alternative: what it could replace.
    parameters : tuple of (name, value, standard error, unit)
        All numbers of an effect that has several.
    fit : Refinement or None
        Of an alternative: the estimate with it in place of what it could replace.
    worse_by, margin : float or None
        Of an alternative: by how much -2 ln L with the price of its numbers is higher than that of the chosen one, and
        up to which difference the flights decide nothing.
    along : str
        Of a place: the body axes along which it is elsewhere, `x` or `xz`.
    unseen_better : bool or None
        Whether what was not fitted is predicted better with it; None where the method does not ask.
    """

    kind: str
    where: str
    term: str
    entry: Entry | None
    value: float
    std_error: float
    unit: str
    time: float | None
    p_value: float
    gain: float
    instead_of: str = ""
    parameters: tuple[tuple[str, float, float, str], ...] = ()
    fit: Refinement | None = field(default=None, repr=False, compare=False)
    worse_by: float | None = None
    margin: float | None = None
    along: str = ""
    unseen_better: bool | None = None


def finding_among(part: Part, tested: int, gain: float, instead_of: str = "") -> Finding:
    """A part with its evidence, one of so many hypotheses that were `asked`."""
    kind, where, term = part.label
    return Finding(
        kind=kind,
        where=where,
        term=term,
        entry=part.entry,
        value=part.value,
        std_error=part.std_error,
        unit=part.active.effect.parameters[0].unit if part.active is not None else "1",
        time=part.time,
        p_value=float(min(1.0, 2.0 * ndtr(-part.ratio) * tested)),
        gain=gain,
        instead_of=instead_of,
        parameters=part.parameters,
    )


def labels(findings: Sequence[Finding]) -> set[tuple[str, str, str]]:
    """Kind, place and term of each finding."""
    return {(finding.kind, finding.where, finding.term) for finding in findings}


def named(label: tuple[str, str, str]) -> str:
    """Kind, place and term as a person writes them."""
    kind, where, term = label
    if kind == "aero_term":
        return f"{where} {term}"
    return f"{kind} of {where}" if where else kind


def unique_alternatives(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Each alternative once, where it was first named, as the likeliest of its kind: at one of two moments, say."""
    best: dict[tuple[str, str, str, str], Finding] = {}
    for finding in findings:
        key = finding.kind, finding.where, finding.term, finding.instead_of
        if key not in best or finding.gain > best[key].gain:
            best[key] = finding
    return tuple(best.values())
