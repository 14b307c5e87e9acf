"""The commands of the page on the Husky give what the page shows. Needs the shared data."""

import os
import re
import shlex
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("WMR_SHARED_DATA", ROOT.parent / "shared" / "data"))
CSV = SHARED / "robots" / "drive_husky" / "husky_windows.csv"
MAP = "docs/examples/husky.toml"
NUMBER = re.compile(r"-?\d+\.?\d*")


def block(kind: str, text: str, number: int = 0) -> str:
    """A fenced block of the page."""
    return re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL)[number]


def figures(text: str) -> list[float]:
    """The numbers in a text."""
    return [float(one) for one in NUMBER.findall(text)]


@pytest.mark.slow
@pytest.mark.skipif(not CSV.exists(), reason="the shared data are not beside the project")
@pytest.mark.timeout(180)
def test_the_commands_of_the_page_give_what_it_shows(tmp_path, monkeypatch, command):
    page = (ROOT / "docs" / "husky.md").read_text(encoding="utf-8")
    (tmp_path / CSV.name).symlink_to(CSV)
    monkeypatch.chdir(tmp_path)
    printed = {}
    for line in block("sh", page).splitlines():
        _, *words = shlex.split(line.replace("--report", "--no-rrd"))
        printed[words[0]] = command(*(str(ROOT / word) if word == MAP else word for word in words)).stdout

    yaml = Path("diff_drive.yaml").read_text(encoding="utf-8")
    assert figures(yaml) == pytest.approx(figures(block("yaml", page)), rel=0.05, abs=0.01)
    shown = block("text", page)
    (odometry,) = re.findall(r"odometry +(.* median\))", shown)
    (found,) = re.findall(r"odometry +(.* median\))", printed["gap"])
    assert figures(found) == pytest.approx(figures(odometry), rel=0.05)
    for effect in ("effective_track", "turning_slip", "icr_offset", "lateral_slip"):
        assert f"{effect} (" in " ".join(printed["gap"].split())
