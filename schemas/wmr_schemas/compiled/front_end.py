# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign, assignment"
"""numba's front end, faster while one of our kernels compiles; what is compiled does not change.

Four fifths of a compilation are numba's own Python. Measured on a first ``run``, these parts are large:

- the overloads of an operator that are tried before the built-in one of ``a + b`` is found;
- the search for new registries at every function, and events of every call of LLVM;
- the garbage collector;
- lists of the variables of a statement;
- the text of errors that are never shown.
"""

import contextlib
import gc
import sys
from collections.abc import Iterator
from typing import Any

from llvmlite.binding import ffi
from numba.core import errors, event, ir
from numba.core.cpu import CPUContext
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction
from numba.core.typing.context import Context as TypingContext

_LOAD = "load_additional_registries"
COLLECTED_AFTER = (100_000, 100, 1000)
"""``gc.set_threshold`` while compiling. Few of the objects that a compilation makes are in cycles."""


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


def variables_in(value: Any) -> list[Any]:
    """The variables in a statement's attribute: :meth:`numba.core.ir.Inst._rec_list_vars` without a call for
    each value that holds none.
    """
    kind = type(value)
    if kind is ir.Var:
        return [value]
    if kind in _PLAIN:
        return []
    if kind is list or kind is tuple:
        return [variable for item in value for variable in variables_in(item)]
    if kind is dict:
        return [v for item in value.values() if type(item) not in _PLAIN for v in variables_in(item)]
    return value.list_vars() if isinstance(value, ir.Inst) else _other_variables(value)


def _other_variables(value: Any) -> list[Any]:
    """Subclasses of the kinds that hold variables."""
    if isinstance(value, ir.Var):
        return [value]
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, (list, tuple)):
        return [variable for item in value for variable in variables_in(item)]
    return []


_PLAIN = frozenset((str, int, float, bool, type(None), ir.Loc))


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


def replacements() -> Iterator[tuple[Any, str, Any]]:
    """Owner, attribute and the quicker value in its place."""
    yield errors, "_termcolor_inst", PlainText()
    yield TargetConfig, "values", values_of
    yield ir.Inst, "_rec_list_vars", lambda self, value: variables_in(value)
    yield BaseFunction, "get_call_type", remembered_call_type(BaseFunction.get_call_type)
    for context in (CPUContext, TypingContext):
        yield context, _LOAD, loaded_where_new(getattr(context, _LOAD))
    if not any(event._registered.values()):
        yield ffi.lib._lock, "_cblist", []


@contextlib.contextmanager
def faster() -> Iterator[None]:
    """With numba's compiler lock held: the quicker functions in the place of numba's own."""
    thresholds = gc.get_threshold()
    replaced = [(owner, name, getattr(owner, name), value) for owner, name, value in replacements()]
    for owner, name, _, value in replaced:
        setattr(owner, name, value)
    gc.set_threshold(*COLLECTED_AFTER)
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        for owner, name, before, _ in replaced:
            setattr(owner, name, before)
