# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign, assignment"
"""numba's front end, faster while one of our kernels compiles; what is compiled does not change.

Four fifths of a compilation are numba's own Python. Measured on a first ``run``, these parts are large:

- the overloads of an operator that are tried before the built-in one of ``a + b`` is found;
- the search for new registries at every function, and events of every call of LLVM;
- the garbage collector;
- where variables live, found out after each of 27 passes, and read after two of them;
- modules that are parsed for the size of a type;
- instructions that the compiler takes out again, see :mod:`.lowering`;
- deletions of variables in functions that count no references;
- the text of errors that are never shown.
"""

import contextlib
import functools
import gc
import logging
import sys
from collections.abc import Iterator
from typing import Any

from llvmlite.binding import ffi
from llvmlite.ir.types import Type
from numba.core import analysis, byteflow, errors, event, ir, lowering, ssa, transforms, typeinfer, utils
from numba.core.compiler_machinery import PassManager
from numba.core.cpu import CPUContext
from numba.core.dispatcher import _FunctionCompiler
from numba.core.postproc import PostProcessor
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction
from numba.core.typing.context import Context as TypingContext
from numba.core.typing.templates import _IntrinsicTemplate

from wmr_schemas.compiled import passes

_LOAD = "load_additional_registries"
COLLECTED_AFTER = (200_000, 100, 1000)
"""``gc.set_threshold`` while compiling. Few of the objects that a compilation makes are in cycles."""
FEW_OBJECTS = 40_000


class PlainText:
    """In place of numba's colours: it words an error for each of the many overloads that it tries in vain."""

    def __getattr__(self, kind: str) -> Any:
        return str


def values_of(config: Any) -> dict[str, Any]:
    """``TargetConfig.values`` of numba, without a call for each option: it is asked 200,000 times."""
    defaults = _DEFAULTS.get(type(config))
    if defaults is None:
        defaults = {name: option.default for name, option in config.options.items()}
        _DEFAULTS[type(config)] = defaults
    return {**defaults, **config._values}


_DEFAULTS: dict[type, dict[str, Any]] = {}


def remembered_call_type(get_call_type: Any) -> Any:
    """``BaseFunction.get_call_type`` that remembers which built-in signature fits given argument types.

    Signatures that an overload implements in Python depend on the options of the caller as well; they are
    looked up as before.
    """

    def found(self: Any, context: Any, args: Any, kws: Any) -> Any:
        key = (tuple(args), tuple(kws.items()))
        memory = self.__dict__.setdefault("_remembered", {})
        known = memory.get(key)
        if known is not None:
            self._impl_keys[known[0].args] = known[1]
            return known[0]
        signature = get_call_type(self, context, args, kws)
        implementation = self._impl_keys[signature.args]
        if not is_overload(self, implementation):
            memory[key] = signature, implementation
        return signature

    return found


def is_overload(function: Any, implementation: Any) -> bool:
    """Whether ``implementation`` is of a template whose body numba compiles."""
    built_in = function.__dict__.get("_built_in")
    if built_in is None:
        built_in = {
            template.key for template in function.templates if not hasattr(template, "_overload_func")
        }
        function.__dict__["_built_in"] = built_in
    return implementation not in built_in


def loaded_where_new(load: Any) -> Any:
    """``load_additional_registries`` of a context, only where a module was imported since the last time.

    Declarations that are made while compiling go to the built-in registry, which is searched as before.
    """
    done: dict[int, int] = {}

    def loaded(self: Any) -> None:
        if done.get(id(self)) != len(sys.modules):
            load(self)
            done[id(self)] = len(sys.modules)

    return loaded


def remembered_size(measure: Any) -> Any:
    """A type's ``get_abi_size`` or ``get_abi_alignment``, once for each type: either parses a module."""

    def measured(self: Any, target_data: Any, context: Any = None) -> int:
        key = measure.__name__, str(self), str(target_data)
        if context is not None or "%" in key[1]:
            return int(measure(self, target_data, context))
        if key not in _SIZES:
            _SIZES[key] = measure(self, target_data)
        return _SIZES[key]

    return measured


