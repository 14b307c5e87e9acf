"""Plausible sizes of effects: those of a result, else the smallest that ``synth --hide`` draws."""

from collections.abc import Mapping

from wmr_replay.gap.model.candidates import candidate_of, declaration_of
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.effects import EffectDeclaration, Range

Parameters = dict[str, float]


def points_of(name: str, extension: Extension, given: Mapping[str, float] | None) -> list[Parameters]:
    """The points at which an effect is simulated, one for each direction of its signature.

    The parameters of a vector, such as a slope's, are unknown in their direction: one point each.
    """
    declaration = declaration_of(name)
    if declaration.vector is None:
        return [dict(given) if given else smallest(declaration, extension)]
    length = sum(value**2 for value in given.values()) ** 0.5 if given else 0.0
    length = length or declaration.ranges[declaration.vector[0]].low
    return [{key: length if key == one else 0.0 for key in declaration.vector} for one in declaration.vector]


def smallest(declaration: EffectDeclaration, extension: Extension) -> Parameters:
    """The weakest effect of the documented ranges; without one, ten steps of a difference quotient."""
    found = {key: 10 * parameter.step for key, parameter in declaration.parameters.items()}
    for key, within in declaration.ranges.items():
        end = within.low if declaration.zero_is_absent else within.high
        found[key] = end * scale_of(within, extension)
    return found


def scale_of(within: Range, extension: Extension) -> float:
    """What a number of the range is multiplied with to have the parameter's unit."""
    base = extension.base
    return {
        "": 1.0,
        "both_wheels": 1 / (2 * base.alpha),
        "turning": 1 / (2 * base.alpha_yaw),
        "wheel_speed": extension.wheel_radius_m / (2 * base.alpha),
        "duration": 1.0,
    }[within.scale]


def rivals_of(name: str, points: list[Parameters], shares: tuple[float, ...]) -> list[list[Parameters]]:
    """Groups of points whose signatures together stand for the effect at any size.

    An effect that is linear in its size is one group; another has a group for each of several sizes.
    """
    candidate = candidate_of(name)
    if not candidate.grid:
        return [points]
    bounded = []
    for share in shares:
        sizes = {key: share * value for key, value in points[0].items()}
        inside = all(low <= sizes[key] <= high for key, (low, high) in candidate.bounds.items())
        bounded += [[sizes]] if inside else []
    return bounded or [points]
