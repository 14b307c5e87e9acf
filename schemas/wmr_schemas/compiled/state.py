"""The state of the sources that compiled code belongs to: its hash, its directory, and those of older states.

The directory is ``<base>/<hash>``. The base is the environment variable ``WMR_REPLAY_CACHE_DIR``, else
``$NUMBA_CACHE_DIR/wmr-replay``, else ``compiled`` in the user's cache directory for ``wmr-replay``.
"""

import hashlib
import os
import shutil
import tempfile
import warnings
from functools import cache
from importlib.util import find_spec
from pathlib import Path

CACHE_VARIABLE = "WMR_REPLAY_CACHE_DIR"
KEPT = 4
"""States that are kept: those of a few versions or branches in turn use."""
HASH_LENGTH = 24

_packages = ["wmr_schemas", "wmr_synth", "wmr_replay"]


def register_sources(package: str) -> None:
    """Let the sources of a package, such as a plug-in with compiled functions, join the hash.

    Functions of packages that are not registered are compiled in memory and not kept. Call it before the
    package's functions are called for the first time. Raises ModuleNotFoundError for an unknown package.
    """
    if find_spec(package) is None:
        raise ModuleNotFoundError(f"no package {package!r} to register compiled functions of", name=package)
    if package not in _packages:
        _packages.append(package)
        for cached in (source_files, source_paths, state_directory):
            cached.cache_clear()


@cache
def source_files() -> dict[str, Path]:
    """Every Python file of the registered packages, by package and path inside it; nothing is imported."""
    found = {}
    for package in _packages:
        spec = find_spec(package)
        if spec is None:
            continue
        if spec.submodule_search_locations is None and spec.origin is not None:
            found[package] = Path(spec.origin)
        for place in spec.submodule_search_locations or ():
            for folder, _, names in os.walk(place):
                room = folder.removeprefix(place).replace(os.sep, "/")
                found |= {f"{package}{room}/{n}": Path(folder, n) for n in names if n.endswith(".py")}
    return found


@cache
def source_paths() -> frozenset[Path]:
    """The places of :func:`source_files`."""
    return frozenset(source_files().values())


def hash_of(files: dict[str, Path], *others: str) -> str:
    """Hash of the files' names and contents, and of other texts."""
    total = hashlib.sha256()
    for name, file in sorted(files.items()):
        content = file.read_bytes()
        total.update(f"{name}\0{len(content)}\0".encode())
        total.update(content)
    for text in others:
        total.update(f"{len(text)}\0{text}".encode())
    return total.hexdigest()[:HASH_LENGTH]


def base_directory() -> Path:
    """Where the states lie; it need not exist."""
    ours, numbas = os.environ.get(CACHE_VARIABLE), os.environ.get("NUMBA_CACHE_DIR")
    if ours:
        return Path(ours).expanduser().absolute()
    if numbas:
        return Path(numbas).expanduser().absolute() / "wmr-replay"
    from platformdirs import user_cache_path  # noqa: PLC0415 – only where nothing is set

    return user_cache_path("wmr-replay", appauthor=False) / "compiled"


@cache
def state_directory(*environment: str) -> Path | None:
    """The directory of these sources in this ``environment``, made and writable; None where there is none.

    Its name is a hash, so that it holds no code of other sources. A warning says why nothing is kept.
    """
    base = base_directory()
    try:
        place = base / hash_of(source_files(), *environment)
        is_new = not place.exists()
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place):
            pass
        os.utime(place)
    except OSError as error:
        warnings.warn(
            f"compiled code is not kept, every start compiles afresh: {base}: {error.strerror or error}; "
            f"set {CACHE_VARIABLE} to a writable directory",
            RuntimeWarning,
            stacklevel=2,
        )
        return None
    if is_new:
        clear_old(base, place)
    return place


def clear_old(base: Path, current: Path) -> None:
    """Remove all but the most recently used states.

    A process that still uses a removed one compiles once more what it has not loaded yet. What another
    process removes at the same time is passed over.
    """
    ages = []
    for place in base.iterdir():
        is_state = len(place.name) == HASH_LENGTH and set(place.name) <= set("0123456789abcdef")
        if is_state and place != current:
            try:
                ages.append((place.stat().st_mtime, place))
            except OSError:
                continue
    for _, place in sorted(ages, reverse=True)[KEPT - 1 :]:
        shutil.rmtree(place, ignore_errors=True)
