"""The measured log of a case, and the base model that ``fit`` calibrates on another log of the robot.

log = logged(Case("courier", "stop-go", "mocap", "payload", seed=7))
log.log, log.hidden.sizes, log.motion
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from engine.bases import kept
from engine.case import Case
from engine.drive import Motion, RanAway, driven, rests_elsewhere
from engine.effects import EDITS, Hidden, World, nothing
from engine.robot import Robot, robot_of, spec_of
from wmr_replay.api.fit import fit
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.model_file import Model
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack, WheelSpeedTrack
from wmr_synth.recorder import write_mcap

START_NS = 1_760_000_000 * NS_PER_S
WHEEL_SPEED_SD_RADPS = 0.01
PATCH_AFTER_S, PATCH_ACCELERATION_MPS2 = 10.0, 0.3
CALIBRATION_SEED = 5_000_000
CALIBRATIONS = 3
"""So many calibration logs a robot and noise; cases share them."""
TRIES = 5
CALIBRATION_DRIVE = "stop-go"
"""A robot is calibrated on a drive that stops, turns and goes: on straight ones α is known to 4 % at best."""


@dataclass(frozen=True, eq=False)
class Logged:
    """A case's log as recorded, the true motion, and what was hidden."""

    log: Log
    motion: Motion
    hidden: Hidden
    robot: Robot


def logged(case: Case) -> Logged:
    """The case driven and measured. Raises RanAway."""
    robot = robot_of(case.robot)
    hidden = hidden_of(case, robot)
    motion = driven(hidden, robot, case.references(), case.duration_s)
    return Logged(measured(case, motion, robot, hidden), motion, hidden, robot)


def hidden_of(case: Case, robot: Robot) -> Hidden:
    """The case's changed world. Raises RanAway where a moved mass tips the robot onto another part."""
    world = World(spec_of(case.robot), robot, case.stream("size"), case.duration_s)
    if not case.effect:
        return nothing(world)
    if case.effect == "slick_patch":
        world = replace(world, places_m=reached_under_torque(case, robot))
    hidden = EDITS[case.effect](world)
    if case.effect == "centre_of_mass" and rests_elsewhere(hidden, nothing(of_file(case, robot))):
        raise RanAway("the robot rests on a part that is no support")
    return hidden


def of_file(case: Case, robot: Robot) -> World:
    """The robot as its file has it."""
    return World(spec_of(case.robot), robot, case.stream("place"), case.duration_s)


def reached_under_torque(case: Case, robot: Robot) -> F64:
    """Places (n, 2) at which the robot without an effect accelerates, after the first 10 s."""
    motion = driven(nothing(of_file(case, robot)), robot, case.references(), case.duration_s)
    pull = robot.alpha * np.abs(motion.left_nm + motion.right_nm)
    later = (motion.t_s > PATCH_AFTER_S) & (motion.t_s < 0.9 * case.duration_s)
    chosen = later & (pull >= min(PATCH_ACCELERATION_MPS2, float(np.quantile(pull, 0.9))))
    if not chosen.any():  # it pulls early on alone
        chosen = later & (pull >= np.quantile(pull[later], 0.9))
    return np.stack([motion.x_m[chosen], motion.y_m[chosen]], axis=1)


def measured(case: Case, motion: Motion, robot: Robot, hidden: Hidden) -> Log:
    """The log as recorded: poses with white noise, torques as commanded, or wheel speeds in their place."""
    rng = case.stream("pose")
    (position_m, yaw_rad), n = case.noise_sd, len(motion.t_s)
    stamps = START_NS + np.rint(motion.t_s * NS_PER_S).astype(np.int64)
    late = stamps + round(hidden.late_s * NS_PER_S)
    pose = PoseTrack(
        late,
        motion.x_m + position_m * rng.normal(size=n),
        motion.y_m + position_m * rng.normal(size=n),
        motion.yaw_rad + yaw_rad * rng.normal(size=n),
    )
    if robot.by_wheels:
        noise = WHEEL_SPEED_SD_RADPS * case.stream("wheels").normal(size=(2, n))
        wheels = WheelSpeedTrack(stamps, motion.left_radps + noise[0], motion.right_radps + noise[1])
        return Log(pose, robot=robot.data_sheet, wheels=wheels)
    unknown = np.full(n, np.nan)
    torque = TorqueTrack(stamps, motion.left_nm, motion.right_nm, unknown, unknown)
    return Log(pose, torque, robot=robot.data_sheet)


def calibration_cases(case: Case) -> tuple[Case, ...]:
    """Other logs of the same robot without the effect: another seed, the same noise, the calibration drive.

    The track of a skid-steered robot depends on the driving: it is calibrated on the case's family as well.
    """
    seed = CALIBRATION_SEED + case.seed % CALIBRATIONS
    drive = replace(case, effect="", again=False, family=CALIBRATION_DRIVE, seed=seed)
    if not robot_of(case.robot).four_wheeled:
        return (drive,)
    return (drive, replace(drive, family=case.family, seed=seed + CALIBRATIONS))


def base_of(case: Case) -> Model:
    """The base model that ``fit`` writes for the case's calibration logs."""
    return fitted(calibration_cases(case))


def driven_through(case: Case) -> Logged:
    """A calibration log; of a robot that runs away with one seed, that of the next."""
    for seed in range(case.seed, case.seed + 2 * CALIBRATIONS * TRIES, 2 * CALIBRATIONS):
        with suppress(RanAway):
            return logged(replace(case, seed=seed))
    raise RanAway(f"{case.robot}, with {TRIES} seeds")


@lru_cache
def fitted(cases: tuple[Case, ...]) -> Model:
    """What ``fit`` says of the logs of cases; kept for other processes."""
    return kept(cases, lambda: calibrated(cases))


def calibrated(cases: tuple[Case, ...]) -> Model:
    """What ``fit`` says of the logs of cases."""
    with TemporaryDirectory() as folder:
        paths = [
            written(driven_through(case).log, Path(folder) / f"{k}.mcap") for k, case in enumerate(cases)
        ]
        return fit(paths if len(paths) > 1 else paths[0]).model


def written(log: Log, path: Path) -> Path:
    """The log as a canonical MCAP."""
    write_mcap(log, path)
    return path
