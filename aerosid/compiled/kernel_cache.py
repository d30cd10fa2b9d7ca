"""Content-addressed cache of compiled kernels: the key is what a kernel computes, not where its file lies or when.

numba's own cache asks for the path of a function's file and for the content of that file alone. A second clone compiles
everything again, and a kernel whose callee changed in another file is taken for current. Here the key of a kernel is a
hash tree over its bytecode, its constants and everything it refers to, callees in other modules too, together with the
versions of Python, numba and LLVM, the processor and the argument types. Editing a comment or a function that no kernel
calls compiles nothing.

Files lie in the user's cache folder, one a kernel and signature, written under another name and renamed. Who compiles a
kernel says so by a second file, and other processes wait for the result in place of compiling it too. A wheel may carry
a folder of the same files, which is only read. What cannot be read, or belongs to another machine, is as if absent.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.caching import CompileResultCacheImpl, _Cache
from numba.core.serialize import dumps

from aerosid.compiled.kernel_digest import UnknownContentError, kernel_digest, sha256_of, signature_text
from aerosid.compiled.stored_kernel import load
from aerosid.compiled.user_folder import user_folder

SHIPPED = Path(__file__).parent / "kernels"
"""Kernels that a wheel carries; absent in a checkout."""

SUFFIX = ".nbc"

KEPT = 60 * 86400.0
"""Numerical: age, s, since the last use from which a kernel's file is removed, when another one is written. Each edit
of a kernel leaves the old file behind, and nothing else would ever take it away."""

_REFRESHED = 86400.0
"""Numerical: age, s, from which a use is noted in the file's time; noting each would write to disk at each start."""

CLAIM = ".compiling"
"""Suffix of the file that names the process which compiles a kernel."""

PATIENCE = 120.0
"""Numerical: age, s, of such a file from which its process is taken for dead: twice the time of the largest kernel on a
busy machine. Waiting for less would compile twice what a loaded machine compiles slowly."""

_POLL = 0.05
"""Numerical: s between two looks for the kernel that another process compiles."""

_CHECKSUM = hashlib.sha256().digest_size

# numba carries types in part only.
_dumps: Callable[[Any], bytes] = dumps

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
        name = self._file_name(sig, target_context.codegen())
        if name is not None:
            stored = _read(SHIPPED / name) or _read(user_folder() / name) or _taken_over(user_folder() / name)
            if stored is not None:
                # Whatever a file from another state of the machine may hold, the kernel can always be compiled.
                with contextlib.suppress(Exception):
                    return load(target_context, stored)
        for listener in _listeners:
            listener(self._dispatcher.py_func.__name__)
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Writes a kernel that was just compiled; a full or read-only disk is no error."""
        name = self._file_name(sig, data.codegen)
        implementation = self._implementation()
        if name is None or not implementation.check_cachable(data):
            return
        payload = _dumps(implementation.reduce(data))
        path = user_folder() / name
        with contextlib.suppress(OSError):
            _write(path, payload)
            path.with_suffix(CLAIM).unlink(missing_ok=True)

    def _implementation(self) -> Any:
        return _Reduction(self._dispatcher.py_func)

    def _file_name(self, sig: Any, codegen: Any) -> str | None:
        if not self._enabled:
            return None
        try:
            content = kernel_digest(self._dispatcher)
            types = signature_text(sig)
        except UnknownContentError:
            return None
        function = self._dispatcher.py_func
        # The module, since the file names it: what is loaded looks up its globals there.
        key = "\n".join((function.__module__, content, types, *_environment(), *map(str, codegen.magic_tuple())))
        return f"{function.__module__.rpartition('.')[2]}.{function.__name__}-{sha256_of(key)[:32]}{SUFFIX}"


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


def _taken_over(path: Path) -> bytes | None:
    """What another process that compiles the same kernel now will have written; None where this one is to compile it.

    Kernels call each other in one direction only, so that two processes never wait for each other.
    """
    claim = path.with_suffix(CLAIM)
    while True:
        try:
            path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            with open(claim, "x", encoding="ascii") as file:
                file.write(_here(os.getpid()))
            atexit.register(claim.unlink, missing_ok=True)  # where the compilation is broken off
            return _read(path)  # which may have come since it was looked for
        except FileExistsError:
            pass
        except OSError:
            return None
        while _is_claimed(claim):
            time.sleep(_POLL)
            if (payload := _read(path)) is not None:
                return payload
        with contextlib.suppress(OSError):
            claim.unlink(missing_ok=True)


def _here(process: int) -> str:
    return f"{process} {platform.node()}"


def _is_claimed(claim: Path) -> bool:
    """Whether the process that claimed a kernel may still be at it."""
    try:
        text = claim.read_text(encoding="ascii")
        process = int(text.split()[0]) if text else 0
        if process and os.name == "posix" and text == _here(process):
            os.kill(process, 0)  # sends nothing; fails where there is no such process
        return time.time() - claim.stat().st_mtime < PATIENCE
    except PermissionError:
        return True
    except (OSError, ValueError):
        return False


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
    for path in (*folder.glob(f"*{SUFFIX}"), *folder.glob(f"*{SUFFIX}*.tmp"), *folder.glob(f"*{CLAIM}")):
        with contextlib.suppress(OSError):
            if path.stat().st_mtime < oldest:
                path.unlink()
