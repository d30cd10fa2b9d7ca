"""Identification methods by name: evidence, equations, likelihood and IEBMEE."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aerosid import compatibility
from aerosid.aircraft import Aircraft
from aerosid.compatibility import KinematicConsistency, agreement_of
from aerosid.effects import ActiveEffect
from aerosid.effects.hypothesis import Hypothesis
from aerosid.equation_error.decision import decide
from aerosid.equation_error.equations.channels import equations_of
from aerosid.equation_error.selection.evidence import EvidenceFinding
from aerosid.equation_error.selection.joint_timing import TwoWitnesses
from aerosid.equation_error.selection.nearly_proven import NearlyProven
from aerosid.equation_error.selection.prices import Support
from aerosid.equation_error.selection.proved_faults import ProvedFaults, prove_faults
from aerosid.equation_error.selection.shared_damping import USUAL, SharedDamping
from aerosid.estimation.fit_settings import NEARBY, WRONG_STRUCTURE
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.maximum_likelihood import Refinement, refine
from aerosid.flight_model.aerodynamics import AerodynamicModel, Entry
from aerosid.loop.settings import LoopSettings, Method, Progress
from aerosid.notation import listed, number, si_unit, with_deviation
from aerosid.search.attribution import Attribution, attribute
from aerosid.search.calm_air import estimated_in_calm_air
from aerosid.search.equation_error_attribution import attribute_by_equations
from aerosid.search.equivalent_causes import with_equivalent_causes
from aerosid.search.final_significance import significant
from aerosid.search.findings import named
from aerosid.search.hypotheses import effect_hypotheses, term_hypotheses
from aerosid.search.indistinguishable_terms import CoefficientRival, coefficient_rivals, with_rivals
from aerosid.search.partial_correlation.attribution import attribute_by_model_error, told_of_unseen
from aerosid.search.settings import AttributionSettings
from aerosid.search.structure_search import StructureSearch


@dataclass(frozen=True)
class Question:
    """Input to an identification method: declared model, candidates, flights and proved sensor faults.

    Attributes
    ----------
    aircraft : Aircraft
        The declared one.
    declared : AerodynamicModel
        Its model, with columns for what the file declares to act.
    given : tuple of ActiveEffect
        That, its numbers held.
    candidates : tuple of Entry
        Terms that may be missing.
    manoeuvres, others : tuple of Manoeuvre
        Flights that are fitted, and flights that are only predicted.
    faults : ProvedFaults or None
        What kinematics prove of the instruments; None where nobody asked, a channel is missing or a flight too short.
    """

    aircraft: Aircraft
    declared: AerodynamicModel
    given: tuple[ActiveEffect, ...]
    candidates: tuple[Entry, ...]
    manoeuvres: tuple[Manoeuvre, ...]
    others: tuple[Manoeuvre, ...]
    faults: ProvedFaults | None = None

    def agreement(self, settings: LoopSettings) -> KinematicConsistency | None:
        """Data compatibility of the instruments; None where it was not requested."""
        return agreement_of(self.faults) if settings.kinematics and self.faults is not None else None

    @property
    def free(self) -> tuple[Entry, ...]:
        """Declared terms that are estimated."""
        return tuple((d.coefficient, d.term) for d in self.aircraft.derivatives if not d.fixed)

    @property
    def is_reconstructed(self) -> bool:
        """Whether every flight holds what its path is reconstructed from by kinematics."""
        needed = set(equations_of(self.aircraft.axes).needed)
        return all(needed <= set(each.outputs) for each in (*self.manoeuvres, *self.others))

    @property
    def shows_air(self) -> bool:
        """Whether vanes show the air of every flight: beside a path that is its own sideslip nothing shows gusts."""
        return all(each.sideslip_measured for each in (*self.manoeuvres, *self.others))

    def attribution(self, settings: AttributionSettings, *, closed: bool) -> AttributionSettings:
        """The settings of the structure search, which has more to ask where kinematics do not judge instruments or air.

        `closed`: whether vanes and airspeed show no more than the path that gyros and accelerometers give.
        """
        compared = self.aircraft.axes in compatibility.CASES
        return replace(settings, instruments_compared=compared, air_judged=compared or closed)

    def hypotheses(self, catalogue: str) -> tuple[Hypothesis, ...]:
        """What may be missing: terms, and of the whole catalogue what these flights can show."""
        terms = term_hypotheses(self.candidates)
        if catalogue == "terms":
            return terms
        return terms + effect_hypotheses(self.declared, self.manoeuvres, self.aircraft.coefficients)


@dataclass(frozen=True)
class Answer:
    """Result of an identification method: attribution, indistinguishable terms and notes.

    `search`: the fitted flights, the hypotheses and the settings, of which further questions are asked; `deciding`:
    the method whose answer it is; `agreement`: what its witness says of the instruments.
    """

    found: Attribution
    search: StructureSearch
    rivals: tuple[CoefficientRival, ...] = ()
    notes: tuple[str, ...] = ()
    deciding: Method = "likelihood"
    agreement: KinematicConsistency | None = None


KINEMATICS_FIRST: tuple[Method, ...] = ("evidence", "equations")
"""Methods that ask first what kinematics prove of the instruments."""


def answer(question: Question, settings: LoopSettings, progress: Progress) -> Answer:
    """Run the method selected in the settings.

    Raises
    ------
    EstimationError
        Where the declared model cannot be simulated.
    """
    methods: dict[Method, Callable[[Question, LoopSettings, Progress], Answer]] = {
        "evidence": by_evidence,
        "equations": by_equations,
        "likelihood": by_likelihood,
        "iebmee": by_model_error,
    }
    asked = settings.kinematics or (settings.catalogue == "all" and settings.method in KINEMATICS_FIRST)
    faults = _proved_faults(question, settings) if asked and question.is_reconstructed else None
    return methods[settings.method](replace(question, faults=faults), settings, progress)


def by_evidence(question: Question, settings: LoopSettings, progress: Progress) -> Answer:
    """Maximum likelihood where kinematic residuals are at the sensors' noise level, equation error elsewhere.

    In air that moves, and behind recorders that filter, an open-loop simulation follows no flight: its errors are not
    the measurement noise that the likelihood takes them for.
    """
    faults = question.faults
    if faults is None or settings.catalogue == "terms":
        return by_likelihood(question, settings, progress)
    ratio = faults.noise_ratio
    if ratio <= settings.equation_error.closed:
        return by_likelihood(question, settings, progress, closed=question.shows_air)
    found = _by_equations(faults, question, settings, progress)
    said = (
        f"The residuals of the kinematic equations are {_times(ratio)} the level expected from the white noise between "
        "successive samples: there is turbulence or recorder filtering. The kinematic and coefficient equations decide "
        "(method equations); errors of open-loop simulations are predictions, no measure of the model."
    )
    return replace(found, notes=(said, *found.notes))


def _times(ratio: float) -> str:
    """A multiple of the noise; beyond 100 the recorder's filter determines the noise, and the number is meaningless."""
    return f"up to {number(ratio, 2)} times" if ratio < 100.0 else "more than 100 times"


