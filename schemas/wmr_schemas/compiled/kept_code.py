# mypy: disable-error-code="no-untyped-call, attr-defined, misc, unused-ignore"
"""The code of one signature as it is kept, and its way back into a process.

numba's own form holds intermediate code as well, for functions that call this one, and every load first
brings numba's declarations of all functions up to date: that imports half of numba, and ``scipy.linalg``.
Here machine code alone is kept, since compiled code calls a kernel's part and not the kernel. Declarations
are brought up to date where something is compiled, or where the code needs what is not there yet, such as
numba's count of references.
"""

import sys
from importlib import import_module
from typing import Any, NamedTuple, Self

from llvmlite.binding import address_of_symbol
from numba.core.compiler import CompileResult
from numba.core.environment import Environment, lookup_environment

INTRINSIC = "llvm."
"""How the names of functions begin that LLVM replaces by code."""


class KeptEnvironment(NamedTuple):
    """What a compiled function finds beside its code: the module it is from, its constants, and its name."""

    module: str
    constants: tuple[Any, ...]
    name: str

    @classmethod
    def of(cls, environment: Any) -> Self:
        """What to keep of one."""
        module = environment.globals["__name__"]
        return cls(module, tuple(environment.consts), environment.env_name)

    def restored(self) -> Any:
        """The environment in this process. Of a function of numba's own that nothing has imported, it has no
        module: machine code reads its constants alone.
        """
        known = lookup_environment(self.name)
        if known is not None:
            return known
        names = {"__name__": self.module}
        if self.module in sys.modules or not self.module.startswith("numba."):
            names = vars(import_module(self.module))
        environment = Environment(names)
        environment.consts[:] = self.constants
        environment.env_name = self.name
        Environment._memo[self.name] = environment
        return environment


class KeptCode(NamedTuple):
    """Machine code, and what numba knows of it."""

    library: str
    machine_code: bytes
    outside: tuple[str, ...]
    """Functions and variables that the code expects in the process."""
    descriptor: Any
    environment: Any
    signature: Any
    object_mode: bool
    reload_init: tuple[Any, ...]
    """Functions to call before."""
    environments: tuple[KeptEnvironment, ...]
    """Those that the code refers to."""

    @classmethod
    def of(cls, result: CompileResult) -> Self:
        """What to keep of a compiled signature."""
        library, descriptor = result.library, result.fndesc
        descriptor.typemap = descriptor.calltypes = None
        return cls(
            library.name,
            library._get_compiled_object(),
            expected_outside(library._final_module),
            descriptor,
            result.environment,
            result.signature,
            result.objectmode,
            tuple(result.reload_init),
            tuple(map(KeptEnvironment.of, result._find_referenced_environments())),
        )

    def restored(self, target: Any) -> CompileResult:
        """The signature, ready to be called. ``target``: numba's context of this processor."""
        for function in self.reload_init:
            function()
        codegen = target.codegen()
        if not all(is_defined(name, codegen) for name in self.outside):
            target.refresh()
        library = codegen.create_library(self.library)
        library.enable_object_caching()
        library._set_compiled_object(self.machine_code)
        library._finalize_final_module()
        codegen._engine._defined_symbols.add(self.descriptor.llvm_cpython_wrapper_name)
        entry = target.get_executable(library, self.descriptor, self.environment)
        environments = [kept.restored() for kept in self.environments]
        for environment in environments:
            codegen.set_env(environment.env_name, environment)
        return self._result(target, library, entry, environments)

    def _result(self, target: Any, library: Any, entry: Any, environments: list[Any]) -> CompileResult:
        known = {
            "typing_context": target.typing_context,
            "target_context": target,
            "entry_point": entry,
            "signature": self.signature,
            "objectmode": self.object_mode,
            "lifted": (),
            "fndesc": self.descriptor,
            "library": library,
            "environment": self.environment,
            "reload_init": self.reload_init,
            "referenced_envs": environments,
        }
        return CompileResult(**{**dict.fromkeys(CompileResult._fields), **known})


def expected_outside(module: Any) -> tuple[str, ...]:
    """Names that a module declares and does not define."""
    named = [*module.functions, *module.global_variables]
    return tuple(n.name for n in named if n.is_declaration and not n.name.startswith(INTRINSIC))


def is_defined(name: str, codegen: Any) -> bool:
    """Whether the linker will find a name: code that calls what it does not find ends the process."""
    return codegen._engine.is_symbol_defined(name) or address_of_symbol(name) is not None
