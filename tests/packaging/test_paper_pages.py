"""The commands on the pages of the tutorial and of the paper's figures give the results that are shown."""

import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from wmr_replay.cli import cli

FIGURES = {f"paper_fig{number}.png" for number in (3, 4, 5, 6)}
Environment = dict[str, str]


@pytest.fixture
def figures(root: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(root / "docs"))
    return import_module("make_paper_figures")


def demo(folder: Path) -> str:
    """The demo's log, shorter and slower, replayed; what was printed."""
    log = str(folder / "demo" / "paper-acceleration.mcap")
    (folder / "demo").mkdir()
    synth = ["synth", "paper-acceleration", "--out", log, "--duration", "12", "--rate", "200"]
    for arguments in (synth, ["run", log, "--out", str(folder / "demo")]):
        done = CliRunner().invoke(cli, arguments, catch_exceptions=False)
        assert done.exit_code == 0, done.output
    return done.output


def test_the_figures_command_draws_figures_3_to_6(
    root: Path, tmp_path: Path, environment: Environment
) -> None:
    command = [
        sys.executable,
        str(root / "docs" / "make_paper_figures.py"),
        "--quick",
        "--out",
        str(tmp_path),
    ]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in tmp_path.iterdir()} == FIGURES
    for name in FIGURES:
        with Image.open(tmp_path / name) as picture:
            colours = picture.convert("RGB").getcolors(maxcolors=picture.width * picture.height)
            assert picture.width >= 1000
            assert len(colours) > 20


def test_the_pictures_on_the_pages_are_committed_and_small(root: Path) -> None:
    images = root / "docs" / "images"
    sizes = {path.name: path.stat().st_size for path in images.iterdir()}
    assert FIGURES | {"viewer.png"} <= sizes.keys()
    assert all(sizes[name] < 150_000 for name in FIGURES)


def test_estimates_are_drawn_at_the_instants_they_describe(figures: ModuleType) -> None:
    run = figures.replay("paper-acceleration", quick=True)
    rows = run.samples.drop_nulls("v_lat_mps").select("t_s", "delay_s", "v_lat_mps").rows()
    expected = {v_lat_mps: t_s - delay_s for t_s, delay_s, v_lat_mps in rows}
    _, _, lateral, _ = figures.figure_3(run).axes
    drawn_s, drawn_mps = (np.asarray(column, float) for column in lateral.lines[0].get_data())
    known = np.isfinite(drawn_mps)
    assert known.sum() > 100
    assert [expected[value] for value in drawn_mps[known]] == pytest.approx(drawn_s[known], abs=1e-9)


def test_the_tutorials_table_can_be_made(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = demo(tmp_path)
    page = (root / "docs" / "tutorial.md").read_text(encoding="utf-8")
    (snippet,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(snippet, {})
    assert "┆ c_k_mps │" in capsys.readouterr().out
    shown = re.findall(r"^(mode|accuracy|detection|false|alpha|results|viewer)\b", page, re.MULTILINE)
    assert sorted(set(re.findall(r"^(\w+) ", printed, re.MULTILINE)) & set(shown)) == sorted(set(shown))