def by_equations(question: Question, settings: LoopSettings, progress: Progress) -> Answer:
    """Equation error with coloured residuals: kinematic equations first, coefficient equations second.

    A study of terms alone, with a start of its own, is answered by the likelihood.
    """
    faults = question.faults
    if faults is None or settings.catalogue == "terms":
        return by_likelihood(question, settings, progress)
    return _by_equations(faults, question, settings, progress)


def _proved_faults(question: Question, settings: LoopSettings) -> ProvedFaults | None:
    """Sensor faults proved by the kinematic equations, independent of any aerodynamic model."""
    return prove_faults(
        question.declared,
        question.free,
        question.given,
        question.hypotheses("all"),
        question.manoeuvres,
        question.others,
        settings.equation_error,
        length=question.aircraft.length,
    )


def _by_equations(faults: ProvedFaults, question: Question, settings: LoopSettings, progress: Progress) -> Answer:
    """Attribution by the coefficient equations, with the proved sensor faults applied."""
    progress("estimating by equation error")
    coefficients = question.aircraft.coefficients
    decision = decide(faults, coefficients)
    found = attribute_by_equations(decision, question.manoeuvres)
    search = StructureSearch(
        question.manoeuvres,
        question.hypotheses(settings.catalogue),
        coefficients,
        found.before,
        settings.attribution,
        question.declared,
    )
    notes = tuple(told_of_timing(each) for each in decision.timings)
    together = decision.supported
    notes += tuple(
        told_of_support(row, together[row.hypothesis.label])
        for row in decision.findings
        if row.hypothesis.label in together and not together[row.hypothesis.label].is_silent
    )
    notes += tuple(told_of_nearly_proven(row) for row in decision.nearly)
    if decision.damping is not None:
        notes = (*notes, told_of_damping(decision.damping))
    if decision.gust_share <= settings.equation_error.calm and not decision.turbulence:
        found = estimated_in_calm_air(found, decision, search)
    found = with_equivalent_causes(found, question.aircraft, question.manoeuvres)
    return Answer(found, search, notes=notes, deciding="equations", agreement=question.agreement(settings))


