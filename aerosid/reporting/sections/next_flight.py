"""Next flight: the designed input, its expected response, and the open questions that it answers."""

from __future__ import annotations

from typing import Any

from aerosid.loop.next_flight.planned_flight import PlannedInput, Question
from aerosid.loop.next_flight.predicted_flight import SURFACES
from aerosid.loop.result import ClosedLoop
from aerosid.notation import number
from aerosid.reporting.figures.chart import Chart, FloatArray, Line, Mark
from aerosid.reporting.figures.layout import Row, limits_around, stacked
from aerosid.reporting.figures.numbered import FigureBook
from aerosid.reporting.words import shown_unit, subscripted

_STRIP, _GAP = 36.0, 9.0
"""Display: pt, of a strip and between strips."""


def context(result: ClosedLoop, figures: FigureBook) -> dict[str, Any] | None:
    """The questions, and the input where there is one; None where no question is open."""
    ahead = result.next_flight
    if ahead is None:
        return None
    planned = ahead.input
    figure = None
    if planned is not None:
        caption = (
            f"Expected flight: {planned.name} of {number(shown_unit('rad').factor * planned.amplitude, 2)} deg from "
            f"{number(planned.airspeed, 4)} m/s, as the chosen model predicts it"
            + (f" and as it would be with {planned.rival}." if planned.rival else ".")
        )
        moved = " and the ".join(SURFACES[name] for name in planned.deflections)
        label = f"Expected time histories of the {moved}, {', '.join(planned.expected)}"
        figure = figures.add(_expected_chart(planned), caption, label)
    return {
        "ahead": ahead,
        "planned": planned,
        "moved": " and ".join(SURFACES[name] for name in planned.deflections) if planned is not None else "",
        "figure": figure,
        "rivals": any(question.kind != "derivative" for question in ahead.questions),
        "derivatives": any(question.kind == "derivative" for question in ahead.questions),
        "answers": [(question, _answer(question)) for question in ahead.questions],
    }


def _expected_chart(planned: PlannedInput) -> Chart:
    """The deflection of each surface, and the expected response below."""
    time = planned.time
    degrees = shown_unit("rad").factor
    rows = []
    for surface, deflection in planned.deflections.items():
        command = degrees * deflection
        drawn: tuple[Mark, ...] = (Line(time, command, "ink"),)
        rows.append(Row(_STRIP, _GAP, f"Δ{subscripted(surface)} [deg]", limits_around(command), drawn))
    for name, history in planned.expected.items():
        unit = shown_unit(history.unit)
        chosen, others = unit.factor * history.chosen, _scaled(unit.factor, history.rival)
        marks: list[Mark] = [Line(time, other, "before") for other in others]
        marks.append(Line(time, chosen, "after"))
        label = f"{subscripted(name)} [{unit.text}]" if unit.text else subscripted(name)
        rows.append(Row(_STRIP, _GAP, label, limits_around(chosen, *others), tuple(marks)))
    return stacked(rows, (float(time[0]), float(time[-1])), "next flight")


def _scaled(factor: float, values: FloatArray | None) -> list[FloatArray]:
    return [] if values is None else [factor * values]


def _answer(question: Question) -> str:
    """The result expected from the input, as a sentence."""
    if question.kind == "derivative":
        now = "unknown" if question.present is None else number(question.present, 2)
        if question.expected is None:
            return f"Standard error now {now}. {question.elsewhere}"
        sentence = f"Standard error now {now}, expected afterwards {number(question.expected, 2)}, "
        sentence += f"required {number(question.needed, 2)}. "
        return sentence + _flights(question)
    if question.expected is None or question.probability is None:
        return question.elsewhere
    likely = _per_cent(question.probability)
    sentence = (
        f"Expected log-likelihood difference 2Δln L {number(question.expected, 3)}, whichever is true "
        f"(required: {number(question.needed, 3)}); one flight distinguishes them with a probability of {likely}. "
    )
    return sentence + _flights(question)


def _per_cent(probability: float) -> str:
    """A probability in per cent; near 0 and 1 as a bound."""
    if probability > 0.999:
        return "more than 99.9 %"
    return f"{number(100 * probability, 3)} %" if probability >= 0.001 else "less than 0.1 %"


def _flights(question: Question) -> str:
    if question.repeats is None:
        return question.elsewhere
    return (
        "One flight is sufficient." if question.repeats == 1 else f"{question.repeats} flights together are sufficient."
    )
