"""A robot of an MJCF file: its specification, and what a data sheet and a compiled model say of it."""

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from wmr_schemas.arrays import F64
from wmr_schemas.robot import RobotParameters

ROBOTS = Path(__file__).with_name("robots")
FOUR_WHEELED = ("rover",)
BY_WHEELS = "-wheels"
"""Ending of the name of a two-wheeled robot that records wheel speeds, and no torques."""
GRAVITY_MPS2 = 9.81


@dataclass(frozen=True, eq=False)
class Robot:
    """Dimensions and inertias without any hidden effect.

    ``mass_kg`` and ``yaw_inertia_kgm2`` are those that the driving forces see, with the wheels' inertia in
    them: m + Σ I_φ/r² and I_θ + Σ l² I_φ/r². ``centre_m`` (3,) is the centre of mass of the base body in its
    frame, whose origin is the middle of the axle. ``weight_n`` is the whole robot's. ``wide_tyres`` are flat
    across: they scrub in turns.
    """

    name: str
    wheel_radius_m: float
    half_track_m: float
    mass_kg: float
    yaw_inertia_kgm2: float
    centre_m: F64
    weight_n: float
    wide_tyres: bool

    @property
    def four_wheeled(self) -> bool:
        """Whether it turns against the scrub of its tyres."""
        return self.name in FOUR_WHEELED

    @property
    def by_wheels(self) -> bool:
        """Whether it records wheel speeds, which drive its base model, and no torques."""
        return self.four_wheeled or self.name.endswith(BY_WHEELS)

    @property
    def alpha(self) -> float:
        """dv_long/dt by the sum of the torques."""
        return 1 / (self.wheel_radius_m * self.mass_kg)

    @property
    def alpha_yaw(self) -> float:
        """l·dyaw_rate/dt by right minus left."""
        return self.half_track_m**2 / (self.wheel_radius_m * self.yaw_inertia_kgm2)

    @property
    def data_sheet(self) -> RobotParameters:
        """What the owner knows: wheel radius and half the track."""
        return RobotParameters(wheel_radius_m=self.wheel_radius_m, half_track_m=self.half_track_m)


def spec_of(name: str) -> mujoco.MjSpec:
    """The robot's specification, to be changed and compiled."""
    return mujoco.MjSpec.from_file(str(ROBOTS / f"{name.removesuffix(BY_WHEELS)}.xml"))


def robot_of(name: str) -> Robot:
    """The robot as its file has it."""
    model = spec_of(name).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    tyre, wheel = model.geom("left tyre"), model.body(model.geom("left tyre").bodyid[0])
    radius, half_track = float(tyre.size[0]), float(wheel.pos[1])
    driven = [
        model.jnt_dofadr[k] for k in range(model.njnt) if model.joint(k).name.startswith(("left", "right"))
    ]
    turning = sum(inertia[k, k] for k in driven) / radius**2
    return Robot(
        name=name,
        wheel_radius_m=radius,
        half_track_m=half_track,
        mass_kg=float(inertia[0, 0] + turning),
        yaw_inertia_kgm2=float(inertia[5, 5] + turning * half_track**2),
        centre_m=model.body("base").ipos.copy(),
        weight_n=float(inertia[0, 0] * GRAVITY_MPS2),
        wide_tyres=bool(model.geom_type[tyre.id] == mujoco.mjtGeom.mjGEOM_CYLINDER),
    )
