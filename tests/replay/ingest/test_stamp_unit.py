"""Stamps that count another unit are recognised by the recorder's clock, and by nothing less."""

import numpy as np
import pytest

from wmr_replay.ingest.channels.clocks import what_is_wrong
from wmr_replay.ingest.channels.stamp_unit import (
    log_time_findings,
    log_time_unit,
    power_of_ten,
    reason,
    stamp_unit_findings,
)

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


@pytest.mark.parametrize(
    ("unit", "divisor"), [("microseconds", 10**3), ("milliseconds", 10**6), ("seconds", 10**9)]
)
def test_a_date_in_another_unit_is_recognised_by_the_day(unit: str, divisor: int) -> None:
    why = what_is_wrong(logged() // divisor, logged())
    assert why == f"its first stamps count {unit} in place of nanoseconds"
    (found,) = stamp_unit_findings({"/pose": why})
    assert found.text.endswith("the log time is used in their place")


@pytest.mark.parametrize(("unit", "divisor"), [("microseconds", 10**3), ("milliseconds", 10**6)])
def test_a_fraction_of_the_second_in_another_unit_is_recognised_and_whole_seconds_are_none(
    unit, divisor
) -> None:
    true = T0 + np.arange(20) * 10 * MS + 3 * MS
    held = true // 10**9 * 10**9 + true % 10**9 // divisor
    assert reason(held, logged()) == f"its stamps' nanoseconds hold {unit}"
    on_the_second = T0 + np.arange(20) * 1000 * MS + np.arange(20)
    assert reason(on_the_second, on_the_second + MS) == ""


@pytest.mark.parametrize(("unit", "divisor"), [("microseconds", 10**3), ("milliseconds", 10**6)])
def test_log_times_in_another_unit_are_at_fault_where_the_stamps_show_dates(unit: str, divisor: int) -> None:
    stamps = T0 + np.arange(20) * 10 * MS
    assert what_is_wrong(stamps, logged() // divisor) == ""
    assert log_time_unit(stamps, logged() // divisor) == f"{unit} in place of nanoseconds"
    (found,) = log_time_findings({"/pose": f"{unit} in place of nanoseconds", "/torque": ""})
    assert found.text == f"/pose: the log time counts {unit} in place of nanoseconds; the stamps are used"
    assert log_time_unit(stamps, logged()) == log_time_unit(stamps - T0, logged() - T0) == ""


def test_stamps_that_show_a_date_only_because_of_their_unit_are_at_fault_themselves() -> None:
    boot = logged() - T0 + 1_500_000 * MS
    assert "microseconds in place of seconds" in what_is_wrong(boot * 10**6, boot)
