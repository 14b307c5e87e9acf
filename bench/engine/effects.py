"""The engine's own mechanism of each effect: an edit of the MJCF specification, or a change while it runs.

Sizes are drawn by what they do to the motion, small to clear, in m/s² or as ratios; ``Hidden.sizes`` says
what the engine was given.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import mujoco
import numpy as np

from engine.robot import GRAVITY_MPS2, Robot
from wmr_schemas.arrays import F64

Rng = np.random.Generator
Sizes = dict[str, float]
SIDES = (("left", -1.0), ("right", 1.0))
FILTERS = (mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
PATCH_TOP_M = 0.0005
"""A sheet on the ground: lower than what a tyre of the engine gives way."""


@dataclass(frozen=True, eq=False)
class Hidden:
    """A changed world: its specification, and what acts beside it.

    ``dead_zone_nm`` is the motor driver's; ``load`` a weight in kg from a time in s on; ``late_s`` how old a
    pose is when it is stamped.
    """

    spec: mujoco.MjSpec
    sizes: Sizes
    dead_zone_nm: float = 0.0
    load: tuple[float, float] | None = None
    late_s: float = 0.0


@dataclass(frozen=True, eq=False)
class World:
    """What an edit gets: the specification to change, the robot, draws, and where the robot drives.

    ``places_m`` (n, 2) are places that the robot reaches under torque; ``duration_s`` is the log's.
    """

    spec: mujoco.MjSpec
    robot: Robot
    rng: Rng
    duration_s: float
    places_m: F64 = field(default_factory=lambda: np.zeros((1, 2)))

    def size(self, low: float, high: float) -> float:
        """A size drawn on a logarithmic scale."""
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def signed(self, low: float, high: float) -> float:
        """The same, of either sign."""
        return float(self.rng.choice((-1.0, 1.0))) * self.size(low, high)

    @property
    def wheel_nm_by_mps2(self) -> float:
        """Torque of each wheel by acceleration ahead."""
        return 1 / (2 * self.robot.alpha)

    def joints(self) -> list[mujoco.MjsJoint]:
        """The joints of the driven wheels."""
        return [joint for joint in self.spec.joints if joint.name.startswith(("left", "right"))]

    def tyres(self) -> list[tuple[mujoco.MjsGeom, float]]:
        """The tyres with their side, −1 left and 1 right."""
        named = [geom for geom in self.spec.geoms if geom.name.endswith("tyre")]
        return [(geom, 1.0 if geom.name.startswith("right") else -1.0) for geom in named]

    def weight(self, mass_kg: float, ahead_m: float = 0.0, size_m: float = 0.05) -> None:
        """A weight at the base's centre of mass, or ahead of it."""
        place = self.robot.centre_m + np.array([ahead_m, 0.0, 0.0])
        self.spec.body("base").add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[size_m, 0, 0],
            pos=place.tolist(),
            mass=mass_kg,
            contype=0,
            conaffinity=0,
        )


Edit = Callable[[World], Hidden]


def nothing(world: World) -> Hidden:
    """The robot as its file has it."""
    return Hidden(world.spec, {})


def payload(world: World) -> Hidden:
    """A weight at the centre of mass."""
    ratio = world.size(0.06, 0.5)
    world.weight(ratio * world.robot.mass_kg)
    return Hidden(world.spec, {"mass_ratio": ratio})


def load_step(world: World) -> Hidden:
    """A weight at the centre of mass, from a time on."""
    ratio, t0_s = world.size(0.12, 0.5), float(world.rng.uniform(0.2, 0.6) * world.duration_s)
    sizes = {"mass_ratio": ratio, "t0_s": t0_s}
    return Hidden(world.spec, sizes, load=(ratio * world.robot.mass_kg, t0_s))


def yaw_inertia(world: World) -> Hidden:
    """A part of the chassis's mass, moved outwards: the mass stays."""
    ratio = world.size(0.1, 0.4)
    chassis = world.spec.geom("chassis")
    arm_m, gyration2 = 1.5 * chassis.size[0], (chassis.size[0] ** 2 + chassis.size[1] ** 2) / 3
    each_kg = ratio * world.robot.yaw_inertia_kgm2 / (2 * (arm_m**2 - gyration2))
    chassis.mass -= 2 * each_kg
    for side in (-1.0, 1.0):
        world.weight(each_kg, side * arm_m, 0.02)
    return Hidden(world.spec, {"ratio": ratio})


def friction_loss(world: World) -> Hidden:
    """Dry friction of the wheel joints."""
    torque_nm = world.size(0.04, 0.3) * world.wheel_nm_by_mps2
    for joint in world.joints():
        joint.frictionloss = torque_nm
    return Hidden(world.spec, {"torque_nm": torque_nm})


