"""Stamps that count another unit are recognised by the recorder's clock, and by nothing less."""

import numpy as np
import pytest

from wmr_replay.ingest.channels.clocks import what_is_wrong
from wmr_replay.ingest.channels.stamp_unit import power_of_ten, stamp_unit_findings

MS = 1_000_000
T0 = 1_700_000_000_000 * MS


def logged(n: int = 20, step_ms: float = 10.0, jitter_ms: float = 1.0) -> np.ndarray:
    jitter = np.random.default_rng(4).uniform(-jitter_ms, jitter_ms, n)
    return T0 + np.rint((np.arange(n) * step_ms + jitter) * MS).astype(np.int64)


@pytest.mark.parametrize(("factor", "power"), [(1e3, 3), (1e6, 6), (1e-3, -3), (1.0, 0), (10.0, 0), (0.1, 0)])
def test_a_power_of_1000_is_recognised(factor: float, power: int) -> None:
    stamps = T0 + np.rint(np.arange(20) * 10 * MS * factor).astype(np.int64)
    assert power_of_ten(stamps, logged()) == power


def test_a_burst_of_the_recorder_is_no_unit() -> None:
    stamps = T0 + np.arange(20) * 10 * MS
    burst = logged(step_ms=0.011, jitter_ms=0.001)
    burst[10:] += 100 * MS
    assert power_of_ten(stamps, burst) == 0
    assert power_of_ten(stamps, np.full(20, T0)) == 0


def test_the_reason_says_how_fast_they_run_and_becomes_a_finding() -> None:
    stamps = T0 + np.arange(20) * 10_000 * MS
    why = what_is_wrong(stamps, logged())
    assert why == "its first stamps run at 1000 times the log time: milliseconds in place of seconds"
    found = stamp_unit_findings({"/pose": why, "/torque": "its first stamps are zero"})
    assert [(f.code, f.text.split(":")[0]) for f in found] == [("stamp_unit", "/pose")]
