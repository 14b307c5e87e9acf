"""The project's folder, and an environment with the variables of a sourced ROS workspace."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OURS = ("MAKE", "MFLAGS", "PYTEST_", "PYTHON", "COV_")
"""Variables of the run that this test belongs to; a command under test starts without them."""


def clean_environment() -> dict[str, str]:
    """The environment of a fresh terminal."""
    return {key: value for key, value in os.environ.items() if not key.startswith(OURS)}


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    return clean_environment()


@pytest.fixture(scope="session")
def ros_environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A PYTHONPATH whose numpy and pytest plugin (found by its entry point) raise on import."""
    prefix = tmp_path_factory.mktemp("ros")
    packages = prefix / "lib" / "python3.10" / "site-packages"
    metadata = packages / "launch_testing_ros-0.19.dist-info"
    (packages / "numpy").mkdir(parents=True)
    metadata.mkdir()
    (packages / "numpy" / "__init__.py").write_text("raise ImportError('the numpy of ROS')\n")
    (packages / "launch_testing_ros_pytest.py").write_text("raise ImportError('the plugin of ROS')\n")
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: launch-testing-ros\nVersion: 0.19\n")
    (metadata / "entry_points.txt").write_text("[pytest11]\nlaunch_ros = launch_testing_ros_pytest\n")
    return {
        **clean_environment(),
        "PYTHONPATH": str(packages),
        "PYTEST_PLUGINS": "launch_testing_ros_pytest",
        "AMENT_PREFIX_PATH": str(prefix),
        "ROS_DISTRO": "humble",
    }


Make = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def make(root: Path) -> Make:
    """``make(*arguments, env=…)`` with the environment that runs this test, nothing re-installed."""

    def run(*arguments: str, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
        installed = [f"--old-file={sys.prefix}/.installed", f"--old-file={sys.prefix}/.installed-dev"]
        command = ["make", *installed, f"VENV={sys.prefix}", *arguments]
        return subprocess.run(command, cwd=root, env=env, capture_output=True, text=True, check=False)

    return run
