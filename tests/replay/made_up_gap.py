"""A made-up gap result: a robot that coasts back and forth; the base model simulates it too fast."""

import numpy as np

from wmr_replay.gap.result.result import (
    Alternative,
    CandidateScore,
    Detectable,
    Estimate,
    FoundEffect,
    GapMetric,
    GapResult,
    HeldOutGap,
    Interval,
    Regime,
    Region,
    Traces,
    TrainGap,
    Where,
)
from wmr_schemas.model_file import Effect, Model, NoiseModel
from wmr_schemas.robot import RobotParameters

START_NS = 1_700_000_000_000_000_000
ROBOT = RobotParameters(alpha=0.278, alpha_yaw=0.342, half_track_m=0.25)
EFFECT = FoundEffect(
    name="viscous_drag",
    channel="longitudinal",
    formula="−c1·v",
    parameters={"c1_per_s": Estimate(0.203, (0.196, 0.210), "1/s")},
    confound_class=("viscous_drag",),
    alternatives=(Alternative("rolling_resistance", 3.2),),
    p_value=3e-15,
    separate_with="driving at a range of speeds",
    residual="longitudinal",
    variable="v_mps",
)


def traces(n: int = 1500, rate_hz: float = 25.0) -> Traces:
    """A figure of eight; the base runs away within each window of 4 s, the extended model hardly."""
    t = np.arange(n) / rate_hz
    measured = np.stack([6 * np.sin(0.2 * t), 3 * np.sin(0.4 * t), np.cos(0.2 * t)], axis=1)
    held_out = (np.floor(t / 12) % 3 == 2).astype(float)
    since = t % 4
    away = 0.03 * (since - 2)[:, None] ** 2 * np.array([1.0, 0.4, 0.1])
    base, extended = measured + away, measured + 0.08 * away
    base[:40], extended[:40] = np.nan, np.nan
    rng = np.random.default_rng(1)
    residual = 0.05 * rng.standard_normal((n, 3))
    drag = np.stack([-0.2 * np.cos(0.2 * t), 0 * t, 0 * t], axis=1)
    mode = np.where((t > 20) & (t < 24), 1.0, 0.0)
    speed = np.cos(0.2 * t)
    quantities = {"v_mps": speed, "v_lat_mps": 0 * t, "yaw_rate_radps": -0.2 * np.sin(0.2 * t)}
    quantities |= {"effort_sum_nm": speed, "effort_diff_nm": 0 * t, "effort_sum_rate_nmps": 0 * t}
    return Traces(
        START_NS, t, measured, base, extended, residual + drag, residual, held_out, mode, quantities
    )


def gap_metric(name: str, unit: str, scale: float) -> GapMetric:
    held = HeldOutGap(0.024 * scale, 0.0052 * scale, 0.0049 * scale, (0.71, 0.84), 2e-5)
    return GapMetric(name, unit, 7, TrainGap(0.023 * scale, 0.005 * scale), held)


def gap_result(**changes: object) -> GapResult:
    """The result, with any field replaced."""
    where = Where(
        channels={"longitudinal": 11.6, "lateral": 1.0, "yaw": 1.02},
        intervals=(Interval(12.0, 16.0, 0.34), Interval(40.0, 42.0, 0.2)),
        regions=(Region(2.0, 1.5, 0.8, 0.31),),
        regime={"speed": (Regime(0.0, 0.5, 20.0, 1.2, 1.0, 1.1), Regime(0.5, 2.0, 40.0, 9.0, 1.0, 1.0))},
    )
    fields = {
        "verdict": "named",
        "sentence": "The base model lacks viscous_drag: −c1·v with c1 = 0.203 1/s.",
        "effects": (EFFECT,),
        "where": where,
        "position": gap_metric("position_rms_4s", "m", 1.0),
        "yaw": gap_metric("yaw_rms_4s", "rad", 0.1),
        "modes": "identified",
        "base": "the log's metadata record",
        "unnameable": (),
        "minimum_detectable": {"slope": Detectable(0.012, "m/s²"), "input_delay": Detectable(0.004, "s")},
        "model": Model(
            robot=ROBOT,
            noise=NoiseModel(position_sd_m=0.001, yaw_sd_rad=0.002),
            effects=(Effect("viscous_drag", {"c1_per_s": 0.203}, {"c1_per_s": 0.0036}),),
        ),
        "seed": 0,
        "notes": (),
        "traces": traces(),
        "candidates": (
            CandidateScore(0, "viscous_drag", 300.0, 290.0, 3e-15),
            CandidateScore(0, "rolling_resistance", 150.0, 140.0, 1e-9, "hold-out"),
        ),
    }
    return GapResult(**(fields | changes))
