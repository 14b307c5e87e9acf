"""The built wheel: its content, and that it works after installation."""

import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

from wmr_schemas import __version__

SOURCES = {"schemas": "wmr_schemas", "synth": "wmr_synth", "replay": "wmr_replay"}
METADATA = {"METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE"}


@pytest.fixture(scope="module")
def wheel(root: Path, tmp_path_factory: pytest.TempPathFactory, environment: dict[str, str]) -> Path:
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(root)]
    subprocess.run(command, env=environment, check=True, capture_output=True)
    (built,) = out.iterdir()
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory, environment: dict[str, str]) -> Path:
    """``bin/`` of a fresh environment that holds the wheel, and sees our dependencies behind it."""
    place = tmp_path_factory.mktemp("elsewhere")
    venv.create(place, with_pip=False, symlinks=True)
    python = place / "bin" / "python"
    subprocess.run([*installer(python), str(wheel)], env=environment, check=True, capture_output=True)
    site_packages = Path(sysconfig.get_path("purelib", vars={"base": str(place)}))
    (site_packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python.parent


def installer(python: Path) -> list[str]:
    """The command that puts one wheel into an environment, and nothing else."""
    offline = ["install", "--no-deps", "--no-index"]
    if find_spec("pip"):
        return [sys.executable, "-m", "pip", "--python", str(python), *offline]
    if uv := shutil.which("uv"):
        return [uv, "pip", *offline, "--python", str(python)]
    pytest.skip("neither pip nor uv is here to install the wheel")


def test_the_wheel_holds_the_three_packages_and_nothing_else(wheel: Path, root: Path) -> None:
    info = f"wmr_replay-{__version__}.dist-info"
    found = set(zipfile.ZipFile(wheel).namelist())
    sources = {
        path.relative_to(root / folder).as_posix()
        for folder, package in SOURCES.items()
        for path in (root / folder / package).rglob("*")
        if path.suffix in {".py", ".typed", ".json", ".js", ".css"}
    }
    assert found == sources | {f"{info}/{name}" for name in METADATA}
    assert "wmr_schemas/gap.schema.json" in found
    assert {f"{package}/py.typed" for package in SOURCES.values()} <= found
    assert {f"{package}/__init__.py" for package in SOURCES.values()} <= found
    assert not any("test" in Path(name).parts[0] for name in found)


def test_every_folder_of_the_wheel_is_a_package(wheel: Path) -> None:
    names = [Path(name) for name in zipfile.ZipFile(wheel).namelist() if name.endswith(".py")]
    assert {path.parent for path in names} == {path.parent for path in names if path.name == "__init__.py"}


def test_it_says_its_version(installed: Path, environment: dict[str, str], tmp_path: Path) -> None:
    command = [str(installed / "wmr-replay"), "--version"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    assert done.stdout == f"wmr-replay, version {__version__}\n"


def test_the_installed_packages_are_the_wheels_own(
    installed: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    code = "import wmr_schemas, wmr_synth, wmr_replay\n" + "".join(
        f"print({package}.__file__)\n" for package in SOURCES.values()
    )
    command = [str(installed / "python"), "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True, text=True)
    places = [Path(line) for line in done.stdout.splitlines()]
    assert len(places) == len(SOURCES)
    assert all(place.is_relative_to(installed.parent) for place in places)


def test_it_writes_a_log_and_replays_it(installed: Path, environment: dict[str, str], tmp_path: Path) -> None:
    program = str(installed / "wmr-replay")
    synth = [program, "synth", "paper-acceleration", "--out", "log.mcap", "--duration", "6", "--rate", "100"]
    for command in (synth, [program, "run", "log.mcap"]):
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
    written = {path.name for path in (tmp_path / "log.wmr").iterdir()}
    kinds = (
        "rrd",
        "samples.parquet",
        "segments.parquet",
        "summary.parquet",
        "hindsight.parquet",
        "hindsight_segments.parquet",
        "summary.json",
        "confusion.parquet",
    )
    assert written == {f"log.{kind}" for kind in kinds}
