"""The declarations of everything that the wheel-speed base can lack: the catalogue's effects, and terms."""

from wmr_schemas.effects import EffectDeclaration, effects_of
from wmr_schemas.effects.declaration import Channel, Parameter
from wmr_schemas.slip_terms import parse_slip_term
from wmr_schemas.terms import COEFFICIENT

CHANNEL_OF: dict[str, Channel] = {"v_long": "longitudinal", "v_lat": "lateral", "yaw_rate": "yaw"}
COEFFICIENT_STEP = 1e-3
"""Step of a coefficient, in which the motion is linear."""


class Declarations(dict[str, EffectDeclaration]):
    """The catalogue's effects by name; a term of the dictionary is declared when it is asked for, and is in
    no listing.
    """

    def __missing__(self, name: str) -> EffectDeclaration:
        """The declaration of a term. Raises InvalidTerm."""
        return term_declaration(name)


def term_declaration(name: str) -> EffectDeclaration:
    """A term with its one coefficient. Raises InvalidTerm."""
    term = parse_slip_term(name)
    return EffectDeclaration(
        name,
        CHANNEL_OF[term.channel],
        term.formula,
        {COEFFICIENT: Parameter(term.unit, COEFFICIENT_STEP)},
        acts_on="rolling",
        models=("wheel_speed",),
    )


DECLARED = Declarations(effects_of("wheel_speed"))
