"""The documentation agrees with the code."""

import importlib.util
import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from wmr_replay.cli.commands import COMMANDS

COMMAND_LINE = re.compile(r"^\s*(?:\.venv/bin/)?(wmr-replay [^\n#`|]+)", re.MULTILINE)


@pytest.fixture(scope="module")
def generator(root: Path) -> ModuleType:
    path = root / "docs" / "make_schema_pages.py"
    spec = importlib.util.spec_from_file_location("make_schema_pages", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_schema_pages_are_up_to_date(generator: ModuleType) -> None:
    pages = generator.outdated()
    assert not pages, "python docs/make_schema_pages.py brings them up to date"


def test_a_page_out_of_date_is_noticed_and_filled(generator: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("before\n<!-- begin modes -->\nold\n<!-- end modes -->\nafter\n")
    (page,) = generator.outdated(tmp_path).values()
    assert page.startswith("before\n")
    assert page.endswith("after\n")
    assert "| 3 | `skidding_slipping` | `0b1000` |\n" in page
    assert "old" not in page


def test_every_result_table_stands_on_a_page(generator: ModuleType, root: Path) -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in (root / "docs").rglob("*.md"))
    assert {name for name in generator.BLOCKS if f"<!-- begin {name} -->" not in text} == set()


def test_every_command_shown_exists(root: Path) -> None:
    pages = [root / "README.md", *(root / "docs").rglob("*.md")]
    shown = [line for page in pages for line in COMMAND_LINE.findall(page.read_text(encoding="utf-8"))]
    used = {shlex.split(line)[1] for line in shown}
    assert {"run", "info", "synth"} <= used
    assert used <= {*COMMANDS, "--help", "--version"}


def test_no_page_loads_anything_from_elsewhere(root: Path) -> None:
    config = (root / "mkdocs.yml").read_text(encoding="utf-8")
    assert "font: false" in config
    assert "://" not in config


def test_every_picture_and_page_that_the_readme_links_to_exists(root: Path) -> None:
    targets = re.findall(r"\]\((?!https?:)([^)#]+)", (root / "README.md").read_text(encoding="utf-8"))
    assert targets
    assert [target for target in targets if not (root / target).exists()] == []
