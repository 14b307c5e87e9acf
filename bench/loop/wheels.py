"""Pairs of robots with wheel speeds, on the project's simulator: lengths and hidden effect are shared."""

from dataclasses import replace

import numpy as np
from encoder_modes import true_modes
from encoders.drivers import SKID_STEER_PACE, driver_of
from encoders.logs import chassis_of
from encoders.split import part

from loop.pair import Pair
from wmr_replay.gap import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.effects import effects_of
from wmr_schemas.model_file import Effect, Model, Provenance
from wmr_schemas.robot import RobotParameters
from wmr_synth import Disturbance, Scenario, SimulatedLog, World, synthesise
from wmr_synth.hidden.world import drawn_world
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.wheel_speed.chassis import CHASSIS, SKID_STEER, Chassis
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import ICY
from wmr_synth.wheel_speed.plan import RollingPlan

LOCAL = ("slip_interval", "low_grip_patch")
EFFECTS = tuple(
    name
    for name, effect in effects_of("wheel_speed").items()
    if not effect.needs_commands and name not in LOCAL
)
LATER = 4_000
LATERAL_SLIP_S = 0.05


def pair(split: str, effect: str, noise: str, seed: int, cell: int, seconds: tuple[float, float]) -> Pair:
    """Two drives by two families of a part of the split on wet and icy ground."""
    families = part(split).families
    kind = CHASSIS[("differential", "skid-steer")[cell % 2]]
    slip_s = LATERAL_SLIP_S if kind is SKID_STEER else 0.0
    kind, nominal = chassis_of(kind, np.random.default_rng([seed, 1]), calibrated=True)
    kind = replace(kind, lateral_slip_s=(slip_s, slip_s), lag_s=(0.1, 0.1), delay_s=(0.02, 0.02))
    world = drawn_world([effect] if effect else [], seed, nominal, seconds[0], Disturbance())
    logs = [
        driven(
            families[(cell + k) % len(families)], kind, nominal, noise, seed + k * LATER, seconds[k], world
        )
        for k in range(2)
    ]
    known = (Effect("lateral_slip", {"seconds": slip_s}),) if slip_s else ()
    base = Model(robot=nominal, effects=known, provenance=Provenance(base_model="wheel_speed"))
    hidden = [Effect(e["name"], e["parameters"]) for e in logs[0].facts["effects"]] if effect else []
    t_s = (logs[1].log.pose.t_ns - logs[1].log.pose.t_ns[0]) / NS_PER_S
    return Pair(
        replace(logs[0].log, mode=None),
        replace(logs[1].log, mode=None),
        base,
        replace(base, effects=(*known, *hidden)),
        true_modes(logs[1]),
        t_s,
        "wheel-speeds",
        lambda log, model: analyse_wheel_speeds([log], model, GapOptions()),
    )


def driven(
    family: str, kind: Chassis, nominal: RobotParameters, noise: str, seed: int, seconds: float, world: World
) -> SimulatedLog:
    """One drive of the robot."""
    pace = SKID_STEER_PACE if kind.kind == SKID_STEER.kind else 1.0
    plan = RollingPlan(kind, driver_of(family, pace), ICY, nominal_error=0.0)
    xy_m, yaw_rad = NOISE_LEVELS[noise]
    sensors = replace(EncoderSensors(), noise_xy_sd_m=xy_m, noise_yaw_sd_rad=yaw_rad)
    scenario = Scenario(f"{family}, {kind.kind}", "a benchmark's drive", seconds, plan, sensors, nominal)
    return synthesise(scenario, seed=seed, world=world)
