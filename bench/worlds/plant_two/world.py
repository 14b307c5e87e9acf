"""A case on the second or the third plant: driven, integrated, and measured by sensors of their own."""

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, ModeTrack, PoseTrack, TorqueTrack
from worlds.case import RATE_HZ, Case, Conditions, RanAway, Truth, World, check_stable
from worlds.drivers import Drive
from worlds.plant_three import equations as third
from worlds.plant_two import equations as eq
from worlds.plant_two.effects import EFFECTS, Sizes, drawn, hidden_of

EQUATIONS: dict[int, ModuleType] = {2: eq, 3: third}
"""By plant. The first states have the same order on both."""
START_NS = 1_750_000_000 * NS_PER_S
COMPLIANCE_S = 0.003
"""Elastic sideslip per lateral acceleration: 3 mm/s at 1 m/s²."""
LARGEST_ACCELERATION_MPS2 = 3.0
PATCH_AFTER_S, PATCH_TORQUE_MPS2 = 10.0, 0.3
ATTEMPTS = 5


def plant_robot(robot: RobotParameters) -> eq.Robot:
    """The equations' coefficients of a robot whose parameters are all known."""
    p = {key: value for key, value in robot.known().items() if not isinstance(value, str)}
    l, mass, inertia = p["half_track_m"], p["mass_kg"], p["yaw_inertia_kgm2"]
    wheel = p["wheel_radius_m"] ** 2 / p["wheel_inertia_kgm2"]
    return eq.Robot(
        alpha=p["alpha"],
        alpha_yaw=p["alpha_yaw"],
        half_track_m=l,
        wheel_radius_m=p["wheel_radius_m"],
        skid_decay_mps2=2 * p["cornering_stiffness_over_epsilon"] / mass,
        share_long=(3 / mass) / (wheel + 2 / mass),
        share_yaw=(3 * l**2 / inertia) / (wheel + 2 * l**2 / inertia),
        mass_over_yaw_inertia=mass / inertia,
        compliance_s=COMPLIANCE_S,
    )


def equations_of(case: Case) -> ModuleType:
    """The equations of the case's plant."""
    return EQUATIONS[case.plant]


def control_of(robot: RobotParameters) -> eq.Control:
    """A controller as strong as 3 m/s² ahead."""
    assert robot.alpha is not None
    return eq.Control(3.0, 0.4, LARGEST_ACCELERATION_MPS2 / (2 * robot.alpha), 1 / RATE_HZ)


def coloured(n: int, dt_s: float, tau_s: float, rng: np.random.Generator, channels: int = 3) -> F64:
    """Unit noise (n, channels) of correlation time ``tau_s``, sampled every ``dt_s``."""
    kept = np.exp(-dt_s / tau_s)
    drive = rng.normal(0.0, 1.0, (n, channels))
    out = np.empty((n, channels))
    out[0] = drive[0]
    for k in range(1, n):
        out[k] = kept * out[k - 1] + np.sqrt(1 - kept**2) * drive[k]
    return out


@dataclass(frozen=True, eq=False)
class Motion:
    """The integrated motion: ``states`` at ``t_s``, commands (left, right) at their own period."""

    t_s: F64
    states: F64
    commands: F64


def moved(case: Case, drive: Drive, robot: RobotParameters, around: Conditions, hidden: eq.Hidden) -> Motion:
    """The drive under control. Raises RanAway where the robot leaves every sensible speed."""
    n = round(case.duration_s * RATE_HZ)
    t_s = np.arange(n) / RATE_HZ
    references = np.stack(drive.path(t_s))
    plant = equations_of(case)
    fine_s = np.arange(n * plant.STEPS_PER_COMMAND) / (RATE_HZ * plant.STEPS_PER_COMMAND)
    rows = np.searchsorted(drive.modes.t_ns / NS_PER_S, fine_s + 1e-9, side="right") - 1
    modes = drive.modes.mode[rows].astype(np.int64)
    start = np.zeros(plant.N_STATES)
    start[eq.V], start[eq.Q] = drive.start
    noise = coloured(n + 1, 1 / RATE_HZ, around.disturbance_s, case.stream("disturbance"))
    states, commands = plant.drive(
        start,
        references,
        modes,
        around.disturbance_mps2 * noise,
        control_of(robot),
        plant_robot(robot),
        hidden,
    )
    check_stable(case, states[:, eq.V], states[:, eq.Q])
    return Motion(np.append(fine_s, case.duration_s), states, commands)


def placed(case: Case, motion: Motion, robot: RobotParameters, rng: np.random.Generator) -> Sizes:
    """A place that the robot reaches under torque, at a time after the first 10 s."""
    assert robot.alpha is not None
    pull = robot.alpha * np.abs(motion.commands.sum(axis=0))
    rows = np.arange(len(pull))
    chosen = (pull > min(PATCH_TORQUE_MPS2, np.quantile(pull, 0.9))) & (rows > PATCH_AFTER_S * RATE_HZ)
    chosen &= rows < 0.9 * len(rows)
    row = int(rng.choice(np.flatnonzero(chosen))) * equations_of(case).STEPS_PER_COMMAND
    return {"x_m": float(motion.states[row, eq.X]), "y_m": float(motion.states[row, eq.Y])}


