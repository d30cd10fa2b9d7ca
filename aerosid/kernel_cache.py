"""Content-addressed cache of compiled kernels: the key is what a kernel computes, not where its file lies or when.

numba's own cache asks for the path of a function's file and for the content of that file alone. A second clone compiles
everything again, and a kernel whose callee changed in another file is taken for current. Here the key of a kernel is a
hash tree over its bytecode, its constants and everything it refers to, callees in other modules too, together with the
versions of Python, numba and LLVM, the processor and the argument types. Editing a comment or a function that no kernel
calls compiles nothing.

Files lie in the user's cache folder, one a kernel and signature, written under another name and renamed, so that
processes may share it without locks. A wheel may carry a folder of the same files, which is only read. What cannot be
read, or belongs to another machine, is as if it were absent.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, _Cache
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.extending import is_jitted

FOLDER_VARIABLE = "AEROSID_CACHE_DIR"
"""Environment variable that names the folder of compiled kernels in place of the user's cache folder."""

SHIPPED = Path(__file__).parent / "compiled_kernels"
"""Kernels that a wheel carries; absent in a checkout."""

SUFFIX = ".nbc"

KEPT = 60 * 86400.0
"""Age [s] since the last use from which a kernel's file is removed, when another one is written. Each edit of a kernel
leaves the old file behind, and nothing else would ever take it away."""

_REFRESHED = 86400.0
"""Age [s] from which a use is noted in the file's time; noting each would write to disk at each start."""

_CHECKSUM = hashlib.sha256().digest_size

# numba carries types in part only.
_dumps: Callable[[Any], bytes] = dumps
_normalized: Callable[[Any], tuple[tuple[Any, ...], Any]] = normalize_signature

OnCompilation = Callable[[str], None]
_listeners: list[OnCompilation] = []


@contextlib.contextmanager
def compilation_announced(listener: OnCompilation) -> Iterator[None]:
    """Calls listener(name of the kernel) before each compilation inside the block."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def user_folder() -> Path:
    """Where kernels are written: AEROSID_CACHE_DIR, or aerosid below NUMBA_CACHE_DIR, or the user's cache folder."""
    if chosen := os.environ.get(FOLDER_VARIABLE):
        return Path(chosen)
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "aerosid"
    from platformdirs import user_cache_path

    return user_cache_path("aerosid", appauthor=False) / "kernels"


class KernelCache(_Cache):
    """The cache of one kernel, in the form in which numba's dispatcher asks for one.

    Parameters
    ----------
    dispatcher : numba dispatcher
        The kernel.
    """

    def __init__(self, dispatcher: Any) -> None:
        self._dispatcher = dispatcher
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder that is written to."""
        return str(user_folder())

    def enable(self) -> None:
        """Uses the files again."""
        self._enabled = True

    def disable(self) -> None:
        """Neither reads nor writes files."""
        self._enabled = False

    def flush(self) -> None:
        """Nothing: a file is never stale, since its name says what is in it."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled kernel of these argument types, None where no file holds it."""
        target_context.refresh()
        name = self._file_name(sig, target_context.codegen())
        if name is not None:
            for folder in (SHIPPED, user_folder()):
                if (payload := _read(folder / name)) is not None:
                    # Whatever a file from another state of the machine may hold, the kernel can always be compiled.
                    with contextlib.suppress(Exception):
                        return self._implementation().rebuild(target_context, pickle.loads(payload))
        for listener in _listeners:
            listener(self._dispatcher.py_func.__name__)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Writes a kernel that was just compiled; a full or read-only disk is no error."""
        name = self._file_name(sig, data.codegen)
        implementation = self._implementation()
        if name is None or not implementation.check_cachable(data):
            return
        payload: bytes = _dumps(implementation.reduce(data))
        with contextlib.suppress(OSError):
            _write(user_folder() / name, payload)

    def _implementation(self) -> Any:
        return _Reduction(self._dispatcher.py_func)

    def _file_name(self, sig: Any, codegen: Any) -> str | None:
        if not self._enabled:
            return None
        try:
            content = kernel_digest(self._dispatcher)
            types = _signature_text(sig)
        except UnknownContentError:
            return None
        function = self._dispatcher.py_func
        # The module, since the file names it: what is loaded looks up its globals there.
        key = "\n".join((function.__module__, content, types, *_environment(), *map(str, codegen.magic_tuple())))
        return f"{function.__module__.rpartition('.')[2]}.{function.__name__}-{_sha(key)[:32]}{SUFFIX}"


class _Reduction(CompileResultCacheImpl):
    """numba's reduction of a compiled function to bytes and back, without its search for a folder."""

    def __init__(self, py_func: FunctionType) -> None:
        self._locator = self
        self._py_file = py_func.__code__.co_filename
        self._lineno = py_func.__code__.co_firstlineno