def told_of_timing(seen: TwoWitnesses) -> str:
    """Note on an instrument's time delay or lag: from kinematics alone, and together with forces and moments."""

    def words(active: ActiveEffect, error: float) -> str:
        kind = active.effect.kind.removeprefix("sensor_")
        return f"a {kind} of {with_deviation(active.values[0], error)} s"

    alone, joint = words(seen.alone, seen.alone_std_error), words(seen.joint, seen.joint_std_error)
    return (
        f"{seen.channel} is recorded late: kinematics alone give {alone}, together with forces and moments {joint}, "
        "which the completed model uses. If the declared structure lacks an effect that resembles a delay, such as "
        "unsteady lift that lags alpha, the estimate from kinematics alone is the better one."
    )


def told_of_support(row: EvidenceFinding, seen: Support) -> str:
    """Note on an instrument error that is significant only in kinematic and coefficient equations together."""
    own = row.active.effect.parameters[0].unit if row.active is not None else "1"
    unit = "" if own == "1" else f" {own}"
    alone = with_deviation(seen.values[0], float(np.sqrt(seen.covariance[0, 0])))
    return (
        f"{named(row.hypothesis.label)} of {with_deviation(row.value, row.std_error)}{unit} is identified from "
        f"kinematics and coefficients together: kinematics alone give {alone}{unit}, 2 ln L {number(2.0 * seen.gain)}, "
        "which is not significant, and forces and moments agree."
    )


NOTED_RISE = 0.005
"""Display: rise of R^2 from which it is noted; its third digit is the last that is printed."""


def told_of_nearly_proven(row: NearlyProven) -> str:
    """Note on an effect that would be significant as the only hypothesis: gain, penalty and R^2."""
    own = si_unit(row.active.effect.parameters[0].unit) if row.active is not None else ""
    value = f"{with_deviation(row.value, row.std_error)} {own}".strip()
    said = (
        f"Near-significant: {named(row.hypothesis.label)} of {value} gains {number(row.gain, 2)} in ln L; the penalty "
        f"for the number of hypotheses is {number(row.price, 2)}"
    )
    if row.rivals:
        others = listed([named(rival.label) for rival in row.rivals[:2]], "or")
        said += f"; replacing it by {others} fits nearly as well"
    better = [(a, b) for a, b in row.unseen if b.r2 >= a.r2 + NOTED_RISE]
    if better:
        shares = [f"{b.coefficient} of {b.recording} from {a.r2:.3f} to {b.r2:.3f}" for a, b in better]
        said += f". It would raise R^2 of {listed(shares)}"
    return f"{said}."


