"""Summary of a closed loop on one screen of a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from aerosid.loop.effect_rows import Effect
from aerosid.loop.model_validation.open_loop_errors import ErrorRow
from aerosid.loop.model_validation.predictions import AHEAD, ONE_STEP, OPEN_LOOP, PredictionRow
from aerosid.loop.next_flight.planned_flight import NextFlight
from aerosid.loop.result import ClosedLoop
from aerosid.loop.second_opinion import SecondOpinion
from aerosid.loop.verdict import Verdict
from aerosid.notation import MISSING, number, p_value, with_deviation
from aerosid.reporting.prose import in_words
from aerosid.reporting.roles import label_of
from aerosid.reporting.words import effect_sentence, ratio, shown_unit

_STYLES = {
    Verdict.EXPLAINED: "bold green",
    Verdict.NOTHING_MISSING: "bold green",
    Verdict.PARTLY_EXPLAINED: "bold yellow",
    Verdict.NOT_EXCITED: "bold yellow",
    Verdict.UNEXPLAINED: "bold red",
    Verdict.INCONSISTENT_DATA: "bold red",
}


def print_summary(result: ClosedLoop, console: Console) -> None:
    """Prints verdict, sentence, effects, derivatives, and the error before and after on each log.

    Parameters
    ----------
    result : ClosedLoop
        The result of close-loop.
    console : Console
        Console to print on. Texts from files are printed as they are, never interpreted as markup.
    """
    console.print(Text(result.verdict.name.lower().replace("_", " "), style=_STYLES[result.verdict]))
    console.print(Text(in_words(result.summary)), soft_wrap=True)
    if result.effects:
        console.print(_effects("Effects missing from the declared model", result.effects))
    if result.alternatives:
        console.print(_effects("Indistinguishable alternatives", result.alternatives))
    if result.derivatives and result.identified:
        console.print(_derivatives(result))
    for log, role in dict.fromkeys((row.log, row.role) for row in result.errors):
        rows = [row for row in result.errors if (row.log, row.role) == (log, role)]
        console.print(_errors(log, label_of(role, result), rows))


def print_consequences(result: ClosedLoop, console: Console) -> None:
    """Prints what is computed after the summary: the cross-check, predictions and the next flight."""
    _print_second_opinion(result, console)
    print_predictions(result, console)
    _print_next_flight(result, console)


def _print_second_opinion(result: ClosedLoop, console: Console) -> None:
    """Prints the cross-check by the model error d(t), with the structures side by side where the methods differ."""
    if result.second_opinion is None:
        return
    console.print(Text(in_words(result.second_opinion.sentence)), soft_wrap=True)
    if len(result.second_opinion.structures) > 1:
        console.print(_structures(result.second_opinion))


def print_predictions(result: ClosedLoop, console: Console) -> None:
    """Prints R^2 of predictions of the last flight, preferably of one not used in the fit."""
    if result.predictions:
        last = result.predictions[-1]
        rows = [row for row in result.predictions if row.log == last.log]
        console.print(_predictions(last.log, label_of(last.role, result), rows))


def _print_next_flight(result: ClosedLoop, console: Console) -> None:
    """Prints the next flight, where there is an open question."""
    if result.next_flight is not None:
        console.print(Text(in_words(_next_flight(result.next_flight))), soft_wrap=True)


def _table(title: str, left: Sequence[str], right: Sequence[str]) -> Table:
    table = Table(title=Text(title), title_justify="left")
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    return table


def _effects(title: str, effects: Sequence[Effect]) -> Table:
    listed = any(effect.instead_of for effect in effects)
    last = "fits worse by" if listed else "error without / with"
    table = _table(title, ("", "effect"), ("value ± standard error", "unit", "p-value", last))
    for effect in effects:
        evidence = effect.evidence
        gain = evidence.validation_gain if evidence.hold_out_gain is None else evidence.hold_out_gain
        criterion = number(effect.worse_by, 2) if listed else MISSING if gain is None else number(gain, 2)
        sentence = effect_sentence(effect) + (f", replacing {effect.instead_of}" if effect.instead_of else "")
        cells = (
            str(effect.rank),
            sentence,
            with_deviation(effect.value, effect.std_error),
            effect.unit,
            p_value(effect.evidence.p_value),
            criterion,
        )
        table.add_row(*(Text(in_words(cell)) for cell in cells))
    return table


def _predictions(log: str, role: str, rows: Sequence[PredictionRow]) -> Table:
    title = f"R^2 of {log} ({in_words(role)}), re-estimated -> completed model"
    table = _table(title, ("",), ("one step ahead", "five seconds ahead", "open loop"))
    for channel in dict.fromkeys(row.channel for row in rows):
        at = {row.horizon: row.r2 for row in rows if row.channel == channel}
        pairs = [(at[horizon]["before"], at[horizon]["after"]) for horizon in (ONE_STEP, AHEAD, OPEN_LOOP)]
        cells = (channel, *(" -> ".join(number(value, 3) for value in pair) for pair in pairs))
        table.add_row(*map(Text, cells))
    return table


def _structures(opinion: SecondOpinion) -> Table:
    """Competing structures of the two methods."""
    table = _table("Comparison of two methods", ("method", "effects"), (f"error, {opinion.role}, first = 1",))
    for row, times in zip(opinion.structures, (1.0, opinion.error_ratio), strict=False):
        cells = (row.method, "; ".join(row.effects) or "none", number(times, 3))
        table.add_row(*(Text(in_words(cell)) for cell in cells))
    return table


def _next_flight(ahead: NextFlight) -> str:
    """The next flight and the open questions that it answers, in one sentence."""
    if ahead.input is None:
        return f"Next flight: {ahead.note}"
    decided = [question for question in ahead.questions if question.repeats is not None]
    flights = max(question.repeats or 1 for question in decided)
    times = "once" if flights == 1 else f"{flights} times"
    amplitude = number(shown_unit("rad").factor * ahead.input.amplitude, 2)
    return (
        f"Next flight: {ahead.input.name}, {amplitude} deg, {times} "
        f"(next_input.csv); expected to answer {len(decided)} of {len(ahead.questions)} open questions."
    )


def _derivatives(result: ClosedLoop) -> Table:
    table = _table(
        "Derivatives", ("", "term"), ("declared", "re-estimated", "completed ± standard error", "largest correlation")
    )
    for row in result.derivatives:
        estimate = with_deviation(row.value if row.estimate is None else row.estimate, row.std_error)
        cells = (
            row.coefficient,
            row.term,
            number(row.declared, 4),
            number(row.refitted, 4),
            estimate if row.shown else f"{number(row.value, 4)}, not significant ({estimate})",
            number(row.correlation_max, 2),
        )
        table.add_row(*map(Text, cells))
    return table


def _errors(log: str, role: str, rows: Sequence[ErrorRow]) -> Table:
    title = f"Open-loop error of {log} ({in_words(role)}), root-mean-square"
    table = _table(title, ("", "unit"), ("declared", "before", "after", "trimmed", "noise", "before/after"))
    for row in rows:
        numbers = (row.declared, row.before, row.after, row.trimmed, None if row.noise_doubt else row.noise)
        cells = (row.channel, row.unit, *(number(value, 2) for value in numbers), ratio(row.after, row.before))
        table.add_row(*map(Text, cells))
    return table
