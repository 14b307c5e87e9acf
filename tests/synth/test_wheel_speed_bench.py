"""The driver families of the wheel-speed benchmarks: their split, and logs of them."""

import importlib
from pathlib import Path

import numpy as np
import pytest

BENCH = Path(__file__).parents[2] / "bench"


@pytest.fixture(scope="module")
def bench():
    """``bench(name)``: a module of bench/encoders."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH))
        yield lambda name: importlib.import_module(f"encoders.{name}")


def test_every_family_is_in_one_part_of_the_split(bench):
    develop, report, late = (bench("split").part(name) for name in ("develop", "report", "late"))
    families = [*develop.families, *report.families, *late.families]
    assert len(families) == len(set(families))
    assert set(families) == set(bench("drivers").FAMILIES)
    assert len(report.families) >= 2
    assert not set(develop.conditions) & set(report.coloured)


@pytest.mark.parametrize("chassis", ["differential", "skid-steer"])
def test_every_family_drives_and_one_seed_is_one_log(bench, chassis):
    made, seen = bench("logs").made, []
    for family in bench("drivers").FAMILIES:
        log = made(family, chassis, "rtk", 3, duration_s=15.0)
        again = made(family, chassis, "rtk", 3, duration_s=15.0)
        assert np.array_equal(log.log.pose.x_m, again.log.pose.x_m)
        assert np.array_equal(log.log.wheels.left_radps, again.log.wheels.left_radps)
        assert np.ptp(log.log.pose.x_m) > 1.0
        seen.append(tuple(log.log.commands.left_radps[:500]))
    assert len(set(seen)) == len(seen)


@pytest.mark.parametrize("chassis", ["differential", "skid-steer"])
def test_a_calibrated_textbook_robot_is_what_it_states(bench, chassis):
    made = bench("logs").made
    facts = made("patrol", chassis, "mocap", 5, calibrated=True, textbook=True, duration_s=5.0).facts
    found = [value for effect in facts["calibration"].values() for value in effect.values()]
    assert found == pytest.approx([0.0] * 4, abs=1e-12)
    assert facts["true_robot"]["lag_s"] == 0.0
    off = made("patrol", chassis, "mocap", 5, duration_s=5.0).facts["calibration"]
    assert 0 < abs(off["wheel_scale"]["ratio"]) <= 0.03
