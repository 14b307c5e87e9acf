"""A second command never compiles what the first did, whatever process it runs in."""

import json
import os
import subprocess
import sys

import pytest

PROBE = """
import json, sys
from wmr_schemas.compiled import on_compiling
compiled = []
on_compiling(compiled.append)
from wmr_replay.cli import main
try:
    main()
except SystemExit as done:
    assert not done.code
print(json.dumps(compiled))
"""


@pytest.mark.timeout(300)
def test_a_second_command_compiles_nothing_that_the_first_did(tmp_path, command):
    log = tmp_path / "drive.mcap"
    command("synth", "patrol", "--duration", 4, "--rate", 50, "--out", log)
    environment = os.environ | {"WMR_REPLAY_CACHE_DIR": str(tmp_path / "cache")}

    def compiled_by(*arguments):
        call = [sys.executable, "-c", PROBE, *map(str, arguments)]
        done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
        return json.loads(done.stdout.splitlines()[-1])

    cheap = ("--identifier", "paper", "--no-hindsight", "--no-rrd", "--quiet")
    first = compiled_by("run", log, "--out", tmp_path / "out", *cheap)
    assert len(first) > 5
    assert compiled_by("batch", log, "--out", tmp_path / "set", "--jobs", 1, *cheap[:3], "--quiet") == []
