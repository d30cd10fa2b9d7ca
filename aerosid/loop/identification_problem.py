"""Input to the identification methods, and the instrument errors that some of them begin with."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

from aerosid import compatibility
from aerosid.aircraft import Aircraft
from aerosid.compatibility import KinematicConsistency, agreement_of
from aerosid.compiled.replicas import replicated
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.selection.instrument_errors import InstrumentErrors, identify_instrument_errors
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.loop.settings import LoopSettings, Method
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.settings import AttributionSettings, ShownError

KINEMATICS_FIRST: tuple[Method, ...] = ("evidence", "equations")
"""Methods that begin with the data compatibility check."""


@dataclass(frozen=True)
class IdentificationProblem:
    """Input to an identification method: declared model, candidates, flights and identified instrument errors.

    Attributes
    ----------
    aircraft : Aircraft
        The declared one.
    declared : AerodynamicModel
        Its model, with columns for the effects declared in the file.
    given : tuple of ActiveEffect
        Those effects, their parameters fixed.
    candidates : tuple of Entry
        Candidate terms.
    manoeuvres, others : tuple of Manoeuvre
        Flights that are fitted, and flights that are only predicted.
    held_out : tuple of Manoeuvre
        Flights that take part in no decision: of these only the instants of step changes are looked for.
    instrument_errors : InstrumentErrors or None
        From the data compatibility check; None where not requested, a channel is missing or a flight too short.
    """

    aircraft: Aircraft
    declared: AerodynamicModel
    given: tuple[ActiveEffect, ...]
    candidates: tuple[Entry, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    others: tuple[Manoeuvre, ...]
    held_out: tuple[Manoeuvre, ...] = ()
    instrument_errors: InstrumentErrors | None = None

    def agreement(self, settings: LoopSettings) -> KinematicConsistency | None:
        """Data compatibility of the instruments; None where it was not requested."""
        return self._agreement if settings.kinematics else None

    @functools.cached_property
    def _agreement(self) -> KinematicConsistency | None:
        """The findings from the instrument errors, formed once for all methods that are tried."""
        return None if self.instrument_errors is None else agreement_of(self.instrument_errors)

    @property
    def free(self) -> tuple[Entry, ...]:
        """Declared terms that are estimated."""
        return self.aircraft.free

    @property
    def is_reconstructed(self) -> bool:
        """Whether every flight holds the channels from which forces and moments are formed."""
        equations = equations_of(self.aircraft.axes)
        return all(equations.can_be_formed(each.outputs) for each in (*self.manoeuvres, *self.others))

    @property
    def reconstructed_hold_out(self) -> tuple[Manoeuvre, ...]:
        """The flights in no decision from whose channels forces and moments can be formed."""
        equations = equations_of(self.aircraft.axes)
        return tuple(each for each in self.held_out if equations.can_be_formed(each.outputs))

    @property
    def has_path(self) -> bool:
        """Whether every flight holds the accelerometers from which its path is integrated."""
        equations = equations_of(self.aircraft.axes)
        return all(equations.has_path(each.outputs) for each in (*self.manoeuvres, *self.others))

    @property
    def shows_air(self) -> bool:
        """Whether every flight shows its air: vanes measure it, and accelerometers the motion without it."""
        return self.has_path and all(each.sideslip_measured for each in (*self.manoeuvres, *self.others))

    def attribution(
        self, settings: AttributionSettings, agreement: KinematicConsistency | None, *, closed: bool
    ) -> AttributionSettings:
        """Settings of the structure search, with more candidates where kinematics do not check instruments or air.

        `agreement`: data compatibility, where it was asked for; `closed`: whether vanes and airspeed agree with the
        path reconstructed from gyros and accelerometers.
        """
        compared = self.aircraft.axes in compatibility.CASES
        shown = () if agreement is None else _shown_by(agreement)
        return replace(
            settings, instruments_compared=compared, air_judged=compared or closed, shown_by_kinematics=shown
        )

    def hypotheses(self, catalogue: str) -> tuple[Hypothesis, ...]:
        """Candidate hypotheses: terms, and with the whole catalogue the effects that these flights can show."""
        terms = term_hypotheses(self.candidates)
        if catalogue == "terms":
            return terms
        return terms + effect_hypotheses(self.declared, self.manoeuvres, self.aircraft.coefficients)


def _shown_by(agreement: KinematicConsistency) -> tuple[ShownError, ...]:
    """The instrument errors of a data compatibility check, and those that it cannot tell from them."""
    found = (*agreement.findings, *(each for group in agreement.inseparable for each in group[1:]))
    return tuple(ShownError(each.kind, each.where, each.axis, each.value, each.std_error) for each in found)


def with_identified_instrument_errors(problem: IdentificationProblem, settings: LoopSettings) -> IdentificationProblem:
    """The problem with the instrument errors identified by the kinematic equations, where the settings ask for them.

    They are independent of any aerodynamic model.
    """
    checked = settings.kinematics or (settings.catalogue == "all" and settings.method in KINEMATICS_FIRST)
    if not checked or not problem.is_reconstructed:
        return problem
    identified = functools.partial(
        identify_instrument_errors,
        problem.declared,
        problem.free,
        problem.given,
        problem.hypotheses("all"),
        problem.manoeuvres,
        problem.others,
        settings.equation_error,
        length=problem.aircraft.length,
    )
    return replace(problem, instrument_errors=replicated(identified))