def joint_damping(world: World) -> Hidden:
    """Viscous friction of the wheel joints."""
    rate_per_s = world.size(0.04, 0.3)
    damping = rate_per_s * world.wheel_nm_by_mps2 * world.robot.wheel_radius_m
    for joint in world.joints():
        joint.damping = [damping, 0.0, 0.0]
    return Hidden(world.spec, {"nm_per_radps": damping, "c1_per_s": rate_per_s})


def fluid_viscosity(world: World) -> Hidden:
    """A viscous medium."""
    rate_per_s = world.size(0.04, 0.3)
    world.spec.option.viscosity = 1.0
    world.spec.option.viscosity = rate_per_s * world.robot.mass_kg / drag_n(world.spec)
    return Hidden(world.spec, {"c1_per_s": rate_per_s})


def fluid_density(world: World) -> Hidden:
    """A dense medium: drag by the square of the speed."""
    per_m = world.size(0.04, 0.3)
    world.spec.option.density = 1.0
    world.spec.option.density = per_m * world.robot.mass_kg / drag_n(world.spec)
    return Hidden(world.spec, {"c2_per_m": per_m})


def drag_n(spec: mujoco.MjSpec) -> float:
    """The medium's force on the robot at 1 m/s ahead, joints at rest."""
    model = spec.copy().compile()
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    mujoco.mj_forward(model, data)
    return -float(data.qfrc_fluid[0])


def scrub(world: World) -> Hidden:
    """Torsional friction of the tyres."""
    robot, size = world.robot, world.size(0.03, 0.2)
    torque_nm = size * robot.yaw_inertia_kgm2 / robot.half_track_m
    for tyre, _ in world.tyres():
        tyre.condim = 4
        tyre.friction = [tyre.friction[0], torque_nm / robot.weight_n, 0.0]
    return Hidden(world.spec, {"d0_mps2": size})


def tilted_gravity(world: World) -> Hidden:
    """Ground that rises: gravity is tilted."""
    size, angle = world.size(0.05, 0.5), world.rng.uniform(0, 2 * np.pi)
    x, y = float(size * np.cos(angle)), float(size * np.sin(angle))
    world.spec.option.gravity = [x, y, -float(np.sqrt(GRAVITY_MPS2**2 - size**2))]
    return Hidden(world.spec, {"grade_x_mps2": x, "grade_y_mps2": y})


def geared(world: World, left: float, right: float) -> None:
    """Other gears of the two motors."""
    for name, ratio in (("left", left), ("right", right)):
        gear = list(world.spec.actuator(name).gear)
        world.spec.actuator(name).gear = [gear[0] * ratio, *gear[1:]]


def gear(world: World) -> Hidden:
    """Both gears larger or smaller."""
    ratio = world.signed(0.06, 0.35)
    geared(world, 1 + ratio, 1 + ratio)
    return Hidden(world.spec, {"ratio": ratio})


def gear_imbalance(world: World) -> Hidden:
    """One gear larger, the other smaller."""
    ratio = world.signed(0.03, 0.2)
    geared(world, 1 - ratio, 1 + ratio)
    return Hidden(world.spec, {"ratio": ratio})


def biased(world: World, left_nm: float, right_nm: float) -> None:
    """A torque that acts without a command."""
    for name, bias_nm in (("left", left_nm), ("right", right_nm)):
        actuator = world.spec.actuator(name)
        actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        actuator.biasprm = [bias_nm, *[0.0] * (len(actuator.biasprm) - 1)]


def bias_common(world: World) -> Hidden:
    """The same bias on both motors."""
    bias_nm = world.signed(0.03, 0.25) * world.wheel_nm_by_mps2
    biased(world, bias_nm, bias_nm)
    return Hidden(world.spec, {"bias_nm": bias_nm})


def bias_differential(world: World) -> Hidden:
    """A bias that turns the robot."""
    bias_nm = world.signed(0.03, 0.2) / (2 * world.robot.alpha_yaw)
    biased(world, -bias_nm, bias_nm)
    return Hidden(world.spec, {"bias_nm": bias_nm})


def activation(world: World) -> Hidden:
    """First-order activation dynamics of both motors, on top of a lag of the robot's own."""
    time_s = world.size(0.04, 0.25)
    for actuator in world.spec.actuators:
        own_s = float(actuator.dynprm[0]) if actuator.dyntype in FILTERS else 0.0
        actuator.dyntype = mujoco.mjtDyn.mjDYN_FILTEREXACT
        actuator.dynprm = [own_s + time_s, *[0.0] * (len(actuator.dynprm) - 1)]
    return Hidden(world.spec, {"time_constant_s": time_s})


def delay(world: World) -> Hidden:
    """The actuators' own delay, a multiple of the time step."""
    step_s = world.spec.option.timestep
    steps = max(round(world.size(0.03, 0.15) / step_s), 1)
    for actuator in world.spec.actuators:
        actuator.delay, actuator.nsample = steps * step_s, steps + 1
    return Hidden(world.spec, {"delay_s": steps * step_s})


