"""The modules of the benchmark's worlds and engine, which lie outside the packages."""

import importlib

import pytest
from tests.replay.gap.bench_worlds import BENCH


@pytest.fixture(scope="module")
def worlds():
    """``worlds(name)``: a module of bench/worlds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        yield lambda name: importlib.import_module(f"worlds.{name}")


@pytest.fixture(scope="module")
def engine():
    """``engine(name)``: a module of bench/engine."""
    pytest.importorskip("mujoco")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        yield lambda name: importlib.import_module(f"engine.{name}")
