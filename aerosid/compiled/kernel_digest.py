"""Hash tree over what a compiled kernel computes with: bytecode, constants, options, and the same of what it calls."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from enum import Enum
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np
from numba.core.sigutils import normalize_signature
from numba.extending import is_jitted

from aerosid.compiled import Kernel

# numba carries types in part only.
_normalized: Callable[[Any], tuple[tuple[Any, ...], Any]] = normalize_signature

_KIND_FLAGS = inspect.CO_VARARGS | inspect.CO_VARKEYWORDS | inspect.CO_GENERATOR
"""Format: what of a function's flags decides what it computes. numba overwrites the others where a profiler runs."""


class UnknownContentError(Exception):
    """A kernel refers to something whose content has no known text; such a kernel is compiled by each process."""


def kernel_digest(kernel: Callable[..., Any]) -> str:
    """Hash over all that a kernel computes with: bytecode, constants, options, and the same of what it refers to.

    Raises
    ------
    UnknownContentError
        Where it refers to an object of a kind whose content is not known here.
    """
    return _Digests().of(kernel, ())


def sha256_of(text: str) -> str:
    """The hash of a text, hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


class _Digests:
    """Digests of what one kernel refers to: each function's is found once, but where it calls one of its callers."""

    def __init__(self) -> None:
        self._found: dict[FunctionType, tuple[str, str]] = {}
        self._recursions = 0

    def of(self, function: Any, callers: tuple[Any, ...]) -> str:
        """Of a function, `callers` being those on the way to it."""
        options = ""
        if isinstance(function, Kernel) or is_jitted(function):
            # A dispatcher for each helper of a kernel that is only loaded would cost more than the loading.
            given = function.options if isinstance(function, Kernel) else function.targetoptions
            options = repr(sorted((name, repr(value)) for name, value in given.items()))
            if isinstance(function, Kernel) and function.optimised:
                options += " optimised before it is merged"
            function = function.py_func
        if function in callers:
            self._recursions += 1
            return f"recursion {len(callers) - callers.index(function)}"
        if function in self._found and self._found[function][0] == options:
            return self._found[function][1]
        before, inside = self._recursions, (*callers, function)
        closed = [self._content(cell.cell_contents, inside) for cell in function.__closure__ or ()]
        preset = (function.__defaults__, tuple(sorted((function.__kwdefaults__ or {}).items())))
        defaults = self._content(preset, inside)
        own = self._code(function.__code__, function.__doc__, function.__globals__, inside)
        digest = sha256_of("\n".join((function.__qualname__, options, own, defaults, *closed)))
        if self._recursions == before:  # else it says from where it was asked
            self._found[function] = options, digest
        return digest

    def _code(self, code: CodeType, doc: str | None, known: dict[str, Any], callers: tuple[Any, ...]) -> str:
        parts = [
            code.co_code.hex(),
            repr((code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags & _KIND_FLAGS)),
            repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)),
        ]
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                parts.append(self._code(constant, None, known, callers))
            elif constant is not doc:
                parts.append(self._content(constant, callers))
        for name in code.co_names:
            if name in known:
                value = known[name]
                # Of a module of ours each attribute that is used counts; co_names does not say whose an attribute is.
                members = [value]
                if isinstance(value, ModuleType) and value.__name__.partition(".")[0] == __name__.partition(".")[0]:
                    members = [getattr(value, attribute) for attribute in code.co_names if hasattr(value, attribute)]
                parts.extend(f"{name} {self._content(member, callers)}" for member in members)
        return sha256_of("\n".join(parts))

    def _content(self, value: Any, callers: tuple[Any, ...]) -> str:
        """A text that is another wherever the value is another for a compiled kernel."""
        if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic | type(...)):
            return f"{type(value).__name__} {value!r}"
        if isinstance(value, np.ndarray):
            return f"array {value.dtype.str} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
        if isinstance(value, type):
            return _class_content(value)
        if isinstance(value, tuple):
            return f"{_class_content(type(value))} ({', '.join(self._content(item, callers) for item in value)})"
        if isinstance(value, frozenset):
            return f"frozenset ({', '.join(sorted(self._content(item, callers) for item in value))})"
        if isinstance(value, FunctionType) and value.__module__.partition(".")[0] in ("numpy", "numba"):
            return f"{value.__module__}.{value.__qualname__}"  # whose versions are in the key
        if isinstance(value, FunctionType | Kernel) or is_jitted(value):
            return self.of(value, callers)
        if isinstance(value, ModuleType):
            return f"module {value.__name__}"
        if isinstance(value, BuiltinFunctionType | np.ufunc):
            return f"builtin {value.__name__}"
        if isinstance(value, numba.types.Type):
            return f"type {value}"
        if isinstance(getattr(value, "__wrapped__", None), FunctionType):  # functions of numpy's array protocol
            return f"{value.__module__}.{value.__qualname__}"
        raise UnknownContentError(f"{type(value).__qualname__} {value!r}")


def _class_content(kind: type) -> str:
    name = f"{kind.__module__}.{kind.__qualname__}"
    if issubclass(kind, Enum):
        return f"{name} {[(member.name, member.value) for member in kind]!r}"
    return f"{name} {getattr(kind, '_fields', '')!r}"


def signature_text(sig: Any) -> str:
    """The argument types, with the field names of named tuples, whose order decides where a kernel finds a field."""
    args, return_type = _normalized(sig)
    text = "; ".join(_type_text(kind) for kind in (*args, return_type))
    if " at 0x" in text:
        raise UnknownContentError(text)
    return text


def _type_text(kind: Any) -> str:
    if not isinstance(kind, numba.types.BaseTuple):
        return str(kind)
    named: Any = getattr(kind, "instance_class", tuple)
    items: Any = kind
    return f"{_class_content(named)}({', '.join(_type_text(item) for item in items)})"
