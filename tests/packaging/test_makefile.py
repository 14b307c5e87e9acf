"""The two commands of the README, with and without a sourced ROS workspace."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Make = Callable[..., subprocess.CompletedProcess[str]]
Environment = dict[str, str]
pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")


def test_the_ros_environment_of_these_tests_does_break_what_is_unprotected(
    ros_environment: Environment,
) -> None:
    command = [sys.executable, "-c", "import numpy"]
    done = subprocess.run(command, env=ros_environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "the numpy of ROS" in done.stderr


def test_tests_run_with_a_ros_workspace_sourced(make: Make, ros_environment: Environment) -> None:
    chosen = "tests/schemas/test_signals.py tests/schemas/test_robot.py -p no:cacheprovider"
    done = make("unit", "JOBS=2", f"PYTEST_ARGS={chosen}", env=ros_environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " passed in " in done.stdout.splitlines()[-1]
    assert "the plugin of ROS" not in done.stdout + done.stderr


def test_the_plugins_in_use_are_active_without_autoload(make: Make, environment: Environment) -> None:
    chosen = "tests/schemas/test_modes.py -p no:cacheprovider --hypothesis-show-statistics"
    done = make("unit", "JOBS=2", f"PYTEST_ARGS={chosen}", env=environment)
    assert done.returncode == 0, done.stderr
    assert "timeout: 600.0s" in done.stdout
    assert "2 workers" in done.stdout


def test_the_demo_runs_with_a_ros_workspace_sourced(
    make: Make, ros_environment: Environment, tmp_path: Path
) -> None:
    done = make("demo", f"DEMO={tmp_path}/demo", env=ros_environment)
    assert done.returncode == 0, done.stdout + done.stderr
    written = {path.name for path in (tmp_path / "demo").iterdir()}
    stem = "paper-acceleration"
    assert {f"{stem}.mcap", f"{stem}.rrd", f"{stem}.samples.parquet", f"{stem}.summary.json"} <= written
    assert f"{stem}.rrd" in done.stdout  # how to open the viewer


@pytest.mark.parametrize("interpreter", ["false", "no-such-python"])
def test_an_old_or_missing_python_is_said_with_both_ways_out(
    interpreter: str, root: Path, environment: Environment, tmp_path: Path
) -> None:
    venv = tmp_path / "venv"
    command = ["make", "demo", f"PYTHON={interpreter}", f"VENV={venv}"]
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"{interpreter} is missing or older than Python 3.11" in done.stderr
    assert "make PYTHON=/path/to/python3.11 demo" in done.stderr
    assert f"uv venv --seed --python 3.12 {venv} && make demo" in done.stderr
    assert not venv.exists()


def test_help_lists_the_two_commands_of_the_readme(make: Make, environment: Environment, root: Path) -> None:
    listed = {line.split()[0] for line in make("help", env=environment).stdout.splitlines()}
    first_block = (root / "README.md").read_text(encoding="utf-8").split("```")[1]
    commands = [line.split("#")[0].split() for line in first_block.splitlines()[1:]]
    assert [command for command in commands if command] == [["make", "demo"], ["make", "test"]]
    assert {"demo", "test"} <= listed


def test_nothing_is_installed_again_unless_the_pins_changed(make: Make, environment: Environment) -> None:
    done = make("--dry-run", "test", "demo", env=environment)
    assert done.returncode == 0
    assert "pip install" not in done.stdout


def test_a_changed_pin_is_installed(root: Path, environment: Environment, tmp_path: Path) -> None:
    (tmp_path / "bin").mkdir()
    for name in ("bin/python", ".installed", ".installed-dev"):
        (tmp_path / name).touch()
    for name in (".installed", ".installed-dev"):
        os.utime(tmp_path / name, (0, 0))
    command = ["make", "--dry-run", f"VENV={tmp_path}", "test"]
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.count("pip install --quiet --constraint constraints.txt") == 3


def test_the_integration_server_runs_all_tests(root: Path, environment: Environment, tmp_path: Path) -> None:
    fake = tmp_path / "make"
    fake.write_text('#!/bin/sh\necho "make $* in $PWD, CI=$CI"\ncat\n')
    fake.chmod(0o755)
    env = {**environment, "PATH": f"{tmp_path}{os.pathsep}{environment['PATH']}"}
    command = [str(root / ".ci" / "run")]
    done = subprocess.run(
        command, cwd=tmp_path, env=env, capture_output=True, text=True, check=True, input="never read"
    )
    assert done.stdout == f"make test slow in {root}, CI=true\n"
