"""Effects between the commanded and the actual wheel speeds, where commands drive the wheel-speed base.

Speeds of a wheel are those of its rim, r·φ̇ with the nominal radius.
"""

from wmr_schemas.effects.declaration import (
    INFINITE,
    WHEEL_SPEED,
    Domain,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
)

EFFECTS = (
    EffectDeclaration(
        "turn_gain",
        "yaw",
        "commanded difference of the wheel speeds·(1 + ratio)",
        {
            "ratio": Parameter(
                "1", 1e-3, -0.9, 9.0, "−0.9 leaves a tenth of the turning", domain=Domain.ABOVE_MINUS_ONE
            )
        },
        acts_on="commands",
        number=38,
        models=WHEEL_SPEED,
        ranges={"ratio": Range(0.1, 0.3, signed=True)},
        exact=(Exact(("turn_gain", "effective_track", "half_track"), driven_by=("command",)),),
        relevant=0.05,
        needs_commands=True,
    ),
    EffectDeclaration(
        "speed_deadzone",
        "input",
        "sgn(u)·max(|u| − threshold, 0), each wheel",
        {
            "threshold_mps": Parameter(
                "m/s", 1e-3, 0.0, INFINITE, "a threshold is never below 0", domain=Domain.NOT_NEGATIVE
            )
        },
        acts_on="commands",
        number=39,
        models=WHEEL_SPEED,
        search=Search(grid=(0.02, 0.05, 0.1, 0.15, 0.2, 0.3)),
        ranges={"threshold_mps": Range(0.03, 0.15)},
        needs_commands=True,
    ),
    EffectDeclaration(
        "speed_saturation",
        "input",
        "clip(u, −limit, limit), each wheel",
        {
            "limit_mps": Parameter(
                "m/s", 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO
            )
        },
        acts_on="commands",
        number=40,
        models=WHEEL_SPEED,
        search=Search(grid=(0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6)),
        ranges={"limit_mps": Range(0.6, 1.0)},
        zero_is_absent=False,
        needs_commands=True,
    ),
    EffectDeclaration(
        "turn_saturation",
        "yaw",
        "clip(commanded yaw rate, −limit, limit)",
        {
            "limit_radps": Parameter(
                "rad/s", 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO
            )
        },
        acts_on="commands",
        number=42,
        models=WHEEL_SPEED,
        search=Search(grid=(0.2, 0.3, 0.45, 0.6, 0.9, 1.3, 1.8, 2.5, 3.5)),
        ranges={"limit_radps": Range(0.3, 0.6)},
        zero_is_absent=False,
        needs_commands=True,
    ),
    EffectDeclaration(
        "speed_desaturation",
        "input",
        "u·min(1, limit/max(|left|, |right|)), both wheels by one factor",
        {
            "limit_mps": Parameter(
                "m/s", 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO
            )
        },
        acts_on="commands",
        number=43,
        models=WHEEL_SPEED,
        search=Search(grid=(0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6)),
        ranges={"limit_mps": Range(0.6, 1.0)},
        zero_is_absent=False,
        needs_commands=True,
    ),
    EffectDeclaration(
        "acceleration_limit",
        "input",
        "|du/dt| ≤ limit, each wheel",
        {
            "limit_mps2": Parameter(
                "m/s²", 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO
            )
        },
        acts_on="commands",
        number=41,
        models=WHEEL_SPEED,
        search=Search(grid=(0.15, 0.25, 0.4, 0.6, 1.0, 1.5, 2.5)),
        ranges={"limit_mps2": Range(0.3, 0.8)},
        zero_is_absent=False,
        needs_commands=True,
    ),
    EffectDeclaration(
        "turn_acceleration_limit",
        "yaw",
        "|d(commanded yaw rate)/dt| ≤ limit",
        {
            "limit_radps2": Parameter(
                "rad/s²", 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO
            )
        },
        acts_on="commands",
        number=44,
        models=WHEEL_SPEED,
        search=Search(grid=(0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 5.0)),
        ranges={"limit_radps2": Range(0.3, 0.8)},
        zero_is_absent=False,
        needs_commands=True,
    ),
)