def stamps(case: Case, around: Conditions) -> tuple[I64, I64]:
    """Stamps of poses and torques in ns since the start; poses jitter and are lost."""
    rng = case.stream("stamps")
    n = round(case.duration_s * RATE_HZ)
    limit = 0.4 / RATE_HZ
    shift = np.clip(around.jitter_s * rng.normal(0.0, 1.0, n), -limit, limit)
    kept = rng.uniform(0.0, 1.0, n) >= around.dropout
    shift[0], kept[0] = 0.0, True
    period_ns = round(NS_PER_S / RATE_HZ)
    pose = np.arange(n) * period_ns + np.rint(shift * NS_PER_S).astype(np.int64)
    return pose[kept], np.arange(n) * period_ns


def seen(name: str, sizes: Sizes, t_s: F64, pose: F64) -> F64:
    """The pose (3, n) behind errors of its measurement; the drift's rate waves by a sixth within 40 s."""
    x, y, yaw = pose
    if name == "pose_lever_arm":
        dx, dy = sizes["x_m"], sizes["y_m"]
        return np.stack(
            [x + np.cos(yaw) * dx - np.sin(yaw) * dy, y + np.sin(yaw) * dx + np.cos(yaw) * dy, yaw]
        )
    if name == "heading_misalignment":
        return np.stack([x, y, yaw + sizes["angle_rad"]])
    if name == "yaw_drift":
        return np.stack([x, y, yaw + sizes["rate_radps"] * (t_s + np.sin(2 * np.pi * t_s / 40.0))])
    return pose


def noisy(case: Case, around: Conditions, t_s: F64, pose: F64) -> F64:
    """The pose with white noise, and a wobble that is correlated over time; the level is their sum's."""
    rng = case.stream("pose")
    sd = np.array([case.noise_sd[0], case.noise_sd[0], case.noise_sd[1]])[:, None]
    white = rng.normal(0.0, 1.0, pose.shape)
    grid_s = np.arange(round(case.duration_s * RATE_HZ) + 1) / RATE_HZ
    wobble = coloured(len(grid_s), 1 / RATE_HZ, around.wobble_s, rng).T
    wobble = wobble[:, np.minimum(np.rint(t_s * RATE_HZ).astype(int), len(grid_s) - 1)]
    share = around.wobble_share
    return pose + sd * (np.sqrt(1 - share) * white + np.sqrt(share) * wobble)


def sized(case: Case, drive: Drive, robot: RobotParameters, around: Conditions) -> Sizes:
    """The hidden effect's parameters as drawn, a patch with its place."""
    if not case.effect:
        return {}
    stream = case.stream("size", EFFECTS.index(case.effect))
    sizes = drawn(case.effect, robot, case.duration_s, stream)
    if case.effect != "low_friction_patch":
        return sizes
    clean = moved(case, drive, robot, around, eq.Hidden())
    return placed(case, clean, robot, case.stream("place")) | sizes


def kept_stable(case: Case, drive: Drive, robot: RobotParameters, around: Conditions) -> tuple[Motion, Sizes]:
    """The motion, its effect halved until the robot keeps to sensible speeds. Raises RanAway."""
    sizes = sized(case, drive, robot, around)
    for _ in range(ATTEMPTS):
        try:
            return moved(case, drive, robot, around, hidden_of(case.effect, sizes)), sizes
        except RanAway:
            sizes = {key: 0.5 * value for key, value in sizes.items()}
    raise RanAway(case.key)


def world_of(case: Case) -> World:
    """The case driven and measured. Raises RanAway where even a small hidden effect is unstable."""
    robot, drive, around = case.robot(), case.drive(), case.conditions()
    motion, sizes = kept_stable(case, drive, robot, around)
    pose_ns, torque_ns = stamps(case, around)
    truth = at_stamps(motion, drive.modes, pose_ns / NS_PER_S)
    pose = np.stack([truth.x_m, truth.y_m, truth.yaw_rad])
    pose = noisy(case, around, truth.t_s, seen(case.effect, sizes, truth.t_s, pose))
    missing = np.full(len(torque_ns), np.nan)
    log = Log(
        PoseTrack(START_NS + pose_ns, *pose),
        TorqueTrack(START_NS + torque_ns, *motion.commands, missing, missing),
        ModeTrack(START_NS + drive.modes.t_ns, drive.modes.mode),
        robot,
    )
    return World(case, log, truth, robot, around, sizes)


def at_stamps(motion: Motion, modes: ModeTrack, t_s: F64) -> Truth:
    """The truth at the instants, joined by straight lines between the integrator's steps."""

    def column(state: int) -> F64:
        return np.interp(t_s, motion.t_s, motion.states[:, state])

    held = np.minimum((t_s * RATE_HZ + 1e-6).astype(int), motion.commands.shape[1] - 1)
    rows = np.searchsorted(modes.t_ns / NS_PER_S, t_s + 1e-9, side="right") - 1
    return Truth(
        t_s,
        *(column(state) for state in (eq.X, eq.Y, eq.YAW, eq.V, eq.W, eq.Q)),
        *motion.commands[:, held],
        modes.mode[rows],
    )
