"""The documentation agrees with the code."""

import importlib.util
import re
import shlex
from pathlib import Path
from types import ModuleType

import click
import pytest

from wmr_replay.cli.commands import COMMANDS, LazyGroup

COMMAND_LINE = re.compile(r"^\s*(?:\.venv/bin/)?(wmr-replay [^\n#`|]+)", re.MULTILINE)


TREE = re.compile(r"^```\{toctree\}\n(?::[^\n]*\n)*\n(.*?)^```", re.MULTILINE | re.DOTALL)


def imported(path: Path) -> ModuleType:
    """The module of a file in docs, which is no package."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def generator(root: Path) -> ModuleType:
    return imported(root / "docs" / "make_schema_pages.py")


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


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('<script src="_static/own.js"></script><a href="https://elsewhere.org">a link</a>', []),
        ('<script async src="https://elsewhere.org/a.js"></script>', ["https://elsewhere.org/a.js"]),
        ('<img alt="x" src="//elsewhere.org/a.png">', ["//elsewhere.org/a.png"]),
        ('<link rel="stylesheet" href="https://elsewhere.org/a.css">', ["https://elsewhere.org/a.css"]),
        ("@font-face { src: url('https://elsewhere.org/a.woff2') }", ["https://elsewhere.org/a.woff2"]),
    ],
)
def test_what_a_page_would_load_from_elsewhere_is_found(root: Path, text: str, found: list[str]) -> None:
    extension = imported(root / "docs" / "_ext" / "nothing_from_elsewhere.py")
    assert extension.loaded_from_elsewhere(text) == found


def test_pictures_load_nothing_from_elsewhere(root: Path) -> None:
    extension = imported(root / "docs" / "_ext" / "nothing_from_elsewhere.py")
    pictures = list((root / "docs" / "images").glob("*.svg"))
    assert len(pictures) >= 2
    loaded = [extension.loaded_from_elsewhere(path.read_text(encoding="utf-8")) for path in pictures]
    assert loaded == [[] for _ in pictures]


def test_the_reference_of_the_commands_has_every_option_of_every_command(root: Path) -> None:
    text = imported(root / "docs" / "_ext" / "command_reference.py").reference()
    group = LazyGroup("wmr-replay")
    context = click.Context(group)
    for name in COMMANDS:
        section = re.split(r"^## ", text, flags=re.MULTILINE)[1 + list(COMMANDS).index(name)]
        assert section.startswith(f"{name}\n")
        command = group.get_command(context, name)
        assert command is not None
        options = [max(param.opts, key=len) for param in command.params if isinstance(param, click.Option)]
        assert [option for option in options if option not in section] == []


def test_every_page_stands_in_one_group_of_the_navigation(root: Path) -> None:
    docs = root / "docs"
    trees = [(docs / page).read_text(encoding="utf-8") for page in ("index.md", "schema/index.md")]
    listed = [TREE.findall(text) for text in trees]
    home = [re.sub(r".*<(.+)>", r"\1", line) for tree in listed[0] for line in tree.splitlines()]
    schemas = [f"schema/{line}" for tree in listed[1] for line in tree.splitlines()]
    pages = {str(path.relative_to(docs).with_suffix("")) for path in docs.rglob("*.md")}
    assert sorted([*home, *schemas]) == sorted(pages - {"index"} | {"self"})
    assert len(re.findall("^:caption: ", trees[0], re.MULTILINE)) >= 5


def test_no_page_holds_a_directive_that_sphinx_would_print_as_text(root: Path) -> None:
    found = [
        f"{page.name}: {line}"
        for page in [root / "README.md", *(root / "docs").rglob("*.md")]
        for line in page.read_text(encoding="utf-8").splitlines()
        if re.match(r"::: ?\w+\.\w|!!! |<<<<<<< |>>>>>>> ", line)
    ]
    assert found == []


def test_every_picture_and_page_that_the_readme_links_to_exists(root: Path) -> None:
    targets = re.findall(r"\]\((?!https?:)([^)#]+)", (root / "README.md").read_text(encoding="utf-8"))
    assert targets
    assert [target for target in targets if not (root / target).exists()] == []
