# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore"
"""numba's passes over its intermediate code, without what no later pass reads; see :mod:`.front_end`."""

import contextlib
from collections.abc import Iterator
from typing import Any

from numba.core import analysis, errors, ir, postproc, transforms
from numba.core.compiler_machinery import _pass_registry


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


def uses_and_definitions(blocks: Any) -> Any:
    """``analysis.compute_use_defs``, which lists the variables of an assignment twice.

    A variable is used in a block where it is read before the block assigns it.
    """
    used: dict[int, set[str]] = {}
    defined: dict[int, set[str]] = {}
    for offset, block in blocks.items():
        uses, definitions = used.setdefault(offset, set()), defined.setdefault(offset, set())
        for statement in block.body:
            if type(statement) in analysis.ir_extension_usedefs:
                analysis.ir_extension_usedefs[type(statement)](statement, uses, definitions)
            elif type(statement) is ir.Assign:
                names = {variable.name for variable in variables_in(statement.value)}
                target = statement.target.name
                if target not in names:
                    definitions.add(target)
                uses |= names - definitions
            else:
                uses.update(v.name for v in statement.list_vars() if v.name not in definitions)
    return analysis._use_defs_result(usemap=used, defmap=defined)


def canonical_where_new(canonicalize: Any) -> Any:
    """``transforms.canonicalize_cfg``, once for each graph of blocks: it depends on the jumps alone."""
    done: set[Any] = set()

    def canonical(blocks: Any) -> Any:
        graph = jumps_of(blocks)
        if graph in done:
            return blocks.copy()
        found = canonicalize(blocks)
        done.add(jumps_of(found))
        return found

    return canonical


def jumps_of(blocks: Any) -> tuple[Any, ...]:
    """Each block's offset and the blocks that may follow it."""
    return tuple((offset, tuple(block.terminator.get_targets())) for offset, block in blocks.items())


def processed_where_read(run: Any) -> Any:
    """``PostProcessor.run``, which finds out after each pass where variables live: here, where this is read.

    Generators are processed as before.
    """

    def processed(self: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
        code = self.func_ir
        if code.is_generator:
            run(self, emit_dels, extend_lifetimes)
            return
        code.blocks = transforms.canonicalize_cfg(code.blocks)
        code.variable_lifetime, code.generator_info = postproc.VariableLifetime(code.blocks), None
        if emit_dels:
            self._insert_var_dels(extend_lifetimes=extend_lifetimes)

    return processed


REFERENCES_ALONE = frozenset(("nopython_rewrites", "ir_legalization"))
"""Passes that serve functions which allocate: the first joins expressions of whole arrays, the second tells
where variables are given up.
"""


def run_pass(self: Any, index: int, instance: Any, state: Any) -> None:
    """``PassManager._runPass`` without events, times and checks of the pass."""
    if not state.flags.nrt and instance.name() in REFERENCES_ALONE:
        return
    instance.analysis = self._analysis
    with errors.new_error_context("Pass {name}", name=instance.name()):
        changed = instance.run_initialization(state)
        changed |= instance.run_pass(state)
        changed |= instance.run_finalizer(state)
    if changed and _pass_registry.get(type(instance)).mutates_CFG:
        postproc.PostProcessor(state.func_ir).run()


@contextlib.contextmanager
def untimed(kind: str, callback: Any) -> Iterator[None]:
    """``event.install_timer`` that measures nothing."""
    yield


class Silent:
    """In place of a logger: numba logs each statement that it visits, at a level that is off."""

    def debug(self, *arguments: Any) -> None:
        """Nothing."""

    def isEnabledFor(self, level: int) -> bool:  # noqa: N802 – the name of logging
        """Never."""
        return False


class ErrorContext:
    """``errors.new_error_context`` as a class: it is entered for each statement, several times."""

    __slots__ = ("arguments", "options", "text")

    def __init__(self, text: str, *arguments: Any, **options: Any) -> None:
        self.text, self.arguments, self.options = text, arguments, options
        loc = options.get("loc")
        if loc is not None and not loc.filename.startswith(errors._numba_path):
            errors.loc_info.update(options)

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if isinstance(error, errors.NumbaError):
            error.add_context(errors._format_msg(self.text, self.arguments, self.options))
