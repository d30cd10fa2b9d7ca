"""Remarks on a result: the recommended decision, and the open points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from aerosid.loop.derivative_table import derivative_name
from aerosid.loop.effect_rows import Effect
from aerosid.loop.model_validation.error_reduction import headline_role
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.result import ClosedLoop
from aerosid.loop.verdict import Verdict
from aerosid.notation import listed, number
from aerosid.reporting.settings import REMARKS
from aerosid.reporting.words import effect_name, shown_unit

DECISIONS = {
    Verdict.EXPLAINED: "Decide whether completed_aircraft.toml replaces the declared model. "
    "Read the open points first.",
    Verdict.PARTLY_EXPLAINED: "Decide whether to adopt the effects below although they do not account for all flights: "
    "the summary says what is open. The residual strips show when and in which channels; a manoeuvre that excites "
    "these motions gives more information.",
    Verdict.UNEXPLAINED: "Do not adopt a completed model. The residual strips and d(t) show when and in which equation "
    "the declared model fails; look there for a cause that is not in the library.",
    Verdict.NOTHING_MISSING: "No term needs to be added. Decide whether to adopt the re-estimated derivatives "
    "in completed_aircraft.toml.",
    Verdict.NOT_EXCITED: "Nothing can be decided from these flights. Fly a manoeuvre with a response well above the "
    "measurement noise, such as a 3-2-1-1 of each control in turn.",
    Verdict.INCONSISTENT_DATA: "Correct the data first: check units, signs, delays and sensor positions in the channel "
    "map, then run again.",
}
"""Recommended decision for each verdict."""

TONES = {
    Verdict.EXPLAINED: "good",
    Verdict.NOTHING_MISSING: "good",
    Verdict.PARTLY_EXPLAINED: "fair",
    Verdict.NOT_EXCITED: "fair",
    Verdict.UNEXPLAINED: "poor",
    Verdict.INCONSISTENT_DATA: "poor",
}


def open_points(result: ClosedLoop) -> tuple[str, ...]:
    """Open points of a result, one sentence each; empty where there is none."""
    return tuple(_open_points(result))


def fits_better(effect: Effect) -> bool:
    """Whether an alternative fits better than the chosen effect by more than the margin of indistinguishability."""
    return effect.worse_by is not None and effect.margin is not None and effect.worse_by < -effect.margin


def headline_rows(result: ClosedLoop) -> tuple[ErrorRow, ...]:
    """Rows of the headline error: those of the logs with the least influence on decisions."""
    role = headline_role(result.errors)
    return tuple(row for row in result.errors if row.role == role)


def _open_points(result: ClosedLoop) -> Iterator[str]:
    if not result.identified:
        yield (
            "Nothing was identified: whether the declared model lacks an effect, and by how much its derivatives are "
            "off, is open until the channels agree."
        )
        for log in dict.fromkeys(row.log for row in result.errors if row.declared is None):
            yield f"On {log} the simulation of the declared model leaves |α| < 1.5 rad: no error can be given."
        return
    if not result.validation and not result.hold_out:
        yield (
            "No flight was reserved for validation (--validate, --hold-out): the errors below are those of the fitted "
            "flights, and a model that fits its identification data need not predict another flight."
        )
    for effect in result.effects:
        gain = (
            effect.evidence.validation_gain if effect.evidence.hold_out_gain is None else effect.evidence.hold_out_gain
        )
        if gain is not None and gain < REMARKS.worse:
            yield (
                f"Without {effect_name(effect)}, with everything else re-estimated, flights not used in the fit are "
                f"predicted better: the error in the median channel is {number(gain, 2)} of that with it."
            )
    yield from _replaceable(result.alternatives)
    if result.validation and not result.hold_out and result.decided_by_validation:
        yield (
            f"The validation flights took part in structure determination ({listed(result.decided_by_validation)}): "
            "their errors are not independent evidence (--hold-out gives a flight that is used in no decision)."
        )
    hidden = [derivative_name(row.coefficient, row.term) for row in result.derivatives if not row.shown]
    if hidden:
        yield f"The flights contain too little information on {listed(hidden)}."
    for effect in result.effects:
        if effect.evidence.p_value > REMARKS.chance:
            chance = number(100.0 * effect.evidence.p_value, 2)
            yield (
                f"{effect_name(effect)} is identified by its gain in likelihood; its parameter alone, "
                f"{number(abs(effect.value / effect.std_error), 2)} standard errors from its null value, would occur "
                f"by chance in {chance} % of such searches."
            )
    left: dict[str, list[str]] = {}
    for log in dict.fromkeys(row.log for row in result.errors):
        for remark in _left_over([row for row in result.errors if row.log == log], noise_is_the_measure(result)):
            left.setdefault(remark, []).append(log)
    yield from (f"On {listed(logs)} {remark}" for remark, logs in left.items())


def _replaceable(alternatives: Sequence[Effect]) -> Iterator[str]:
    """Remarks on the effects that others could replace: these are named where they are few, else they are counted."""
    groups: dict[str, list[Effect]] = {}
    for effect in alternatives:
        groups.setdefault(effect.instead_of or "the chosen structure", []).append(effect)
    equal = {
        place: [effect_name(effect) for effect in effects if not fits_better(effect)]
        for place, effects in groups.items()
    }
    equal = {place: names for place, names in equal.items() if names}
    count = len({name for names in equal.values() for name in names})
    if count > REMARKS.most_named:
        one_of = "one of " if len(equal) > 1 else ""
        yield (
            f"Each of {count} other effects could stand in the place of {one_of}{listed(list(equal))}: these "
            "manoeuvres cannot distinguish them. “Indistinguishable alternatives” lists them."
        )
    else:
        for place, names in equal.items():
            yield f"These manoeuvres cannot distinguish {listed(names)} from {place}."
    for place, effects in groups.items():
        yield from _better(place, effects)


def _better(place: str, alternatives: Sequence[Effect]) -> Iterator[str]:
    """A remark on the effects with which the fit improves by more than the margin."""
    better = [effect for effect in alternatives if fits_better(effect)]
    if better:
        names = [f"{effect_name(effect)} (by {number(-(effect.worse_by or 0.0), 2)})" for effect in better]
        margin = number(max(effect.margin or 0.0 for effect in better), 2)
        yield (
            f"Replacing {place}, the fit improves in -2 ln L by more than the margin of {margin} with {listed(names)}: "
            "the search retained the chosen structure as a whole; decide on physical grounds."
        )


def noise_is_the_measure(result: ClosedLoop) -> bool:
    """Whether simulation errors are given in units of the noise: not in turbulence or after a recorder's filter.

    There the equations decide: open-loop errors are due to the turbulence, and the recorder's filter sets the noise.
    """
    return result.decided_by != "equations"


def _left_over(rows: Sequence[ErrorRow], measured: bool) -> Iterator[str]:
    """What is said of the remaining error on one log; `measured`: in units of the noise."""
    diverged = [row.channel for row in rows if row.after is None]
    if diverged:
        yield "the simulation of the completed model leaves |α| < 1.5 rad: no error can be given."
    shifted = [
        row for row in rows if row.after and row.trimmed is not None and row.after > REMARKS.above_noise * row.trimmed
    ]
    grown = [
        row for row in rows if row.after and row.trimmed is not None and row.trimmed > REMARKS.above_noise * row.after
    ]
    if shifted:
        fallen = listed([_change(row, row.after, row.trimmed) for row in shifted])
        increased = listed([_change(row, row.after, row.trimmed, "increases") for row in grown])
        yield (
            f"the error of {fallen} when the constants of the coefficients are re-estimated on it: its trim, "
            "centre of gravity or instrument zeros differ from those of the fitted flights"
            f"{f', or an effect is missing: that of {increased}' if increased else ''}."
        )
    known = [row for row in rows if _rest(row) is not None and not row.noise_doubt]
    above = [row for row in known if (_rest(row) or 0.0) > REMARKS.above_noise * row.noise > 0.0]
    if above:
        times = [
            f"{row.channel} ({number((_rest(row) or 0.0) / row.noise, 2)} times)" if measured else row.channel
            for row in above
        ]
        why = ": there is turbulence or recorder filtering, and the ratio to the noise does not measure the model"
        yield f"the error remains above the measurement noise in {listed(times)}{'' if measured else why}."


def _rest(row: ErrorRow) -> float | None:
    return row.after if row.trimmed is None else row.trimmed


def _change(row: ErrorRow, start: float | None, end: float | None, verb: str = "decreases") -> str:
    unit = shown_unit(row.unit)
    first, last = (number(None if value is None else value * unit.factor, 2) for value in (start, end))
    return f"{row.channel} {verb} from {first} to {last} {unit.text}".rstrip()
