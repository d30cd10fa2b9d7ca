"""Remarks on a result: what an engineer has to decide, and what the flights do not prove."""

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
    Verdict.EXPLAINED: "Decide whether the declared model gives way to completed_aircraft.toml. "
    "Read first what is not proven.",
    Verdict.PARTLY_EXPLAINED: "Decide whether the effects below are adopted although more is missing. The residual "
    "strips show when and in which channels; a manoeuvre that excites these moments would say more.",
    Verdict.UNEXPLAINED: "Do not adopt a completed model. The residual strips and d(t) show when and in which equation "
    "the declared model fails; look there for a cause that the library does not hold.",
    Verdict.NOTHING_MISSING: "No term is to be added. Decide whether the re-estimated derivatives are adopted: "
    "completed_aircraft.toml holds them.",
    Verdict.NOT_EXCITED: "Nothing can be decided from these flights. Fly a manoeuvre that moves the aircraft well out "
    "of its noise, such as a 3-2-1-1 of the elevator.",
    Verdict.INCONSISTENT_DATA: "Mend the data first: check units, signs, delays and sensor positions in the channel "
    "map, then run again.",
}
"""What each verdict asks of the engineer."""

TONES = {
    Verdict.EXPLAINED: "good",
    Verdict.NOTHING_MISSING: "good",
    Verdict.PARTLY_EXPLAINED: "fair",
    Verdict.NOT_EXCITED: "fair",
    Verdict.UNEXPLAINED: "poor",
    Verdict.INCONSISTENT_DATA: "poor",
}


def unproven(result: ClosedLoop) -> tuple[str, ...]:
    """What a reader might take for proven and is not, one sentence each; empty where nothing is open."""
    return tuple(_unproven(result))


def fits_better(effect: Effect) -> bool:
    """Whether an alternative fits better than the chosen effect by more than decides nothing."""
    return effect.worse_by is not None and effect.margin is not None and effect.worse_by < -effect.margin


def headline_rows(result: ClosedLoop) -> tuple[ErrorRow, ...]:
    """The rows that answer whether the model got better: of the logs that are farthest from every decision."""
    role = headline_role(result.errors)
    return tuple(row for row in result.errors if row.role == role)


def _unproven(result: ClosedLoop) -> Iterator[str]:
    if not result.validation and not result.hold_out:
        yield (
            "No flight was held back (--validate, --hold-out): the errors below are those of the fitted flights, and a "
            "model that fits the flight it was made from need not predict another."
        )
    for effect in result.effects:
        gain = (
            effect.evidence.validation_gain if effect.evidence.hold_out_gain is None else effect.evidence.hold_out_gain
        )
        if gain is not None and gain < REMARKS.worse:
            yield (
                f"Without {effect_name(effect)}, everything else estimated again, the flights that were not fitted are "
                f"predicted better: the error in the median channel is {number(gain, 2)} of that with it."
            )
    for chosen in dict.fromkeys(effect.instead_of for effect in result.alternatives):
        yield from _rivals_of(chosen, [effect for effect in result.alternatives if effect.instead_of == chosen])
    if result.validation and not result.hold_out and result.decided_by_validation:
        yield (
            f"The validation flights had a say in what is named ({listed(result.decided_by_validation)}): their "
            "errors are no independent evidence of it (--hold-out names a flight that no decision touches)."
        )
    hidden = [derivative_name(row.coefficient, row.term) for row in result.derivatives if not row.shown]
    if hidden:
        yield f"The flights hold too little information on {listed(hidden)}."
    for effect in result.effects:
        if effect.evidence.p_value > REMARKS.chance:
            chance = number(100.0 * effect.evidence.p_value, 2)
            yield (
                f"{effect_name(effect)} is named by what it brings to the likelihood; its number alone, "
                f"{number(abs(effect.value / effect.std_error), 2)} standard errors from its null value, would come "
                f"by chance in {chance} % of such searches."
            )
    for log in dict.fromkeys(row.log for row in result.errors):
        rows = [row for row in result.errors if row.log == log]
        yield from _left_over(log, rows, noise_is_the_measure(result))


def _rivals_of(chosen: str, rivals: Sequence[Effect]) -> Iterator[str]:
    """What the flights say of the effects that could stand in the place of one."""
    place = chosen or "what was chosen"
    equal = [effect_name(effect) for effect in rivals if not fits_better(effect)]
    if equal:
        yield f"These manoeuvres cannot tell {listed(equal)} from {place}."
    better = [effect for effect in rivals if fits_better(effect)]
    if better:
        names = [f"{effect_name(effect)} (by {number(-(effect.worse_by or 0.0), 2)})" for effect in better]
        margin = number(max(effect.margin or 0.0 for effect in better), 2)
        yield (
            f"In place of {place} the flights are fitted better in -2 ln L by more than the margin of {margin} with "
            f"{listed(names)}: the search kept the chosen structure as a whole, and physics must judge."
        )


def noise_is_the_measure(result: ClosedLoop) -> bool:
    """Whether errors of simulations are to be counted in units of the noise: not where air moves or a filter smooths.

    There the equations decide, and open-loop errors are the air's, over a noise that the recorder has made.
    """
    return result.decided_by != "equations"


def _left_over(log: str, rows: Sequence[ErrorRow], measured: bool) -> Iterator[str]:
    """What remains of the error on one log; `measured` in units of the noise."""
    diverged = [row.channel for row in rows if row.after is None]
    if diverged:
        yield f"On {log} the simulation of the completed model leaves |α| < 1.5 rad: no error can be given."
    shifted = [
        row for row in rows if row.after and row.trimmed is not None and row.after > REMARKS.above_noise * row.trimmed
    ]
    grown = [
        row for row in rows if row.after and row.trimmed is not None and row.trimmed > REMARKS.above_noise * row.after
    ]
    if shifted:
        fallen = listed([_change(row, row.after, row.trimmed) for row in shifted])
        price = listed([_change(row, row.after, row.trimmed, "grows") for row in grown])
        yield (
            f"On {log} the error of {fallen} when the constants of the coefficients are re-estimated on it: its trim, "
            "centre of gravity or instrument zeros differ from those of the fitted flights"
            f"{f', or more is missing: that of {price}' if price else ''}."
        )
    known = [row for row in rows if _rest(row) is not None and not row.noise_doubt]
    above = [row for row in known if (_rest(row) or 0.0) > REMARKS.above_noise * row.noise > 0.0]
    if above:
        times = [
            f"{row.channel} ({number((_rest(row) or 0.0) / row.noise, 2)} times)" if measured else row.channel
            for row in above
        ]
        why = ": the air moves, or the recorder filters, and how many times says nothing of the model"
        yield f"On {log} the error stays above the measurement noise in {listed(times)}{'' if measured else why}."


def _rest(row: ErrorRow) -> float | None:
    return row.after if row.trimmed is None else row.trimmed


def _change(row: ErrorRow, start: float | None, end: float | None, verb: str = "falls") -> str:
    unit = shown_unit(row.unit)
    first, last = (number(None if value is None else value * unit.factor, 2) for value in (start, end))
    return f"{row.channel} {verb} from {first} to {last} {unit.text}".rstrip()
