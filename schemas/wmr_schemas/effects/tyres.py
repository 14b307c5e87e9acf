"""Effects on the lateral force of the tyres."""

from wmr_schemas.effects.declaration import Domain, EffectDeclaration, Exact, Parameter, Range, Search
from wmr_schemas.modes import ContactMode

EFFECTS = (
    EffectDeclaration(
        "cornering_stiffness",
        "lateral",
        "G_x·(1 + ratio)",
        {
            "ratio": Parameter(
                "1",
                1e-3,
                -0.95,
                20.0,
                "−0.95 leaves a twentieth: the skid hardly decays; at 21 times it is over within a bin",
                domain=Domain.ABOVE_MINUS_ONE,
            )
        },
        acts_on="tyre",
        number=21,
        taken_for=ContactMode.SKIDDING,
        search=Search(clipped=True),
        ranges={"ratio": Range(0.25, 0.5, signed=True)},
        exact=(Exact(("cornering_stiffness", "epsilon", "lateral_mass")),),
    ),
    EffectDeclaration(
        "undeclared_skid",
        "lateral",
        "the skidding dynamics while the mode says ideal",
        {
            "stiffness_ratio": Parameter(
                "1",
                1e-2,
                0.02,
                100.0,
                "below 0.02 the skid does not decay within a log; above 100 it is no skid",
                domain=Domain.ABOVE_ZERO,
            )
        },
        acts_on="tyre",
        number=25,
        followed=True,
        taken_for=ContactMode.SKIDDING,
        search=Search(starts=(0.2, 0.4, 0.8, 1.6, 3.2)),
        ranges={"stiffness_ratio": Range(0.4, 1.2)},
        zero_is_absent=False,
    ),
)