def told_of_damping(damping: SharedDamping) -> str:
    """Note on the part of C_m q_hat that these manoeuvres cannot separate from C_m alpha_dot_hat."""
    least, most = damping.parts
    own = f"{number(100.0 * damping.own)} %" if damping.own > 1e-3 else "less than 0.1 %"
    return (
        f"C_m q_hat is a combined derivative: it includes {number(damping.share)} times the C_m alpha_dot_hat that the "
        f"model may lack; {own} of that regressor is independent of the declared terms in these manoeuvres. With a "
        f"C_m alpha_dot_hat of the usual size ({USUAL[0]} to {USUAL[1]} of C_m q_hat), C_m q_hat alone is "
        f"{100.0 * least / damping.value:.0f} to {100.0 * most / damping.value:.0f} % of the estimate; the standard "
        "error does not include this."
    )


def _declared_estimate(question: Question, settings: LoopSettings, progress: Progress) -> Refinement:
    """Maximum-likelihood estimate of the declared structure."""
    progress("re-estimating the declared model")
    return refine(
        _begun(question.declared, settings.start),
        question.manoeuvres,
        question.free,
        effects=question.given,
        priors=_priors(question.aircraft) if settings.priors else (),
        settings=NEARBY if settings.start else WRONG_STRUCTURE,
    )


def by_likelihood(question: Question, settings: LoopSettings, progress: Progress, *, closed: bool = False) -> Answer:
    """Score tests, trial fits and maximum likelihood; `closed`: kinematics show that the air rests."""
    manoeuvres, declared = question.manoeuvres, question.declared
    agreement = question.agreement(settings)
    before = _declared_estimate(question, settings, progress)
    progress("determining the structure from the residual")
    hypotheses = question.hypotheses(settings.catalogue)
    if settings.catalogue == "terms":
        quiet = replace(settings.attribution, disturbances=False)
        found = attribute(before, manoeuvres, hypotheses, (), quiet, declared, question.others)
        search = StructureSearch(manoeuvres, hypotheses, (), before, quiet, declared)
        return Answer(significant(found, search), search, agreement=agreement)
    attribution = question.attribution(settings.attribution, closed=closed)
    found = attribute(
        before,
        manoeuvres,
        hypotheses,
        question.aircraft.coefficients,
        attribution,
        declared,
        question.others,
        moving_air=agreement is not None and agreement.is_gusty,
    )
    search = StructureSearch(manoeuvres, hypotheses, question.aircraft.coefficients, before, attribution, declared)
    found = significant(found, search)
    found = with_equivalent_causes(found, question.aircraft, manoeuvres)
    rivals = coefficient_rivals(found, manoeuvres, hypotheses)
    return Answer(with_rivals(found, rivals, settings.attribution.reach), search, tuple(rivals), agreement=agreement)


def by_model_error(
    question: Question, settings: LoopSettings, progress: Progress, first: Answer | None = None
) -> Answer:
    """Prefilter, continuous IEBMEE with the fixed interval, partial correlation with d(t), recursive least squares.

    `first`: another method's answer to the same question, of which the hypotheses and the motion are taken.
    """
    progress("re-estimating the declared model")
    known = first.search.hypotheses if first is not None else ()
    hypotheses = known or question.hypotheses(settings.catalogue)
    found, selection = attribute_by_model_error(
        question.declared,
        question.manoeuvres,
        question.free,
        question.given,
        hypotheses,
        question.aircraft.coefficients,
        settings.chain,
        settings.model_error,
        progress,
        first.found if first is not None else None,
    )
    search = StructureSearch(
        question.manoeuvres,
        hypotheses,
        question.aircraft.coefficients,
        found.before,
        settings.attribution,
        question.declared,
    )
    notes = tuple(told_of_unseen(selection))
    return Answer(found, search, notes=notes, deciding="iebmee", agreement=question.agreement(settings))


def _begun(declared: AerodynamicModel, start: Sequence[float]) -> AerodynamicModel:
    """The declared model with other values of its terms to begin from, where some are given."""
    if not start:
        return declared
    values = declared.values.copy()
    values[: len(start)] = start
    return declared.with_values(values)


def _priors(aircraft: Aircraft) -> tuple[tuple[Entry, float, float], ...]:
    return tuple(
        ((d.coefficient, d.term), d.value, d.sigma) for d in aircraft.derivatives if d.sigma is not None and not d.fixed
    )
