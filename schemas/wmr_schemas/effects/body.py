"""Forces on the body that are no resistance: gravity on a slope, a centre of mass off the axle."""

from wmr_schemas.effects.declaration import EffectDeclaration, Parameter, Range, Separable
from wmr_schemas.effects.manoeuvres import Manoeuvre

EFFECTS = (
    EffectDeclaration(
        "slope",
        "both",
        "grade_x·cos(yaw) + grade_y·sin(yaw)",
        {"grade_x_mps2": Parameter("m/s²", 1e-4), "grade_y_mps2": Parameter("m/s²", 1e-4)},
        acts_on="acceleration",
        number=10,
        ranges={"grade_x_mps2": Range(0.1, 0.5), "grade_y_mps2": Range(0.1, 0.5)},
        vector=("grade_x_mps2", "grade_y_mps2"),
        separable=(Separable(("torque_bias_common",), Manoeuvre.HEADINGS),),
    ),
    EffectDeclaration(
        "com_offset",
        "both",
        "d·yaw_rate² on dv_long/dt, −(l·m·d/I)·v·yaw_rate on l·yaw_acc",
        {"offset_m": Parameter("m", 1e-4)},
        acts_on="acceleration",
        number=18,
        ranges={"offset_m": Range(0.01, 0.03, signed=True)},
        separable=(Separable(("yaw_damping",), Manoeuvre.TURNING),),
        relevant=0.05,
    ),
)
