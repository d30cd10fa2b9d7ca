"""Ratio of root-mean-square errors before and after, by channel: the one measure of how much closer a model is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aerosid.loop.judgement_settings import JUDGEMENT
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.roles import ROLES


@dataclass(frozen=True)
class ErrorReduction:
    """By what factor the errors of one role's logs fall from before to after.

    Attributes
    ----------
    role : str
        Of the logs.
    median : float
        Over channels and logs.
    ratios : tuple of (str, str, float)
        Log, channel and before/after, largest first; below 1 the error grows.
    """

    role: str
    median: float
    ratios: tuple[tuple[str, str, float], ...]

    @property
    def best(self) -> tuple[str, str, float]:
        """Log, channel and ratio where the error falls most."""
        return self.ratios[0]

    @property
    def worst(self) -> tuple[str, str, float]:
        """Log, channel and ratio where it falls least, or grows most."""
        return self.ratios[-1]


def headline_role(errors: Sequence[ErrorRow]) -> str:
    """Whose errors answer whether a model became better: those farthest from every decision."""
    roles = {row.role for row in errors}
    return next((role for role in reversed(ROLES) if role in roles), ROLES[0])


def error_reduction(errors: Sequence[ErrorRow]) -> ErrorReduction | None:
    """The reduction over the logs of the headline's role; None where no error can be compared.

    A channel whose simulation left its range, before or after, has no error to compare.
    """
    role = headline_role(errors)
    ratios = [
        (row.log, row.channel, row.before / row.after)
        for row in errors
        if row.role == role and row.before is not None and row.after is not None and row.after > 0.0
    ]
    if not ratios:
        return None
    ordered = tuple(sorted(ratios, key=lambda each: -each[2]))
    return ErrorReduction(role, float(np.median([ratio for _, _, ratio in ordered])), ordered)


def error_reduction_sentence(errors: Sequence[ErrorRow]) -> str:
    """The reduction as one sentence that holds for each channel; empty where there is none to tell."""
    reduction = error_reduction(errors)
    if reduction is None:
        return ""
    fallen = sum(ratio > 1.0 + JUDGEMENT.unchanged for _, _, ratio in reduction.ratios)
    grown = sum(ratio < 1.0 - JUDGEMENT.unchanged for _, _, ratio in reduction.ratios)
    flights = f"{reduction.role.replace('_', '-')} flight" + "s" * (len({log for log, _, _ in reduction.ratios}) > 1)
    count = len(reduction.ratios)
    if not fallen and not grown:
        return f"On the {flights} the open-loop error is the same before and after in every channel."
    (_, best, most), (_, worst, least) = reduction.best, reduction.worst
    return (
        f"On the {flights} the ratio of the open-loop errors, before/after, is {reduction.median:.2f} in the median "
        f"channel ({most:.2f} in {best}, {least:.2f} in {worst}); the error decreases in {fallen} of {count} channels "
        f"and increases in {grown}."
    )
