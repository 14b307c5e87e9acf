"""A user's effect from a wheel of its own: scanned, named, written to model.toml, read back and taken out.

The log hides the effect in a second form, registered here: another sign, and the cable's own distance.
"""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import polars as pl
import pytest

import wmr_replay
import wmr_schemas
import wmr_synth
from wmr_schemas.model_file import Effect, Model, model_to_toml, read_model

SIZE = 0.04
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]  # three commands compile what they need
HIDE = f"""
import numpy as np
from pathlib import Path
from wmr_synth import Sensors, World, record, synthesise
from wmr_synth.driving.patrol import SMALL_ROBOT
from wmr_synth.hidden import DEFAULT_DISTURBANCE, OwnForm, draw_effect, parse_hide, register_form

def drag(motion, values):
    cable_m = np.sqrt(motion.x_m**2 + motion.y_m**2)
    sign = motion.v_long_mps / np.sqrt(motion.v_long_mps**2 + 0.005**2)
    return np.stack([-values["c_per_s2"] * cable_m * sign, 0 * cable_m, 0 * cable_m], axis=1)

register_form("tether", OwnForm("−c·r·v/√(v² + .005²)", acceleration=drag))
name, given = parse_hide("tether:c_per_s2={SIZE}")
effect = draw_effect(name, given, np.random.default_rng(0), SMALL_ROBOT, 60.0)
world = World((effect,), disturbance=DEFAULT_DISTURBANCE)
simulated = synthesise("patrol", seed=11, duration_s=60.0, world=world, robot=SMALL_ROBOT)
assert simulated.facts["effects"][0]["form"].startswith("−c·r·v/√")
record(simulated, Path("tether.mcap"))
"""


def run(*command: str, env: dict[str, str], cwd: Path) -> str:
    done = subprocess.run(command, env=env, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(
    root: Path, tmp_path_factory: pytest.TempPathFactory, environment: dict[str, str]
) -> dict[str, str]:
    """The environment of an interpreter that sees the example's wheel and our packages."""
    out, target = tmp_path_factory.mktemp("dist"), tmp_path_factory.mktemp("target")
    example = root / "docs" / "examples" / "tether-effect"
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(example)]
    run(*build, env=environment, cwd=out)
    (wheel,) = out.glob("tether_effect-*.whl")
    pip = [sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "--target", str(target)]
    run(*pip, str(wheel), env=environment, cwd=out)
    ours = {str(Path(package.__file__).parents[1]) for package in (wmr_schemas, wmr_synth, wmr_replay)}
    caches = {key: value for key, value in os.environ.items() if key == "NUMBA_CACHE_DIR"}
    return {**environment, **caches, "PYTHONPATH": os.pathsep.join([str(target), *sorted(ours)])}


@pytest.fixture(scope="module")
def folder(installed: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a log that hides the effect, and what ``gap`` and ``run`` made of it."""
    place = tmp_path_factory.mktemp("tether")
    run(sys.executable, "-c", HIDE, env=installed, cwd=place)
    program = [sys.executable, "-c", "from wmr_replay.cli import main; main()"]
    modes = ("--modes", "topic:/ground_truth/mode", "--no-rrd", "--max-effects", "1")
    run(*program, "gap", "tether.mcap", *modes, "--out", "gap", env=installed, cwd=place)
    paper = ("--identifier", "paper")
    run(*program, "run", "tether.mcap", *paper, "--out", "without", env=installed, cwd=place)
    model = ("--model", "gap/tether.model.toml")
    run(*program, "run", "tether.mcap", *paper, *model, "--out", "with", env=installed, cwd=place)
    return place


def test_the_page_shows_the_example_as_it_is(root: Path) -> None:
    page = (root / "docs" / "your-own-effect.md").read_text(encoding="utf-8")
    source = (root / "docs/examples/tether-effect/tether_effect/__init__.py").read_text(encoding="utf-8")
    assert source.partition('"""\n\n')[2] in page


def test_it_is_named_with_its_own_parameter_and_unit(folder: Path) -> None:
    found = json.loads((folder / "gap" / "tether.gap.json").read_text(encoding="utf-8"))
    assert found["verdict"] == "named"
    assert [effect["name"] for effect in found["effects"]] == ["tether"]
    value = found["effects"][0]["parameters"]["c_per_s2"]
    assert value["value"] == pytest.approx(SIZE, rel=0.1)
    assert value["unit"] == "1/s²"
    assert "rolling_resistance" in found["minimum_detectable"]


def test_it_stands_in_the_model_file_which_needs_the_package(folder: Path, installed: dict[str, str]) -> None:
    path = folder / "gap" / "tether.model.toml"
    (effect,) = tomllib.loads(path.read_text(encoding="utf-8"))["effects"]
    assert (effect["name"], effect["c_per_s2"]) == ("tether", pytest.approx(SIZE, rel=0.1))
    read = "from pathlib import Path; from wmr_schemas.model_file import *; "
    read += "m = read_model(Path('gap/tether.model.toml')); print(m.effects[0].parameters['c_per_s2'])"
    assert float(run(sys.executable, "-c", read, env=installed, cwd=folder)) == effect["c_per_s2"]
    with pytest.raises(Exception, match="'tether' is no effect"):
        read_model(path)


def test_a_replay_with_the_model_takes_it_out(folder: Path) -> None:
    """C_d in ideal rolling is the drag, .25 m/s² on average, without the model; with it what noise leaves."""

    def residual(name: str) -> float:
        rows = pl.read_parquet(folder / name / "tether.samples.parquet").drop_nulls("c_d_mps2")
        ideal = rows.filter((pl.col("mode_true") == 0) & (pl.col("v_long_mps").abs() > 0.2))
        sign = ideal["v_long_mps"].sign()
        return float((ideal["c_d_mps2"] * sign).mean())

    without, with_it = residual("without"), residual("with")
    assert without < -0.1
    assert abs(with_it) < 0.15 * abs(without)


def test_a_model_file_round_trips_it(installed: dict[str, str], tmp_path: Path) -> None:
    model = Model(effects=(Effect("tether", {"c_per_s2": 0.03}),))
    (tmp_path / "m.toml").write_text(model_to_toml(model), encoding="utf-8")
    code = "from pathlib import Path; from wmr_schemas.model_file import *; p = Path('m.toml'); "
    code += "print(model_to_toml(read_model(p)) == p.read_text(encoding='utf-8'))"
    assert run(sys.executable, "-c", code, env=installed, cwd=tmp_path) == "True\n"
