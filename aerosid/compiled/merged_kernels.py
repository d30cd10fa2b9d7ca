"""Functions that exist inside compiled callers only: lowered once, and turned into machine code with each caller.

numba optimises every function by itself, turns it into machine code with wrappers for Python, and does the same again
after it has been merged into a caller. For what is always merged the first time serves no one.
"""

from __future__ import annotations

from typing import Any

from numba.core import codegen, compiler
from numba.core.compiler_machinery import LoweringPass, PassManager, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NoPythonBackend

# numba carries types in part only.
_passes: Any = compiler.DefaultPassBuilder


class _MergedLibrary(codegen.JITCodeLibrary):
    """A function's code with that of its callees, as it came from the lowering."""

    def finalize(self) -> None:
        """Links the callees; whoever calls optimises the whole."""
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True


class _OptimisedLibrary(_MergedLibrary):
    """As above, optimised by itself before a caller takes it in."""

    def finalize(self) -> None:
        """Links the callees and optimises what comes of it; no machine code is made."""
        super().finalize()
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)


class _Place:
    """What numba knows a function by where it has no address."""


@register_pass(mutates_CFG=False, analysis_only=True)
class _KeepForCallers(LoweringPass):
    """Makes a function that was lowered and not compiled known to its callers."""

    _name = "keep_for_callers"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Enters the function among those that can be called from compiled code."""
        place = _Place()
        state.targetctx.insert_user_function(place, state.cr.fndesc, [state.library])
        state.reload_init.extend(state.library._reload_init)
        state.cr = state.cr._replace(entry_point=place)
        return True


class _LoweringOnly(compiler.CompilerBase):
    """The compiler up to LLVM's intermediate language."""

    library = _MergedLibrary

    def define_pipelines(self) -> list[PassManager]:
        """The passes of numba itself, into a library that is only linked."""
        flags = self.state.flags
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        name = self.state.func_id.func_qualname
        self.state.library = self.library(self.state.targetctx.codegen(), name)
        passes = _passes.define_nopython_pipeline(self.state)
        passes.add_pass_after(_KeepForCallers, NoPythonBackend)
        passes.finalize()
        return [passes]


class _LoweringOptimised(_LoweringOnly):
    """The same into a library that is optimised."""

    library = _OptimisedLibrary


class MergedDispatcher(CPUDispatcher):
    """The face that a function shows to compiled callers."""

    def add_overload(self, cres: Any) -> None:
        """Keeps a result for callers; nothing can be called from Python."""
        self.overloads[tuple(cres.signature.args)] = cres


def merge_into_callers(dispatcher: Any, optimised: bool) -> Any:
    """The dispatcher, whose compiled callers take its function in without its being compiled by itself.

    `optimised`: whether it is optimised before they do, with sizes that it does not know yet.
    """
    passes = _LoweringOptimised if optimised else _LoweringOnly
    merged = MergedDispatcher(dispatcher.py_func, {}, dict(dispatcher.targetoptions), pipeline_class=passes)
    dispatcher.get_call_template = merged.get_call_template
    dispatcher.get_overload = merged.get_overload
    return dispatcher
