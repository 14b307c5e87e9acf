"""The commands of the quick pages do what the pages show; ``make docs-commands`` runs those of all pages."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


def runner_of(root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("run_commands", root / "docs" / "run_commands.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclass looks itself up there
    spec.loader.exec_module(module)
    return module


RUNNER = runner_of(ROOT)
QUICK = [page for page, known in RUNNER.settings().items() if known.get("quick")]


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """A page of our own, whose folder counts as the sources."""
    monkeypatch.setattr(RUNNER, "ROOT", tmp_path)
    return tmp_path / "page.md"


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK)
def test_the_commands_of_a_quick_page_do_what_it_says(name: str) -> None:
    known = RUNNER.settings()[name]
    if "needs" in known:
        pytest.importorskip(known["needs"])
    RUNNER.run_page(ROOT / name, known.get("prepare", ""))


def test_every_page_that_needs_something_beforehand_exists_and_has_commands() -> None:
    assert set(RUNNER.settings()) <= {RUNNER.name_of(page) for page in RUNNER.pages()}
    assert len(QUICK) >= 2


def test_files_and_commands_of_a_page_are_done_in_order(page: Path) -> None:
    page.write_text("""
```toml
# conf/a.toml
b = 1
```
<!-- not run: no network -->
```sh
exit 7
```
<!-- exit: 3 -->
```sh
cat conf/a.toml; exit 3
```

It prints

```text
# conf/a.toml
…
```
""")
    RUNNER.run_page(page)
    assert [step.kind for step in RUNNER.steps(page.read_text())] == ["conf/a.toml", "sh"]
    assert RUNNER.left_out(page.read_text()) == ["no network"]


@pytest.mark.parametrize(
    ("commands", "shown"),
    [("false", None), ("echo one; echo two", "two"), ("echo 1.00", "1.05"), ("true", "one")],
)
def test_a_wrong_page_is_told_with_its_line(page: Path, commands: str, shown: str | None) -> None:
    page.write_text(f"# Title\n\n```sh\n{commands}\n```\n" + (f"\n```text\n{shown}\n```\n" if shown else ""))
    with pytest.raises(RUNNER.WrongPage, match=r"page\.md:3: "):
        RUNNER.run_page(page)


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("window 0.46 s", "window 0.46 s", True),
        ("window 0.46 s", "window 0.47 s", True),
        ("window 0.46 s", "window 0.25 s", False),
        ("97.9%", "98.1%", True),
        ("mode ideal", "mode  ideal", True),
        ("mode ideal", "mode skidding", False),
        ("viewer …", "viewer rerun a.rrd", True),
        ("a … z", "a b y", False),
        ("p < 1e-12", "p < 1e-06", False),
        ("█╋░░", "██╋░", True),
    ],
)
def test_lines_are_the_same_but_for_last_digits(shown: str, printed: str, same: bool) -> None:
    assert RUNNER.same_line(shown, printed) is same


def test_a_text_behind_the_next_heading_is_no_output() -> None:
    (step,) = RUNNER.steps("```sh\ntrue\n```\n## Next\n```text\nx\n```\n")
    assert step.expected is None


def test_python_blocks_run_by_themselves_and_are_held_to_their_output(page: Path) -> None:
    page.write_text(
        "```python\nprint(open('x', 'w').write('abc'))\n```\n```text\n3\n```\n```sh\ncat x\n```\n"
    )
    RUNNER.run_page(page)
    page.write_text("# Title\n\n```python\nx = 1\n```\n\n```python\nprint(x)\n```\n")
    with pytest.raises(RUNNER.WrongPage, match=r"page\.md:7: exit code 1"):
        RUNNER.run_page(page)


def test_the_notebook_is_the_only_page_with_python_that_runs_elsewhere() -> None:
    """Each page with a block of Python is run here, or says at the block why not."""
    with_python = {p for p in (ROOT / "docs").rglob("*.md") if "```python" in p.read_text(encoding="utf-8")}
    assert with_python - set(RUNNER.pages()) == {RUNNER.NOTEBOOK}
