"""A cornering stiffness that is stated far too large: rolling is not taken for a skid that nearly rolls."""

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from wmr_replay.jobs.replay import MemorySource, Replay
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings

BENCH = Path(__file__).parents[3] / "bench"


@pytest.fixture(scope="module")
def world():
    """Slow square waves of steering, 1 mm of noise, a small disturbance: little but rolling."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        case = importlib.import_module("worlds.case").Case(1, "square-wave", "mocap", "", 310_500, 30.0)
        yield importlib.import_module("worlds.simulate").simulated(case)


def accuracies(world, factor):
    """Causally and in hindsight, from 5 s on."""
    robot = world.log.robot
    stated = replace(robot, cornering_stiffness_over_epsilon=robot.cornering_stiffness_over_epsilon * factor)
    source = MemorySource(replace(world.log, robot=stated), "log")
    replay = Replay(source, Engine(Settings(), ReplayModel(stated)))
    tables = pl.concat(replay.samples()), pl.concat(replay.hindsight())
    rows = [table.filter(pl.col("t_s") > 5.0) for table in tables]
    return [float(np.mean(one["mode"].to_numpy() == one["mode_true"].to_numpy())) for one in rows]


def test_a_stiffness_off_by_ten_tells_modes_as_well(world):
    right = accuracies(world, 1.0)
    for factor in (0.1, 10.0):
        assert accuracies(world, factor) == pytest.approx(right, abs=0.03)
