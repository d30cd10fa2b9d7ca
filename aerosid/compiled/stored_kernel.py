"""Loading of compiled kernels from stored machine code, without what numba starts up to compile.

numba rebuilds a cached function ready to be taken in by functions that are compiled later: it reads the intermediate
language beside the machine code, and registers all that its compiler knows of. Kernels called from Python need neither:
the intermediate language is read when a caller that is compiled asks for it, and the compiler registers what it knows
when it first runs.
"""

from __future__ import annotations

import io
import pickle
import sys
from typing import Any

import llvmlite.binding as llvm
from numba.core import codegen, compiler, environment, runtime

# numba carries types in part only.
_compiler: Any = compiler
_runtime: Any = runtime
_environments: Any = environment


class NotLoadableError(Exception):
    """What is stored has another form than what numba writes as machine code."""


class _StoredLibrary(codegen.JITCodeLibrary):
    """Machine code from a file; its intermediate language stays bytes until a compiled caller takes it in."""

    intermediate = b""

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = llvm.parse_bitcode(self.intermediate)
        return self._shared_module


def load(target_context: Any, payload: bytes) -> Any:
    """The compile result of a kernel from the bytes that numba's reduction of it was written to.

    Parameters
    ----------
    target_context : numba target context
        Of the processor.
    payload : bytes
        Pickled reduction of a compile result.

    Raises
    ------
    NotLoadableError
        Where the reduction holds no machine code.
    """
    _runtime.rtsys.initialize(target_context)  # memory of arrays, which machine code asks for by address
    stored = _Unpickler(io.BytesIO(payload)).load()
    (name, kind, code), described, own, signature, objectmode, lifted, annotation, reload_init, referenced = stored
    if kind != "object":
        raise NotLoadableError(kind)
    for begin in reload_init:
        begin()
    library = _library(target_context.codegen(), name, *code)
    names = (described.llvm_func_name, described.llvm_cpython_wrapper_name, described.llvm_cfunc_wrapper_name)
    # Of the functions that were taken in, few have constants that the machine code asks for.
    linked = {each for each in (*names, *(env.env_name for env in referenced)) if each.encode() in code[0]}
    library.codegen._engine._defined_symbols.update(linked)
    result = _compiler.compile_result(
        target_context=target_context,
        typing_context=target_context.typing_context,
        library=library,
        environment=own,
        entry_point=target_context.get_executable(library, described, own),
        fndesc=described,
        type_annotation=annotation,
        signature=signature,
        objectmode=objectmode,
        lifted=lifted,
        reload_init=reload_init,
        referenced_envs=referenced,
    )
    for each in referenced:
        if each.env_name in linked:
            library.codegen.set_env(each.env_name, each)
    return result


def _library(code_generator: Any, name: str, machine_code: bytes, intermediate: bytes) -> Any:
    library = _StoredLibrary(code_generator, name)
    library.intermediate = intermediate
    library.enable_object_caching()
    library._set_compiled_object(machine_code)
    library._finalize_final_module()
    return library


class _Unpickler(pickle.Unpickler):
    """numba's pickles, without importing those of its own modules whose functions the machine code has taken in."""

    def find_class(self, module: str, name: str) -> Any:
        """The object of a name; for an environment of constants one that imports nothing."""
        found = super().find_class(module, name)
        return _environment if found is _environments._rebuild_env else found


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """The constants that machine code of a function refers to.

    Its globals serve functions compiled in object mode alone, and no kernel is one: those of a module of numba that is
    not imported yet hold no more than the module's name.
    """
    if (
        module in sys.modules
        or module.partition(".")[0] != "numba"
        or _environments.lookup_environment(name) is not None
    ):
        return _environments._rebuild_env(module, constants, name)
    made = _environments.Environment({"__name__": module})
    made.consts[:] = constants
    made.env_name = name
    _environments.Environment._memo[name] = made
    return made
