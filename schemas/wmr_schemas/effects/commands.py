"""Effects between the commanded and the actual wheel speeds, where commands drive the wheel-speed base.

Speeds of a wheel are those of its rim, r·φ̇ with the nominal radius.
"""

from wmr_schemas.effects.declaration import (
    INFINITE,
    WHEEL_SPEED,
    Channel,
    Domain,
    EffectDeclaration,
    Exact,
    Parameter,
    Range,
    Search,
)


def limit(
    number: int,
    name: str,
    channel: Channel,
    formula: str,
    parameter: tuple[str, str],
    *,
    grid: tuple[float, ...],
    drawn: tuple[float, float],
) -> EffectDeclaration:
    """A limit of a drive: its parameter's name and unit, where it is sought, and what is drawn for it."""
    key, unit = parameter
    bound = Parameter(unit, 1e-3, 0.0, INFINITE, "a limit is never below 0", domain=Domain.ABOVE_ZERO)
    return EffectDeclaration(
        name,
        channel,
        formula,
        {key: bound},
        acts_on="commands",
        number=number,
        models=WHEEL_SPEED,
        search=Search(grid=grid),
        ranges={key: Range(*drawn)},
        zero_is_absent=False,
        needs_commands=True,
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
    limit(
        40,
        "speed_saturation",
        "input",
        "clip(u, −limit, limit), each wheel",
        ("limit_mps", "m/s"),
        grid=(0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6),
        drawn=(0.6, 1.0),
    ),
    limit(
        42,
        "turn_saturation",
        "yaw",
        "clip(commanded yaw rate, −limit, limit)",
        ("limit_radps", "rad/s"),
        grid=(0.2, 0.3, 0.45, 0.6, 0.9, 1.3, 1.8, 2.5, 3.5),
        drawn=(0.3, 0.6),
    ),
    limit(
        43,
        "speed_desaturation",
        "input",
        "u·min(1, limit/max(|left|, |right|)), both wheels by one factor",
        ("limit_mps", "m/s"),
        grid=(0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3, 1.6),
        drawn=(0.6, 1.0),
    ),
    limit(
        41,
        "acceleration_limit",
        "input",
        "|du/dt| ≤ limit, each wheel",
        ("limit_mps2", "m/s²"),
        grid=(0.15, 0.25, 0.4, 0.6, 1.0, 1.5, 2.5),
        drawn=(0.3, 0.8),
    ),
    limit(
        44,
        "turn_acceleration_limit",
        "yaw",
        "|d(commanded yaw rate)/dt| ≤ limit",
        ("limit_radps2", "rad/s²"),
        grid=(0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 5.0),
        drawn=(0.3, 0.8),
    ),
)
