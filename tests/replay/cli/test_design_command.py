"""``wmr-replay design``: table, JSON, plots, a log's pose, and its error messages."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from wmr_replay.cli.design import command
from wmr_schemas.errors import InvalidSetting


def run(*options):
    return CliRunner().invoke(command, [str(o) for o in options], catch_exceptions=False)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("diff") / "eight.mcap"
    options = ["synth", "figure-eight", "--duration", "8", "--rate", "100", "--noise-variance", "1e-6"]
    main = "from wmr_replay.cli import main; main()"
    subprocess.run(
        [sys.executable, "-c", main, *options, "--out", str(path)], check=True, capture_output=True
    )
    return path


def test_the_table_holds_the_figures_of_the_literature():
    done = run("--window", 0.5, "--rate", 1000, "--json")
    design = json.loads(done.stdout)
    first, second = design["orders"][1:]
    assert (design["n_taps"], design["delay_s"]) == (501, 0.25)
    assert first["noise_coefficient"] == pytest.approx(12)
    assert second["noise_coefficient"] == pytest.approx(720)
    assert second["sd"] == pytest.approx((720 * 0.001 / 0.5**5) ** 0.5, rel=0.02)
    assert "delay 0.25 s" in run("--window", 0.5, "--rate", 1000).stdout


def test_bandwidth_is_where_the_gain_of_a_moving_mean_has_lost_3_db():
    done = json.loads(run("--degree", 0, "--window", 1.0, "--rate", 1000, "--json").stdout)
    assert done["orders"][0]["bandwidth_hz"] == pytest.approx(0.4429, abs=0.003)


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_a_picture_is_drawn_by_its_ending(ending, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"kernel.{ending}"
    run("--plot", path)
    begin = path.read_bytes()[:200]
    assert begin.startswith(b"\x89PNG") if ending == "png" else b"<svg" in path.read_bytes()[:2000]
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_without_matplotlib_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    for name in [name for name in sys.modules if name.startswith("wmr_replay.api.plots")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(InvalidSetting, match=r"matplotlib.*: pip install 'wmr-replay\[plot\]'"):
        run("--plot", tmp_path / "kernel.png")


@pytest.mark.parametrize(
    ("plot", "message"), [("kernel.gif", "ends in .png"), ("no/such/k.png", "no directory")]
)
def test_pictures_that_cannot_be_written_are_refused_first(plot, message, tmp_path):
    with pytest.raises(InvalidSetting, match=message):
        run("--plot", tmp_path / plot)


def test_a_window_without_samples_is_refused():
    with pytest.raises(InvalidSetting, match="holds 2 samples at 10 Hz; degree 2 needs 4 or more"):
        run("--window", 0.1, "--rate", 10)


def test_a_delay_without_a_log_is_a_usage_error():
    done = CliRunner().invoke(command, ["--max-delay", "0.1"])
    assert done.exit_code == 2
    assert "--log FILE" in done.output


def test_the_effect_on_a_log_is_measured(log: Path, tmp_path):
    done = json.loads(run("--log", log, "--window", 0.3, "--max-delay", 0.2, "--json").stdout)
    effect = done["log"]
    assert done["rate_hz"] == pytest.approx(100)
    assert effect["rows"] == pytest.approx(800, abs=2)
    assert effect["ok"] == effect["rows"] - 30
    assert [s["noise_sd"] for s in effect["signals"]] == pytest.approx([1e-3] * 3, rel=0.15)
    assert [a["order"] for a in effect["advice"]] == [1, 2]
    assert all(a["choice"]["delay_s"] <= 0.2 + 1e-6 for a in effect["advice"])
    text = run("--log", log, "--window", 0.3, "--max-delay", 0.2, "--plot", tmp_path / "k.svg").stdout
    assert "Kalman" in text
    assert (tmp_path / "k.svg").stat().st_size > 10_000
