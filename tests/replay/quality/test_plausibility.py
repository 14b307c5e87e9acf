"""Wrong signs and units are found and named; clean logs are left alone; batches change no bit."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.identify import Motion
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_replay.quality import Observed
from wmr_replay.quality.heading import HeadingMonitor
from wmr_replay.quality.plausibility import PlausibilityMonitor
from wmr_schemas import PAPER_ROBOT, RobotParameters
from wmr_schemas.findings import KINDS, Finding, Severity
from wmr_schemas.signals import Log
from wmr_schemas.status import Status
from wmr_synth import Sensors, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.005, noise_yaw_sd_rad=0.003)


@cache
def clean(scenario: str = "patrol", seed: int = 3) -> Log:
    """A drive of 40 s with a few skids and slips."""
    return synthesise(scenario, seed=seed, duration_s=40.0, sensors=SENSORS).log


def found_in(log: Log) -> dict[str, Finding]:
    """The findings of this monitor in a replay, by code."""
    engine = Engine(Settings(identifier="paper", tune=False), ReplayModel(log.robot))
    engine.push(as_batch(log))
    engine.finish()
    ours = {code for _, code, _, _ in CASES.values()}
    return {finding.code: finding for finding in engine.findings if finding.code in ours}


def torque(log: Log, left: float, right: float, *, swap: bool = False) -> Log:
    track = log.torque
    assert track is not None
    sides = (track.right_nm, track.left_nm) if swap else (track.left_nm, track.right_nm)
    return replace(log, torque=replace(track, left_nm=left * sides[0], right_nm=right * sides[1]))


def wheels(log: Log, left: float, right: float) -> Log:
    track = log.torque
    assert track is not None
    fast = replace(track, left_radps=left * track.left_radps, right_radps=right * track.right_radps)
    return replace(log, torque=fast)


def pose(log: Log, position: float = 1.0, yaw: float = 1.0) -> Log:
    p = log.pose
    return replace(log, pose=replace(p, x_m=position * p.x_m, y_m=position * p.y_m, yaw_rad=yaw * p.yaw_rad))


def robot(log: Log, **factors: float) -> Log:
    known = {name: float(log.robot.known()[name]) * factor for name, factor in factors.items()}
    return replace(log, robot=replace(log.robot, **known))


RPM = 60 / (2 * np.pi)
CASES: dict[str, tuple[Callable[[Log], Log], str, str, bool]] = {
    "both torques reversed": (lambda log: torque(log, -1, -1), "torque_sign", "both torques are", True),
    "left torque reversed": (lambda log: torque(log, -1, 1), "torque_sign", "the left torque is", True),
    "right torque reversed": (lambda log: torque(log, 1, -1), "torque_sign", "the right torque is", True),
    "sides exchanged": (lambda log: torque(log, 1, 1, swap=True), "sides_swapped", "left and right", True),
    "left wheel reversed": (lambda log: wheels(log, -1, 1), "wheel_speed_sign", "the left wheel", False),
    "millimetres": (lambda log: pose(log, 1000), "position_unit", "millimetres", True),
    "centimetres": (lambda log: pose(log, 100), "position_unit", "centimetres", True),
    "clockwise": (lambda log: pose(log, yaw=-1), "yaw_unit", "clockwise", True),
    "degrees": (lambda log: pose(log, yaw=180 / np.pi), "yaw_unit", "degrees", True),
    "rpm": (lambda log: wheels(log, RPM, RPM), "wheel_speed_unit", "rpm in place of rad/s", False),
    "electrical rpm": (
        lambda log: wheels(log, 7 * RPM, 7 * RPM),
        "wheel_speed_unit",
        "electrical rpm of a motor with 7 pole pairs",
        False,
    ),
    "radius of 100 m": (
        lambda log: robot(log, wheel_radius_m=1000),
        "wheel_speed_unit",
        "radius in milli",
        False,
    ),
    "whole track": (lambda log: robot(log, half_track_m=2), "half_track", "that is the whole track", True),
    "newton millimetres": (lambda log: torque(log, 1e3, 1e3), "torque_unit", "N·mm in place of N·m", True),
    "before the gear": (
        lambda log: torque(log, 0.04, 0.04),
        "torque_unit",
        "before a gear of about 2",
        False,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_fault_is_named_with_its_likely_cause(case: str) -> None:
    fault, code, words, bars = CASES[case]
    found = found_in(fault(clean()))
    assert list(found) == [code]
    assert words in found[code].text
    assert (found[code].severity == Severity.BARS) == bars
    assert bool(found[code].n) == bars


@pytest.mark.parametrize("scenario", ["patrol", "random", "stop-and-go", "figure-eight"])
@pytest.mark.parametrize("seed", [11, 12])
def test_nothing_is_found_in_clean_logs_that_skid_and_slip(scenario: str, seed: int) -> None:
    assert found_in(clean(scenario, seed)) == {}


def test_a_robot_that_follows_the_papers_convention_is_left_alone() -> None:
    """Its α is r²/(3 I_φ), 9 times what mass and radius give."""
    log = clean("random", 13)
    assert log.robot == PAPER_ROBOT
    assert "torque_unit" not in found_in(log)


def test_without_alpha_the_torques_are_held_against_mass_and_radius() -> None:
    log = clean()
    known = replace(log.robot, alpha=None, alpha_yaw=None)
    assert found_in(replace(log, robot=known)) == {}
    heavy = replace(known, mass_kg=1000 * (known.mass_kg or 0.0))
    assert set(found_in(replace(log, robot=heavy))) == {"torque_unit"}


def test_an_unknown_robot_gives_no_claims_on_units() -> None:
    log = replace(wheels(torque(clean(), 50, 50), 9, 9), robot=RobotParameters())
    assert found_in(log) == {}


def test_every_code_of_the_monitor_is_declared() -> None:
    for _, code, _, bars in CASES.values():
        assert KINDS[code].bars == (Status.IMPLAUSIBLE if bars or code == "torque_unit" else None)


def rows(n: int, *, sign: float = -1.0, rate_hz: float = 20.0) -> Observed:
    """n rows of a robot that drives to and fro and turns, its torques times ``sign``."""
    rng = np.random.default_rng(5)
    t_s = np.arange(n) / rate_hz
    speed, turning = 1 + 0.8 * np.sin(t_s), 0.5 * np.sin(0.7 * t_s)
    ahead, turn = 0.8 * np.cos(t_s), 0.35 * np.cos(0.7 * t_s)
    yaw = np.cumsum(turning) / rate_hz
    xy = np.cumsum([speed * np.cos(yaw), speed * np.sin(yaw)], axis=1) / rate_hz
    efforts = np.array([ahead - turn, ahead + turn]) * 5 * sign + 0.1 * rng.normal(size=(2, n))
    inputs = np.concatenate([efforts, [speed - turning, speed + turning]])
    sd = np.full(n, 0.01)
    motion = Motion(speed, 0 * speed, turning, ahead, turn, sd, sd, sd, sd, sd)
    measured = np.concatenate([xy, yaw[None]])
    known = RobotParameters(alpha=0.1, alpha_yaw=0.1, half_track_m=1.0, wheel_radius_m=1.0)
    t_ns = (t_s * 1e9).astype(np.int64)
    noise = np.full((2, n), 1e-6)
    return Observed(t_ns, t_s, measured, inputs, inputs, motion, noise, known, measured, measured)


def part(o: Observed, cut: slice) -> Observed:
    cuts = {
        name: Motion(*(m[cut] for m in value)) if name == "motion" else value[..., cut]
        for name, value in o._asdict().items()
        if name != "robot"
    }
    return o._replace(**cuts)


def without_heading(o: Observed) -> Observed:
    """The same drive with a heading that has nothing to do with the path."""
    other = 0.4 * o.t_s**2
    m = o.motion
    x_mps = m.v_long_mps * np.cos(o.pose[2]) - m.v_lat_mps * np.sin(o.pose[2])
    y_mps = m.v_long_mps * np.sin(o.pose[2]) + m.v_lat_mps * np.cos(o.pose[2])
    cos, sin = np.cos(other), np.sin(other)
    seen = m._replace(
        v_long_mps=x_mps * cos + y_mps * sin, v_lat_mps=y_mps * cos - x_mps * sin, yaw_rate_radps=0.8 * o.t_s
    )
    pose = np.stack([*o.pose[:2], other])
    return o._replace(pose=pose, smoothed_pose=pose, pose_raw=pose, motion=seen)


Kind = type[PlausibilityMonitor] | type[HeadingMonitor]
MONITORS: list[Kind] = [PlausibilityMonitor, HeadingMonitor]
WHOLE, FAST = rows(600), rows(30_000, rate_hz=1000.0)


def test_of_a_fast_log_every_few_rows_are_enough() -> None:
    """At 1 kHz a fault is found in the same half second as at 20 Hz."""
    at_s = [
        float(log.t_s[np.argmax(PlausibilityMonitor().push(log) == Status.IMPLAUSIBLE)])
        for log in (WHOLE, FAST)
    ]
    assert at_s[0] > 0
    assert at_s[1] == pytest.approx(at_s[0], abs=0.5)
    assert not (PlausibilityMonitor().push(rows(30_000, sign=1.0, rate_hz=1000.0)) != Status.OK).any()


def test_rows_are_barred_from_the_detection_on_alone() -> None:
    status = PlausibilityMonitor().push(WHOLE)
    barred = status == Status.IMPLAUSIBLE
    first = int(np.flatnonzero(barred)[0])
    assert barred[first:].all()
    assert 10 <= WHOLE.t_s[first] <= 15
    assert not (PlausibilityMonitor().push(rows(600, sign=1.0)) != Status.OK).any()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0, 1), max_size=8), st.booleans(), st.sampled_from(MONITORS))
def test_batches_change_neither_status_nor_findings(cuts: list[float], fast: bool, kind: Kind) -> None:
    log = FAST if fast else WHOLE
    log = log if kind is PlausibilityMonitor else without_heading(log)
    whole, cut = kind(), kind()
    status = whole.push(log)
    edges = [0, *sorted(round(c * len(log.t_s)) for c in cuts), len(log.t_s)]
    pieces = [cut.push(part(log, slice(a, b))) for a, b in pairwise(edges)]
    assert (status != Status.OK).any()
    np.testing.assert_array_equal(np.concatenate(pieces), status)
    assert cut.findings() == whole.findings()


@settings(max_examples=20, deadline=None)
@given(st.floats(0, 1), st.booleans())
def test_a_prefix_has_the_statuses_of_the_whole(share: float, fast: bool) -> None:
    log = FAST if fast else WHOLE
    n = round(share * len(log.t_s))
    status = PlausibilityMonitor().push(log)
    np.testing.assert_array_equal(PlausibilityMonitor().push(part(log, slice(0, n))), status[:n])


def test_absurd_values_do_not_spoil_what_comes_behind() -> None:
    spoiled = WHOLE.smoothed.copy()
    spoiled[:, 40:44] = [[np.inf], [1e200], [np.nan], [-1e300]]
    monitor = PlausibilityMonitor()
    monitor.push(WHOLE._replace(smoothed=spoiled))
    assert [f.code for f in monitor.findings()] == ["torque_sign"]
