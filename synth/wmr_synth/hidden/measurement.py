"""Effects on the pose as it is measured: a lever arm, a misaligned heading, a drifting one."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.model_file import Effect
from wmr_synth.hidden.registry import OWN_FORMS
from wmr_synth.plants.motion import Motion

MEASURED = ("pose_lever_arm", "heading_misalignment", "yaw_drift")


def as_seen(motion: Motion, effects: Iterable[Effect]) -> Motion:
    """The motion with the pose that a sensor reports: at p + R(yaw) a, with yaw + angle + drift·t."""
    yaw, seen = motion.yaw_rad, motion
    for effect in effects:
        p = effect.parameters
        if effect.name == "pose_lever_arm":
            x_m = seen.x_m + np.cos(yaw) * p["x_m"] - np.sin(yaw) * p["y_m"]
            y_m = seen.y_m + np.sin(yaw) * p["x_m"] + np.cos(yaw) * p["y_m"]
            seen = replace(seen, x_m=x_m, y_m=y_m)
        elif effect.name == "heading_misalignment":
            seen = replace(seen, yaw_rad=seen.yaw_rad + p["angle_rad"])
        elif effect.name == "yaw_drift":
            seen = replace(seen, yaw_rad=seen.yaw_rad + p["rate_radps"] * motion.t_ns / NS_PER_S)
        elif (own := OWN_FORMS.get(effect.name)) is not None and own.seen is not None:
            seen = own.seen(seen, p)
    return seen
