"""Settings of the judgement of a result: significance of derivatives, excitation of a flight."""

from __future__ import annotations

from dataclasses import dataclass

from aerosid.search.settings import AttributionSettings


@dataclass(frozen=True)
class JudgementSettings:
    """Limits of the judgement of an estimate, each with quantity, unit, effect and source.

    Attributes
    ----------
    shown : float
        Share, 1, of its size (its own or the declared, the greater) by which a derivative may be uncertain and be
        shown: three standard errors, as required of an identified effect, so that none is also insignificant.
    shown_constant : float
        The same of a constant. At more than its size it lies within two standard errors of the declared value, so that
        holding it there does not pull the derivatives that trim the flight with it.
    moves : float
        Times its noise, 1, that the standard deviation of an angle to the air or of a rate must be for a flight to have
        moved at all: that of a steady flight is its noise, which is known from the log within a quarter.
    correlated : float
        Largest absolute correlation with another estimate, 1, from which it is given as the reason why a derivative is
        not shown: a variance ten times as large as alone.
    unchanged : float
        Distance of a ratio of errors from 1, 1, below which two digits after the point show none.
    unnamed : float
        Multiple of its penalty, 1, by which an effect that was eliminated gains where something is missing all the
        same. Chosen, of benchmarks/wide_detection.py, `two`: 9 where a delay and a dead band were refuted (seed 911,
        flight 0), 4 where noise of the control looked like a dead band (seed 901, flight 9).
    """

    shown: float = 1.0 / AttributionSettings().final_deviations
    shown_constant: float = 1.0
    moves: float = 2.0
    correlated: float = 0.95
    unchanged: float = 0.005
    unnamed: float = 6.0

    def least_known(self, *, constant: bool) -> float:
        """Share of its size by which a derivative, or a constant, may be uncertain and be shown."""
        return self.shown_constant if constant else self.shown


JUDGEMENT = JudgementSettings()
"""The limits of every result."""
