"""``wmr-replay --help`` is fast: it imports no heavy package."""

import json
import subprocess
import sys

import pytest

HEAVY = {"numpy", "numba", "polars", "rerun", "scipy", "pyarrow", "matplotlib", "rosbags", "mcap", "rich"}
PROBE = """
import json, sys
from wmr_replay.cli import main
try:
    main()
except SystemExit as done:
    assert not done.code, done.code
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


IMPORT = """
import json, sys, wmr_replay
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})))
"""


def test_importing_the_package_imports_no_heavy_package(environment: dict[str, str]) -> None:
    command = [sys.executable, "-c", IMPORT]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert set(json.loads(done.stdout)).isdisjoint({*HEAVY, "click"})


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_no_heavy_package_is_imported(option: str, environment: dict[str, str]) -> None:
    command = [sys.executable, "-c", PROBE, option]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert "click" in loaded
    assert loaded.isdisjoint(HEAVY), loaded & HEAVY
