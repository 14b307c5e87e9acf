"""Drive a robot of an MJCF file by wheel torques, and record its log; or replay the torques of a log.

python drive.py robot.xml simulated.mcap            # a minute of driving
python drive.py robot.xml real.mcap --stand-in      # a robot that differs from its file
python drive.py robot.xml --replay real.mcap        # how far the engine ends from the log after 4 s
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np

import wmr_replay as wr
from wmr_synth import write_mcap

RATE_HZ, DURATION_S, WINDOW_S = 100, 60, 4
RADIUS_M, HALF_TRACK_M, INERTIA_KGM2 = 0.08, 0.17, 0.2
MASS_KG = 13.5
START_NS = 1_760_000_000_000_000_000
POSITION_SD_M, YAW_SD_RAD = 0.001, 0.002


def plant_of(spec):
    """A model and its state, settled on the wheels."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=500)
    return model, data


def step(model, data, torques):
    """One period of the controller."""
    data.ctrl[:] = torques
    mujoco.mj_step(model, data, nstep=round(1 / (RATE_HZ * model.opt.timestep)))
    mujoco.mj_kinematics(model, data)


def pose_of(model, data):
    """x, y and yaw of the site."""
    site = data.site("pose")
    return *site.xpos[:2], np.arctan2(site.xmat[3], site.xmat[0])


def speeds_of(model, data):
    """Speed ahead and yaw rate."""
    yaw = pose_of(model, data)[2]
    return np.cos(yaw) * data.qvel[0] + np.sin(yaw) * data.qvel[1], data.qvel[5]


def references(rng):
    """Speed and yaw rate, new ones every 2 to 4 s, smoothed over half a second."""
    holds = rng.integers(2 * RATE_HZ, 4 * RATE_HZ, DURATION_S)
    speed = np.repeat(rng.uniform(-0.6, 1.2, DURATION_S), holds)[: DURATION_S * RATE_HZ]
    turning = np.repeat(rng.uniform(-1.0, 1.0, DURATION_S), holds)[: DURATION_S * RATE_HZ]
    kernel = np.ones(RATE_HZ // 2) / (RATE_HZ // 2)
    return np.stack([np.convolve(one, kernel)[: DURATION_S * RATE_HZ] for one in (speed, turning)], axis=1)


def drive(spec, seed):
    """Poses (n, 3) and torques (n, 2), left and right, of a drive under proportional control."""
    rng, (model, data) = np.random.default_rng(seed), plant_of(spec)
    rows = []
    for speed, turning in references(rng):
        ahead, rate = speeds_of(model, data)
        force, moment = 2.5 * MASS_KG * (speed - ahead), 2.5 * INERTIA_KGM2 * (turning - rate)
        left, right = force - moment / HALF_TRACK_M, force + moment / HALF_TRACK_M
        torques = np.clip([RADIUS_M / 2 * left, RADIUS_M / 2 * right], -2, 2)
        rows.append([*pose_of(model, data), *torques])
        step(model, data, torques)
    rows = np.array(rows)
    rows[:, 2] = np.unwrap(rows[:, 2])
    rows[:, :3] += rng.normal(size=(len(rows), 3)) * (POSITION_SD_M, POSITION_SD_M, YAW_SD_RAD)
    return rows[:, :3], rows[:, 3:]


def record(path, poses, torques):
    """Write the log: pose, wheel torques, wheel radius and half the track."""
    t_ns = START_NS + np.arange(len(poses)) * (1_000_000_000 // RATE_HZ)
    unknown = np.full(len(poses), np.nan)
    robot = wr.RobotParameters(wheel_radius_m=RADIUS_M, half_track_m=HALF_TRACK_M)
    torque = wr.TorqueTrack(t_ns, *torques.T.copy(), unknown, unknown)
    write_mcap(wr.Log(wr.PoseTrack(t_ns, *poses.T.copy()), torque, robot=robot), path)


def stand_in(spec):
    """In place of a real robot: 2 kg heavier than its file says, with dry friction at its wheels."""
    weight = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [0.05, 0, 0], "mass": 2}
    spec.body("base").add_geom(**weight, contype=0, conaffinity=0)
    for name in ("left", "right"):
        spec.joint(name).frictionloss = 0.05


def replay(spec, log):
    """Distance of the engine from the log after 4 s from the log's motion, root mean square in m."""
    signals = wr.open_log(log).signals()
    poses = signals.pose.select("x_m", "y_m", "yaw_rad").to_numpy(writable=True)
    poses[:, 2] = np.unwrap(poses[:, 2])
    torques = signals.torque.select("left_nm", "right_nm").to_numpy()
    model, data = plant_of(spec)
    settled, errors, n = data.qpos.copy(), [], WINDOW_S * RATE_HZ
    for start in range(20, len(poses) - n, n):
        around = slice(start - 15, start + 16)
        slopes, (x, y, yaw) = np.polyfit(np.arange(-15, 16) / RATE_HZ, poses[around], 2)[1:]
        data.qpos[:], data.qvel[:] = settled, 0
        data.qpos[:2], data.qpos[3:7] = (x, y), (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))
        data.qvel[[0, 1, 5]] = slopes
        ahead = slopes[0] * np.cos(yaw) + slopes[1] * np.sin(yaw)
        for name, side in (("left", -1), ("right", 1)):
            data.joint(name).qvel[0] = (ahead + side * HALF_TRACK_M * slopes[2]) / RADIUS_M
        for row in range(start, start + n):
            step(model, data, torques[row])
        errors.append(np.hypot(*(pose_of(model, data)[:2] - poses[start + n, :2])))
    return float(np.sqrt(np.mean(np.square(errors))))


def main():
    """Drive or replay."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot", type=Path)
    parser.add_argument("log", type=Path, nargs="?")
    parser.add_argument("--stand-in", action="store_true")
    parser.add_argument("--replay", type=Path)
    options = parser.parse_args()
    spec = mujoco.MjSpec.from_file(str(options.robot))
    if options.stand_in:
        stand_in(spec)
    if options.replay:
        distance_mm = 1000 * replay(spec, options.replay)
        print(f"{options.robot}: {distance_mm:.0f} mm from the log after {WINDOW_S} s")
    else:
        record(options.log, *drive(spec, seed=int(options.stand_in)))


if __name__ == "__main__":
    main()
