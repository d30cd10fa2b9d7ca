"""The house rules that a reader feels first: where modules lie, and how long modules and functions are."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "aerosid"
LOOSE = {"__init__", "__main__", "errors", "nomenclature", "notation", "file_set"}
FOLDERS = {
    "signals", "logs", "manoeuvres", "flight_model", "effects", "aircraft", "estimation", "model_error",
    "equation_error", "search", "compatibility", "loop", "reporting", "studies", "cli", "compiled",
}  # fmt: skip
MOST_LINES = 400
LONGEST_FUNCTION = 60
MOST_ARGUMENTS = 10
MODULES = sorted(PACKAGE.rglob("*.py"))


def name(module: Path) -> str:
    return module.relative_to(PACKAGE).as_posix()


def functions(module: Path) -> Iterator[ast.FunctionDef]:
    """Those that are neither compiled nor a command of the command line."""
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            decorators = " ".join(ast.unparse(decorator) for decorator in node.decorator_list)
            command = name(module).startswith("cli/") and node.name.endswith("_command")
            if "njit" not in decorators and not command:
                yield node


def code_lines(function: ast.FunctionDef) -> int:
    """Lines without the docstring."""
    first = function.body[0]
    documented = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    described = (first.end_lineno or 0) - first.lineno + 1 if documented else 0
    return (function.end_lineno or 0) - function.lineno + 1 - described


def argument_count(function: ast.FunctionDef) -> int:
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    return len([argument for argument in arguments if argument.arg not in ("self", "cls")])


def test_nothing_lies_loose_in_the_root() -> None:
    assert {path.stem for path in PACKAGE.glob("*.py")} == LOOSE
    assert {path.name for path in PACKAGE.iterdir() if path.is_dir() and path.name != "__pycache__"} == FOLDERS


@pytest.mark.parametrize("module", MODULES, ids=name)
def test_a_module_is_read_in_one_sitting(module: Path) -> None:
    assert module.read_text(encoding="utf-8").count("\n") <= MOST_LINES
    for function in functions(module):
        assert code_lines(function) <= LONGEST_FUNCTION, function.name
        assert argument_count(function) <= MOST_ARGUMENTS, function.name


@pytest.mark.parametrize("module", MODULES, ids=name)
def test_a_module_says_what_it_is(module: Path) -> None:
    first = ast.get_docstring(ast.parse(module.read_text(encoding="utf-8")))
    assert first
    assert module.stem not in {"utils", "core", "helpers", "common", "misc", "base"}