def dead_zone(world: World) -> Hidden:
    """Torques below a threshold stay in the motor driver."""
    threshold_nm = world.size(0.06, 0.4) * world.wheel_nm_by_mps2
    return Hidden(world.spec, {"threshold_nm": threshold_nm}, dead_zone_nm=threshold_nm)


def force_range(world: World) -> Hidden:
    """Motors that can do less."""
    limit_nm = world.size(0.3, 0.7) * world.wheel_nm_by_mps2
    for actuator in world.spec.actuators:
        actuator.forcelimited, actuator.forcerange = True, [-limit_nm, limit_nm]
    return Hidden(world.spec, {"limit_nm": limit_nm})


def site_moved(world: World) -> Hidden:
    """The pose is that of a point off the axle's middle."""
    size, angle = world.size(0.03, 0.3), world.rng.uniform(0, 2 * np.pi)
    if world.robot.four_wheeled:
        angle = 0.0 if angle < np.pi else np.pi
    x, y = float(size * np.cos(angle)), float(size * np.sin(angle))
    world.spec.site("pose").pos = [x, y, 0.0]
    return Hidden(world.spec, {"x_m": x, "y_m": y})


def site_turned(world: World) -> Hidden:
    """The pose's heading is not the robot's."""
    angle = world.signed(0.01, 0.1)
    world.spec.site("pose").quat = [float(np.cos(angle / 2)), 0.0, 0.0, float(np.sin(angle / 2))]
    return Hidden(world.spec, {"angle_rad": angle})


def centre_of_mass(world: World) -> Hidden:
    """The chassis sits further ahead or back."""
    offset_m = world.signed(0.04, 0.1) if world.robot.four_wheeled else world.signed(0.006, 0.03)
    chassis = world.spec.geom("chassis")
    moved = offset_m * world.robot.weight_n / GRAVITY_MPS2 / chassis.mass
    chassis.pos = [chassis.pos[0] + moved, *chassis.pos[1:]]
    return Hidden(world.spec, {"offset_m": offset_m})


def slick_patch(world: World) -> Hidden:
    """A thin sheet with little friction on the ground."""
    x, y = world.places_m[int(world.rng.integers(len(world.places_m)))]
    radius_m, friction = float(world.rng.uniform(0.5, 1.2)), world.size(0.04, 0.12)
    world.spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[radius_m, radius_m, 0.05],
        pos=[float(x), float(y), PATCH_TOP_M - 0.05],
        friction=[friction, 0.0, 0.0],
        priority=2,
        condim=3,
        solref=[0.008, 1.0],
    )
    return Hidden(world.spec, {"x_m": float(x), "y_m": float(y), "radius_m": radius_m, "friction": friction})


def resized(world: World, left: float, right: float) -> None:
    """Other radii of the tyres."""
    for tyre, side in world.tyres():
        ratio = right if side > 0 else left
        wide = tyre.type == mujoco.mjtGeom.mjGEOM_CYLINDER  # its second size is half its width
        tyre.size = [tyre.size[0] * ratio, tyre.size[1] * (1.0 if wide else ratio), tyre.size[2]]


def wheel_size(world: World) -> Hidden:
    """All wheels larger or smaller."""
    ratio = world.signed(0.01, 0.05)
    resized(world, 1 + ratio, 1 + ratio)
    return Hidden(world.spec, {"ratio": ratio})


def wheel_size_difference(world: World) -> Hidden:
    """The right wheels larger, the left ones smaller."""
    ratio = world.signed(0.003, 0.02)
    resized(world, 1 - ratio, 1 + ratio)
    return Hidden(world.spec, {"ratio": ratio})


def track(world: World) -> Hidden:
    """Wheels further apart or closer."""
    ratio = world.signed(0.03, 0.15)
    for body in world.spec.bodies:
        if body.name.startswith(("left", "right")):
            body.pos = [body.pos[0], body.pos[1] * (1 + ratio), body.pos[2]]
    return Hidden(world.spec, {"ratio": ratio})


def late_pose(world: World) -> Hidden:
    """Poses stamped later than they were."""
    late_s = round(world.size(0.02, 0.15), 2)
    return Hidden(world.spec, {"delay_s": late_s}, late_s=late_s)


EDITS: dict[str, Edit] = {
    edit.__name__: edit
    for edit in (
        payload, yaw_inertia, friction_loss, joint_damping, fluid_viscosity, fluid_density, scrub,
        tilted_gravity, gear, gear_imbalance, bias_common, bias_differential, activation, delay, dead_zone,
        force_range, site_moved, site_turned, centre_of_mass, slick_patch, load_step, wheel_size,
        wheel_size_difference, track, late_pose,
    )
}  # fmt: skip
"""Every edit by its name in ``accepted.toml``."""
