"""The release workflow, the documentation by version, and how to cite."""

import importlib.util
import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml


@pytest.fixture(scope="module")
def workflow(root: Path) -> dict[str, Any]:
    path = root / ".github" / "workflows" / "release.yml"
    text = path.read_text(encoding="utf-8")
    assert "://" not in text
    parsed = yaml.safe_load(text)
    assert isinstance(parsed, dict)
    return parsed


@pytest.fixture(scope="module")
def versions(root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("publish_version", root / "docs" / "publish_version.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_nothing_is_published_that_was_not_tested(workflow: dict[str, Any], root: Path) -> None:
    jobs = workflow["jobs"]
    lines = [step["run"] for step in jobs["build"]["steps"] if "run" in step]
    assert lines.index("make test") < lines.index(".venv/bin/python -m build")
    assert jobs["publish"]["needs"] == "build"
    assert jobs["docs"]["needs"] == "publish"
    targets = re.findall(r"^([a-z-]+):", (root / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert {line.removeprefix("make ") for line in lines if line.startswith("make ")} <= set(targets)


def test_the_publisher_is_trusted_and_holds_no_password(workflow: dict[str, Any]) -> None:
    assert workflow["permissions"] == {"contents": "read"}
    assert workflow["jobs"]["publish"]["permissions"] == {"id-token": "write"}
    assert "secrets." not in str(workflow)


def test_the_newest_release_is_the_start_page_and_older_ones_stay(
    versions: ModuleType, tmp_path: Path
) -> None:
    site, pages = tmp_path / "site", tmp_path / "pages"
    site.mkdir()
    pages.mkdir()
    for version in ("0.9.0", "0.10.0", "0.2.1", "1.0.0rc1"):
        (site / "index.html").write_text(version)
        versions.publish(site, pages, version)
    start = (pages / "index.html").read_text()
    assert 'content="0; url=0.10.0/"' in start
    assert re.findall(r"<li><a href=\"(.+?)/\">", start) == ["0.10.0", "0.9.0", "0.2.1", "1.0.0rc1"]
    assert (pages / "0.2.1" / "index.html").read_text() == "0.2.1"


@pytest.mark.parametrize("version", ["", "../elsewhere", "main", "1.0/2"])
def test_what_is_no_version_is_refused(versions: ModuleType, tmp_path: Path, version: str) -> None:
    with pytest.raises(ValueError, match="is no version"):
        versions.publish(tmp_path, tmp_path, version)


def test_the_citation_names_the_paper_and_this_version(root: Path) -> None:
    citation = yaml.safe_load((root / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"]
    paper = citation["preferred-citation"]
    assert [author["family-names"] for author in paper["authors"]] == ["Yu", "Barbot", "Floquet"]
    assert paper["year"] == 2009
