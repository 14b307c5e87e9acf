"""``constraints.txt`` holds exact versions of all packages, and nothing of the machine that wrote it."""

import re
import sys
import tomllib
from importlib.metadata import distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PIN = re.compile(r"[a-z0-9-]+==[A-Za-z0-9.+!]+( ; [^#]+)?")


@pytest.fixture(scope="module")
def lines(root: Path) -> list[str]:
    return (root / "constraints.txt").read_text(encoding="utf-8").splitlines()


@pytest.fixture(scope="module")
def wanted(root: Path) -> list[Requirement]:
    """Every requirement that pyproject.toml names, extras included."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = [project["dependencies"], *project["optional-dependencies"].values()]
    requirements = [Requirement(text) for group in groups for text in group]
    return [requirement for requirement in requirements if requirement.name != project["name"]]


def test_every_line_is_an_exact_pin(lines: list[str]) -> None:
    assert lines
    assert [line for line in lines if not PIN.fullmatch(line)] == []


@pytest.mark.parametrize("python", ["3.11.9", "3.12.1", "3.13.0"])
@pytest.mark.parametrize(
    "system",
    [("linux", "Linux"), ("darwin", "Darwin"), ("win32", "Windows")],
    ids=["linux", "macos", "windows"],
)
def test_every_requirement_has_one_pin_that_satisfies_it(
    lines: list[str], wanted: list[Requirement], python: str, system: tuple[str, str]
) -> None:
    place = {
        "python_full_version": python,
        "python_version": python.rpartition(".")[0],
        "sys_platform": system[0],
        "platform_system": system[1],
        "platform_python_implementation": "CPython",
    }
    pins = [Requirement(line) for line in lines]
    here = [pin for pin in pins if pin.marker is None or pin.marker.evaluate(place)]
    version = {canonicalize_name(pin.name): str(pin.specifier).removeprefix("==") for pin in here}
    assert len(version) == len(here)
    for requirement in wanted:
        assert requirement.specifier.contains(version[canonicalize_name(requirement.name)]), requirement


def test_what_make_installed_is_what_is_pinned(lines: list[str]) -> None:
    if not (Path(sys.prefix) / ".installed-dev").exists():
        pytest.skip("this environment was not installed by make")
    pins = [pin for pin in map(Requirement, lines) if pin.marker is None or pin.marker.evaluate()]
    pinned = {canonicalize_name(pin.name): str(pin.specifier).removeprefix("==") for pin in pins}
    installed = {canonicalize_name(found.name): found.version for found in distributions()}
    found = {name: version for name, version in installed.items() if name in pinned}
    assert found
    assert found == {name: pinned[name] for name in found}
