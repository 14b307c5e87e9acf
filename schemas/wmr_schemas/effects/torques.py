"""Effects between the commanded torque and the torque that acts."""

from wmr_schemas.effects.declaration import (
    BOTH,
    INFINITE,
    Domain,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
    Separable,
)
from wmr_schemas.effects.manoeuvres import Manoeuvre

EFFECTS = (
    EffectDeclaration(
        "torque_imbalance",
        "input",
        "right·(1 + ratio), left·(1 − ratio)",
        {"ratio": Parameter("1", 1e-4, -0.9, 0.9, "at 1 one wheel has no torque at all: a broken drive")},
        acts_on="efforts",
        number=11,
        ranges={"ratio": Range(0.05, 0.2, signed=True)},
        relevant=0.15,
    ),
    EffectDeclaration(
        "torque_bias_common",
        "input",
        "u + bias on both wheels",
        {"bias_nm": Parameter("N·m", 1e-4)},
        acts_on="efforts",
        number=12,
        ranges={"bias_nm": Range(0.06, 0.25, signed=True, scale="both_wheels")},
    ),
    EffectDeclaration(
        "torque_bias_differential",
        "input",
        "right + bias, left − bias",
        {"bias_nm": Parameter("N·m", 1e-4)},
        acts_on="efforts",
        number=13,
        ranges={"bias_nm": Range(0.05, 0.2, signed=True, scale="turning")},
    ),
    EffectDeclaration(
        "actuator_lag",
        "input",
        "u / (T·s + 1)",
        {
            "time_constant_s": Parameter(
                "s",
                2e-3,
                1e-3,
                2.0,
                "1 ms is below every log's resolution; a lag of 2 s is no actuator",
                domain=Domain.NOT_NEGATIVE,
            )
        },
        acts_on="efforts",
        models=BOTH,
        needs_commands=True,
        wheel_speed_formula="commanded wheel speeds / (T·s + 1)",
        number=14,
        search=Search(grid=(0.03, 0.06, 0.1, 0.16, 0.25, 0.4)),
        ranges={"time_constant_s": Range(0.05, 0.25)},
        separable=(Separable(("input_delay",), Manoeuvre.STEPS),),
        other_forms=("input_delay",),
        relevant=0.15,
    ),
    EffectDeclaration(
        "input_delay",
        "input",
        "u(t − delay)",
        {
            "delay_s": Parameter(
                "s",
                2e-3,
                -0.5,
                1.0,
                "clocks that differ by more are found before; negative where the pose's clock lags",
                domain=Domain.NOT_NEGATIVE,
            )
        },
        acts_on="efforts",
        models=BOTH,
        needs_commands=True,
        wheel_speed_formula="commanded wheel speeds, of t − delay",
        number=15,
        search=Search(grid=(-0.1, -0.05, 0.03, 0.06, 0.1, 0.15, 0.22, 0.3)),
        ranges={"delay_s": Range(0.05, 0.2)},
        exact=(
            Exact(("input_delay", "pose_clock_offset"), driven_by=("torque",)),
            Exact(("input_delay", "pose_delay", "pose_clock_offset"), driven_by=("command",)),
        ),
        relevant=0.15,
    ),
    EffectDeclaration(
        "torque_deadzone",
        "input",
        "sgn(u)·max(|u| − threshold, 0)",
        {
            "threshold_nm": Parameter(
                "N·m", 1e-3, 0.0, INFINITE, "a threshold is never below 0", domain=Domain.NOT_NEGATIVE
            )
        },
        acts_on="efforts",
        number=16,
        search=Search(grid=(0.05, 0.1, 0.2, 0.35, 0.5, 0.8), grid_unit="typical_effort"),
        ranges={"threshold_nm": Range(0.1, 0.4, scale="both_wheels")},
    ),
    EffectDeclaration(
        "torque_saturation",
        "input",
        "clip(u, −limit, limit)",
        {
            "limit_nm": Parameter(
                "N·m", 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO
            )
        },
        acts_on="efforts",
        number=17,
        search=Search(
            grid=(0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.6, 0.75, 0.9, 0.96), grid_unit="largest_effort"
        ),
        ranges={"limit_nm": Range(0.5, 0.9, scale="both_wheels")},
        zero_is_absent=False,
    ),
)
