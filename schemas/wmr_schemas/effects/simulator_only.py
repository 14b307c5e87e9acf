"""Effects that only the simulator has: no candidate names them, no model file holds them."""

from wmr_schemas.effects.declaration import EffectDeclaration, Parameter, Range

EFFECTS = (
    EffectDeclaration(
        "wheel_eccentricity",
        "both",
        "½·amplitude·sin(wheel angle), each wheel",
        {"amplitude_mps2": Parameter("m/s²", 1e-4)},
        acts_on="acceleration",
        number=27,
        ranges={"amplitude_mps2": Range(0.1, 0.3)},
    ),
)