_SIZES: dict[tuple[str, str, str], int] = {}


def is_listened_to() -> bool:
    """Whether anything but the timers that numba keeps for itself listens to its events."""
    return any(type(one) is not event.TimingListener for all_ in event._registered.values() for one in all_)


def replacements() -> Iterator[tuple[Any, str, Any]]:
    """Owner, attribute and the quicker value in its place."""
    yield errors, "_termcolor_inst", PlainText()
    if hasattr(errors, "HighlightColorScheme"):  # only with colorama
        yield errors.HighlightColorScheme, "_markup", lambda self, text, color=None, style=None: text
    yield TargetConfig, "values", values_of
    yield ir.Inst, "_rec_list_vars", lambda self, value: passes.variables_in(value)
    yield analysis, "compute_use_defs", passes.uses_and_definitions
    yield transforms, "canonicalize_cfg", passes.canonical_where_new(transforms.canonicalize_cfg)
    yield PostProcessor, "run", passes.processed_where_read(PostProcessor.run)
    yield PassManager, "_runPass", passes.run_pass
    for module in (errors, typeinfer, lowering):
        yield module, "new_error_context", passes.ErrorContext
    yield BaseFunction, "get_call_type", remembered_call_type(BaseFunction.get_call_type)
    yield utils, "pysignature", functools.cache(utils.pysignature)
    for measure in ("get_abi_size", "get_abi_alignment"):
        yield Type, measure, remembered_size(getattr(Type, measure))
    for context in (CPUContext, TypingContext):
        yield context, _LOAD, loaded_where_new(getattr(context, _LOAD))
    yield event, "install_timer", passes.untimed
    for module in (ssa, byteflow):
        if not module._logger.isEnabledFor(logging.DEBUG):
            yield module, "_logger", passes.Silent()
    if not is_listened_to():
        yield ffi.lib._lock, "_cblist", []


@contextlib.contextmanager
def garbage_collected_once() -> Iterator[None]:
    """Search the objects that are made meanwhile for garbage, at the end; not those that exist already.

    A few objects are left to the next collection.
    """
    thresholds, is_ours = gc.get_threshold(), not gc.get_freeze_count()
    if is_ours:
        gc.freeze()
    gc.set_threshold(*COLLECTED_AFTER)
    try:
        yield
    finally:
        if gc.get_count()[0] > FEW_OBJECTS or gc.get_count()[1]:
            gc.collect()
        gc.set_threshold(*thresholds)
        if is_ours:
            gc.unfreeze()


@contextlib.contextmanager
def faster() -> Iterator[None]:
    """With numba's compiler lock held: the quicker functions in the place of numba's own."""
    from wmr_schemas.compiled import lowering as shorter  # noqa: PLC0415 – loads much of numba

    quicker = [*replacements(), *shorter.replacements()]
    replaced = [(owner, name, getattr(owner, name), value) for owner, name, value in quicker]
    for owner, name, _, value in replaced:
        setattr(owner, name, value)
    try:
        with garbage_collected_once():
            yield
    finally:
        for owner, name, before, _ in replaced:
            setattr(owner, name, before)


def compiled_anew(self: Any, args: Any, return_type: Any) -> tuple[bool, Any]:
    """``_FunctionCompiler._compile_cached`` of numba, without its memory of what failed before."""
    return True, self._compile_core(args, return_type)


@contextlib.contextmanager
def own() -> Iterator[None]:
    """With numba's compiler lock held: numba's own front end, as if nothing had been tried before.

    Intrinsics are typed again, and so their code is registered again; failures of callees are forgotten.
    """
    for template in _IntrinsicTemplate.__subclasses__():
        template._impl_cache.clear()
    before = _FunctionCompiler._compile_cached
    _FunctionCompiler._compile_cached = compiled_anew
    try:
        yield
    finally:
        _FunctionCompiler._compile_cached = before
