"""scipy's LAPACK and BLAS without the package ``scipy.linalg`` around them, which is slow to import.

They are the compiled modules ``_flapack`` and ``_fblas``. Where they are not found by their names,
``scipy.linalg`` is imported and gives them.
"""

import importlib
import sys
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from typing import Any

import scipy

PUBLIC = {"_flapack": "lapack", "_fblas": "blas"}
"""What ``scipy.linalg`` calls the compiled modules."""


@cache
def routines(module: str) -> Any:
    """The functions of ``_flapack`` or ``_fblas`` by their names, such as ``dgesv``."""
    name = f"scipy.linalg.{module}"
    if name in sys.modules:
        return sys.modules[name]
    found = PathFinder.find_spec(name, [str(Path(scipy.__file__).parent / "linalg")])
    if found is None or found.loader is None:
        return importlib.import_module(f"scipy.linalg.{PUBLIC[module]}")
    compiled = module_from_spec(found)
    found.loader.exec_module(compiled)
    return compiled
