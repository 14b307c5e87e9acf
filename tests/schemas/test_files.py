"""Files that are whole or absent."""

import os
from pathlib import Path

import pytest

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import PartFile, check_writable, made_folder, whole_file, whole_files


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_the_target_holds_the_old_content_until_the_new_one_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    target.write_text("old")
    with whole_file(target) as part:
        part.write_text("new")
        assert target.read_text() == "old"
        assert part.parent == tmp_path
        assert str(os.getpid()) in part.name
    assert target.read_text() == "new"
    assert names(tmp_path) == {"a.txt"}


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_a_failure_leaves_the_folder_as_it_was(tmp_path: Path, error: type[BaseException]) -> None:
    (tmp_path / "a").write_text("old")

    def write() -> None:
        with whole_files({"a": tmp_path / "a", "b": tmp_path / "b"}) as parts:
            parts["a"].write_text("half")
            parts["b"].write_text("half")
            raise error

    with pytest.raises(error):
        write()
    assert names(tmp_path) == {"a"}
    assert (tmp_path / "a").read_text() == "old"


def test_the_first_file_appears_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda self, to: (order.append(Path(to).name), replace(self, to))[1])
    with whole_files({1: tmp_path / "log", 2: tmp_path / "truth"}) as parts:
        for part in parts.values():
            part.touch()
    assert order == ["truth", "log"]


def test_a_file_that_the_block_forgot_is_an_error_and_nothing_appears(tmp_path: Path) -> None:
    def write() -> None:
        with whole_files({1: tmp_path / "log", 2: tmp_path / "truth"}) as parts:
            parts[1].touch()

    with pytest.raises(FileNotFoundError):
        write()
    assert names(tmp_path) == set()


def test_discarding_a_finished_file_keeps_it(tmp_path: Path) -> None:
    part = PartFile(tmp_path / "a")
    part.path.touch()
    part.finish()
    part.discard()
    assert names(tmp_path) == {"a"}


def test_folders_made_for_nothing_are_removed_and_older_ones_stay(tmp_path: Path) -> None:
    def make(folder: Path, *, leave: bool = False) -> None:
        with made_folder(folder):
            if leave:
                (folder / "kept").touch()
            raise KeyboardInterrupt

    (tmp_path / "old").mkdir()
    for folder, leave in (("old", False), ("new/below", False), ("full", True)):
        with pytest.raises(KeyboardInterrupt):
            make(tmp_path / folder, leave=leave)
    assert names(tmp_path) == {"old", "full"}
    with made_folder(tmp_path / "made" / "below") as folder:
        assert folder.is_dir()


def test_a_place_that_cannot_be_written_is_known_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check_writable(tmp_path / "new" / "folder")
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidSetting, match=r"file/out: cannot be written \(.*file is no directory\)"):
        check_writable(tmp_path / "file" / "out")
    monkeypatch.setattr("os.access", lambda *_: False)  # a test may run as root, who may write everywhere
    with pytest.raises(InvalidSetting, match="may not be changed by this user"):
        check_writable(tmp_path / "new")
