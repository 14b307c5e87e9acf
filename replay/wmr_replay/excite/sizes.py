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


def sizes_tried(name: str, point: Parameters, ratio: float, each_way: int) -> list[Parameters]:
    """Sizes at which an effect that is not linear in its size is tried as a rival, ``ratio`` apart: the
    plausible one and ``each_way`` smaller and larger ones, within the bounds of a fit.
    """
    bounds, found = candidate_of(name).bounds, []
    for k in range(-each_way, each_way + 1):
        sizes = {key: ratio**k * value for key, value in point.items()}
        if all(low <= sizes[key] <= high for key, (low, high) in bounds.items()):
            found.append(sizes)
    return found or [point]