@cache
def _environment() -> tuple[str, ...]:
    """What beside a kernel's source decides what compilation gives."""
    settings = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "ENABLE_AVX", "DEBUGINFO_DEFAULT")
    return (
        sys.implementation.cache_tag or sys.version,
        platform.python_version(),
        f"numba {numba.__version__}",
        f"llvmlite {llvmlite.__version__}",
        f"numpy {np.__version__.partition('.')[0]}",
        *(f"{name} {getattr(numba.config, name, None)}" for name in settings),
    )


def _read(path: Path) -> bytes | None:
    try:
        content = path.read_bytes()
        if time.time() - path.stat().st_mtime > _REFRESHED:
            os.utime(path)
    except PermissionError:  # of the time alone: a folder that is only read
        pass
    except OSError:
        return None
    checksum, payload = content[:_CHECKSUM], content[_CHECKSUM:]
    return payload if hashlib.sha256(payload).digest() == checksum else None


def _write(path: Path, payload: bytes) -> None:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    _remove_unused(path.parent)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(hashlib.sha256(payload).digest() + payload)
        os.replace(temporary, path)
    except OSError:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise


@cache  # once a process and folder
def _remove_unused(folder: Path) -> None:
    oldest = time.time() - KEPT
    for path in (*folder.glob(f"*{SUFFIX}"), *folder.glob(f"*{SUFFIX}*.tmp")):
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < oldest:
                path.unlink()


class UnknownContentError(Exception):
    """A kernel refers to something whose content has no known text; such a kernel is compiled by each process."""


def kernel_digest(kernel: Callable[..., Any]) -> str:
    """Hash over all that a kernel computes with: bytecode, constants, options, and the same of what it refers to.

    Raises
    ------
    UnknownContentError
        Where it refers to an object of a kind whose content is not known here.
    """
    return _function_digest(kernel, ())


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _function_digest(function: Any, callers: tuple[Any, ...]) -> str:
    options = ""
    if is_jitted(function):
        options = repr(sorted((name, repr(value)) for name, value in function.targetoptions.items()))
        function = function.py_func
    if function in callers:
        return f"recursion {len(callers) - callers.index(function)}"
    inside = (*callers, function)
    closed = [_content(cell.cell_contents, inside) for cell in function.__closure__ or ()]
    defaults = _content((function.__defaults__, tuple(sorted((function.__kwdefaults__ or {}).items()))), inside)
    own = _code(function.__code__, function.__doc__, function.__globals__, inside)
    return _sha("\n".join((function.__qualname__, options, own, defaults, *closed)))


def _code(code: CodeType, doc: str | None, known: dict[str, Any], callers: tuple[Any, ...]) -> str:
    parts = [
        code.co_code.hex(),
        repr((code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)),
        repr((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)),
    ]
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            parts.append(_code(constant, None, known, callers))
        elif constant is not doc:
            parts.append(_content(constant, callers))
    for name in code.co_names:
        if name in known:
            value = known[name]
            # Of a module of ours each attribute that is used counts; co_names does not say whose an attribute is.
            members = [value]
            if isinstance(value, ModuleType) and value.__name__.partition(".")[0] == __name__.partition(".")[0]:
                members = [getattr(value, attribute) for attribute in code.co_names if hasattr(value, attribute)]
            parts.extend(f"{name} {_content(member, callers)}" for member in members)
    return _sha("\n".join(parts))


def _content(value: Any, callers: tuple[Any, ...]) -> str:
    """A text that is another wherever the value is another for a compiled kernel."""
    if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic | type(...)):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype.str} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, type):
        return _class_content(value)
    if isinstance(value, tuple):
        return f"{_class_content(type(value))} ({', '.join(_content(item, callers) for item in value)})"
    if isinstance(value, frozenset):
        return f"frozenset ({', '.join(sorted(_content(item, callers) for item in value))})"
    if isinstance(value, FunctionType) and value.__module__.partition(".")[0] in ("numpy", "numba"):
        return f"{value.__module__}.{value.__qualname__}"  # whose versions are in the key
    if isinstance(value, FunctionType) or is_jitted(value):
        return _function_digest(value, callers)
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


def _signature_text(sig: Any) -> str:
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
