"""A whole log without the poses that a tracker repeated while the robot moved."""

from dataclasses import replace

import numpy as np

from wmr_replay.align import Aligner, FrozenPose
from wmr_replay.ingest.tracks import WholeLog
from wmr_replay.pipeline.memory import as_batch
from wmr_schemas.signals import PoseTrack


def with_measured_poses(whole: WholeLog) -> WholeLog:
    """The log without its frozen poses, as a replay leaves them out; a note says how many there were."""
    aligner, stage = Aligner(), FrozenPose()
    parts = [aligner.push(as_batch(whole.log)), aligner.finish()]
    frozen = np.concatenate([stage.push(rows).frozen for rows in parts])
    if not frozen.any():
        return whole
    pose, kept = whole.log.pose, ~frozen
    measured = PoseTrack(pose.t_ns[kept], pose.x_m[kept], pose.y_m[kept], pose.yaw_rad[kept])
    note = f"{stage.n} of {len(pose)} poses repeat the one before to the bit while the robot moves; left out"
    return replace(whole, log=replace(whole.log, pose=measured), notes=(*whole.notes, note))
