"""Terms read by Python's own parser and evaluated on its tree: naive, slow, and no code of the package."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import cache


def term_by_tree(text: str, values: Mapping[str, float]) -> float:
    """Value of the product that the text says, `^` being a power."""
    return _value(_tree(text), values)


@cache
def _tree(text: str) -> ast.expr:
    """Read once: a simulation asks for the same few terms at every step."""
    return ast.parse(text.replace("^", "**").strip(), mode="eval").body


def _value(node: ast.expr, values: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=float(number) | int(number)):
            return float(number)
        case ast.Name(id=name):
            return values[name]
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            return _value(left, values) * _value(right, values)
        case ast.BinOp(left=left, op=ast.Sub(), right=right):
            return _value(left, values) - _value(right, values)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _value(left, values) + _value(right, values)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return _value(left, values) ** _value(right, values)
        case ast.Call(func=ast.Name(id="abs"), args=[inner]):
            return abs(_value(inner, values))
        case ast.Call(func=ast.Name(id="pos"), args=[inner]):
            return max(_value(inner, values), 0.0)
    raise AssertionError(ast.dump(node))
