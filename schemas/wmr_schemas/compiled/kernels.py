# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign"
"""A dispatcher of numba's whose callees are parts of it, with a cache of our own; see ``internals``."""

import contextlib
import pickle
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

from llvmlite.binding import create_new_function_pass_manager
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import _FunctionCompiler
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher
from numba.core.serialize import dumps
from numba.core.types import unliteral

from wmr_schemas.compiled import store
from wmr_schemas.compiled.front_end import faster, own
from wmr_schemas.compiled.internals import directory_for
from wmr_schemas.compiled.kept_code import KeptCode
from wmr_schemas.compiled.notice import tell

EXPLICIT: dict[str, Any] = {"nopython": True, "_nrt": True, "error_model": "python", "boundscheck": None}
"""Options that a function would else take over from whichever function calls it first."""
KERNEL = {"no_cfunc_wrapper": True}
PART = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}
REFERENCES = "NRT_"
"""How the names of the functions begin that count references."""
PYTHON_WRAPPER = "_ZN7cpython"
"""How the names of the wrappers begin that Python calls."""
FrontEnd = Callable[[], contextlib.AbstractContextManager[None]]


def few_passes() -> Any:
    """Variables into registers, simpler instructions and jumps."""
    passes = create_new_function_pass_manager()
    passes.add_simplify_cfg_pass()
    passes.add_sroa_pass()
    passes.add_instruction_combine_pass()
    passes.add_simplify_cfg_pass()
    return passes


class PartLibrary(JITCodeLibrary):
    """Code of one function; without a wrapper for Python it is neither optimised nor emitted for itself."""

    @cached_property
    def _is_part(self) -> bool:
        return not any(f.name.startswith(PYTHON_WRAPPER) for f in self._final_module.functions)

    def _optimize_functions(self, ll_module: Any) -> None:
        """Each function alone, which makes the module small; one pass manager serves all of them.

        Few passes do: a kernel's module goes through all of them later, with its parts in place.
        """
        ll_module.data_layout = self._codegen._data_layout
        passes, builder = few_passes(), self._codegen._pass_builder()
        for function in ll_module.functions:
            if not function.is_declaration:
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        """A kernel's module; the first of numba's two passes only prepares references for pruning."""
        if self._is_part:
            return
        if any(f.name.startswith(REFERENCES) for f in self._final_module.functions):
            super()._optimize_final_module()
            return
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        if not self._is_part:
            super()._finalize_final_module()
            return
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """The address of a function; 0 in a part, which has no address of its own."""
        self._ensure_finalized()
        return 0 if self._is_part else int(super().get_pointer_to_function(name))


def set_environment(codegen: Any, name: str, env: Any) -> None:
    """As numba does it, where the code was emitted."""
    if codegen._engine.get_global_value_address(name):
        type(codegen).set_env(codegen, name, env)


@contextlib.contextmanager
def callees_as_parts(codegen: Any, front_end: FrontEnd) -> Iterator[None]:
    """What is compiled meanwhile becomes a part, unless Python can call it; no other thread compiles then."""
    with global_compiler_lock, front_end():
        before = codegen._library_class
        codegen._library_class = PartLibrary
        codegen.set_env = lambda name, env: set_environment(codegen, name, env)
        try:
            yield
        finally:
            codegen._library_class = before
            del codegen.set_env


class KernelCompiler(_FunctionCompiler):
    """The compiler of a kernel; it is asked only for what the cache does not hold."""

    def compile(self, args: Any, return_type: Any) -> Any:
        """One signature; where the quicker front end fails, numba's own has the last word.

        Raises NumbaError where that fails too.
        """
        tell(self.py_func.__qualname__)
        codegen = self.targetdescr.target_context.codegen()
        try:
            with callees_as_parts(codegen, faster):
                return super().compile(args, return_type)
        except (NumbaError, NotImplementedError, AssertionError, AttributeError, TypeError):
            with callees_as_parts(codegen, own):
                return super().compile(args, return_type)


class KernelCache(NullCache):
    """Compiled signatures of one function in the directory of the present state."""

    def __init__(self, function: Any) -> None:
        self._function = function
        self._name = f"{function.__module__}.{function.__qualname__}-{function.__code__.co_firstlineno}"

    def _file(self, sig: Any, codegen: Any) -> Path | None:
        directory = directory_for(self._function, tuple(map(str, codegen.magic_tuple())))
        return None if directory is None else store.file_of(directory, self._name, str(sig))

    @property
    def cache_path(self) -> str | None:
        """The present state's directory."""
        from numba.core.registry import cpu_target  # noqa: PLC0415

        file = self._file((), cpu_target.target_context.codegen())
        return None if file is None else str(file.parent)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled signature, or None, with numba's declarations up to date for what is compiled next."""
        file = self._file(sig, target_context.codegen())
        content = None if file is None else store.read(file)
        signature, kept = pickle.loads(content) if content is not None else (None, None)
        if kept is not None and signature == str(sig):
            return kept.restored(target_context)
        target_context.refresh()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a compiled signature."""
        file = self._file(sig, data.codegen)
        if file is not None and not data.lifted and not data.library.has_dynamic_globals:
            store.write(file, dumps((str(sig), KeptCode.of(data))))


class Kernel(CPUDispatcher):
    """A function that Python calls; compiled code calls its :attr:`part` in its place."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None) -> None:
        options = {**EXPLICIT, **(targetoptions or {}), **KERNEL}
        super().__init__(py_func, locals, options)
        self._compiler = KernelCompiler(py_func, self.targetdescr, options, self.locals, Compiler)
        self._cache = KernelCache(py_func)

    def _compilation_chain_init_hook(self) -> None:
        """Nothing: where code is compiled, all installed packages are searched for extensions of numba."""

    @cached_property
    def part(self) -> Any:
        """The same function as a part of others."""
        return CPUDispatcher(self.py_func, targetoptions={**self.targetoptions, **PART})

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """How compiled code calls it: one specialisation for all integers, constant or not."""
        return self.part.get_call_template(
            tuple(unliteral(a) for a in args), {k: unliteral(a) for k, a in kws.items()}
        )

    def get_overload(self, sig: Any) -> Any:
        """The part's code."""
        return self.part.get_overload(sig)
