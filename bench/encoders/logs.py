"""Logs by driver family, chassis, noise and seed; everything random in one follows from its seed.

log = made("patrol", "skid-steer", "rtk", seed=7)
log.log.wheels, log.truth.mode, log.facts["calibration"]
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from encoders.drivers import SKID_STEER_PACE, driver_of
from wmr_schemas.robot import RobotParameters
from wmr_synth import Disturbance, Scenario, SimulatedLog, synthesise
from wmr_synth.hidden.world import drawn_world
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.wheel_speed.chassis import CHASSIS, NOMINAL_ERROR, SKID_STEER, Chassis
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import DRY, ICY
from wmr_synth.wheel_speed.plan import CommandsAs, RollingPlan
from wmr_synth.wheel_speed.torques import TorquesAs

DURATION_S = 90.0
RADIUS_M, HALF_TRACK_M = (0.08, 0.17), (0.18, 0.35)


def made(  # noqa: PLR0913 – one call says what a log is
    family: str,
    chassis: str,
    noise: str,
    seed: int,
    *,
    hide: Sequence[str] = (),
    calibrated: bool = False,
    textbook: bool = False,
    slippery: bool = True,
    commands: CommandsAs = "wheels",
    duration_s: float = DURATION_S,
    sensors: EncoderSensors | None = None,
    torques: TorquesAs = "none",
) -> SimulatedLog:
    """A log of 100 Hz with encoders of 2048 ticks, unless ``sensors`` says more than the pose's noise.

    Args:
        family: A driver of ``encoders.drivers.FAMILIES``.
        chassis: ``differential`` or ``skid-steer``; its stated lengths are drawn.
        noise: Pose noise: ``mocap``, ``rtk`` or ``poor``.
        seed: One seed, one log.
        hide: Effects beyond the base model, as on the command line.
        calibrated: The stated lengths are the true ones and x_icr is 0; else they are up to 3 % off, and a
            skid-steer robot's effective track is 1.4 to 2.2 times the stated one.
        textbook: No elastic and no lateral slip of its own, an even ground, an immediate drive: with nothing
            hidden the base model is exact wherever the wheels grip.
        slippery: Wet and icy stretches; else dry ground throughout.
        commands: How the log holds the commands.
        duration_s: Length.
        sensors: Rates and ticks; the pose's noise is that of ``noise`` all the same.
        torques: How the log holds the torques of the wheels.
    """
    rng = np.random.default_rng([seed, 1])
    kind, nominal = chassis_of(CHASSIS[chassis], rng, calibrated=calibrated)
    plan = RollingPlan(
        kind,
        driver_of(family, SKID_STEER_PACE if chassis == SKID_STEER.kind else 1.0),
        ICY if slippery else DRY,
        nominal_error=0.0 if calibrated else NOMINAL_ERROR,
        textbook=textbook,
        commands=commands,
        torques=torques,
    )
    xy_m, yaw_rad = NOISE_LEVELS[noise]
    measured = replace(sensors or EncoderSensors(), noise_xy_sd_m=xy_m, noise_yaw_sd_rad=yaw_rad)
    return synthesise(
        Scenario(f"{family}, {chassis}", "a benchmark's drive", duration_s, plan, measured, nominal),
        seed=seed,
        world=drawn_world(hide, seed, nominal, duration_s, Disturbance()),
    )


def chassis_of(
    kind: Chassis, rng: np.random.Generator, *, calibrated: bool
) -> tuple[Chassis, RobotParameters]:
    """A chassis with stated lengths drawn; where ``calibrated`` the stated half-track is the effective
    one.
    """
    radius_m, half_track_m = float(rng.uniform(*RADIUS_M)), float(rng.uniform(*HALF_TRACK_M))
    ratio = float(rng.uniform(*kind.track_ratio))
    if calibrated:
        half_track_m *= ratio
        kind = replace(kind, track_ratio=(1.0, 1.0), icr_offset_m=(0.0, 0.0))
    return kind, RobotParameters(wheel_radius_m=radius_m, half_track_m=half_track_m)
