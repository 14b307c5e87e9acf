# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore, method-assign, assignment"
"""numba's front end, faster while one of our kernels compiles; what is compiled does not change.

Four fifths of a compilation are numba's own Python. Four parts of it, measured on a first ``run``, are large:

- the overloads of an operator that are tried before the built-in one of ``a + b`` is found;
- the garbage collector;
- lists of the variables of a statement;
- the text of errors that are never shown.
"""

import contextlib
import gc
from collections.abc import Iterator
from typing import Any

from numba.core import errors, ir
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction

YOUNG_OBJECTS = 100_000
"""New objects between two garbage collections. Few of those that a compilation makes are in cycles."""


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


@contextlib.contextmanager
def faster() -> Iterator[None]:
    """With numba's compiler lock held: the quicker functions in the place of numba's own."""
    thresholds = gc.get_threshold()
    before = errors._termcolor_inst, TargetConfig.values, ir.Inst._rec_list_vars, BaseFunction.get_call_type
    errors._termcolor_inst = PlainText()
    TargetConfig.values = values_of
    ir.Inst._rec_list_vars = lambda self, value: variables_in(value)
    BaseFunction.get_call_type = remembered_call_type(before[3])
    gc.set_threshold(max(YOUNG_OBJECTS, thresholds[0]), *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        (
            errors._termcolor_inst,
            TargetConfig.values,
            ir.Inst._rec_list_vars,
            BaseFunction.get_call_type,
        ) = before
