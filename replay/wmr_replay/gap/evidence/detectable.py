"""The smallest size of each effect that the log would have shown, and whether it excites them at all."""

from collections.abc import Mapping

import numpy as np
from scipy.stats import norm

from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.result.result import Detectable
from wmr_replay.gap.search.scan import Scanned
from wmr_schemas.effects import EFFECTS

LEVEL, POWER = 0.01, 0.9


def minimum_detectable(scanned: Scanned) -> Mapping[str, Detectable]:
    """Size at which a test at 1 %, corrected for everything scanned, finds an effect nine times in ten:
    (z₁ + z₂)/√(ψᵀψ), with the other effects of the model projected out; for a grid's effect, by its smallest
    point.
    """
    tried = sum(lead.tried for lead in scanned.leads)
    z = float(norm.isf(LEVEL / tried / 2) + norm.isf(1 - POWER))
    found = {}
    for name, (value, information) in scanned.unit_information.items():
        effect = candidate_of(name).declaration
        if effect.zero_is_absent and information > 0:
            unit = next(iter(effect.units.values()))
            found[name] = Detectable(abs(value) * z / float(np.sqrt(information)), unit)
    return found


def unseen(detectable: Mapping[str, Detectable]) -> tuple[str, ...]:
    """Effects of a size that matters which the log would not have shown."""
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.relevant is not None
        and (name not in detectable or detectable[name].value > effect.relevant)
    )
