"""Verdict on the declared model, and its summary sentence."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np

from aerosid.effects import KINDS
from aerosid.effects.refutation import Refutation, Refuted
from aerosid.equation_error.selection.control_dependence import dependent
from aerosid.estimation.fit_settings import RESIDUAL_TESTS
from aerosid.estimation.manoeuvre import Manoeuvre
from aerosid.estimation.residual_tests import unexplained_channels
from aerosid.flight_model.aerodynamics import Entry
from aerosid.loop.derivative_table import derivative_name
from aerosid.loop.effect_rows import Effect
from aerosid.loop.judgement_settings import JUDGEMENT
from aerosid.loop.model_validation.error_reduction import error_reduction_sentence
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.nomenclature import is_surface
from aerosid.notation import listed, number, with_deviation
from aerosid.search.attribution import Attribution
from aerosid.search.cross_validation import is_inadequate_on
from aerosid.search.findings import named
from aerosid.search.lowered_coefficients import LOWERED, LoweredCoefficient, LoweringEffect
from aerosid.search.other_derivatives import OtherDerivative


class Verdict(Enum):
    """The outcome of a loop; each value is a sentence for the report."""

    EXPLAINED = "The identified effects account for the residual of the declared model down to the measurement noise."
    PARTLY_EXPLAINED = "The identified effects are significant, but they do not account for the whole residual."
    UNEXPLAINED = "The declared model is wrong, and no effect in the library accounts for the residual."
    NOTHING_MISSING = "With its derivatives re-estimated, the declared model fits the flight down to the noise."
    NOT_EXCITED = "The manoeuvre does not excite the aircraft enough for identification."
    INCONSISTENT_DATA = "The measured channels contradict one another; no aerodynamic model can fit them all."


class Judgement(NamedTuple):
    """A verdict, and whether the completed structure leaves more than noise."""

    verdict: Verdict
    leaves_residual: bool


def judge(found: Attribution, manoeuvres: Sequence[Manoeuvre], validation: Sequence[Manoeuvre] = ()) -> Judgement:
    """The verdict on a set of findings.

    A validation flight with other derivatives is not explained by the completed model, however well its structure fits,
    nor is one of which it predicts a coefficient worse.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
        The flights that were fitted.
    validation : sequence of Manoeuvre
        Flights that were not: where the completed structure, re-estimated there, leaves more than noise, more is
        missing than the flights that were fitted show.

    Notes
    -----
    In identified turbulence the residuals are the innovations of a filter, not those of an open-loop simulation, and
    follow any slow motion: they are compared with the white noise, known or not. Where a recorder hides that too,
    neither tells a missing effect from the air, and the coefficients' residuals are tested against the controls; in
    still air too, where a sensor's coloured noise is in every residual: beside that test only a slow one counts.
    """
    if not found.findings and not is_excited(found, manoeuvres):
        return Judgement(Verdict.NOT_EXCITED, leaves_residual=False)
    if found.dependence is not None:
        leaves = bool(dependent(found.dependence)) or (
            found.still_air and _leaves_residual(found, manoeuvres, validation, RESIDUAL_TESTS.sensor_memory)
        )
    else:
        leaves = _leaves_residual(found, manoeuvres, validation, RESIDUAL_TESTS.recorder_memory)
    leaves = leaves or _shows_what_is_not_named(found)
    if not found.findings:
        return Judgement(Verdict.UNEXPLAINED if leaves else Verdict.NOTHING_MISSING, leaves)
    partly = leaves or bool(found.other_derivatives) or any(row.significant for row in found.lowered)
    return Judgement(Verdict.PARTLY_EXPLAINED if partly else Verdict.EXPLAINED, leaves)


def _leaves_residual(
    found: Attribution, manoeuvres: Sequence[Manoeuvre], validation: Sequence[Manoeuvre], memory: float
) -> bool:
    """Whether any flight leaves more than noise; behind a recorder more that repeats itself for `memory` s."""
    hidden, least = found.noise_hidden and found.in_turbulence is None, RESIDUAL_TESTS.least_share
    return bool(
        unexplained_channels(found.tested, manoeuvres, noise_hidden=hidden, memory=memory, least_share=least)
    ) or any(
        is_inadequate_on(found.tested, each, noise_hidden=hidden, memory=memory, least_share=least)
        for each in validation
    )


def _shows_what_is_not_named(found: Attribution) -> bool:
    """Whether an effect that was eliminated, as one that unseen flights refute, gains far more than its penalty.

    Something of its kind is missing then, in this place or another.
    """
    if found.predictions is None:
        return False
    near = found.predictions.decision.near_significant
    return any(row.gain > JUDGEMENT.unnamed * row.penalty and not row.is_retained for row in near)


MOTION = ("alpha", "beta", "p", "q", "r")


def is_excited(found: Attribution, manoeuvres: Sequence[Manoeuvre]) -> bool:
    """Whether the flights are excited and a derivative by a control is significant; without any, another one.

    By the standard error as published, no smaller than the Cramer-Rao bound; of a regression by that of its structure
    alone, since what might stand beside it widens the error and not the motion. An estimate from noise alone may be far
    from zero in its own standard errors, since the estimator is not linear: so the motion is tested as well. A flight
    that does not show what its controls do, such as the third of a second after a step, shows nothing that is missing.
    """
    completed, uncertainty = found.completed, found.completed_deviations
    # Constants are known from any level flight; what depends on the motion needs one.
    moving = [n for n, (_, term) in enumerate(completed.free) if term.factors]
    if not moving:
        return True
    controlled = [n for n in moving if any(is_surface(name) for name in completed.free[n][1].variables)]
    moving = controlled or moving
    values = np.array([abs(completed.model.value(completed.free[n])) for n in moving])
    errors = np.maximum(uncertainty.published, uncertainty.white)[moving]
    if uncertainty.beside_effects is not None:
        errors = np.fmin(errors, np.sqrt(np.diag(uncertainty.beside_effects))[moving])
    known = np.any(errors < JUDGEMENT.shown * values)
    return bool(known) and any(_moves(manoeuvre) for manoeuvre in manoeuvres)


def _moves(manoeuvre: Manoeuvre) -> bool:
    places = [n for n, name in enumerate(manoeuvre.axes.outputs) if name in MOTION]
    return bool(np.any(manoeuvre.spread[places] > JUDGEMENT.moves * manoeuvre.noise[places]))


_LISTED = 4
"""Display: effects that the summary lists (the table has all), and derivatives of a remark."""


def summarise(
    verdict: Verdict,
    effects: Sequence[Effect],
    errors: Sequence[ErrorRow],
    others: Sequence[OtherDerivative] = (),
    lowered: Sequence[LoweredCoefficient] = (),
    *,
    leaves: bool = True,
) -> str:
    """Summary: the missing effects, what else is open, and the error reduction on flights not used in the fit.

    `others`: derivatives that differ on a validation flight; `lowered`: coefficients of lower R^2 there;
    `leaves`: whether a residual remains.
    """
    sentence = verdict.value
    if effects:
        sentence = f"The declared model lacks {_first_of([_named(effect) for effect in effects])}."
        if verdict is Verdict.PARTLY_EXPLAINED and leaves:
            sentence += " A significant residual remains."
    if verdict is Verdict.NOT_EXCITED:
        return f"{sentence} The completed aircraft keeps every declared value."
    if others:
        sentence += f" {_another(others)}"
    worse = [f"{row.coefficient} of {row.log}" for row in lowered if row.significant and row.is_written_lower]
    if effects and worse:
        sentence += f" The completed model predicts {_first_of(worse)} worse than the declared structure."
    freely = [f"{row.coefficient} of {row.log}" for row in lowered if row.significant and not row.is_written_lower]
    if effects and freely:
        sentence += f" With all derivatives free the effects predict {_first_of(freely)} worse than without them."
    return f"{sentence} {error_reduction_sentence(errors)}".strip()


def notes_on_refuted(refuted: Refuted, *, by_blocks: bool = False) -> list[str]:
    """One sentence for each effect that was found on the identification flights and refuted.

    `by_blocks`: cross-validation on parts of the identification flights, each predicted from the rest.
    """
    predicted = "of parts of them from the rest" if by_blocks else "of the validation flights"
    words = {
        Refutation.PREDICTION: "would improve the fit of the identification flights but degrades the prediction "
        f"{predicted}: refuted, and not included.",
        Refutation.OWN_FIT: "would improve the likelihood of the identification flights by their whitened residuals "
        "alone; its coefficient itself is fitted worse with it, as where a term stands for a slow drift: refuted, and "
        "not included.",
    }
    return [f"{_capitalised(*label)} {words[grounds]}" for label, grounds in refuted.items()]


def _another(others: Sequence[OtherDerivative]) -> str:
    """The sentence of the summary on validation flights with other derivatives."""
    logs = list(dict.fromkeys(each.log for each in others))
    verb = "show" if len(logs) > 1 else "shows"
    return f"{listed(logs)} {verb} other derivatives than the identification, as of another loading or aircraft."


def notes_on_other_derivatives(others: Sequence[OtherDerivative]) -> list[str]:
    """A remark on each validation flight whose derivatives differ from those of the identification."""
    notes = []
    for log in dict.fromkeys(each.log for each in others):
        own = [each for each in others if each.log == log]
        values = [
            f"{each.coefficient} {each.term} {with_deviation(each.value, each.std_error)} "
            f"(identification {with_deviation(each.fitted, each.fitted_std_error)})"
            for each in own
        ]
        notes.append(
            f"{log} shows other derivatives than the identification: {_first_of(values)}. The largest difference is "
            f"{number(own[0].distance, 2)} standard errors. The completed aircraft is that of the identification. "
            "Compare loading, configuration, airspeed and channels of this recording, or identify from it as well."
        )
    return notes


def notes_on_lowered(lowered: Sequence[LoweredCoefficient]) -> list[str]:
    """A remark on each coefficient of a validation flight whose R^2 is lower, significantly or not.

    All derivatives are free in both structures, which then differ in the effects alone; the table of R^2 gives the
    completed model as it is written.
    """
    notes = []
    for row in lowered:
        fallen = f"R² with all derivatives free {number(row.before)} before and {number(row.after)} after"
        if row.written is not None and abs(row.written - row.after) > LOWERED.fall:
            fallen += f" ({number(row.written)} as the completed model is written)"
        if not row.significant:
            notes.append(
                f"{row.coefficient} of {row.log}: {fallen}, a fall of less than {number(LOWERED.deviations, 1)} "
                f"standard errors of {number(row.std_error, 2)}, which contain that flight's noise and the uncertainty "
                "of the derivatives. It does not count against the completed model."
            )
            continue
        model = "completed model" if row.is_written_lower else "identified effects with all derivatives free"
        told = (
            f"{row.coefficient} of {row.log} is predicted worse by the {model} than by the declared structure "
            f"re-estimated: {fallen}, standard error of the fall {number(row.std_error, 2)}."
        )
        if row.effect is not None:
            told += f" {_on_lowering(row.effect)}"
        notes.append(told)
    return notes


def _on_lowering(effect: LoweringEffect) -> str:
    """What the coefficient would be without an effect, and what that flight alone says of it."""
    unit = f" {effect.unit}" if effect.unit not in ("", "1") else ""
    fitted = f"{with_deviation(effect.fitted, effect.std_error)}{unit}"
    alone = f"{with_deviation(effect.alone, effect.alone_std_error)}{unit}"
    told = f"Without {_in_words(*effect.label)} it would be {number(effect.r2)}."
    if effect.differs:
        return (
            f"{told} That flight alone gives {alone} for it, {number(effect.distance, 2)} standard errors from "
            f"{fitted} of the identification: the flights differ in it, as of another sensor, recorder setting or "
            "configuration. Find out which holds before using the completed model."
        )
    if effect.is_determined:
        return (
            f"{told} That flight alone gives {alone} for it, and the identification {fitted}: both show it, and "
            "something else may be missing beside it that this coefficient needs."
        )
    return (
        f"{told} That flight alone does not determine it; the identification gives {fitted}. Check it before using the "
        "completed model for this coefficient."
    )


def _first_of(words: Sequence[str]) -> str:
    """The first few in a sentence, and how many more there are."""
    further = [f"{len(words) - _LISTED} more"] if len(words) > _LISTED else []
    return listed([*words[:_LISTED], *further])


def _capitalised(kind: str, where: str, term: str) -> str:
    """An effect at the beginning of a sentence: `C_m alpha^2`, `A sensor scale of theta`."""
    words = _in_words(kind, where, term)
    return f"{words[:1].upper()}{words[1:]}"


def _in_words(kind: str, where: str, term: str) -> str:
    """An effect inside a sentence: `C_m alpha^2`, `a sensor scale of theta`."""
    if kind == "aero_term":
        return f"{where} {term}"
    words = KINDS[kind].words if kind in KINDS else f"a {kind.replace('_', ' ')}"
    return f"{words}{_place(kind, where)}"


def _place(kind: str, where: str) -> str:
    """Where an effect acts: ` of alpha`, ` along z` of one along a body axis."""
    along = kind in KINDS and KINDS[kind].place == "axis"
    return f" {'along' if along else 'of'} {where}" if where else ""


def validation_decisions(
    found: Attribution, insignificant: Sequence[Entry] = (), *, estimator: bool = False
) -> tuple[str, ...]:
    """What validation flights confirmed, refuted and chose, a few words each; empty where there is nothing.

    `insignificant`: derivatives of which they decided whether they keep their declared values; `estimator`: whether
    they chose the regression.
    """
    confirmed = [f"confirmed {coefficient} {term}" for coefficient, term in (each.entry for each in found.confirmed)]
    refuted = [label for label, grounds in found.refuted.items() if grounds is Refutation.PREDICTION]
    names = [derivative_name(coefficient, str(term)) for coefficient, term in insignificant]
    chosen = [f"chose declared or estimated values of {listed(names)}"] if names else []
    by = ["chose the regression over output error"] if estimator else []
    return (*confirmed, *(f"refuted {named(label)}" for label in refuted), *by, *chosen)


def notes_on_coloured_noise(coloured: Sequence[tuple[str, str, float]]) -> list[str]:
    """One sentence for each log whose sensors have coloured noise: (log, channel, memory) each."""
    sentences = []
    for log in dict.fromkeys(log for log, _, _ in coloured):
        channels = ", ".join(f"{name} ({memory:.2f})" for place, name, memory in coloured if place == log)
        sentences.append(
            f"{log}: the noise of {channels} is coloured (lag-1 autocorrelation): it is treated as noise and not as a "
            "missing effect, and the standard errors are corrected for it."
        )
    return sentences


def _named(effect: Effect) -> str:
    """An effect with its estimate, for a sentence."""
    if effect.kind == "aero_term":
        return f"{effect.where} {effect.term} = {with_deviation(effect.value, effect.std_error)}"
    unit = "" if effect.unit == "1" else f" {effect.unit}"
    words = _in_words(effect.kind, effect.where, effect.term)
    if effect.along:
        words += f" along {listed(list(effect.along))}"
    return f"{words}{effect.moment} ({with_deviation(effect.value, effect.std_error)}{unit})"
