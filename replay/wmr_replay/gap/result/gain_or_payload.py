"""A payload or a drive gain, of a robot whose calibration does not show how its torques turn it.

Ahead, a payload p and a gain g = 1/(1 + p) − 1 are the same. In turning they differ by a yaw inertia of that
ratio: a load at the centre of mass leaves it as it is. Where α_yaw may be off by more, either may be the
other.
"""

from dataclasses import replace

from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.misfit import turning_is_unknown
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.settings.scan import MisfitSettings

TWIN = {"payload": "drive_gain", "drive_gain": "payload"}


def with_twin(effect: FittedCandidate, extension: Extension, own: MisfitSettings) -> FittedCandidate:
    """The effect, with its twin as an alternative that is as likely where turning alone tells them apart and
    the base model does not know it that well.
    """
    twin = TWIN.get(effect.name)
    if twin is None or twin in extension.effects or not turning_is_unknown(extension.misfit, own):
        return effect
    (size,) = extension.effects[effect.name].values()
    if abs(1 / (1 + size) - 1) > extension.misfit["yaw_inertia"]:
        return effect
    others = (one for one in effect.alternatives if one[0] != twin)
    return replace(effect, alternatives=((twin, 0.0), *others))
