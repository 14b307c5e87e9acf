"""A drive out of a file as a scenario's plan."""

from collections.abc import Callable

import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.drive_file import DriveFile
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.modes import ContactMode
from wmr_synth.driving.drivers import Driver, FollowedSpeeds, Gains, OpenLoop, Waypoints
from wmr_synth.driving.plan import Plan, phases

ROUNDING_S = 1e-6
"""A stamp this much before a knot counts as the knot."""


def played_plan(drive: DriveFile) -> Callable[[float, np.random.Generator], Plan]:
    """The plan of a drive: ideal rolling throughout, from the speeds of its first knot on, from rest where
    torques are played. Behind the last knot its values hold.
    """
    driver = driver_of(drive)
    start = (drive.first[0], drive.second[0]) if drive.follow == "speeds" else (0.0, 0.0)

    def plan(duration_s: float, _: np.random.Generator) -> Plan:
        return Plan(driver, phases((ContactMode.IDEAL,), (duration_s,), duration_s), *start)

    return plan


def driver_of(drive: DriveFile) -> Driver:
    """Who plays the drive. Raises InvalidSetting where the robot's α or half track is needed and unknown."""
    if drive.follow == "torques":
        return OpenLoop(held_torques(drive))
    robot, controller = drive.robot, drive.controller
    if robot.alpha is None or robot.half_track_m is None or controller is None:
        raise InvalidSetting("a drive by speeds needs [robot] alpha and half_track_m, and a [controller]")
    return FollowedSpeeds(
        Waypoints(drive.t_s, drive.first, drive.second),
        (robot.alpha, robot.alpha_yaw_or_alpha or robot.alpha),
        robot.half_track_m,
        Gains(**vars(controller)),
    )


def held_torques(drive: DriveFile) -> Callable[[F64], tuple[F64, F64]]:
    """Torques left and right at any times, each held from its knot on."""
    left_nm, right_nm = np.array(drive.first), np.array(drive.second)

    def efforts_nm(t_s: F64) -> tuple[F64, F64]:
        at = np.maximum(np.searchsorted(drive.t_s, t_s + ROUNDING_S, side="right") - 1, 0)
        return left_nm[at], right_nm[at]

    return efforts_nm
