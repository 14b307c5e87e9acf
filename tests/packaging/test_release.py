"""The release workflow, the documentation by version, and how to cite."""

import importlib.util
import os
import re
import subprocess
import sys
import tarfile
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
    assert lines.index("make test slow") < lines.index(".venv/bin/python -m build")
    assert jobs["publish"]["needs"] == "build"
    assert jobs["docs"]["needs"] == "publish"
    targets = re.findall(r"^([a-z-]+):", (root / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    made = [line.split()[1:] for line in lines if line.startswith("make ")]
    assert {target for some in made for target in some} <= set(targets)


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


def git(*arguments: str, cwd: Path) -> str:
    call = ["git", "-c", "user.name=a", "-c", "user.email=a@localhost", *arguments]
    return subprocess.run(call, cwd=cwd, check=True, capture_output=True, text=True).stdout


def test_the_documentation_reaches_its_branch_from_the_first_release_on(
    workflow: dict[str, Any], root: Path, tmp_path: Path
) -> None:
    """The commands of the workflow's last job, with a repository of our own in place of the server's."""
    origin = tmp_path / "origin.git"
    git("init", "--quiet", "--bare", "--initial-branch=main", str(origin), cwd=tmp_path)
    git("clone", "--quiet", str(origin), "first", cwd=tmp_path)
    script = tmp_path / "first" / "docs" / "publish_version.py"
    script.parent.mkdir()
    script.write_text((root / "docs" / "publish_version.py").read_text(encoding="utf-8"))
    git("add", "--all", cwd=script.parent)
    git("commit", "--quiet", "--message", "sources", cwd=script.parent)
    git("push", "--quiet", "origin", "HEAD:main", cwd=script.parent)
    for tag in ("v0.1.0", "v0.2.0"):
        here = tmp_path / tag
        (here / "site").mkdir(parents=True)
        (here / "site" / "index.html").write_text(tag)
        git("clone", "--quiet", str(origin), "sources", cwd=here)
        for step in workflow["jobs"]["docs"]["steps"]:
            if "run" in step:
                place = here / step.get("working-directory", ".")
                done = subprocess.run(
                    ["bash", "-e", "-c", step["run"]],
                    cwd=place,
                    env=os.environ | {"GITHUB_REF_NAME": tag},
                    capture_output=True,
                    text=True,
                    check=False,
                )
                assert done.returncode == 0, done.stderr
    found = git("ls-tree", "-r", "--name-only", "gh-pages", cwd=origin).split()
    assert found == [".nojekyll", "0.1.0/index.html", "0.2.0/index.html", "index.html"]
    assert 'url=0.2.0/"' in git("show", "gh-pages:index.html", cwd=origin)


def test_sources_and_wheel_are_of_one_version_and_the_sources_can_be_tested(
    root: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    """`python -m build` as the workflow calls it, but for the download of its own tools."""
    call = [sys.executable, "-m", "build", "--sdist", "--no-isolation", "--outdir", str(tmp_path), str(root)]
    subprocess.run(call, env=environment, check=True, capture_output=True)
    version = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    (built,) = tmp_path.iterdir()
    assert built.name == f"wmr_replay-{version}.tar.gz"
    with tarfile.open(built) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    for folder in ("schemas", "synth", "replay", "tests", "docs"):
        kept = (path for path in (root / folder).rglob("*") if path.is_file())
        wanted = {path.relative_to(root).as_posix() for path in kept if "cache" not in path.parent.name}
        assert wanted <= names
    assert {"Makefile", "constraints.txt", "README.md", "LICENSE", "CITATION.cff", ".ci/run"} <= names
    assert {".github/workflows/release.yml", "bench/gap.py", "PKG-INFO"} <= names
