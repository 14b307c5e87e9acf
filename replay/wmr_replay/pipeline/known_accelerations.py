"""What a model's further effects do to the robot, at the instants t − δ that its derivatives describe."""

import numpy as np

from wmr_replay.differentiate import Derivatives
from wmr_replay.identify import Motion
from wmr_replay.identify.terms import extra_along
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_schemas.arrays import F64, I64, NS_PER_S


def known_acceleration(model: ReplayModel, motion: Motion, yaw_rad: F64, efforts: F64) -> F64:
    """dv_long/dt (n,) by the model's further effects, m/s²."""
    if not model.terms.any:
        return np.zeros(len(yaw_rad))
    moving = np.stack([motion.v_long_mps, motion.v_lat_mps, yaw_rad, motion.yaw_rate_radps])
    return np.asarray(extra_along(moving, efforts, model.gains, model.terms)[0])


def own_accelerations(model: ReplayModel, since_ns: I64, motion: Motion, derivatives: Derivatives) -> F64:
    """Accelerations (2, n) of users' effects, m/s², in rows at ``since_ns`` (n,) after the log's start."""
    x_m, y_m, yaw_rad = derivatives.estimates[:, 0]
    return model.own_accelerations(
        {
            "t_s": since_ns / NS_PER_S - derivatives.delay_s,
            "x_m": x_m,
            "y_m": y_m,
            "yaw_rad": yaw_rad,
            "v_mps": motion.v_long_mps,
            "v_lat_mps": motion.v_lat_mps,
            "yaw_rate_radps": motion.yaw_rate_radps,
            "left_nm": derivatives.inputs[0],
            "right_nm": derivatives.inputs[1],
        }
    )
