"""The smallest size of each effect that the log would have shown."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.result.result import Detectable
from wmr_replay.gap.scan.misfit import floor_of
from wmr_replay.gap.scan.scan import LibraryScan
from wmr_replay.gap.settings.result import DetectableSettings
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.effects import EffectDeclaration, named_of


def minimum_detectable(
    scanned: LibraryScan, settings: DetectableSettings, answers: Mapping[str, float] | None = None
) -> Mapping[str, Detectable]:
    """Size at which a test at 1 %, corrected for everything scanned, finds an effect in nine logs of ten.

    (z₁ + z₂)/√(ΨᵀΨ), with the other effects of the model projected out; for an effect on a grid, by the point
    that is seen best. ``answers`` are the scores that a controller's answer makes of lags at that point, to
    be exceeded by that much. Infinite where no size within the effect's own bounds would be seen. Effects
    whose size is no distance from the base model are left out.
    """
    n_tried = max(sum(one.n_tried for one in scanned.scored), 1)
    z = float(-ndtri(settings.level / n_tried / 2) - ndtri(1 - settings.power))
    found = {}
    for name, (value, information) in scanned.unit_information.items():
        effect = candidate_of(name).declaration
        if effect.zero_is_absent and information > 0:
            unit = next(iter(effect.units.values()))
            root = float(np.sqrt(information))
            least = abs(value) * (z + (answers or {}).get(name, 0.0) / root) / root
            found[name] = Detectable(least if least <= largest_size(effect) else float("inf"), unit)
    return found


def largest_size(effect: EffectDeclaration) -> float:
    """The larger absolute bound of the effect's first parameter, its size."""
    return max(map(abs, next(iter(effect.bounds.values()))))


def unseen(detectable: Mapping[str, Detectable]) -> tuple[str, ...]:
    """Effects of a relevant size that the log would not have shown."""
    return tuple(
        name
        for name, effect in named_of("torque").items()
        if effect.relevant is not None
        and (name not in detectable or detectable[name].value > effect.relevant)
    )


def beyond_rests(
    detectable: Mapping[str, Detectable], extension: Extension, own: MisfitSettings
) -> Mapping[str, Detectable]:
    """The sizes, no smaller than what is a rest of the base model: that much is no finding, however well the
    log shows it.
    """
    return {
        name: replace(least, value=max(least.value, floor_of(name, extension, own)))
        for name, least in detectable.items()
    }
