"""The one place that relies on numba's undocumented internals, for the versions it was tested with.

numba compiles every function that another one calls as if Python might call it too: it generates wrappers,
optimises the function alone and emits its machine code, and then links its intermediate code into the caller
and optimises it there once more. A chain of five small functions is optimised five times. Here a function
that is called by compiled code becomes a *part*: its intermediate code is linked into the function that
Python calls, which alone is optimised, emitted and kept. Numbers do not depend on this: neither way
reorders floating-point operations.

With another version of numba, or one whose internals differ, functions are compiled by plain ``numba.njit``,
whose cache would not notice a changed callee, and which therefore keeps nothing: slower, equal in result.
"""

import sys
import warnings
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import config

from wmr_schemas.compiled.state import source_paths, state_directory

TESTED = {"0.68": "0.50"}
"""Minor versions of numba, and of the llvmlite beside it, whose internals are known."""
UNDOCUMENTED = {"_nrt"}
"""Options that plain ``numba.njit`` is not given."""


def minor(version: str) -> str:
    """``"0.61"`` of ``"0.61.2"``."""
    return ".".join(version.split(".")[:2])


def is_tested() -> bool:
    """Whether numba and llvmlite are of versions whose internals are known."""
    return TESTED.get(minor(numba.__version__)) == minor(llvmlite.__version__)


@cache
def kernel_class() -> Any:
    """The dispatcher class of :mod:`wmr_schemas.compiled.kernels`; None where this numba is not known."""
    reason = "not a version that was tried"
    if is_tested():
        try:
            from wmr_schemas.compiled.kernels import Kernel  # noqa: PLC0415
        except (ImportError, AttributeError) as error:
            reason = str(error)
        else:
            return Kernel
    versions = f"numba {numba.__version__} with llvmlite {llvmlite.__version__}"
    warnings.warn(
        f"{versions}: {reason}; compiled code is not kept, every start compiles afresh",
        RuntimeWarning,
        stacklevel=2,
    )
    return None


def decorate(function: Any, options: dict[str, Any]) -> Any:
    """``function`` compiled on its first call."""
    kernel = kernel_class()
    if kernel is None or getattr(config, "DISABLE_JIT", False):
        return numba.njit(**{k: v for k, v in options.items() if k not in UNDOCUMENTED})(function)
    return kernel(function, targetoptions=options)


def directory_for(function: Any, processor: tuple[str, ...]) -> Path | None:
    """Where compiled code of the ``function`` is kept; None for one whose sources are not in the hash."""
    if function.__closure__ is not None:
        return None
    if Path(function.__code__.co_filename) not in source_paths():
        return None
    return state_directory(sys.version, numba.__version__, llvmlite.__version__, *processor)
