"""Findings: parts of an estimate beyond the declared model, and their labels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from aerosid.effects import KINDS, ActiveEffect, NoiseEffect
from aerosid.effects.kinds import axes_of
from aerosid.effects.step_input import instant_if_step, is_step_change
from aerosid.estimation.maximum_likelihood import Refinement
from aerosid.flight_model.aerodynamics import Entry

Identity = tuple[str, str, str, float | None, str]
"""Kind, place and term; of a step change also its instant, s, and log: several of one place differ in these."""

Parameters = tuple[tuple[str, float, float, str], ...]
"""Name, value, standard error and unit of each parameter of an effect."""


@dataclass(frozen=True)
class Part:
    """A part added to the declared model: a term or an effect, with its value and standard error."""

    entry: Entry | None
    active: ActiveEffect | None
    value: float
    null: float
    std_error: float
    std_errors: tuple[float, ...] = ()

    @property
    def parameters(self) -> Parameters:
        """Those of the effect: `parameters_of`."""
        if self.active is None:
            return ()
        return parameters_of(
            self.active, self.std_errors or (self.std_error,) + (np.nan,) * (len(self.active.values) - 1)
        )

    @property
    def ratio(self) -> float:
        """t-ratio: distance from the null value over the standard error; 0 where noise could imitate it."""
        if self.active is not None and abs(self.value - self.null) < self.active.effect.parameters[0].least:
            return 0.0
        return abs(self.value - self.null) / self.std_error if self.std_error > 0.0 else np.inf

    @property
    def is_disturbance(self) -> bool:
        """Whether it is a gust or unmodelled forces, which the likelihood ratio alone tests."""
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
        return instant_if_step(self.active)

    @property
    def log(self) -> str:
        """Of a step change: the log that it belongs to."""
        return log_of_step(self.active)

    @property
    def ordinal(self) -> int:
        """Which of several step changes in one place it is, from 1."""
        return self.active.ordinal if self.active is not None else 1


@dataclass(frozen=True)
class Finding:
    """One effect missing from the declared model, or an alternative to one.

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
    log : str
        Of a step change: the log that it belongs to.
    ordinal : int
        Which of several step changes in one place it is, from 1.
    p_value : float
        Under the null hypothesis, times the number of hypotheses tested (Bonferroni).
    gain : float
        Rise of -2 ln L when it is removed.
    instead_of : str
        Of an alternative: the finding that it could replace.
    parameters : tuple of (name, value, standard error, unit)
        All parameters of an effect that has several.
    fit : Refinement or None
        Of an alternative: the estimate with it in place of the finding that it could replace.
    worse_by, margin : float or None
        Of an alternative: penalised -2 ln L less that of the chosen one, and the largest insignificant difference.
    along : str
        Of a sensor position: the body axes along which it differs, `x` or `xz`.
    unseen_better : bool or None
        Whether validation records are predicted better with it; None where the method does not test it.
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
    parameters: Parameters = ()
    fit: Refinement | None = field(default=None, repr=False, compare=False)
    worse_by: float | None = None
    margin: float | None = None
    along: str = ""
    unseen_better: bool | None = None
    log: str = ""
    ordinal: int = 1


def finding_among(part: Part, tested: int, gain: float, instead_of: str = "") -> Finding:
    """A part as a finding; `tested`: number of hypotheses tested (Bonferroni)."""
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
        log=part.log,
        ordinal=part.ordinal,
        p_value=float(min(1.0, 2.0 * ndtr(-part.ratio) * tested)),
        gain=gain,
        instead_of=instead_of,
        parameters=part.parameters,
        along=axes_of(part.active),
    )


def parameters_of(active: ActiveEffect, errors: Sequence[float]) -> Parameters:
    """The parameters of an effect that has several or whose one parameter needs its name, as a position its axis.

    Not those of a step change: its instant is given by itself.
    """
    kind, names = KINDS.get(active.effect.kind), [number.name for number in active.effect.parameters]
    needs_no_name = kind is None or names == [kind.leading] or not names
    if is_step_change(active) or (len(active.values) < 2 and needs_no_name):
        return ()
    return tuple(
        (parameter.name, value, error, parameter.unit)
        for parameter, value, error in zip(active.effect.parameters, active.values, errors, strict=True)
    )


def identity(row: Finding | Part) -> Identity:
    """The key that identifies a part among those of its structure, and a finding with its part."""
    kind, where, term = row.label if isinstance(row, Part) else (row.kind, row.where, row.term)
    return kind, where, term, row.time, row.log


def log_of_step(active: ActiveEffect | None) -> str:
    """The log that a step change belongs to; empty of any other effect, which acts on all."""
    return active.log if active is not None and is_step_change(active) else ""


def labels(findings: Sequence[Finding]) -> set[tuple[str, str, str]]:
    """Kind, place and term of each finding."""
    return {(finding.kind, finding.where, finding.term) for finding in findings}


def named(label: tuple[str, str, str]) -> str:
    """Kind, place and term in words."""
    kind, where, term = label
    if kind == "aero_term":
        return f"{where} {term}"
    return f"{kind} of {where}" if where else kind


def unique_alternatives(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Each alternative once, in the order of first mention, of several (as at two instants) that of largest gain."""
    best: dict[tuple[str, str, str, str], Finding] = {}
    for finding in findings:
        key = finding.kind, finding.where, finding.term, finding.instead_of
        if key not in best or finding.gain > best[key].gain:
            best[key] = finding
    return tuple(best.values())
