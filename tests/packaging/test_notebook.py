"""The notebook runs, and its page is the one that its script makes."""

import re
from importlib import import_module
from pathlib import Path

import pytest
from PIL import Image

OUTPUT = re.compile(r'^```text\n.*?^```$|^<div class="result">.*?</div>$', re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def made(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page and pictures, made anew in a folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(root / "docs"))
        return Path(import_module("make_notebook").make(tmp_path_factory.mktemp("notebook")))


def without_outputs(page: str) -> str:
    """Text, code and where outputs stand: figures may differ in their last digits between processors."""
    return OUTPUT.sub("(output)", page)


def test_the_page_is_the_one_that_the_script_makes(made: Path, root: Path) -> None:
    committed = (root / "docs" / "notebook.md").read_text(encoding="utf-8")
    assert without_outputs(made.read_text(encoding="utf-8")) == without_outputs(committed), (
        "python docs/make_notebook.py brings the page up to date"
    )
    assert committed.count("```text") >= 6


def test_the_numbers_on_the_page_are_those_of_today(made: Path, root: Path) -> None:
    """Shares and accuracies to two digits; an answer that has changed does not stay on the page."""
    accuracy = re.compile(r"accuracy (\d+\.\d)%")
    (now,), (then,) = (
        accuracy.findall(path.read_text(encoding="utf-8")) for path in (made, root / "docs" / "notebook.md")
    )
    assert float(now) == pytest.approx(float(then), abs=0.5)


def test_the_pictures_are_drawn_and_committed(made: Path, root: Path) -> None:
    pictures = sorted(path.name for path in (made.parent / "images").iterdir())
    assert pictures == ["notebook_1.png", "notebook_2.png"]
    for name in pictures:
        assert (root / "docs" / "images" / name).stat().st_size < 200_000
        with Image.open(made.parent / "images" / name) as picture:
            colours = picture.convert("RGB").getcolors(maxcolors=picture.width * picture.height)
            assert picture.width >= 900
            assert len(colours) > 50
