"""Sizes and names of states, outputs and coefficients come from `flight_model/axes.py`, nowhere else from a number."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "aerosid"

FORBIDDEN = {
    "a loop over so many states or outputs": r"range\((5|8)\)",
    "an array of so many states or outputs": r"(zeros|empty|ones)\(\(?[58]\b|eye\(5\)",
    "a slice of so many states": r"\[:, :[35]\]|\[:[35], :[35]\]",
    "the count of leading columns": r"(columns\)?|shape\[1\]) - 8\b|columns\[8:|\[:, 8:\]|\b8 \+ extra|len\(INPUT",
    "the count of states among parameters": r"\b5 \* len\(|free(\.size)? \+ 5\b|\+ 5 \* (n|log)\b",
    "states by hand": r"\bby_u, by_w, by_q, by_theta\b|\bby_q, by_theta\b",
    "an output by its number": r"flight\.measured\[:, \d\]|work\.outputs\[\d\]|positions\[\d, \d\]",
    "an input by its number": r"flight\.inputs\[(:|0|k), \d\]",
}


@cache
def code_of(path: Path) -> list[tuple[int, str]]:
    """Lines with their numbers, without comments and docstrings."""
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            for n in range(node.lineno - 1, node.end_lineno or node.lineno):
                lines[n] = ""
    return [(n, line.split("  # ")[0]) for n, line in enumerate(lines, 1)]


@pytest.mark.parametrize(("what", "pattern"), FORBIDDEN.items(), ids=FORBIDDEN)
def test_no_size_of_a_case_stands_in_the_code(what: str, pattern: str) -> None:
    found = [
        f"{path.relative_to(PACKAGE)}:{number}: {line.strip()}"
        for path in sorted(PACKAGE.rglob("*.py"))
        for number, line in code_of(path)
        if re.search(pattern, line)
    ]
    assert not found, f"{what}: take it from the axes\n" + "\n".join(found)


@pytest.mark.parametrize("pattern", FORBIDDEN.values(), ids=FORBIDDEN)
def test_the_patterns_see_what_they_are_meant_for(pattern: str) -> None:
    """Each finds at least one of the lines that stood in the code before there were axes."""
    before = """
    for i in range(5):
    np.zeros((samples, 8)), np.zeros(5), np.eye(5)
    h.d[:, :3]
    extra = flight.inputs.shape[1] - 8
    first = free + 5 * n
    by_u, by_w, by_q, by_theta = row[0], row[1], row[2], row[3]
    speed = flight.measured[:, 0]
    beta = flight.inputs[0, 7]
    """
    assert re.search(pattern, before)
