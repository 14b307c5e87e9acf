"""Compiled code is never stale, is found where it is kept, and is done without where it cannot be.

Every case is a real process with a package of its own: ``top`` calls ``middle``, which calls ``bottom``.
"""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wmr_schemas.compiled import state

CALLS = """
import json, sys, warnings
from wmr_schemas.compiled import on_compiling, register_sources
told, caught = [], []
warnings.showwarning = lambda message, *_: caught.append(str(message))
warnings.simplefilter("always")
on_compiling(told.append)
{before}
register_sources("chain")
from chain.top import top
print(json.dumps([top(2.0), told, caught]))
"""
MODULES = {
    "__init__": "",
    "bottom": "from wmr_schemas.compiled import compiled\nADDED = 5.0\n"
    "@compiled\ndef bottom(x):\n    return x + ADDED\n",
    "middle": "from chain.bottom import bottom\nfrom wmr_schemas.compiled.lean import lean\n"
    "@lean\ndef middle(x):\n    return 2.0 * bottom(x)\n",
    "top": "from chain.middle import middle\nfrom wmr_schemas.compiled import compiled\n"
    "@compiled\ndef top(x):\n    return middle(x) + 1.0\n",
}


class Chain:
    """The package, and processes that call it."""

    def __init__(self, root: Path) -> None:
        self.root, self.cache = root, root / "cache"
        for name, text in MODULES.items():
            file = root / "chain" / f"{name}.py"
            file.parent.mkdir(exist_ok=True)
            file.write_text(text)

    def edit(self, added: float) -> None:
        file = self.root / "chain" / "bottom.py"
        stat = file.stat()
        file.write_text(MODULES["bottom"].replace("5.0", repr(added)))
        os.utime(file, (stat.st_atime, stat.st_mtime))

    def start(self, before: str = "", **variables: str) -> subprocess.Popen[str]:
        paths = [str(self.root), *(p for p in sys.path if p)]
        environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
        environment |= {"PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1"}
        environment |= {state.CACHE_VARIABLE: str(self.cache)} | variables
        return subprocess.Popen(
            [sys.executable, "-c", CALLS.format(before=before)],
            env=environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def run(self, before: str = "", **variables: str) -> tuple[float, list[str], list[str]]:
        """The answer, the functions that were compiled, and the warnings."""
        return result_of(self.start(before, **variables))


def result_of(process: subprocess.Popen[str]) -> tuple[float, list[str], list[str]]:
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    answer, told, caught = json.loads(out)
    return answer, told, caught


@pytest.fixture
def chain(tmp_path: Path) -> Chain:
    return Chain(tmp_path)


def test_a_callee_two_levels_down_is_edited_and_the_answer_changes_at_once(chain: Chain) -> None:
    assert chain.run() == (15.0, ["top"], [])
    assert chain.run() == (15.0, [], [])
    chain.edit(7.0)
    assert chain.run() == (19.0, ["top"], [])
    chain.edit(5.0)
    assert chain.run() == (15.0, [], [])


def test_the_processor_and_the_versions_have_states_of_their_own(tmp_path: Path) -> None:
    file = tmp_path / "a.py"
    file.write_text("x = 1\n")
    base = state.hash_of({"a": file}, "numba 1", "cpu")
    assert base == state.hash_of({"a": file}, "numba 1", "cpu")
    assert base != state.hash_of({"a": file}, "numba 2", "cpu")
    assert base != state.hash_of({"a": file}, "numba 1", "gpu")
    assert base != state.hash_of({"b": file}, "numba 1", "cpu")
    file.write_text("x = 2\n")
    assert base != state.hash_of({"a": file}, "numba 1", "cpu")


def test_the_sources_of_all_three_packages_are_in_the_hash() -> None:
    files = state.source_files()
    assert "wmr_schemas/compiled/state.py" in files
    assert "wmr_replay/identify/filter_bank/update.py" in files
    assert {name.partition("/")[0] for name in files} >= {"wmr_schemas", "wmr_synth", "wmr_replay"}


def test_nothing_is_written_beside_the_sources(chain: Chain) -> None:
    folder = chain.root / "chain"
    before = sorted(folder.rglob("*"))
    folder.chmod(0o555)
    try:
        assert chain.run()[:2] == (15.0, ["top"])
        assert chain.run()[:2] == (15.0, [])
    finally:
        folder.chmod(0o755)
    assert sorted(folder.rglob("*")) == before


def test_without_a_writable_place_it_compiles_in_memory_and_says_so_once(chain: Chain) -> None:
    chain.cache.write_text("a file where the directory should be")
    for _ in range(2):
        answer, told, caught = chain.run()
        assert (answer, told) == (15.0, ["top"])
        assert len(caught) == 1
        assert "\n" not in caught[0]
        assert state.CACHE_VARIABLE in caught[0]


def test_numbas_own_variable_is_honoured_below_our_hash(chain: Chain) -> None:
    place = chain.root / "numbas"
    assert chain.run(**{"NUMBA_CACHE_DIR": str(place), state.CACHE_VARIABLE: ""})[0] == 15.0
    (kept,) = (place / "wmr-replay").iterdir()
    assert len(kept.name) == state.HASH_LENGTH
    assert any(kept.iterdir())


UNKNOWN = """
import numba
numba.__version__ = "99.1.0"
"""


def test_an_unknown_numba_compiles_plainly_and_says_so(chain: Chain) -> None:
    answer, _, caught = chain.run(UNKNOWN)
    assert answer == 15.0
    assert len(caught) == 1
    assert "numba 99.1.0" in caught[0]
    assert not chain.cache.exists()


def test_the_compiler_of_a_plain_installation_has_no_colours(chain: Chain) -> None:
    """numba colours its errors where colorama is there, and has nothing to be quickened without it."""
    (chain.root / "colorama.py").write_text("raise ImportError('not installed')\n")
    assert chain.run() == (15.0, ["top"], [])


LOST_CODE = """
from numba.core.base import BaseContext
from wmr_schemas.compiled import front_end
quicker, own = front_end.replacements, BaseContext.insert_func_defn
def losing(self, definitions):
    for _ in definitions:
        lost.append(_)
lost = []
def replacements():
    yield from quicker()
    yield BaseContext, "insert_func_defn", losing
front_end.replacements = replacements
"""
LARGEST = "\n@compiled\ndef bottom(x):\n    return max((x + ADDED, ADDED))\n"


def test_where_the_quicker_front_end_loses_code_numbas_own_compiles_once_more(chain: Chain) -> None:
    """The code of an intrinsic, as of max of a tuple, is registered while compiling, and only once."""
    file = chain.root / "chain" / "bottom.py"
    file.write_text(file.read_text() + LARGEST)
    assert chain.run(LOST_CODE) == (15.0, ["top"], [])
    assert chain.run() == (15.0, [], [])


def test_what_no_front_end_compiles_is_told_as_numba_tells_it(chain: Chain) -> None:
    file = chain.root / "chain" / "bottom.py"
    file.write_text(file.read_text().replace("x + ADDED", "x + 'a'"))
    process = chain.start()
    assert "TypingError" in process.communicate(timeout=300)[1]
    assert process.returncode == 1


LOADS = """
import numba, struct, sys
import numpy as np
{before}
from wmr_schemas.compiled import unaligned
from wmr_schemas.compiled.lean import lean
def caller(load):
    @lean
    def call(data, place):
        return load(data, place)
    return call
for name, code, value in (
    ("u16", "<H", 0xBEEF), ("u32", "<I", 0xDEADBEEF), ("u64", "<Q", 2**63 + 5), ("i64", "<q", -3),
    ("f64", "<d", -1.5e300), ("f32", "<f", 0.25),
):
    data = np.frombuffer(b"xyz" + struct.pack(code, value) + b"w", np.uint8)
    found = caller(getattr(unaligned, "load_" + name))(data, 3)
    assert found == value, (name, found, value)
"""


@pytest.mark.parametrize("before", ["", UNKNOWN], ids=["tested", "unknown"])
def test_numbers_are_read_at_any_byte(before: str) -> None:
    command = [sys.executable, "-W", "ignore", "-c", LOADS.format(before=before)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_an_inlined_callee_is_edited_and_the_answer_changes_at_once(chain: Chain) -> None:
    file = chain.root / "chain" / "middle.py"
    file.write_text(MODULES["middle"].replace("lean", "inlined").replace("compiled.inlined", "compiled.lean"))
    assert chain.run() == (15.0, ["top"], [])
    chain.edit(7.0)
    assert chain.run()[0] == 19.0


def test_two_processes_may_compile_at_once(chain: Chain) -> None:
    both = [chain.start(), chain.start()]
    assert [result_of(process)[0] for process in both] == [15.0, 15.0]
    assert chain.run() == (15.0, [], [])
    assert not list(chain.cache.rglob("part-*"))


def test_a_damaged_file_is_compiled_again(chain: Chain) -> None:
    chain.run()
    (file,) = (f for f in chain.cache.rglob("*") if f.is_file())
    file.write_bytes(file.read_bytes()[:100])
    assert chain.run() == (15.0, ["top"], [])
    assert chain.run() == (15.0, [], [])


def test_functions_of_unregistered_packages_are_not_kept(chain: Chain) -> None:
    unregistered = "register_sources = lambda package: None"
    assert chain.run(unregistered)[:2] == (15.0, ["top"])
    assert chain.run(unregistered)[:2] == (15.0, ["top"])


def test_only_the_states_used_last_are_kept(tmp_path: Path) -> None:
    states = []
    for age in range(8):
        place = tmp_path / f"{age:024x}"
        place.mkdir()
        (place / "code").write_text("x")
        os.utime(place, (1e9 - age, 1e9 - age))
        states.append(place)
    (tmp_path / "somebody-elses").mkdir()
    state.clear_old(tmp_path, states[6])
    kept = {p for p in states if p.exists()}
    assert kept == {*states[: state.KEPT - 1], states[6]}
    assert (tmp_path / "somebody-elses").exists()


def test_parts_and_kernels_give_the_same_numbers() -> None:
    from wmr_replay.identify.filter_bank.states import N_STATES
    from wmr_replay.identify.filter_bank.traction import largest_demand, slipping_share

    mean, covariance = np.full(N_STATES, 0.1), np.eye(N_STATES)
    demand = np.log(0.5 * np.exp(0.1) * 9.0)
    assert largest_demand(mean, 4.0, -5.0) == pytest.approx(np.exp(demand), rel=1e-15)
    assert 0.0 < slipping_share(mean, covariance, 4.0, -5.0) < 1.0


BANK = """
import numpy as np
from wmr_replay.identify.filter_bank.hypotheses import make_hypotheses
from wmr_replay.identify.filter_bank.states import N_STATES
from wmr_replay.identify.filter_bank.steps import update_all
hypotheses = make_hypotheses(3)
hypotheses.size[0], hypotheses.covariance[0] = 1, np.eye(N_STATES)
update_all(hypotheses, np.array([3.0, 1.0, 1.0]), np.full(3, 0.1), np.empty(N_STATES))
print(hypotheses.mean[0, 0])
"""


def test_the_banks_outlier_bound_is_edited_in_a_copy_and_the_update_changes_at_once(tmp_path: Path) -> None:
    for package in ("wmr_schemas", "wmr_synth", "wmr_replay"):
        (place,) = importlib.util.find_spec(package).submodule_search_locations  # type: ignore[union-attr]
        shutil.copytree(place, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    environment = os.environ | {"PYTHONPATH": str(tmp_path), state.CACHE_VARIABLE: str(tmp_path / "cache")}

    def mean() -> float:
        command = [sys.executable, "-c", BANK]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return float(done.stdout)

    assert mean() == pytest.approx(3.0 / 1.1)
    source = tmp_path / "wmr_replay" / "identify" / "filter_bank" / "update.py"
    edited = source.read_text().replace("OUTLIER_SD = PRIORS.outlier_sd", "OUTLIER_SD = 0.01")
    assert edited != source.read_text()
    source.write_text(edited)
    assert mean() == pytest.approx(3.0 / (3.0 / 0.01) ** 2)


def test_the_quicker_front_end_generates_the_code_that_numba_generates(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A loop with several ways back, a generator, and variables that live across blocks.

    What lowers to fewer instructions is left out: it generates other code, for the same numbers. Nothing is
    inlined: numba counts labels over all that a process inlines, and their order depends on it.
    """
    import numba
    from numba.core.compiler_lock import global_compiler_lock

    from wmr_schemas.compiled import lowering
    from wmr_schemas.compiled.front_end import faster

    monkeypatch.setattr(lowering, "replacements", tuple)

    @numba.njit
    def odd(n):  # type: ignore[no-untyped-def]
        for i in range(n):
            if i % 2:
                yield i

    def total(values, most):  # type: ignore[no-untyped-def]
        sum_, i, last = 0.0, 0, values[0]
        while i < len(values):
            i += 1
            if values[i - 1] < 0.0:
                continue
            last = max(last, values[i - 1])
            for k in odd(i):
                sum_ += k * last
            if sum_ > most:
                break
        return sum_ + last

    def code() -> str:
        """The function's code, without the numbers that numba counts functions with and names' lengths."""
        function = numba.njit(total)
        signature = (numba.float64[::1], numba.float64)
        function.compile(signature)
        return re.sub(r"B\d+v\d+|\[\d+ x i8\]", "", function.inspect_llvm(signature))

    plain = code()
    assert code() == plain
    with global_compiler_lock, faster():
        assert code() == plain


def steps_through(a: Any, at: Any, out: Any) -> Any:
    """Every kind of index and range that is lowered in a way of our own: ``a`` (n, m, 3), ``at`` three."""
    i, j, k = at
    out[0], out[1], out[2], out[-1] = a[i, j, k], a[-1, j, -2], a[0, 0, 0], a[i][j][k]
    plane, row, column = a[i], a[i, -1], a[:, 0, 1]
    out[3], out[4], out[5], out[6] = plane[j, 2], row[-1], column[-1], plane[0, 1:][1]
    plane[j, 0] += 0.5
    row[k] *= 2.0
    for start, stop, step in ((0, 3, 1), (2, 2, 1), (3, 1, 1), (5, -1, -2), (0, 7, 3)):
        for n in range(start, stop, step):
            out[7] += n + 0.25 * step
    for n in range(len(a)):
        for m in range(n, a.shape[1]):
            if a[n, m, 0] > a[i, j, 0]:
                continue
            out[8] += a[n, m, n - 1] * (m + 1)
        out[9] = n
    for n in range(-3):
        out[9] += n
    at[0] = len(plane) + row.shape[0] + column.size
    return plane[j, 0] + out[-1]


@pytest.mark.parametrize("allocates", [True, False])
@pytest.mark.parametrize("layout", ["C", "F", "A"])
def test_items_views_and_ranges_are_those_of_python(
    layout: str, allocates: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from wmr_schemas.compiled import compiled, kernels

    monkeypatch.setattr(kernels, "own", None)  # what the quicker front end cannot compile is an error here
    function = compiled(nogil=True, _nrt=allocates)(steps_through)
    given = np.random.default_rng(3).normal(size=(4, 10, 3))
    arrays = {"C": given, "F": np.asfortranarray(given), "A": given[:, ::2]}
    asked, told = arrays[layout].copy(order="K"), arrays[layout].copy(order="K")
    if layout == "A":
        asked, told = given.copy()[:, ::2], given.copy()[:, ::2]
    at, at_told = np.array([2, -3, 1]), np.array([2, -3, 1])
    out, out_told = np.zeros(11), np.zeros(11)
    assert function(asked, at, out) == steps_through(told, at_told, out_told)
    for ours, pythons in ((asked, told), (at, at_told), (out, out_told)):
        np.testing.assert_array_equal(ours, pythons)


def test_an_array_that_dies_at_the_head_of_a_loop_is_given_up_once() -> None:
    from wmr_schemas.compiled import compiled

    @compiled
    def total(n):  # type: ignore[no-untyped-def]
        first = np.ones(n)
        last = np.full(n, 2.0)
        sum_ = first.sum() if n > 2 else 0.0
        for i in range(n):
            sum_ += last[i]
            if sum_ > 100.0:
                last = np.zeros(n)
        return sum_

    for _ in range(100):
        assert [total(n) for n in (1, 3, 50)] == [2.0, 9.0, 102.0]


def test_numbas_own_timers_count_as_no_listener_and_a_users_listener_does() -> None:
    from numba.core import event

    from wmr_schemas.compiled.front_end import is_listened_to

    assert not is_listened_to()
    with event.install_timer("numba:llvm_lock", lambda _: None):
        assert not is_listened_to()
    with event.install_recorder("numba:llvm_lock"):
        assert is_listened_to()
