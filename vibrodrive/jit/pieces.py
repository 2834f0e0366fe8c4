"""Numba's compiler for functions that only kernels call (`inline` and `part` in compile.py), here called parts.

The compiler omits the passes that these functions do not need. This halves the compile time.

This module uses private names of Numba, which may change. `compile.py` uses plain ``njit`` if this module cannot be
imported. Therefore all private names are used at import, so that a missing name makes the import fail.
"""

from __future__ import annotations

import gc
import inspect
import operator
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from numba.core import ir, typed_passes, types, untyped_passes
from numba.core.analysis import dead_branch_prune
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.datamodel.models import BooleanModel
from numba.core.dispatcher import Dispatcher
from numba.core.ir_utils import build_definitions
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction


def _insert_constants(state: Any) -> None:
    """Replace known values by constants, and remove branches that depend on them.

    Known values are literal arguments and attributes of modules. Numba itself does this for None, global variables and
    closure variables.
    """
    modules: dict[str, Any] = {}
    for block in state.func_ir.blocks.values():
        for statement in list(block.find_insts(ir.Assign)):
            given = statement.value
            if isinstance(given, ir.Arg) and isinstance(state.args[given.index], types.Literal):
                statement.value = ir.Const(state.args[given.index].literal_value, given.loc)
            elif isinstance(given, ir.Global) and isinstance(given.value, ModuleType):
                modules[statement.target.name] = given.value
                block.remove(statement)
            elif isinstance(given, ir.Expr) and given.op == "getattr" and given.value.name in modules:
                value = getattr(modules[given.value.name], given.attr)
                statement.value = ir.Global(given.attr, value, given.loc)
    state.func_ir._definitions = build_definitions(state.func_ir.blocks)
    dead_branch_prune(state.func_ir, state.args)


_PASSES = (
    untyped_passes.TranslateByteCode().run_pass,
    untyped_passes.FixupArgs().run_pass,
    _insert_constants,
    untyped_passes.GenericRewrites().run_pass,
    untyped_passes.ReconstructSSA().run_pass,
    typed_passes.NopythonTypeInference().run_pass,
    typed_passes.PreLowerStripPhis().run_pass,
    typed_passes.IRLegalization().run_pass,
    typed_passes.NativeLowering().run_pass,
    typed_passes.NoPythonBackend().run_pass,
)
"""Numba's passes, except those for closures, array expressions, exceptions and objects. Parts contain none of these."""


class _Passes(PassManager):
    """The passes, one after the other, without the checks and the analysis that Numba adds to each of them."""

    def run(self, state: Any) -> None:
        for each in _PASSES:
            each(state)


class _Unlinked(JITCodeLibrary):
    """Code of a function that only kernels call, which LLVM optimises and translates as a part of the kernel only.

    Numba itself would also optimise and translate each function separately, which takes the same time again.
    """

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0  # this function is never called by its address

    @property
    def codegen(self) -> _Unlinked:
        return self

    def set_env(self, name: str, env: object) -> None:
        """Do nothing. Numba links the Python objects of a function in this method, but a part has no such objects."""


class Piece(CompilerBase):
    """Numba's compiler for functions that only kernels call."""

    def define_pipelines(self) -> list[Any]:
        self.state.library = _Unlinked(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return [_Passes("part")]


OPTIONS: dict[str, Any] = {"no_cpython_wrapper": True, "pipeline_class": Piece}
"""Options of Numba that functions for `Piece` need."""

_overridden = JITCodeLibrary._optimize_final_module, JITCodeLibrary._finalize_final_module, BooleanModel.from_data
_needed = Dispatcher.get_call_template, Dispatcher.add_overload, types.unliteral
_known_options = cpu_target.options.no_cpython_wrapper
_typing = BaseFunction.get_call_type


def _without_branch(self: BooleanModel, builder: Any, value: Any) -> Any:
    return builder.icmp_unsigned("!=", value, value.type(0))


_OPERATORS = {value for name, value in vars(operator).items() if not name.startswith("_")} | {bool}
_known: dict[tuple[Any, ...], tuple[Any, Any]] = {}


def _type_once(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of an operator for these types of arguments. Numba would try dozens of rules at each use."""
    if self.typing_key not in _OPERATORS or kws:
        return _typing(self, context, args, kws)
    key = self.typing_key, args
    if key not in _known:
        found: Any = _typing(self, context, args, kws)
        _known[key] = found, self._impl_keys[found.args]
    signature, self._impl_keys[signature.args] = _known[key]
    return signature


def once(dispatcher: Any, from_python: Callable[[], Callable[..., Any]], *constant: str) -> Any:
    """Let a dispatcher compile once for each set of argument types, and of values of the arguments in `constant`.

    Numba lets Python call the function that `from_python` returns, because this machine code cannot be called.
    """
    names = inspect.getfullargspec(dispatcher.py_func).args
    template = dispatcher.get_call_template

    def for_types(args: Any, kws: Any) -> Any:
        kept = [a if name in constant else types.unliteral(a) for name, a in zip(names, args, strict=True)]
        return template(kept, kws)

    dispatcher.get_call_template = for_types
    dispatcher.add_overload = lambda result: dispatcher.overloads.update({tuple(result.signature.args): result})
    dispatcher._compile_for_args = lambda *args, **kwargs: from_python()
    return dispatcher


@contextmanager
def compiling() -> Iterator[None]:
    """Compile without garbage collection, without branches for bool arguments, and with `_type_once`.

    Compilation produces little garbage. Numba makes a branch for each bool argument, which takes time and prevents
    vectorisation of the reads after the branch.
    """
    with global_compiler_lock:
        collecting, branching, typing = gc.isenabled(), BooleanModel.from_data, BaseFunction.get_call_type
        gc.disable()
        BooleanModel.from_data = _without_branch  # type: ignore[method-assign]
        BaseFunction.get_call_type = _type_once  # type: ignore[method-assign]
        try:
            yield
        finally:
            BooleanModel.from_data = branching  # type: ignore[method-assign]
            BaseFunction.get_call_type = typing  # type: ignore[method-assign]
            if collecting:
                gc.enable()
