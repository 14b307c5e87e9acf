"""The project's own regression test and the examples of docs/ci.md use the same commands and references."""

import re
import shlex
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import polars as pl
import pytest
import yaml

from wmr_replay.cli import main

FENCED = re.compile(r"```yaml\n(.*?)```", re.DOTALL)
REFERENCES = Path("tests", "references")


def exit_code(line: str) -> int:
    """What a command line ends with; in this process, which has imported everything already."""
    with mock.patch.object(sys, "argv", shlex.split(line)):
        try:
            main()
        except SystemExit as done:
            return int(done.code or 0)
    return 0


def commands_of(example: object) -> list[str]:
    """The shell commands of a pipeline, in order: every ``run`` and every ``script``."""
    if isinstance(example, dict):
        own = [example["run"]] if isinstance(example.get("run"), str) else list(example.get("script", []))
        return own + [line for value in example.values() for line in commands_of(value) if line not in own]
    if isinstance(example, list):
        return [line for value in example for line in commands_of(value)]
    return []


@pytest.fixture(scope="module")
def examples(root: Path) -> list[object]:
    text = (root / "docs" / "ci.md").read_text(encoding="utf-8")
    return [yaml.safe_load(block) for block in FENCED.findall(text)]


@pytest.fixture
def repository(root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's repository as docs/ci.md has it, with our references."""
    shutil.copytree(root / REFERENCES, tmp_path / "ci" / "references")
    for name in ("suite.toml", "criteria.toml"):
        shutil.move(tmp_path / "ci" / "references" / name, tmp_path / "ci" / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_examples_pass_on_our_references_and_fail_on_a_planted_change(
    examples: list[object], repository: Path
) -> None:
    github, gitlab = (commands_of(example) for example in examples)
    assert github == gitlab
    install, *lines = github
    assert install.startswith("python -m pip install wmr-replay")
    assert [shlex.split(line)[:2] for line in lines] == [["wmr-replay", "suite"], ["wmr-replay", "check"]]
    assert [exit_code(line) for line in lines] == [0, 0]
    assert not len(pl.read_parquet(repository / "diff.parquet"))
    suite = ET.parse(repository / "report.xml").getroot().find("testsuite")
    assert suite is not None
    assert suite.get("failures") == "0"
    assert int(suite.get("tests", "0")) >= 5 * (3 + 4)

    path = repository / "ci" / "references" / "rough.samples.parquet"
    table = pl.read_parquet(path)
    planted = pl.when(pl.int_range(pl.len()) == 500).then(pl.col("mode") + 1).otherwise("mode")
    table.with_columns(mode=planted).write_parquet(path)
    assert exit_code(lines[1]) == 1
    found = pl.read_parquet(repository / "diff.parquet").select("log", "table", "column", "row").rows()
    assert found == [("rough", "samples", "mode", 500)]


def test_the_examples_keep_what_the_check_writes(examples: list[object]) -> None:
    (line,) = [line for line in commands_of(examples[0]) if " check " in line]
    written = {shlex.split(line)[shlex.split(line).index(option) + 1] for option in ("--diff", "--junit")}
    github, gitlab = examples
    assert isinstance(github, dict)
    assert isinstance(gitlab, dict)
    upload = github["jobs"]["replay"]["steps"][-1]
    assert set(upload["with"]["path"].split()) == written
    artifacts = gitlab["replay"]["artifacts"]
    assert {artifacts["reports"]["junit"], *artifacts["paths"]} == written


def test_our_own_ci_writes_the_reference_logs_and_checks_them(
    make: Callable[..., subprocess.CompletedProcess[str]], environment: dict[str, str]
) -> None:
    done = make("--dry-run", "test", env=environment)
    assert done.returncode == 0, done.stderr
    lines = [shlex.split(line)[1:] for line in done.stdout.splitlines() if "/wmr-replay " in line]
    assert [line[:2] for line in lines] == [
        ["suite", f"{REFERENCES}/suite.toml"],
        ["check", str(REFERENCES)],
    ]


def test_the_reference_set_is_small_and_covers_the_three_identifiers(root: Path) -> None:
    files = list((root / REFERENCES).iterdir())
    assert sum(path.stat().st_size for path in files) < 1_500_000
    stored = [pl.read_parquet(path)["settings"][0] for path in files if ".summary." in path.name]
    for identifier in ("paper", "algebraic", "bank"):
        assert any(f'"identifier": "{identifier}"' in settings for settings in stored)
