"""A number is a field of a settings class, or says what it is if not a threshold."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "aerosid"
SAID = ("Numerical: ", "Physical: ", "Standard: ", "Display: ", "Layout: ", "Format: ", "Design: ", "Published: ")
"""How the docstring of a number begins that is no threshold: what bounds steps, memory or rounding, what nature or a
standard gives, what a reader sees, what a kernel's arrays hold where, what the form of a file or a text fixes, what a
simulated flight or study is flown with, what a paper printed."""

MODULES = sorted(PACKAGE.rglob("*.py"))


def is_number(node: ast.expr | None) -> bool:
    """Whether an expression is a number by itself, or holds nothing else."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        return bool(node.elts) and all(map(is_number, node.elts))
    return isinstance(node, ast.Dict) and bool(node.values) and all(map(is_number, node.values))


def numbers(source: str) -> Iterator[tuple[str, str]]:
    """The numbers of a module outside any class or function, each with the docstring behind it."""
    body = ast.parse(source).body
    for node, behind in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.Assign | ast.AnnAssign) and is_number(node.value):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            said = behind.value if isinstance(behind, ast.Expr) else None
            text = said.value if isinstance(said, ast.Constant) and isinstance(said.value, str) else ""
            yield ", ".join(ast.unparse(target) for target in targets), text


@pytest.mark.parametrize("module", MODULES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_a_loose_number_says_why_it_is_no_threshold(module: Path) -> None:
    loose = [name for name, text in numbers(module.read_text(encoding="utf-8")) if not text.startswith(SAID)]
    assert not loose, "make it a field of a frozen settings class, with quantity, unit, effect and source"


def test_a_threshold_is_seen_in_whatever_form_it_stands() -> None:
    source = """
LIMIT = 0.5
SHARES: tuple[float, ...] = (0.1, -0.2)
BY_UNIT = {"rad": 1.0 / 3.0}
\"\"\"Share of something.\"\"\"
NAMES = {"rad": "angle"}
STEPS = 8
\"\"\"Numerical: steps at most.\"\"\"
"""
    found = dict(numbers(source))
    assert list(found) == ["LIMIT", "SHARES", "BY_UNIT", "STEPS"]
    assert [name for name, text in found.items() if not text.startswith(SAID)] == ["LIMIT", "SHARES", "BY_UNIT"]
